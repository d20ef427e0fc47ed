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

/* Cubic through values y and rates d at the ends of a step of length h, at its share s. */
static double hermite(double y0, double d0, double y1, double d1, double h, double s)
{
    const double r = 1.0 - s;
    return r * r * (1.0 + 2.0 * s) * y0 + s * s * (3.0 - 2.0 * s) * y1 + s * r * h * (r * d0 - s * d1);
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

/* A value inside the step: the polynomial through the interpolation nodes where the method has some, because the rates
 * at the ends of a stiff step ring while the values do not; else the cubic through values and rates. `node` points to
 * the value in the first node; the same value of the next node lies one msfp_node further. */
static double inside(const msfp_weights *w, double y0, double d0, const double *node, double y1, double d1, double h,
                     double share)
{
    if (w->count == 2)
        return hermite(y0, d0, y1, d1, h, share);
    double y = w->of[0] * y0 + w->of[w->count - 1] * y1;
    for (int i = 1; i < w->count - 1; ++i)
        y += w->of[i] * node[(size_t)(i - 1) * (sizeof(msfp_node) / sizeof(double))];
    return y;
}

void msfp_interpolate(const msfp_run *run, double share, msfp_state *out)
{
    const msfp_state *a = &run->now, *b = &run->next;
    const msfp_node *m = run->node;
    const msfp_weights w = msfp_weights_at(run, share);
    const double h = b->t - a->t;
    out->t = a->t + share * h;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < MSFP_NQ; ++d) {
            out->q[k][d] = inside(&w, a->q[k][d], a->v[k][d], &m->q[k][d], b->q[k][d], b->v[k][d], h, share);
            out->v[k][d] = inside(&w, a->v[k][d], a->a[k][d], &m->v[k][d], b->v[k][d], b->a[k][d], h, share);
            out->a[k][d] = (1.0 - share) * a->a[k][d] + share * b->a[k][d];
        }
        for (int d = 0; d < 2; ++d)
            out->f[k][d] = inside(&w, a->f[k][d], a->df[k][d], &m->f[k][d], b->f[k][d], b->df[k][d], h, share);
    }
#if MSFP_HEAT
    double da[NB][MSFP_HEAT], db[NB][MSFP_HEAT];
    msfp_heat_rates(&a->heat[0][0], a->flux, &da[0][0]);
    msfp_heat_rates(&b->heat[0][0], b->flux, &db[0][0]);
    for (int k = 0; k < NB; ++k) {
        out->flux[k] = (1.0 - share) * a->flux[k] + share * b->flux[k];
        for (int i = 0; i < MSFP_HEAT; ++i)
            out->heat[k][i] = inside(&w, a->heat[k][i], da[k][i], &m->heat[k][i], b->heat[k][i], db[k][i], h, share);
    }
#endif
    for (int i = 0; i < 2; ++i)
        out->foot[i] = inside(&w, a->foot[i], a->foot[i + 1], &m->foot[i], b->foot[i], b->foot[i + 1], h, share);
    out->foot[2] = (1.0 - share) * a->foot[2] + share * b->foot[2];
    for (int i = 0; i < MSFP_WORKS; ++i)
        out->work[i] = inside(&w, a->work[i], a->power[i], &m->work[i], b->work[i], b->power[i], h, share);
}

void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at)
{
    memset(at, 0, sizeof *at);
    msfp_point_at(run, s->t, at);
    memcpy(at->q, s->q, sizeof at->q);
    memcpy(at->v, s->v, sizeof at->v);
    memcpy(at->a, s->a, sizeof at->a);
    memcpy(at->f, s->f, sizeof at->f);
    memcpy(at->foot, s->foot, sizeof at->foot);
    msfp_heat_point(s, at);
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
static double foot_error(const msfp_run *run, const msfp_increment *error, int rates)
{
    const double gravity = run->parameters.gravity, stiffness = run->parameters.top[MSFP_TOP_PARAMETERS_KV];
    const double mass = msfp_sprung_mass(&run->parameters);
    if (mass == 0.0)
        return 0.0;
    const double settlement = fmax(mass * gravity / stiffness, smallest_settlement);
    const double speed = sqrt(settlement * gravity); /* settlement times circular frequency */
    return fmax(fabs(error->foot[0]) / settlement, rates ? fabs(error->foot[1]) / speed : 0.0) / run->options.rtol;
}

double msfp_error_norm(const msfp_run *run, const msfp_increment *error, int rates)
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
