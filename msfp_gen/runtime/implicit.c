/* implicit.c: one step of a stiffly accurate ESDIRK method on the condensed equations.
 *
 * Unknowns of a stage are the angular rates v; q = Q + beta v and a = (v - V)/beta with beta = gamma h follow
 * from the method's own formula, and Y, Z from theirs, surface by surface. Rates stay out of the error norm.
 */
#include <math.h>
#include <string.h>
#include "msfp_model.h"
#include "heat.h"
#include "tableau.h"

#define DOF MSFP_DOF
#define NB MSFP_NB
#define ND MSFP_ND
#define NQ MSFP_NQ

#define STAGES MSFP_STAGES

static const int unknown[ND] = MSFP_FREE;

typedef struct {
    const msfp_tableau *method;
    double v[STAGES][NB][NQ], a[STAGES][NB][NQ], df[STAGES][NB][2], power[STAGES][MSFP_WORKS];
    double Q[NB][NQ], V[NB][NQ];
    double beta;
    msfp_seed seed;
    msfp_point at;
    double f[NB][2];
} stages;

/* What the stages before leave: q = Q + beta v, v = V + beta a, f = fp + beta df. */
static void prepare(const msfp_run *run, stages *s, int i, double h)
{
    const msfp_state *now = &run->now;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d) {
            s->Q[k][d] = now->q[k][d];
            s->V[k][d] = now->v[k][d];
            for (int j = 0; j < i; ++j) {
                s->Q[k][d] += h * s->method->a[i][j] * s->v[j][k][d];
                s->V[k][d] += h * s->method->a[i][j] * s->a[j][k][d];
            }
        }
        for (int d = 0; d < 2; ++d) {
            s->seed.fp[k][d] = now->f[k][d];
            for (int j = 0; j < i; ++j)
                s->seed.fp[k][d] += h * s->method->a[i][j] * s->df[j][k][d];
        }
    }
}

static void place(stages *s)
{
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < NQ; ++d)
            s->at.q[k][d] = s->Q[k][d] + s->beta * s->at.v[k][d];
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i)
            s->at.a[k][unknown[i]] = (s->at.v[k][unknown[i]] - s->V[k][unknown[i]]) / s->beta;
}

static void over_normal(const msfp_work *w, double *residual);

/* Residual over N at the present rates, and its largest entry relative to its natural size; infinite where it cannot be formed. */
static double size_of(msfp_run *run, stages *s, double *residual)
{
    double scale[DOF], size = 0.0;
    place(s);
    ++run->counts[MSFP_COUNT_EVALUATIONS];
    if (msfp_condensed(&run->parameters, &s->at, &s->seed, &run->work, s->f, residual, NULL))
        return INFINITY;
    msfp_residual_scale(&run->parameters, &run->work, scale);
    for (int i = 0; i < DOF; ++i)
        if (!(fabs(residual[i]) / scale[i] <= size)) {
            size = fabs(residual[i]) / scale[i];
            run->worst_surface = i / ND + 1;
        }
    over_normal(&run->work, residual);
    return size < INFINITY ? size : INFINITY;
}

static void move(stages *s, const double *step, double factor)
{
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i)
            s->at.v[k][unknown[i]] -= factor * step[k * ND + i];
}

/* Newton works on moments over N, which has the same root: the balance of a light slider is N times a lever that
 * nearly vanishes, and a heavy top makes N itself depend strongly on the rates. Dividing removes that product. */
static void over_normal(const msfp_work *w, double *residual)
{
    if (MSFP_UPLIFT) /* N follows from the seat, not from the rates, and may vanish */
        return;
    for (int k = 0; k < NB; ++k)
        for (int i = k * ND; i < (k + 1) * ND; ++i)
            residual[i] /= w->contact[k][MSFP_CONTACT_N];
}

static void tangent_over_normal(const msfp_work *w, const double *residual, double *tangent)
{
    if (MSFP_UPLIFT)
        return;
    for (int k = 0; k < NB; ++k) {
        const double inverse = 1.0 / w->contact[k][MSFP_CONTACT_N];
        for (int i = k * ND; i < (k + 1) * ND; ++i)
            for (int c = 0; c < DOF; ++c)
                tangent[i * DOF + c] = inverse * (tangent[i * DOF + c] - residual[i] * w->dnormal[k][c]);
    }
}

/* Factors of the tangent at the present rates. */
static int factorise(msfp_run *run, stages *s)
{
    double residual[DOF];
    ++run->counts[MSFP_COUNT_EVALUATIONS];
    ++run->counts[MSFP_COUNT_FACTORISATIONS];
    run->factored_beta = 0.0;
    const int status = msfp_condensed(&run->parameters, &s->at, &s->seed, &run->work, s->f, residual, run->factors);
    if (status)
        return status;
    over_normal(&run->work, residual);
    tangent_over_normal(&run->work, residual, run->factors);
    run->work_sign = msfp_lu(run->factors, DOF, run->pivots);
    if (run->work_sign == 0)
        return MSFP_E_IRREGULAR;
    run->factored_beta = s->beta;
    return MSFP_OK;
}

