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

/* What the stages before stage i give, as `msfp_stage_begin` forms it, and the columns of the point that follow. */
MSFP_INLINE void prepare(const msfp_run *run, const msfp_parameter_batch *batch, const msfp_state_columns *stages,
                         const msfp_tableau *method, int i, double h, msfp_state_columns *from, msfp_point_columns *dat)
{
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const double beta = stage_history->stage[i].beta;
    memcpy(from, &batch->now, offsetof(msfp_state_columns, a));
    msfp_sum_rates((double *)from, (const double *)stages, sizeof *stages / sizeof(double), method->a[i], i, h, C);
    if (msfp_any_column(batch->h)) {
        msfp_state rates = { 0 };
        msfp_add_rates(&rates, stage_history->state, method->a[i], i, 1.0);
        msfp_add_scaled(from->q[0], MSFP_FROM((const double *)&rates, q, 1), batch->h, 1.0,
                        MSFP_COORDINATES + MSFP_INTEGRATED);
    }
    msfp_known_of_stage((const double *)from, beta, C, dat->f[0][0], dat->foot[0]);
    for (int c = 0; c < C; ++c) {
        dat->beta[c] = dat->foot_beta[c] = method->gamma * batch->h[c];
        dat->foot[0][c] += dat->beta[c] * stage_history->stage[i].at.foot[1];
    }
    msfp_memory_point_columns(&run->parameters, &batch->parameters, &stage_history->stage[i].from, from, beta, dat);
}

/* Columns of q and a from those of v, by the stage formula q = Q + beta v, a = (v - V)/beta, at stage i. */
MSFP_INLINE void stage_point_columns(const msfp_run *run, int i, const msfp_state_columns *restrict from,
                                     msfp_point_columns *restrict dat)
{
    const msfp_stage *stage = &run->gradients->stage_history.stage[i];
    const double beta = stage->beta, rate = stage->inertia / beta;
    msfp_stage_formula(from->q[0][0], from->v[0][0], beta, rate, dat->v[0][0], MSFP_COORDINATES * C, dat->q[0][0],
                       dat->a[0][0]);
    if (!msfp_any_column(dat->beta))
        return;
    msfp_add_scaled(dat->q[0], stage->at.v[0], dat->beta, 1.0, NB * NQ);
    msfp_add_scaled(dat->a[0], stage->at.a[0], dat->beta, -rate, NB * NQ);
}

/* Solve stage i for the columns of its rates: batch->point. batch->work has the columns at constant rates. */
MSFP_INLINE void solve_stage(msfp_run *run, msfp_parameter_batch *batch, int i, const msfp_state_columns *from)
{
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const msfp_stage *stage = &stage_history->stage[i];
    msfp_point_columns *dat = &batch->point;
    double *x = batch->work.residual[0];
    memcpy(dat->v, batch->now.v, sizeof dat->v); /* of a locked spin */
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < ND; ++d)
            memset(dat->v[k][unknown[d]], 0, sizeof(msfp_columns));
    stage_point_columns(run, i, from, dat);
    msfp_condensed_columns(&run->parameters, &batch->parameters, &stage->at, dat, &stage->weights,
                           &stage_history->work[i], &stage_history->slopes[i], MSFP_OF_RESIDUAL, &batch->work);
    msfp_lu_solve_columns(stage_history->factors[i], stage_history->pivots[i], C, x);
    msfp_move_rates(dat->v[0][0], x, 1.0, C);
    stage_point_columns(run, i, from, dat);
    batch->complete = 0;
}

