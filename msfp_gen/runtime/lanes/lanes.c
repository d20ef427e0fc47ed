/* lanes.c: the condensed equations of several runs at once: kinematics.c and condensed.c with a run in every lane. */
#define _DEFAULT_SOURCE /* posix_memalign */
#include "lane_newton.h"
#include "lane_columns.h"
#include <stdlib.h>

enum { BALANCED = MSFP_PLANAR ? 1 : 3 }; /* components of a turning */

static void coordinates_of(lane *x, const lane *q, const lane *v, const lane *a)
{
    const lane *orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < BALANCED; ++i)
            x[coordinate(order, i)] = orders[order][MSFP_PLANAR ? 1 : i];
}

/* The base, from the inertial frame at r_01. */
static void base(lane_work *w)
{
    lane ground[MSFP_BODY_SIZE], e[3][3];
    memset(ground, 0, sizeof ground);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            e[i][k] = lane_of(i == k);
    lane_body_t1_put(ground, e[0]);
    lane_body_t2_put(ground, e[1]);
    lane_body_t3_put(ground, e[2]);
    lane_body_C_put(ground, w->in.at.base[0]);
    lane_body_V_put(ground, w->in.at.base[1]);
    lane_body_A_put(ground, w->in.at.base[2]);
    coordinates_of(w->out.x[0], w->in.at.base[0] + 3, w->in.at.base[1] + 3, w->in.at.base[2] + 3);
    lane_forward(w->in.parts.body[0], ground, w->out.x[0], w->out.body[0]);
}

static void stack_up(lane_work *w)
{
    for (int k = 1; k <= NB; ++k) {
        coordinates_of(w->out.x[k], w->in.at.q[k - 1], w->in.at.v[k - 1], w->in.at.a[k - 1]);
        lane_forward(w->in.parts.body[k], w->out.body[k - 1], w->out.x[k], w->out.body[k]);
    }
}

static void top(lane_work *w)
{
    lane force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE];
    lane_outside(w, force, moment);
#if MSFP_TURNED
    lane upright[MSFP_UPRIGHT_SIZE];
    lane_held(w, upright);
#endif
    lane_top_wrench(w->in.top, w->out.body[NB], w->out.x[NB], force, moment TURNED(upright), wrench);
    memcpy(w->out.force[NB], wrench, sizeof w->out.force[NB]);
    memcpy(w->out.moment[NB], wrench + VECTOR, sizeof w->out.moment[NB]);
    w->more.reference = w->in.weight + lane_abs(w->in.at.load[0]) + lane_abs(w->in.at.load[1]) + lane_abs(w->in.at.load[2]);
}

static void balances(lane_work *w)
{
    lane out[MSFP_ANGULAR_SIZE];
    for (int k = 1; k <= NB; ++k) {
        lane_angular_balance(w->in.parts.body[k], w->out.body[k], w->out.force[k - 1], w->out.moment[k - 1], w->out.force[k], w->out.moment[k], out);
        memcpy(w->residual + (k - 1) * ND, out, NA * sizeof *out);
        w->more.lock[k - 1] = MSFP_PLANAR || !MSFP_SPIN_LOCKED ? lane_of(0.0) : out[MSFP_ANGULAR_SIZE - 1];
    }
}

/* msfp_residual_scale, and the largest entry by it. */
static void measure(lane_work *w)
{
    w->size = lane_of(0.0);
    w->worst = lane_of(-1.0);
    for (int k = 0; k < NB; ++k) {
        const lane *par = w->in.parts.surface[k];
        const lane met = MSFP_RIMS ? lane_abs(w->out.rim[k][MSFP_RIM_FC]) : lane_of(0.0);
        const lane pressed = lane_min(w->out.contact[k][MSFP_CONTACT_N], 1e3 * w->more.reference) + met;
        const lane natural = pressed * par[MSFP_SURFACE_PARAMETERS_R] * (par[MSFP_SURFACE_PARAMETERS_MU] + 0.01);
        const lane scale = lane_max(natural, lane_of(1e-12));
        for (int i = k * ND; i < (k + 1) * ND; ++i) {
            const lane one = lane_abs(w->residual[i]) / scale;
            const lane_mask larger = ~(one <= w->size);
            w->size = lane_choose(larger, lane_choose(one < INFINITY, one, lane_of(INFINITY)), w->size);
            w->worst = lane_choose(larger, lane_of(i), w->worst);
        }
    }
}

