/* state.c: states of a run, the points of the equations at them, dense output inside a step, errors of a step. */
#include <math.h>
#include <string.h>
#include "steppers.h"

#define NUMBERS(state, field) MSFP_NUMBERS(msfp_state, state, field)

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

void msfp_hermite(const double *y0, const double *d0, const double *y1, const double *d1, double h, double s, int count,
                  double *out)
{
    const double r = 1.0 - s, w0 = r * r * (1.0 + 2.0 * s), w1 = s * s * (3.0 - 2.0 * s), w = s * r * h;
    for (int i = 0; i < count; ++i)
        out[i] = w0 * y0[i] + w1 * y1[i] + w * (r * d0[i] - s * d1[i]);
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

/* `count` numbers inside the step: on the polynomials through the interpolation nodes where the method has some, because
 * the rates at the ends of a stiff step ring while the values do not; else on the cubics through values and rates. value,
 * rate: where they begin in a state [bytes]. */
static void inside(const msfp_run *run, const msfp_weights *w, double share, size_t value, size_t rate, int count,
                   msfp_state *out)
{
    const char *ends[2] = { (const char *)&run->now, (const char *)&run->next };
    const double *y0 = (const double *)(ends[0] + value), *y1 = (const double *)(ends[1] + value);
    const double *numbers[MSFP_NODES + 2] = { y0, y1 };
    double weights[MSFP_NODES + 2] = { w->of[0], w->of[w->count - 1] }, *to = (double *)((char *)out + value);
    if (w->count == 2) {
        msfp_hermite(y0, (const double *)(ends[0] + rate), y1, (const double *)(ends[1] + rate),
                     run->next.t - run->now.t, share, count, to);
        return;
    }
    for (int i = 2; i < w->count; ++i) {
        numbers[i] = (const double *)((const char *)&run->node[i - 2].state + value);
        weights[i] = w->of[i - 1];
    }
    msfp_weigh(weights, w->count, numbers, count, to);
}

void msfp_interpolate(const msfp_run *run, double share, msfp_state *out)
{
    const size_t q = offsetof(msfp_state, q), v = offsetof(msfp_state, v), a = offsetof(msfp_state, a);
    const msfp_weights w = msfp_weights_at(run, share);
    out->t = run->now.t + share * (run->next.t - run->now.t);
    inside(run, &w, share, q, v, MSFP_COORDINATES, out);
    inside(run, &w, share, v, a, MSFP_INTEGRATED, out);
    for (int k = 0; k < MSFP_INTEGRATED; ++k)
        NUMBERS(out, a)[k] = (1.0 - share) * NUMBERS(&run->now, a)[k] + share * NUMBERS(&run->next, a)[k];
}

void msfp_add_rates(msfp_state *sum, const msfp_state *states, const double *weights, int count, double h)
{
    for (int j = 0; j < count; ++j) {
        msfp_add(NUMBERS(sum, q), NUMBERS(&states[j], v), h * weights[j], MSFP_COORDINATES);
        msfp_add(NUMBERS(sum, v), NUMBERS(&states[j], a), h * weights[j], MSFP_INTEGRATED);
    }
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

void msfp_place(const msfp_state *s, msfp_point *at)
{
    memcpy(at->q, s->q, sizeof at->q);
    memcpy(at->v, s->v, sizeof at->v);
    memcpy(at->f, s->f, sizeof at->f);
    memcpy(at->foot, s->foot, sizeof at->foot);
    msfp_memory_point(s, 0.0, at);
}

void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at)
{
    memset(at, 0, sizeof *at);
    msfp_point_at(run, s->t, at);
    msfp_place(s, at);
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
