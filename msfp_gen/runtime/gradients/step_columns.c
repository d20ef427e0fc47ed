/* step_columns.c: derivatives of the states of a run, step by step: the stage formula of the method is differentiated,
 * with the tangent of each stage as it was solved ("staggered direct": Feehery, Tolsma and Barton 1997).
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { STAGES = MSFP_STAGES };
static const int unknown[ND] = MSFP_FREE;

/* As msfp_lu_solve for all columns at once. */
MSFP_COLUMNWISE void msfp_solve_columns(const double *restrict factors, const int *restrict pivots,
                                        msfp_columns *restrict columns)
{
    enum { PACKS = C / MSFP_PACK_SIZE };
    msfp_pack *const x = (msfp_pack *)columns;
    for (int k = 0; k < DOF; ++k)
        for (int c = 0; c < PACKS; ++c) {
            const msfp_pack swap = x[pivots[k] * PACKS + c];
            x[pivots[k] * PACKS + c] = x[k * PACKS + c];
            x[k * PACKS + c] = swap;
        }
    for (int c = 0; c < PACKS; ++c) {
        for (int i = 1; i < DOF; ++i) {
            msfp_pack rest = x[i * PACKS + c];
            for (int j = 0; j < i; ++j)
                rest -= factors[i * DOF + j] * x[j * PACKS + c];
            x[i * PACKS + c] = rest;
        }
        for (int i = DOF - 1; i >= 0; --i) {
            msfp_pack rest = x[i * PACKS + c];
            for (int j = i + 1; j < DOF; ++j)
                rest -= factors[i * DOF + j] * x[j * PACKS + c];
            x[i * PACKS + c] = rest * factors[i * DOF + i];
        }
    }
}

MSFP_COLUMNWISE void msfp_friction_columns(const msfp_work_columns *d, msfp_columns df[NB][2], msfp_columns f[NB][2])
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_SHEAR_SIZE; ++i) {
            memcpy(df[j][i], d->contact[j] + (MSFP_CONTACT_DY + i) * C, sizeof df[j][i]);
            if (f)
                memcpy(f[j][i], d->contact[j] + (MSFP_CONTACT_Y + i) * C, sizeof f[j][i]);
        }
}

/* Rates of all stages, in columns and as values. */
typedef struct {
    msfp_columns v[STAGES][NB][NQ], a[STAGES][NB][NQ], df[STAGES][NB][2], foot[STAGES][2];
    double rates[STAGES][NB][2]; /* of Y, Z */
#if MSFP_HEAT
    msfp_heat_columns heat;
#endif
} stage_columns;

/* Rates of the bodies [MSFP_NB][MSFP_NQ] at stage j. */
static const double *rates_v(const msfp_run *run, int j)
{
    return j ? &run->gradients->trail.stage[j].at.v[0][0] : &run->now.v[0][0];
}

static const double *rates_a(const msfp_run *run, int j)
{
    return j ? &run->gradients->trail.stage[j].at.a[0][0] : &run->now.a[0][0];
}

static const double *rates_foot(const msfp_run *run, int j)
{
    return (j ? run->gradients->trail.work[j].foot : run->now.foot) + MSFP_FOOT_Y1;
}

