/* lane_surface.h: the sliding surfaces of several runs at once: surface.c and contact.c with a run in every lane. */
#ifndef MSFP_LANE_SURFACE_H
#define MSFP_LANE_SURFACE_H
#include "lane_work.h"

#define ROWS (MOMENT + FRICTION + 1) /* rows of the contact's Jacobian: M, dY, dZ, N */

/* ---- what the outside does to the top --------------------------------------------------------------------------- */

LANE_INLINE void lane_outside(const lane_work *w, lane *force, lane *moment)
{
    lane_force_F_put(force, w->in.at.load);
    lane_moment_M_put(moment, w->in.at.load + 3);
}

#if MSFP_TURNED
LANE_INLINE void lane_held(const lane_work *w, lane *upright)
{
    lane support[MSFP_SUPPORT_SIZE];
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            support[order * PAIR + i] = w->in.at.support[order][MSFP_PLANAR ? 1 : i];
    lane_upright(support, upright);
}
#endif

/* ---- rims: few are met at a time, so run by run ---------------------------------------------------------------- */

/* Rim force of surface j in one run; for a tangent with its Jacobian in angles and rates. */
static void lane_rim_met(lane_work *w, int j, int run)
{
#if MSFP_RIMS
    double x[MSFP_RIM_LOCAL], out[MSFP_RIM_SIZE], drim[MSFP_RIM_SIZE * MSFP_RIM_LOCAL], identity[MSFP_RIM_LOCAL * MSFP_RIM_LOCAL] = { 0 };
    for (int i = 0; i < MSFP_RIM_LOCAL; ++i) {
        x[i] = w->out.x[j + 1][coordinate(i / PAIR, i % PAIR)][run];
        identity[i * MSFP_RIM_LOCAL + i] = 1.0;
    }
    if (w->wanted)
        msfp_rim_tangent(w->parameters[run]->surface[j], x, out, identity, drim);
    else
        msfp_rim(w->parameters[run]->surface[j], x, out);
    w->more.rim_sum[j][run] = out[MSFP_RIM_FC];
    if (!(out[MSFP_RIM_FC] < 0.0))
        return;
    w->rim_active[j][run] = 1;
    for (int i = 0; i < MSFP_RIM_SIZE; ++i)
        w->out.rim[j][i][run] = out[i];
    if (!w->wanted)
        return;
    if (!w->any_rim[j])
        memset(w->rim_slope[j], 0, sizeof w->rim_slope[j]);
    w->any_rim[j] = 1;
    for (int i = 0; i < (VECTOR + MOMENT) * MSFP_RIM_LOCAL; ++i)
        w->rim_slope[j][i][run] = drim[i];
#else
    (void)w, (void)j, (void)run;
#endif
}

static void lane_rims(lane_work *w, int j)
{
    memset(w->out.rim[j], 0, sizeof w->out.rim[j]);
    memset(w->rim_active[j], 0, sizeof w->rim_active[j]);
    w->more.rim_sum[j] = lane_of(0.0);
    w->any_rim[j] = 0;
    if (!MSFP_RIMS)
        return;
    const unsigned away = lane_bits(lane_body_cp(w->out.body[j + 1]) * w->out.body[j + 1][MSFP_BODY_CT] > w->in.rim_cosine[j]);
    for (int run = 0; run < W && away != LANE_BITS; ++run)
        if (!(away >> run & 1))
            lane_rim_met(w, j, run);
}

/* ---- friction: Y, Z by their stage formula ---------------------------------------------------------------------- */

/* x of the 1x1 or 2x2 system a x = b, in place of b. */
LANE_INLINE void lane_solve_small(const lane *a, lane *b)
{
#if MSFP_PLANAR
    b[0] /= a[0];
#else
    const lane inverse = 1.0 / (a[0] * a[3] - a[1] * a[2]);
    const lane x = (b[0] * a[3] - a[1] * b[1]) * inverse;
    b[1] = (a[0] * b[1] - a[2] * b[0]) * inverse;
    b[0] = x;
#endif
}

/* Newton's progress with one surface. */
typedef struct {
    lane newton[FRICTION], step[FRICTION], size, best;
    lane_mask there;
} lane_progress;

/* What is left of the stage formula of surface j. */
LANE_INLINE void lane_miss(lane_work *w, int j, lane_progress *p, unsigned *broken)
{
    const lane beta = w->in.seed.beta, accuracy = lane_max(w->in.seed.accuracy, lane_of(1e-12));
    lane *out = w->out.contact[j], sum = lane_of(0.0);
    lane_contact(w->in.parts.surface[j], w->out.local[j], w->in.f[j], out);
    p->size = lane_of(0.0);
    for (int r = 0; r < FRICTION; ++r) {
        p->newton[r] = w->in.f[j][r] - w->in.seed.fp[j][r] - beta * out[MSFP_CONTACT_DY + r];
        p->size = lane_max(p->size, lane_abs(p->newton[r]));
        sum += lane_abs(p->newton[r]);
    }
    p->there = ~(p->size > accuracy * (1.0 + lane_abs(beta * out[MSFP_CONTACT_DY])));
    *broken |= ~lane_bits(sum < INFINITY) & LANE_BITS;
}

