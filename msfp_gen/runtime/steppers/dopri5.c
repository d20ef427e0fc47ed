/* dopri5.c: the method of PEER 2017/07, Dormand-Prince 5(4) (1980) with Newton's method on the 6(n-1) unknowns per
 * stage. */
#include <math.h>
#include <string.h>
#include "steppers.h"

enum { STAGES = 7 };

static const double a[STAGES][STAGES - 1] = {
    { 0 },
    { 1.0 / 5 },
    { 3.0 / 40, 9.0 / 40 },
    { 44.0 / 45, -56.0 / 15, 32.0 / 9 },
    { 19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729 },
    { 9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656 },
    { 35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84 }
};
static const double c[STAGES] = { 0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1 };
/* fifth-order weights less fourth-order weights */
static const double e[STAGES] = {
    71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40
};

typedef struct {
    double v[NB][NQ], a[NB][NQ], f[NB][2], foot[2];
} slope;

/* State derivatives at a point: Newton's method on the momentum balances, starting from the solution of the last
 * stage. */
static int slope_at(msfp_run *run, msfp_point *at, slope *s)
{
    msfp_solution solution;
    int status = MSFP_E_NEWTON;
    for (int warm = run->have_unknowns; warm >= 0 && status == MSFP_E_NEWTON; --warm) {
        status = msfp_solve_momentum_balances(&run->parameters, at, &run->work, run->unknowns, warm, &solution);
        run->counts[MSFP_COUNT_NEWTON_ITERATIONS] += solution.iterations;
        run->counts[MSFP_COUNT_EVALUATIONS] += 2 * solution.iterations + 1;
        run->counts[MSFP_COUNT_FACTORISATIONS] += solution.iterations;
    }
    run->have_unknowns = status == MSFP_OK;
    if (status)
        return status;
    if (solution.iterations) {
        if (run->determinant == 0)
            run->determinant = solution.determinant;
        if (solution.determinant != run->determinant) {
            run->have_unknowns = 0; /* they belong to another root, where a shorter step must not start */
            return MSFP_E_IRREGULAR;
        }
    }
    memcpy(s->v, at->v, sizeof s->v);
    memcpy(s->a, at->a, sizeof s->a);
    memcpy(s->foot, run->work.foot + MSFP_FOOT_Y1, sizeof s->foot);
    msfp_friction_rates(&run->work, s->f);
    return MSFP_OK;
}

/* The point of a stage from the weighted rates of the earlier stages. */
static void combine(const msfp_state *now, const slope *k, const double *weights, int count, double h, msfp_point *at)
{
    memcpy(at->q, now->q, sizeof at->q);
    memcpy(at->v, now->v, sizeof at->v);
    memcpy(at->f, now->f, sizeof at->f);
    memcpy(at->foot, now->foot, sizeof at->foot);
    for (int i = 0; i < count; ++i)
        for (int d = 0; d < 2; ++d)
            at->foot[d] += h * weights[i] * k[i].foot[d];
    for (int i = 0; i < count; ++i)
        for (int b = 0; b < NB; ++b) {
            for (int d = 0; d < NQ; ++d) {
                at->q[b][d] += h * weights[i] * k[i].v[b][d];
                at->v[b][d] += h * weights[i] * k[i].a[b][d];
            }
            for (int d = 0; d < 2; ++d)
                at->f[b][d] += h * weights[i] * k[i].f[b][d];
        }
}

/* Integrals of the energy balance by Simpson's rule: the power of a rim damper is a peak that lasts only a few
 * steps. */
static int integrals(msfp_run *run, double h)
{
    msfp_state middle, *next = &run->next;
    msfp_point at;
    msfp_work w;
    double g[NB][2], residual[MSFP_DOF], power[MSFP_WORKS];
    msfp_seed seed = { 0 };
    memcpy(next->work, run->now.work, sizeof next->work); /* not used at the middle of the step */
    msfp_interpolate(run, 0.5, &middle);
    msfp_to_point(run, &middle, &at);
    memcpy(seed.fp, at.f, sizeof seed.fp);
    memcpy(g, at.f, sizeof g);
#if MSFP_LAW
    memcpy(w.coefficient, run->work.coefficient, sizeof w.coefficient);
#endif
    const int status = msfp_condensed(&run->parameters, &at, &seed, &w, g, residual, NULL);
    if (status)
        return status;
    const msfp_mechanical mechanical = msfp_mechanical_energy(&run->parameters, &at, &w);
    msfp_powers(&run->parameters, &at, &w, &mechanical, power);
    for (int i = 0; i < MSFP_WORKS; ++i)
        next->work[i] += h / 6.0 * (run->now.power[i] + 4.0 * power[i] + next->power[i]);
    return MSFP_OK;
}