/* Newton step from the residual at hand (scaled in place). Where a full step does not reduce the residual, halve it. */
static double take_step(msfp_run *run, stages *s, double *residual, double size, int fresh)
{
    double step[DOF], factor = 1.0;
    memcpy(step, residual, sizeof step);
    msfp_lu_solve(run->factors, DOF, run->pivots, step);
    move(s, step, 1.0);
    double next = size_of(run, s, residual);
    while (fresh && next > size && factor > 0.05) {
        move(s, step, -0.5 * factor);
        factor *= 0.5;
        next = size_of(run, s, residual);
    }
    if (!fresh && !(next < size)) { /* old factors mislead: back to where they were */
        move(s, step, -1.0);
        next = size_of(run, s, residual);
    }
    return next;
}

/* What rounding leaves of a residual: accelerations of parted bodies are differences of velocities over a short time. */
static double rounding(const stages *s)
{
    double speed = 0.0;
    for (int k = 0; k < NB; ++k)
        for (int d = 3; d < NQ; ++d)
            speed = fmax(speed, fabs(s->at.v[k][d]));
    return fmax(1e-10, 2e-12 * speed / s->beta);
}

/* Newton on the residual. Factors serve as long as they reduce it tenfold: other stages, other steps of like size. The
 * switches of friction and rims make it semi-smooth. The sign of the determinant is looked at with every factorisation;
 * while old factors contract the residual the tangent has theirs. */
static int solve_stage(msfp_run *run, stages *s)
{
    const double goal = fmin(1e-3, fmax(rounding(s), 1e-2 * run->options.rtol));
    double residual[DOF];
    int fresh = 0, good = fabs(run->factored_beta - s->beta) < 0.2 * s->beta;
    double size = size_of(run, s, residual);
    for (int i = 0; size > goal; ++i) {
        if (i == 30 || !(size < INFINITY)) {
            run->status_surface = run->worst_surface;
            run->status_value = size;
            return MSFP_E_NEWTON;
        }
        ++run->counts[MSFP_COUNT_NEWTON];
        fresh = !good;
        if (fresh) {
            const int status = factorise(run, s);
            if (status)
                return status;
        }
        const double before = size;
        size = take_step(run, s, residual, size, fresh);
        good = size < 0.1 * before;
    }
    if (run->work_sign && run->determinant == 0)
        run->determinant = run->work_sign;
    if (run->work_sign && run->work_sign != run->determinant) { /* perhaps of a guess far off: what counts is the solution's */
        const int status = factorise(run, s);
        if (status)
            return status;
    }
    if (!run->work_sign || run->work_sign == run->determinant)
        return MSFP_OK;
    run->status_surface = run->worst_surface;
    run->status_value = size;
    return MSFP_E_IRREGULAR;
}

static void guess(const msfp_run *run, stages *s, int i, double h, int extrapolate)
{
    const double *c = s->method->c;
    memcpy(s->at.v, run->now.v, sizeof s->at.v);
    memcpy(s->f, i > 1 ? s->f : run->now.f, sizeof s->f);
    if (extrapolate)
        for (int k = 0; k < NB; ++k)
            for (int d = 0; d < ND; ++d) {
                const int j = unknown[d];
                const double slope = i > 1 ? (s->v[1][k][j] - s->v[0][k][j]) / c[1] : h * run->now.a[k][j];
                s->at.v[k][j] += c[i] * slope;
                if (i > 2) /* as curved as the last stage says */
                    s->at.v[k][j] += c[i] * (c[i] - c[1]) / (c[i - 1] * (c[i - 1] - c[1]))
                                     * (s->v[i - 1][k][j] - s->v[0][k][j] - c[i - 1] * slope);
            }
}

static int stage(msfp_run *run, stages *s, int i, double h)
{
    prepare(run, s, i, h);
    msfp_point_at(run, run->now.t + s->method->c[i] * h, &s->at);
    msfp_heat_prepare(run, s->method->a[i], i, h, s->beta, &s->at);
    int status = MSFP_E_NEWTON;
    for (int attempt = 0; attempt < 2 && status == MSFP_E_NEWTON; ++attempt) {
        guess(run, s, i, h, (run->restart ? 1 : 0) == attempt);
        run->work_sign = 0;
        status = solve_stage(run, s);
    }
    if (status)
        return status;
    memcpy(s->v[i], s->at.v, sizeof s->v[i]);
    memcpy(s->a[i], s->at.a, sizeof s->a[i]);
    msfp_heat_stage(run, i, s->beta);
    if (run->middles < MSFP_MIDDLES && i == s->method->middle[run->middles]) {
        msfp_middle *m = &run->middle[run->middles++];
        m->share = s->method->c[i];
        msfp_heat_middle(run, m);
        memcpy(m->q, s->at.q, sizeof m->q);
        memcpy(m->v, s->at.v, sizeof m->v);
        memcpy(m->f, s->f, sizeof m->f);
    }
    msfp_friction_rates(&run->work, s->df[i]);
    msfp_powers(&run->parameters, &s->at, s->f, &run->work, s->power[i]);
    return MSFP_OK;
}

