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

/* State derivatives at a point: Newton's method on the momentum balances, starting from the solution of the last
 * stage. */
static int rates_at(msfp_run *run, msfp_point *at, msfp_state *s)
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
    msfp_state_of(run, at, at->f, s);
    memset(s->power, 0, sizeof s->power); /* works are integrated by other weights */
    return MSFP_OK;
}

/* The point of stage i, from the weighted rates of the earlier stages. */
static void stage_point(msfp_run *run, const msfp_state *stages, int i, double h, msfp_state *from, msfp_point *at)
{
    *from = run->now;
    msfp_add_rates(from, stages, a[i], i, h);
    msfp_place(&run->parameters, from, at);
}

/* Integrals of the energy balance by Simpson's rule: the power of a rim damper is a peak that lasts only a few
 * steps. */
static int integrals(msfp_run *run, double h)
{
    msfp_state middle, *next = &run->next;
    msfp_point at;
    msfp_work w;
    double g[NB][2], residual[MSFP_DOF], power[MSFP_WORKS];
    msfp_stage_weights weights = { 0 };
    memcpy(next->work, run->now.work, sizeof next->work); /* not used at the middle of the step */
    msfp_interpolate(run, 0.5, &middle);
    msfp_to_point(run, &middle, &at);
    memcpy(weights.fp, at.f, sizeof weights.fp);
    memcpy(g, at.f, sizeof g);
#if MSFP_LAW
    memcpy(w.coefficient, run->work.coefficient, sizeof w.coefficient);
#endif
    const int status = msfp_condensed(&run->parameters, &at, &weights, &w, g, residual, NULL);
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
static int at_stability_limit(const msfp_state *sixth, const msfp_state *last, double h)
{
    double rates = 0.0, states = 0.0;
    for (int b = 0; b < NB; ++b)
        for (int d = 0; d < NQ; ++d) {
            const double slopes = last->a[b][d] - sixth->a[b][d], change = last->v[b][d] - sixth->v[b][d];
            rates += slopes * slopes;
            states += change * change;
        }
    return h * h * rates > 3.25 * 3.25 * states && states > 0.0;
}

static int finish(msfp_run *run, const msfp_point *at, const msfp_state *last, double h)
{
    msfp_state *next = &run->next;
    double g[NB][2], residual[MSFP_DOF];
    msfp_stage_weights weights = { 0 };
    memcpy(weights.fp, at->f, sizeof weights.fp);
    memcpy(g, at->f, sizeof g);
    const int status = msfp_condensed(&run->parameters, at, &weights, &run->work, g, residual, NULL);
    if (status)
        return status;
    *next = *last;
    memcpy(next->foot, run->work.foot + MSFP_FOOT_Y, sizeof next->foot);
    memcpy(next->dfoot, run->work.foot + MSFP_FOOT_Y1, sizeof next->dfoot);
    msfp_powers_of(run, at, next);
    next->t = run->now.t + h;
    run->reached = *at;
    return integrals(run, h);
}

int msfp_step_dopri5(msfp_run *run, double h, double *error)
{
    msfp_state k[STAGES], from, estimate = { 0 };
    msfp_point at;
    run->node_count = 0;
    memset(&at, 0, sizeof at);
    k[0] = run->now;
    if (run->determinant == 0) { /* the reference sign is that of the start, not of a first step that may be too long */
        msfp_point_at(run, run->now.t, &at);
        stage_point(run, k, 0, h, &from, &at);
        const int status = rates_at(run, &at, &k[1]);
        if (status)
            return status;
    }
    memset(k[0].power, 0, sizeof k[0].power);
    for (int i = 1; i < STAGES; ++i) {
        msfp_point_at(run, run->now.t + c[i] * h, &at);
        stage_point(run, k, i, h, &from, &at);
        const int status = rates_at(run, &at, &k[i]);
        if (status)
            return status;
        msfp_memory_state(&run->parameters, &run->work, &from, 0.0, &k[i]);
    }
    msfp_add_rates(&estimate, k, e, STAGES, h);
    *error = fmax(msfp_error_norm(run, &estimate, 1), msfp_memory_error(run, &estimate, &k[STAGES - 1], 0.0));
    if (*error <= 1.0)
        run->stability_limit_steps =
            at_stability_limit(&k[STAGES - 2], &k[STAGES - 1], h) ? run->stability_limit_steps + 1 : 0;
    return finish(run, &at, &k[STAGES - 1], h);
}