/* Columns of Q, V, fp and the foot of stage i, as `prepare` of implicit.c forms them. */
MSFP_INLINE void prepare(const msfp_run *run, const msfp_group *group, const stage_columns *s,
                         const msfp_tableau *method, int i, double h, msfp_columns Q[NB][NQ], msfp_columns V[NB][NQ],
                         msfp_point_columns *dat)
{
    const msfp_state_columns *now = &group->now;
    const msfp_stage *stage = &run->gradients->trail.stage[i];
    memcpy(Q, now->q, sizeof now->q);
    memcpy(V, now->v, sizeof now->v);
    memcpy(dat->f, now->f, sizeof dat->f);
    memcpy(dat->foot, now->foot, sizeof dat->foot);
    for (int j = 0; j < i; ++j) {
        const double weight = method->a[i][j];
        msfp_add_columns(&Q[0][0], &s->v[j][0][0], h * weight, NB * NQ);
        msfp_add_columns(&V[0][0], &s->a[j][0][0], h * weight, NB * NQ);
        msfp_add_columns(&dat->f[0][0], &s->df[j][0][0], h * weight, 2 * NB);
        msfp_add_columns(dat->foot, s->foot[j], h * weight, 2);
        if (msfp_any_column(group->h)) {
            msfp_add_scaled(&Q[0][0], rates_v(run, j), group->h, weight, NB * NQ);
            msfp_add_scaled(&V[0][0], rates_a(run, j), group->h, weight, NB * NQ);
            msfp_add_scaled(&dat->f[0][0], &s->rates[j][0][0], group->h, weight, 2 * NB);
            msfp_add_scaled(dat->foot, rates_foot(run, j), group->h, weight, 2);
        }
    }
    for (int c = 0; c < C; ++c) {
        dat->beta[c] = dat->foot_beta[c] = method->gamma * group->h[c];
        dat->foot[0][c] += stage->beta * dat->foot[1][c] + dat->beta[c] * stage->at.foot[1];
    }
}

/* Columns of q and a from those of v, by the stage formula q = Q + beta v, a = (v - V)/beta, at stage i. */
MSFP_INLINE void stage_point(const msfp_run *run, int i, msfp_columns (*restrict Q)[NQ], msfp_columns (*restrict V)[NQ],
                             msfp_point_columns *restrict dat)
{
    const msfp_stage *stage = &run->gradients->trail.stage[i];
    const double beta = stage->beta, rate = stage->inertia / beta;
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < NQ; ++d)
            for (int c = 0; c < C; ++c) {
                dat->q[k][d][c] = Q[k][d][c] + beta * dat->v[k][d][c];
                dat->a[k][d][c] = rate * (dat->v[k][d][c] - V[k][d][c]);
            }
    if (!msfp_any_column(dat->beta))
        return;
    msfp_add_scaled(dat->q[0], rates_v(run, i), dat->beta, 1.0, NB * NQ);
    msfp_add_scaled(dat->a[0], rates_a(run, i), dat->beta, -rate, NB * NQ);
}

/* Solve stage i for the columns of its rates: group->point. group->work has the columns at constant rates. */
MSFP_INLINE void solve_stage(msfp_run *run, msfp_group *group, int i, msfp_columns Q[NB][NQ], msfp_columns V[NB][NQ])
{
    const msfp_trail *trail = &run->gradients->trail;
    const msfp_stage *stage = &trail->stage[i];
    msfp_point_columns *dat = &group->point;
    msfp_columns *x = group->work.residual;
    memcpy(dat->v, group->now.v, sizeof dat->v); /* of a locked spin */
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < ND; ++d)
            memset(dat->v[k][unknown[d]], 0, sizeof(msfp_columns));
    stage_point(run, i, Q, V, dat);
    msfp_condensed_columns(&run->parameters, &group->parameters, &stage->at, dat, &stage->seed, &trail->work[i],
                           &trail->slopes[i], MSFP_OF_RESIDUAL, &group->work);
    msfp_solve_columns(trail->factors[i], trail->pivots[i], x);
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < ND; ++d)
            msfp_add_columns(&dat->v[k][unknown[d]], &x[k * ND + d], -1.0, 1);
    stage_point(run, i, Q, V, dat);
    group->complete = 0;
}

void msfp_complete_columns(msfp_run *run, msfp_group *group)
{
    msfp_trail *trail = &run->gradients->trail;
    const int last = msfp_last_stage(run), wanted = MSFP_OF_ROW | (run->gradients->energies ? MSFP_OF_RESIDUAL : 0);
    const msfp_stage *stage = &trail->stage[last];
    if (!trail->all_slopes)
        msfp_contact_slopes(&run->parameters, &stage->seed, &trail->work[last], stage->g, 1, &trail->slopes[last]);
    trail->all_slopes = 1;
    if (!group->complete)
        msfp_condensed_columns(&run->parameters, &group->parameters, &stage->at, &group->point, &stage->seed,
                               &trail->work[last], &trail->slopes[last], wanted, &group->work);
    group->complete = 1;
}