void msfp_complete_columns(msfp_run *run, msfp_parameter_batch *batch)
{
    msfp_stage_history *stage_history = &run->gradients->stage_history;
    const int last = msfp_last_stage(run), wanted = MSFP_OF_ROW | (run->gradients->energies ? MSFP_OF_RESIDUAL : 0);
    const msfp_stage *stage = &stage_history->stage[last];
    if (!stage_history->all_slopes)
        msfp_contact_slopes(&run->parameters, &stage->weights, &stage_history->work[last], stage->g, 1,
                            &stage_history->slopes[last]);
    stage_history->all_slopes = 1;
    if (!batch->complete)
        msfp_condensed_columns(&run->parameters, &batch->parameters, &stage->at, &batch->point, &stage->weights,
                               &stage_history->work[last], &stage_history->slopes[last], wanted, &batch->work);
    batch->complete = 1;
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

/* Columns of a solved stage and of its rates, by the derivatives with respect to its unknowns that its tangent contains. */
MSFP_INLINE void stage_state(msfp_run *run, msfp_parameter_batch *batch, int i, const msfp_state_columns *from,
                             msfp_state_columns *to)
{
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const msfp_stage *stage = &stage_history->stage[i];
    const msfp_work *w = &stage_history->work[i];
    const msfp_point_columns *dat = &batch->point;
    const msfp_columns *x = (const msfp_columns *)batch->work.residual;
    memcpy(to->q, dat->q, sizeof to->q);
    memcpy(to->v, dat->v, sizeof to->v);
    memcpy(to->a, dat->a, sizeof to->a);
    if (MSFP_FRICTION_FORCE_SIZE < 2)
        memset(to->df, 0, sizeof to->df);
    msfp_friction_columns(&batch->work, to->df, NULL);
    for (int j = 0; j < NB; ++j)
        for (int d = 0; d < MSFP_FRICTION_FORCE_SIZE; ++d)
            add_rates(w->drates[j][d], x, to->df[j][d]);
    memcpy(to->f, dat->f, sizeof to->f);
    msfp_add_columns(to->f[0], to->df[0], stage->beta, 2 * NB);
    if (msfp_any_column(dat->beta))
        msfp_add_scaled(to->f[0], stage_history->state[i].df[0], dat->beta, 1.0, 2 * NB);
    const int sprung = msfp_top_is_sprung(&run->parameters);
    const int of_plate[3] = { MSFP_BODY_CZ, MSFP_BODY_VZ, MSFP_BODY_AZ };
    for (int k = 0; k < (sprung ? MSFP_BODY_SIZE : 3); ++k) {
        const int field = sprung ? k : of_plate[k];
        add_rates(w->dbody[NB] + field * DOF, x, batch->work.body[NB] + field * C);
    }
    msfp_foot_columns(&run->parameters, &batch->parameters, &stage->at, dat, w, &batch->work);
    memcpy(to->foot, batch->work.foot + MSFP_FOOT_Y * C, sizeof to->foot);
    memcpy(to->dfoot, batch->work.foot + MSFP_FOOT_Y1 * C, sizeof to->dfoot);
#if MSFP_MEMORY
    for (int j = 0; j < NB; ++j)
        add_rates(w->drates[j][MSFP_FRICTION_FORCE_SIZE], x, batch->work.contact[j] + MSFP_CONTACT_SOURCE * C);
    msfp_memory_state_columns(&run->parameters, &batch->parameters, w, &batch->work, &stage->from, from, stage->beta,
                              dat->beta, to);
#endif
    memcpy(to->work, from->work, sizeof to->work);
    memset(to->power, 0, sizeof to->power);
}

static MSFP_WIDE void implicit_step(msfp_run *run, msfp_parameter_batch *batch)
{
    const msfp_tableau *method = msfp_tableau_of(run->options.method);
    const double h = run->gradients->stage_history.stage[1].beta / method->gamma;
    msfp_point_columns *dat = &batch->point;
    msfp_state_columns stages[STAGES], from;
    msfp_columns dt;
    int node = 0;
    stages[0] = batch->now;
    memset(dat, 0, sizeof *dat);
    for (int i = 1; i < method->stages; ++i) {
        prepare(run, batch, stages, method, i, h, &from, dat);
        for (int c = 0; c < C; ++c)
            dt[c] = batch->now.t[c] + method->c[i] * batch->h[c];
        msfp_inputs_columns(run, batch, run->now.t + method->c[i] * h, dt, dat);
        solve_stage(run, batch, i, &from);
        stage_state(run, batch, i, &from, &stages[i]);
        if (run->gradients->energies)
            msfp_stage_works(run, batch, i, &from, stages);
        if (node < run->node_count && i == method->nodes[node])
            batch->node[node++] = stages[i];
    }
    batch->next = stages[method->stages - 1];
}

#if MSFP_CLOSED_FORM
enum { ANGLE = 1 };

/* A quasi-static step: the parabola through the last two states, at whose end forces balance (quasistatic.c). */
static MSFP_WIDE void quasistatic_step(msfp_run *run, msfp_parameter_batch *batch)
{
    const msfp_state_columns *now = &batch->now;
    msfp_state_columns *next = &batch->next;
    msfp_point_columns *dat = &batch->point;
    msfp_state_columns from = *now;
    const double h = run->next.t - run->now.t, last = run->step_history.h, r = last > 0.0 ? h / last : 0.0;
    memset(dat, 0, sizeof *dat);
    memset(from.v, 0, sizeof from.v);
    for (int k = 0; k < NB; ++k)
        for (int c = 0; c < C; ++c) {
            const double q = now->q[k][ANGLE][c];
            from.q[k][ANGLE][c] = q + r * r / (1.0 + 2.0 * r) * (q - batch->before[k][c]);
            dat->slip[k][MSFP_SLIP_Y * C + c] = now->f[k][0][c];
            dat->slip[k][MSFP_SLIP_TURN * C + c] = from.q[k][ANGLE][c] - q;
            batch->before[k][c] = q;
        }
    memcpy(dat->foot, now->foot, sizeof dat->foot);
    msfp_inputs_columns(run, batch, run->next.t, now->t, dat);
    solve_stage(run, batch, 1, &from);
    msfp_complete_columns(run, batch);
    *next = *now;
    memcpy(next->q, dat->q, sizeof next->q);
    memcpy(next->v, dat->v, sizeof next->v);
    msfp_friction_columns(&batch->work, next->df, next->f);
    for (int k = 0; k < NB; ++k)
        for (int c = 0; c < C; ++c)
            next->a[k][ANGLE][c] =
                2.0 * (next->v[k][ANGLE][c] - (next->q[k][ANGLE][c] - now->q[k][ANGLE][c]) / h) / h;
    if (run->gradients->energies)
        msfp_quasistatic_works(run, batch);
}
#endif

void msfp_step_columns(msfp_run *run, msfp_parameter_batch *batch)
{
#if MSFP_CLOSED_FORM
    if (msfp_is_quasistatic(run)) {
        quasistatic_step(run, batch);
        return;
    }
#endif
    implicit_step(run, batch);
}
#endif