/* Y, Z beyond the unit disc are integration error. How far a step takes them out counts like any other error; being out
 * from before does not, since no shorter step would mend it: sliding brings them back. */
static double beyond_disc(const msfp_run *run, const double f[MSFP_NB][2])
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double *now = run->now.f[j];
        const double before = fmax(1.0, sqrt(now[0] * now[0] + now[1] * now[1]));
        worst = fmax(worst, sqrt(f[j][0] * f[j][0] + f[j][1] * f[j][1]) - before);
    }
    return worst / run->options.rtol;
}

/* The embedded estimate of an undamped fast mode is of the size of its ringing, however well the method damps it.
 * Filter it as Hosea and Shampine (1996) do, by (1 - beta J)^-1: the last stage with its history moved by the
 * estimate, solved with the factors at hand. */
static void filter(msfp_run *run, stages *s, double dq[NB][NQ], double dv[NB][NQ], double df[NB][2])
{
    stages moved = *s;
    double residual[DOF];
    if (run->factored_beta != s->beta)
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d) {
            moved.Q[k][d] += dq[k][d];
            moved.V[k][d] += dv[k][d];
        }
        for (int d = 0; d < 2; ++d)
            moved.seed.fp[k][d] += df[k][d];
    }
    if (!(size_of(run, &moved, residual) < INFINITY))
        return;
    msfp_lu_solve(run->factors, DOF, run->pivots, residual);
    move(&moved, residual, 1.0);
    if (!(size_of(run, &moved, residual) < INFINITY))
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d)
            dq[k][d] = moved.at.q[k][d] - s->at.q[k][d];
        for (int d = 0; d < 2; ++d)
            df[k][d] = moved.f[k][d] - s->f[k][d];
    }
}

int msfp_step_implicit(msfp_run *run, double h, double *error)
{
    stages s;
    double dq[NB][NQ] = { { 0 } }, dv[NB][NQ] = { { 0 } }, df[NB][2] = { { 0 } };
    const msfp_state *now = &run->now;
    msfp_state *next = &run->next;
    const msfp_tableau *method = s.method = msfp_tableau_of(run->options.method);
    const int last = method->stages - 1;
    run->middles = 0;
    s.beta = method->gamma * h;
    s.seed.cq = s.beta;
    s.seed.cv = 1.0;
    s.seed.ca = 1.0 / s.beta;
    s.seed.beta = s.beta;
    s.seed.accuracy = 1e-5 * run->options.rtol;
    memset(&s.at, 0, sizeof s.at);
    memcpy(s.v[0], now->v, sizeof s.v[0]);
    memcpy(s.a[0], now->a, sizeof s.a[0]);
    memcpy(s.df[0], now->df, sizeof s.df[0]);
    memcpy(s.power[0], now->power, sizeof s.power[0]);
    msfp_heat_begin(run);
    double disc = 0.0;
    for (int i = 1; i <= last; ++i) {
        const int status = stage(run, &s, i, h);
        if (status)
            return status;
        disc = fmax(disc, beyond_disc(run, s.f));
    }
    next->t = now->t + h;
    msfp_heat_finish(run);
    memcpy(next->q, s.at.q, sizeof next->q);
    memcpy(next->v, s.at.v, sizeof next->v);
    memcpy(next->a, s.at.a, sizeof next->a);
    memcpy(next->f, s.f, sizeof next->f);
    memcpy(next->df, s.df[last], sizeof next->df);
    memcpy(next->power, s.power[last], sizeof next->power);
    for (int e = 0; e < MSFP_WORKS; ++e) {
        next->work[e] = now->work[e] + h * method->gamma * s.power[last][e];
        for (int i = 0; i < last; ++i)
            next->work[e] += h * method->a[last][i] * s.power[i][e];
    }
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i <= last; ++i) {
            for (int d = 0; d < NQ; ++d) {
                dq[k][d] += h * method->e[i] * s.v[i][k][d];
                dv[k][d] += h * method->e[i] * s.a[i][k][d];
            }
            for (int d = 0; d < 2; ++d)
                df[k][d] += h * method->e[i] * s.df[i][k][d];
        }
    disc = fmax(disc, msfp_heat_error(run, method->e, last + 1, h, s.beta));
    *error = fmax(disc, msfp_error_norm(run, dq, NULL, df));
    if (*error > 1.0) {
        const msfp_work converged = run->work;
        filter(run, &s, dq, dv, df);
        run->work = converged;
        *error = fmax(disc, msfp_error_norm(run, dq, NULL, df));
    }
    return MSFP_OK;
}