/* columns += row * x, where `row` has the derivatives of a number with respect to the rates of a stage, and -x the
 * columns of these rates. */
MSFP_INLINE void add_rates(const double *row, const msfp_columns *x, double *columns)
{
    double sum[C];
    msfp_combine_columns(row, 1, x[0], DOF, sum);
    for (int c = 0; c < C; ++c)
        columns[c] -= sum[c];
}

/* Columns of what the next stages need of a solved one, by the derivatives with respect to its rates that its tangent
 * contains: of the rates of Y, Z, of Y, Z and of the foot. */
MSFP_INLINE void stage_results(msfp_run *run, msfp_group *group, int i, const double rates[NB][2],
                               msfp_columns df[NB][2], msfp_columns f[NB][2])
{
    const msfp_trail *trail = &run->gradients->trail;
    const msfp_stage *stage = &trail->stage[i];
    const msfp_work *w = &trail->work[i];
    const msfp_point_columns *dat = &group->point;
    const msfp_columns *x = (const msfp_columns *)group->work.residual;
    msfp_friction_columns(&group->work, df, NULL);
    for (int j = 0; j < NB; ++j)
        for (int d = 0; d < MSFP_SHEAR_SIZE; ++d)
            add_rates(w->drates[j][d], x, df[j][d]);
    memcpy(f, dat->f, sizeof dat->f);
    msfp_add_columns(f[0], df[0], stage->beta, 2 * NB);
    if (msfp_any_column(dat->beta))
        msfp_add_scaled(f[0], rates[0], dat->beta, 1.0, 2 * NB);
    const int sprung = msfp_top_is_sprung(&run->parameters);
    const int of_plate[3] = { MSFP_BODY_CZ, MSFP_BODY_VZ, MSFP_BODY_AZ };
    for (int i = 0; i < (sprung ? MSFP_BODY_SIZE : 3); ++i) {
        const int field = sprung ? i : of_plate[i];
        add_rates(w->dbody[NB] + field * DOF, x, group->work.body[NB] + field * C);
    }
    msfp_foot_columns(&run->parameters, &group->parameters, &stage->at, dat, w, &group->work);
}

/* The state at stage i, which is solved; its works are those of group->next. */
MSFP_INLINE void state_of_stage(const msfp_group *group, const stage_columns *s, int i, msfp_columns f[NB][2],
                                msfp_state_columns *to)
{
    const msfp_point_columns *dat = &group->point;
    memcpy(to->q, dat->q, sizeof to->q);
    memcpy(to->v, dat->v, sizeof to->v);
    memcpy(to->a, dat->a, sizeof to->a);
    memcpy(to->f, f, sizeof to->f);
    memcpy(to->df, s->df[i], sizeof to->df);
#if MSFP_HEAT
    memcpy(to->heat, s->heat.heat, sizeof to->heat);
    memcpy(to->flux, s->heat.flux, sizeof to->flux);
#endif
    memcpy(to->foot, group->work.foot, sizeof to->foot);
    if (to != &group->next)
        memcpy(to->work, group->next.work, sizeof to->work);
}