/* Whether the fastest rate of decay, estimated from the last two stages at the end of the step, exceeds the limit of
 * stability of the method (Hairer and Wanner, Solving ODEs II, IV.2). Undamped ringing is not detected here; the error
 * estimate detects it. */
static int at_stability_limit(const slope *sixth, const slope *last, const msfp_point *before, const msfp_point *at,
                              double h)
{
    double rates = 0.0, states = 0.0;
    for (int b = 0; b < NB; ++b)
        for (int d = 0; d < NQ; ++d) {
            const double slopes = last->a[b][d] - sixth->a[b][d], change = at->v[b][d] - before->v[b][d];
            rates += slopes * slopes;
            states += change * change;
        }
    return h * h * rates > 3.25 * 3.25 * states && states > 0.0;
}

static int finish(msfp_run *run, const msfp_point *at, const slope *last, double h)
{
    msfp_state *next = &run->next;
    double g[NB][2], residual[MSFP_DOF];
    msfp_seed seed = { 0 };
    memcpy(seed.fp, at->f, sizeof seed.fp);
    memcpy(g, at->f, sizeof g);
    const int status = msfp_condensed(&run->parameters, at, &seed, &run->work, g, residual, NULL);
    if (status)
        return status;
    next->t = run->now.t + h;
    msfp_heat_finish(run);
    run->reached = *at;
    memcpy(next->q, at->q, sizeof next->q);
    memcpy(next->v, at->v, sizeof next->v);
    memcpy(next->a, last->a, sizeof next->a);
    memcpy(next->f, at->f, sizeof next->f);
    memcpy(next->df, last->f, sizeof next->df);
    memcpy(next->foot, run->work.foot, sizeof next->foot);
    next->mechanical = msfp_mechanical_energy(&run->parameters, at, &run->work);
    msfp_powers(&run->parameters, at, &run->work, &next->mechanical, next->power);
    return integrals(run, h);
}

int msfp_step_dopri5(msfp_run *run, double h, double *error)
{
    slope k[STAGES];
    msfp_point at, sixth;
    msfp_increment estimate;
    run->node_count = 0;
    memset(&at, 0, sizeof at);
    memset(&estimate, 0, sizeof estimate);
    msfp_heat_begin(run);
    if (run->determinant == 0) { /* the reference sign is that of the start, not of a first step that may be too long */
        msfp_point_at(run, run->now.t, &at);
        msfp_heat_point(&run->now, &at);
        combine(&run->now, k, a[0], 0, h, &at);
        const int status = slope_at(run, &at, &k[0]);
        if (status)
            return status;
    }
    memcpy(k[0].v, run->now.v, sizeof k[0].v);
    memcpy(k[0].a, run->now.a, sizeof k[0].a);
    memcpy(k[0].f, run->now.df, sizeof k[0].f);
    memcpy(k[0].foot, run->now.foot + MSFP_FOOT_Y1, sizeof k[0].foot);
    for (int i = 1; i < STAGES; ++i) {
        sixth = at;
        msfp_point_at(run, run->now.t + c[i] * h, &at);
        combine(&run->now, k, a[i], i, h, &at);
        msfp_heat_prepare(run, a[i], i, h, 0.0, &at);
        const int status = slope_at(run, &at, &k[i]);
        if (status)
            return status;
        msfp_heat_stage(run, i, 0.0);
    }
    for (int i = 0; i < STAGES; ++i)
        for (int d = 0; d < 2; ++d)
            estimate.foot[d] += h * e[i] * k[i].foot[d];
    for (int i = 0; i < STAGES; ++i)
        for (int b = 0; b < NB; ++b) {
            for (int d = 0; d < NQ; ++d) {
                estimate.q[b][d] += h * e[i] * k[i].v[b][d];
                estimate.v[b][d] += h * e[i] * k[i].a[b][d];
            }
            for (int d = 0; d < 2; ++d)
                estimate.f[b][d] += h * e[i] * k[i].f[b][d];
        }
    *error = fmax(msfp_error_norm(run, &estimate, 1), msfp_heat_error(run, e, STAGES, h, 0.0));
    if (*error <= 1.0)
        run->stability_limit_steps =
            at_stability_limit(&k[STAGES - 2], &k[STAGES - 1], &sixth, &at, h) ? run->stability_limit_steps + 1 : 0;
    return finish(run, &at, &k[STAGES - 1], h);
}
