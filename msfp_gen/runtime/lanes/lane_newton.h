/* lane_newton.h: Newton's method in several runs at once, as long as old factors serve: take_step of newton.c with a run in
 * every lane. Private to lanes.c, which defines `evaluate`.
 */
#ifndef MSFP_LANE_NEWTON_H
#define MSFP_LANE_NEWTON_H
#include "lane_work.h"

static void evaluate(lane_work *w);
static const int unknown[ND] = MSFP_FREE;

/* What a step takes; runs that take none get another's. */
static void gather_newton(lane_work *w, msfp_request *const *r)
{
    const msfp_request *some = NULL, *of[W];
    for (int i = 0; i < W; ++i)
        some = r[i]->stage ? r[i] : some;
    for (int i = 0; i < W; ++i) {
        of[i] = r[i]->stage ? r[i] : some;
        w->newton.inertia[i] = of[i]->stage->inertia;
        for (int k = 0; k < DOF; ++k)
            w->newton.pivots[k][i] = of[i]->pivots[k];
    }
    GATHER(w->newton.Q, of[i]->stage->Q);
    GATHER(w->newton.V, of[i]->stage->V);
    GATHER(w->newton.factors, of[i]->factors);
}

/* msfp_lu_solve: x of the residual. */
static void solve(const lane_work *w, lane *x)
{
    const lane *matrix = w->newton.factors;
    memcpy(x, w->residual, sizeof w->residual);
    for (int k = 0; k < DOF; ++k)
        for (int run = 0; run < W; ++run) {
            const int from = w->newton.pivots[k][run];
            const double swap = x[from][run];
            x[from][run] = x[k][run];
            x[k][run] = swap;
        }
    for (int j = 0; j < DOF; ++j)
        for (int i = j + 1; i < DOF; ++i)
            x[i] -= matrix[i * DOF + j] * x[j];
    for (int i = DOF - 1; i >= 0; --i) {
        for (int j = i + 1; j < DOF; ++j)
            x[i] -= matrix[i * DOF + j] * x[j];
        x[i] *= matrix[i * DOF + i];
    }
}

static lane_mask mask_of(unsigned bits)
{
    lane_mask mask = { 0 };
    for (int run = 0; run < W; ++run)
        mask[run] = bits >> run & 1 ? -1 : 0;
    return mask;
}

/* Rates after a step of the runs `on`, and after the last step taken back of the runs `back`; angles and accelerations
 * follow. */
static void move(lane_work *w, unsigned on, unsigned back)
{
    const lane_mask forward = mask_of(on), backward = mask_of(back), moved = forward | backward;
    const lane beta = w->in.seed.beta, rate = w->newton.inertia / beta;
    lane x[DOF];
    solve(w, x);
    for (int k = 0; k < NB; ++k) {
        for (int i = 0; i < ND; ++i) {
            lane *step = &w->newton.step[k * ND + i], *v = &w->in.at.v[k][unknown[i]];
            *step = lane_choose(forward, x[k * ND + i], *step);
            *v = lane_choose(forward, *v - *step, lane_choose(backward, *v + *step, *v));
            const lane a = rate * (*v - w->newton.V[k][unknown[i]]);
            w->in.at.a[k][unknown[i]] = lane_choose(moved, a, w->in.at.a[k][unknown[i]]);
        }
        for (int d = 0; d < MSFP_NQ; ++d)
            w->in.at.q[k][d] = lane_choose(moved, w->newton.Q[k][d] + beta * w->in.at.v[k][d], w->in.at.q[k][d]);
    }
}

/* Which runs take a step (bits), and in *back which have to take one back, after which they are done. */
static unsigned going_on(const lane_work *w, msfp_request *const *r, int count, unsigned done, unsigned *back)
{
    unsigned on = 0;
    *back = 0;
    for (int i = 0; i < count; ++i) {
        const double size = w->status[i] ? INFINITY : w->size[i];
        if (!r[i]->stage || done >> i & 1 || size <= r[i]->stage->goal || !(size < INFINITY || r[i]->stage->taken))
            continue;
        on |= (unsigned)(size < 0.1 * r[i]->stage->before && r[i]->stage->taken < r[i]->most) << i;
        *back |= (unsigned)(r[i]->stage->taken && !(size < r[i]->stage->before)) << i;
    }
    return on & ~*back;
}

/* Newton's method with old factors, in the runs that may, as long as they are a quarter of the lanes: fewer had better wait for
 * others. */
static void descend(lane_work *w, msfp_request *const *r, int count)
{
    unsigned back, done = 0, ever = 0;
    for (;;) {
        unsigned on = going_on(w, r, count, done, &back);
        if (!back && 4 * __builtin_popcount(on) < count)
            break;
        if (!ever)
            gather_newton(w, r);
        ever |= on;
        for (int i = 0; i < count; ++i) {
            r[i]->more += (on | back) >> i & 1;
            if (on >> i & 1) {
                ++r[i]->stage->taken;
                r[i]->stage->before = w->size[i];
            }
            if ((on | back) >> i & 1)
                w->status[i] = MSFP_OK;
        }
        move(w, on, back);
        done |= back;
        w->asked = mask_of(on | back);
        evaluate(w);
    }
    if (ever)
        SCATTER(w->in.at.v, ever >> i & 1, r[i]->stage->at.v);
}

#endif