/* Residual and tangent over N where that is asked for: newton.c has why. */
static void over_normal(lane_work *w)
{
    for (int k = 0; k < NB; ++k) {
        const lane normal = lane_choose(w->over, w->out.contact[k][MSFP_CONTACT_N], lane_of(1.0)), inverse = 1.0 / normal;
        for (int i = k * ND; i < (k + 1) * ND; ++i) {
            w->residual[i] /= normal;
            for (int c = 0; c < DOF && w->wanted; ++c) {
                const lane change = lane_choose(w->over, w->residual[i] * w->dnormal[k][c], lane_of(0.0));
                w->tangent[i * DOF + c] = inverse * (w->tangent[i * DOF + c] - change);
            }
        }
    }
}

/* ---- from the runs and back ------------------------------------------------------------------------------------- */

/* Scenes of one bearing are common: what the lanes hold already stays. */
static void gather_parameters(lane_work *w, msfp_request *const *r)
{
    int same = 1;
    for (int i = 0; i < W; ++i) {
        same &= w->values[i] == r[i]->values;
        w->values[i] = r[i]->values;
        w->in.weight[i] = r[i]->parameters->weight;
    }
    if (same)
        return;
    GATHER(w->in.parts, r[i]->parameters->body);
    GATHER(w->in.top, r[i]->parameters->top);
    GATHER(w->in.rim_cosine, r[i]->parameters->rim_cosine);
}

static void gather(lane_work *w, msfp_request *const *r)
{
    GATHER(w->in.at, r[i]->at->base);
    GATHER(w->in.seed, &r[i]->seed->cq);
    GATHER(w->in.f, r[i]->f);
    gather_parameters(w, r);
    for (int i = 0; i < W; ++i) {
        w->parameters[i] = r[i]->parameters;
        w->over[i] = r[i]->over_normal ? -1 : 0;
        w->status[i] = MSFP_OK;
    }
}

/* Runs that fill a vector up come last and get nothing. */
static void scatter(lane_work *w, msfp_request *const *r, int count)
{
    int full = 0;
    for (int i = 0; i < count; ++i) {
        r[i]->status = w->status[i];
        r[i]->size = w->size[i];
        r[i]->worst = (int)w->worst[i];
        full += w->status[i] != MSFP_OK || w->size[i] <= r[i]->keep;
    }
#define KEPT (i < count && (w->status[i] != MSFP_OK || w->size[i] <= r[i]->keep))
    SCATTER(w->in.f, i < count, r[i]->f);
    SCATTER(w->residual, i < count, r[i]->residual);
    if (w->wanted)
        SCATTER(w->tangent, i < count, r[i]->tangent);
    if (!full)
        return;
    SCATTER(w->out, KEPT, r[i]->work->x);
    SCATTER(w->more, KEPT, r[i]->work->rim_sum);
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < NB && KEPT; ++j)
            r[i]->work->rim_active[j] = w->rim_active[j][i];
#undef KEPT
}

static void evaluate(lane_work *w)
{
    stack_up(w);
    top(w);
    for (int j = NB - 1; j >= 0; --j)
        lane_interface_force(w->in.parts.body[j + 1], w->out.body[j + 1], w->out.force[j + 1], w->out.force[j]);
    lane_surfaces(w);
    balances(w);
    if (w->wanted)
        lane_tangent(w);
    measure(w);
    over_normal(w);
}

void msfp_lanes(lane_work *w, msfp_request *const *requests, int count)
{
    msfp_request *all[W];
    w->wanted = requests[0]->tangent != NULL;
    for (int i = 0; i < W; ++i)
        all[i] = requests[i < count ? i : 0];
    gather(w, all);
    base(w);
    w->asked = mask_of(LANE_BITS);
    evaluate(w);
    if (!w->wanted)
        descend(w, all, count);
    scatter(w, all, count);
}

lane_work *msfp_lanes_new(void)
{
    void *memory = NULL;
    if (posix_memalign(&memory, 64, sizeof(lane_work)))
        return NULL;
    return memset(memory, 0, sizeof(lane_work));
}
