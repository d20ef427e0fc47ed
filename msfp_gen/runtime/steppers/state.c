/* state.c: states of a run, the points of the equations at them, dense output inside a step, errors of a step. */
#include <math.h>
#include <string.h>
#include "steppers.h"

static const int unknown[MSFP_ND] = MSFP_FREE;

void msfp_point_at(msfp_run *run, double t, msfp_point *at)
{
    /* Up to and at a jump the motion is that before the jump. */
    if (run->next_jump < run->jump_count && t >= run->jumps[run->next_jump])
        t = nextafter(run->jumps[run->next_jump], -INFINITY);
    msfp_history_at(&run->motion, t, 3, at->base);
    msfp_history_at(&run->load, t, 1, (double(*)[6])at->load);
#if MSFP_TOP_ROTATION
    msfp_history_at(&run->support, t, 2, at->support);
#endif
}

msfp_weights msfp_weights_at(const msfp_run *run, double share)
{
    double nodes[MSFP_NODES + 2] = { 0.0 };
    msfp_weights w = { { 0.0 }, run->node_count + 2 };
    for (int i = 0; i < run->node_count; ++i)
        nodes[i + 1] = run->node[i].share;
    nodes[run->node_count + 1] = 1.0;
    for (int i = 0; i < w.count; ++i) {
        w.of[i] = 1.0;
        for (int j = 0; j < w.count; ++j)
            w.of[i] *= j == i ? 1.0 : (share - nodes[j]) / (nodes[i] - nodes[j]);
    }
    return w;
}

/* On the polynomials through the interpolation nodes where the method has some, because the rates at the ends of a stiff
 * step ring while the values do not; else on cubics. */
void msfp_interpolate(const msfp_run *run, double share, msfp_state *out)
{
    const msfp_weights w = msfp_weights_at(run, share);
    const double *now = (const double *)&run->now, *next = (const double *)&run->next;
    const double *numbers[MSFP_NODES + 2] = { MSFP_FROM(now, q, 1), MSFP_FROM(next, q, 1) };
    double weights[MSFP_NODES + 2] = { w.of[0], w.of[w.count - 1] };
    for (int i = 2; i < w.count; ++i) {
        numbers[i] = MSFP_FROM((const double *)&run->node[i - 2].state, q, 1);
        weights[i] = w.of[i - 1];
    }
    if (w.count == 2)
        msfp_cubics(now, next, run->next.t - run->now.t, share, 1, (double *)out);
    else
        msfp_weigh(weights, w.count, numbers, MSFP_COORDINATES + MSFP_INTEGRATED, MSFP_FROM((double *)out, q, 1));
    out->t = run->now.t + share * (run->next.t - run->now.t);
    msfp_linear_rates(now, next, share, 1, (double *)out);
}

void msfp_add_rates(msfp_state *sum, const msfp_state *states, const double *weights, int count, double h)
{
    msfp_sum_rates((double *)sum, (const double *)states, sizeof *states / sizeof(double), weights, count, h, 1);
}

void msfp_state_of(const msfp_run *run, const msfp_point *at, double f[NB][2], msfp_state *s)
{
    memcpy(s->q, at->q, sizeof s->q);
    memcpy(s->v, at->v, sizeof s->v);
    memcpy(s->a, at->a, sizeof s->a);
    memcpy(s->f, f, sizeof s->f);
    memcpy(s->foot, run->work.foot + MSFP_FOOT_Y, sizeof s->foot);
    memcpy(s->dfoot, run->work.foot + MSFP_FOOT_Y1, sizeof s->dfoot);
    msfp_friction_rates(&run->work, s->df);
}

void msfp_powers_of(const msfp_run *run, const msfp_point *at, msfp_state *s)
{
    s->mechanical = msfp_mechanical_energy(&run->parameters, at, &run->work);
    const msfp_input_parts parts = msfp_powers(&run->parameters, at, &run->work, &s->mechanical, s->power);
    s->prescribed_power = parts.prescribed;
    s->load_power = parts.load;
}

void msfp_place(const msfp_parameters *p, const msfp_state *s, msfp_point *at)
{
    (void)p;
    memcpy(at->q, s->q, sizeof at->q);
    memcpy(at->v, s->v, sizeof at->v);
    memcpy(at->f, s->f, sizeof at->f);
    memcpy(at->foot, s->foot, sizeof at->foot);
    msfp_memory_point(p, s, 0.0, at);
}

void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at)
{
    memset(at, 0, sizeof *at);
    msfp_point_at(run, s->t, at);
    msfp_place(&run->parameters, s, at);
    memcpy(at->a, s->a, sizeof at->a);
}

double msfp_absolute_tolerance(const msfp_run *run, int j, int d)
{
    if (d < 3)
        return run->options.atol_angle;
    /* The tolerance of a separation is that of the force it causes, relative as for Y, Z. */
    return 10.0 * run->options.rtol * run->work.reference / run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_KS];
}

/* A settlement below this counts as this [m]: a mass with a period below 20 ms follows the top plate. */
static const double smallest_settlement = 1e-4;

/* Largest error of the height of the foot, and if `rates` of its velocity, over its tolerance [-]. The tolerance is
 * the share rtol of the settlement under the supported mass, and so of the force of the spring, which N is. */
static double foot_error(const msfp_run *run, const msfp_state *error, int rates)
{
    const double gravity = run->parameters.gravity, stiffness = run->parameters.top[MSFP_TOP_PARAMETERS_KV];
    const double mass = msfp_sprung_mass(&run->parameters);
    if (mass == 0.0)
        return 0.0;
    const double settlement = fmax(mass * gravity / stiffness, smallest_settlement);
    const double speed = sqrt(settlement * gravity); /* settlement times circular frequency */
    return fmax(fabs(error->foot[0]) / settlement, rates ? fabs(error->foot[1]) / speed : 0.0) / run->options.rtol;
}

double msfp_error_norm(const msfp_run *run, const msfp_state *error, int rates)
{
    const double rtol = run->options.rtol;
    double worst = foot_error(run, error, rates);
    for (int k = 0; k < NB; ++k) {
        for (int i = 0; i < MSFP_ND; ++i) {
            const int d = unknown[i];
            const double atol = msfp_absolute_tolerance(run, k, d);
            const double q = fmax(fabs(run->now.q[k][d]), fabs(run->next.q[k][d]));
            worst = fmax(worst, fabs(error->q[k][d]) / (atol + rtol * q));
            if (rates)
                worst = fmax(worst, fabs(error->v[k][d]) / (atol + rtol * fabs(run->now.v[k][d])));
        }
        for (int d = 0; d < 2; ++d)
            worst = fmax(worst, fabs(error->f[k][d]) / (10.0 * rtol));
    }
    return worst;
}

double msfp_friction_jump_error(const msfp_state *now, const msfp_state *next)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double y = next->f[j][0] - now->f[j][0], z = next->f[j][1] - now->f[j][1];
        worst = fmax(worst, y * y + z * z);
    }
    worst = 2.0 * sqrt(worst);
    return worst > 1.0 ? worst * worst * worst : 0.0;
}