static MSFP_COLUMNWISE void implicit_step(msfp_run *run, msfp_group *group)
{
    const msfp_tableau *method = msfp_tableau_of(run->options.method);
    const msfp_trail *trail = &run->gradients->trail;
    const double h = trail->stage[1].beta / method->gamma;
    const msfp_state_columns *now = &group->now;
    msfp_state_columns *next = &group->next;
    msfp_point_columns *dat = &group->point;
    msfp_columns Q[NB][NQ], V[NB][NQ], f[NB][2], dt;
    stage_columns s;
    int node = 0;
    if (MSFP_SHEAR_SIZE < 2)
        memset(s.df, 0, sizeof s.df);
#if MSFP_HEAT
    msfp_heat_columns_begin(run, group, &s.heat);
#endif
    memcpy(s.v[0], now->v, sizeof s.v[0]);
    memcpy(s.a[0], now->a, sizeof s.a[0]);
    memcpy(s.df[0], now->df, sizeof s.df[0]);
    memcpy(s.foot[0], now->foot + MSFP_FOOT_Y1, sizeof s.foot[0]);
    memcpy(s.rates[0], run->now.df, sizeof s.rates[0]);
    memset(dat, 0, sizeof *dat);
    for (int i = 1; i < method->stages; ++i) {
        msfp_friction_rates(&trail->work[i], s.rates[i]);
        prepare(run, group, &s, method, i, h, Q, V, dat);
        for (int c = 0; c < C; ++c)
            dt[c] = now->t[c] + method->c[i] * group->h[c];
        msfp_inputs_columns(run, group, run->now.t + method->c[i] * h, dt, dat);
#if MSFP_HEAT
        msfp_heat_columns_prepare(run, group, method->a[i], i, h, &s.heat, dat);
#endif
        solve_stage(run, group, i, Q, V);
        stage_results(run, group, i, (const double(*)[2])s.rates[i], s.df[i], f);
#if MSFP_HEAT
        for (int j = 0; j < NB; ++j) {
            memcpy(s.heat.flux[j], group->work.contact[j] + MSFP_CONTACT_FLUX * C, sizeof s.heat.flux[j]);
            add_rates(trail->work[i].drates[j][MSFP_SHEAR_SIZE], group->work.residual[0], s.heat.flux[j]);
        }
        msfp_heat_columns_stage(run, group, i, &s.heat);
#endif
        memcpy(s.v[i], dat->v, sizeof s.v[i]);
        memcpy(s.a[i], dat->a, sizeof s.a[i]);
        memcpy(s.foot[i], group->work.foot + MSFP_FOOT_Y1 * C, sizeof s.foot[i]);
        if (run->gradients->energies)
            msfp_stage_works(run, group, i);
        if (node < run->node_count && i == method->nodes[node])
            state_of_stage(group, &s, i, f, &group->node[node++]);
    }
    state_of_stage(group, &s, method->stages - 1, f, next);
}

#if MSFP_CLOSED_FORM
enum { ANGLE = 1 };

/* A quasi-static step: the parabola through the last two states, at whose end forces balance (quasistatic.c). */
static MSFP_COLUMNWISE void quasistatic_step(msfp_run *run, msfp_group *group)
{
    const msfp_state_columns *now = &group->now;
    msfp_state_columns *next = &group->next;
    msfp_point_columns *dat = &group->point;
    msfp_columns Q[NB][NQ], V[NB][NQ] = { 0 };
    const double h = run->next.t - run->now.t, last = run->step_history.h, r = last > 0.0 ? h / last : 0.0;
    memset(dat, 0, sizeof *dat);
    memcpy(Q, now->q, sizeof Q);
    for (int k = 0; k < NB; ++k)
        for (int c = 0; c < C; ++c) {
            const double q = now->q[k][ANGLE][c];
            Q[k][ANGLE][c] = q + r * r / (1.0 + 2.0 * r) * (q - group->before[k][c]);
            dat->slip[k][MSFP_SLIP_Y * C + c] = now->f[k][0][c];
            dat->slip[k][MSFP_SLIP_TURN * C + c] = Q[k][ANGLE][c] - q;
            group->before[k][c] = q;
        }
    memcpy(dat->foot, now->foot, sizeof dat->foot);
    msfp_inputs_columns(run, group, run->next.t, now->t, dat);
    solve_stage(run, group, 1, Q, V);
    msfp_complete_columns(run, group);
    *next = *now;
    memcpy(next->q, dat->q, sizeof next->q);
    memcpy(next->v, dat->v, sizeof next->v);
    msfp_friction_columns(&group->work, next->df, next->f);
    for (int k = 0; k < NB; ++k)
        for (int c = 0; c < C; ++c)
            next->a[k][ANGLE][c] =
                2.0 * (next->v[k][ANGLE][c] - (next->q[k][ANGLE][c] - now->q[k][ANGLE][c]) / h) / h;
    if (run->gradients->energies)
        msfp_quasistatic_works(run, group);
}
#endif

void msfp_step_columns(msfp_run *run, msfp_group *group)
{
#if MSFP_CLOSED_FORM
    if (msfp_is_quasistatic(run)) {
        quasistatic_step(run, group);
        return;
    }
#endif
    implicit_step(run, group);
}
#endif