/* A Newton step on Y, Z of surface j in the runs that are not there yet; what overshoots goes half its last step back. */
LANE_INLINE void lane_improve(lane_work *w, int j, lane_progress *p, lane_mask still)
{
    const lane_mask overshot = p->size > p->best;
    lane a[FRICTION * FRICTION];
    for (int r = 0; r < FRICTION * FRICTION; ++r)
        a[r] = (r % (FRICTION + 1) == 0) - w->in.seed.beta * w->out.contact[j][MSFP_CONTACT_YY + r];
    lane_solve_small(a, p->newton);
    for (int r = 0; r < FRICTION; ++r) {
        p->step[r] = lane_choose(overshot, 0.5 * p->step[r], p->newton[r]);
        const lane moved = w->in.f[j][r] + lane_choose(overshot, p->step[r], -p->step[r]);
        w->in.f[j][r] = lane_choose(p->there | still, w->in.f[j][r], moved);
    }
    p->best = lane_choose(overshot, p->best, p->size);
}

/* Newton on Y, Z of all surfaces in turn, so that one does not wait for the square roots of another. A run of which one
 * surface has no finite value is left as it is. */
LANE_INLINE void lane_friction(lane_work *w)
{
    lane_progress progress[NB];
    lane_mask still = ~w->asked;
    unsigned broken = 0, done = lane_bits(still);
    for (int j = 0; j < NB; ++j) {
        for (int r = 0; r < FRICTION; ++r)
            progress[j].step[r] = lane_of(0.0);
        progress[j].best = lane_of(INFINITY);
    }
    for (int i = 0; i < 60 && done != LANE_BITS; ++i) {
        const unsigned before = broken;
        unsigned there = LANE_BITS;
        for (int j = 0; j < NB; ++j) {
            if (i == 0 || lane_bits(progress[j].there) != LANE_BITS)
                lane_miss(w, j, &progress[j], &broken);
            there &= lane_bits(progress[j].there);
        }
        for (int run = 0; run < W && broken != before; ++run)
            if ((broken & ~before & ~done) >> run & 1) {
                w->status[run] = i == 0 ? MSFP_E_FINITE : MSFP_E_NEWTON;
                still[run] = -1;
            }
        done |= there | broken;
        for (int j = 0; j < NB && done != LANE_BITS; ++j)
            if (lane_bits(progress[j].there) != LANE_BITS)
                lane_improve(w, j, &progress[j], still);
    }
    for (int run = 0; run < W && done != LANE_BITS; ++run)
        if (!(done >> run & 1))
            w->status[run] = MSFP_E_NEWTON;
}

/* Jacobian of the moment and of N with Y, Z following their stage formula: [MOMENT + 1][INPUTS]. */
LANE_INLINE void lane_condense(const lane_work *w, int j, lane *condensed)
{
    lane jacobian[ROWS * MSFP_LOCAL], a[FRICTION][FRICTION + INPUTS];
    lane_contact_jacobian(w->in.parts.surface[j], w->out.local[j], w->in.f[j], jacobian);
    for (int r = 0; r < FRICTION; ++r)
        for (int c = 0; c < FRICTION + INPUTS; ++c) {
            const lane from = jacobian[(MOMENT + r) * MSFP_LOCAL + (c < FRICTION ? INPUTS + c : c - FRICTION)];
            a[r][c] = c < FRICTION ? (r == c) - w->in.seed.beta * from : w->in.seed.beta * from;
        }
    for (int k = 0; k < FRICTION; ++k) /* Gauss and Jordan */
        for (int r = 0; r < FRICTION; ++r) {
            const lane factor = r == k ? 1.0 - 1.0 / a[k][k] : a[r][k] / a[k][k];
            for (int c = k + 1; c < FRICTION + INPUTS && r != k; ++c)
                a[r][c] -= factor * a[k][c];
        }
    for (int r = 0; r <= MOMENT; ++r) {
        const lane *row = jacobian + (r < MOMENT ? r : MOMENT + FRICTION) * MSFP_LOCAL;
        for (int k = 0; k < INPUTS; ++k) {
            lane sum = row[k];
            for (int c = 0; c < FRICTION; ++c)
                sum += row[INPUTS + c] * a[c][FRICTION + k] / a[c][c];
            condensed[r * INPUTS + k] = sum;
        }
    }
}

/* ---- one surface ------------------------------------------------------------------------------------------------ */

LANE_INLINE void lane_surface_moment(const lane_work *w, int j, lane *moment)
{
    for (int r = 0; r < MOMENT; ++r)
        moment[r] = w->out.contact[j][r] + w->out.rim[j][VECTOR + r];
}

/* Moments of all surfaces on the bodies above. */
LANE_INLINE void lane_surfaces(lane_work *w)
{
    lane moment[MOMENT];
    for (int j = 0; j < NB; ++j) {
        lane_rims(w, j);
        lane_surface_local(w->out.body[j], w->out.body[j + 1], w->out.x[j + 1], w->out.x[j], w->out.force[j], w->out.rim[j], w->out.local[j]);
    }
    lane_friction(w);
    for (int j = 0; j < NB; ++j) {
        lane_surface_moment(w, j, moment);
        lane_moment_to_world(w->out.body[j], moment, w->out.moment[j]);
    }
}

#endif
