/* lane_columns.h: the tangent of several runs at once: columns.c with a run in every lane. Columns of bodies above the one
 * at hand are left out where they are known. */
#ifndef MSFP_LANE_COLUMNS_H
#define MSFP_LANE_COLUMNS_H
#include "lane_surface.h"

static const lane at_rest[SCREW];

/* Force and moment of the surface above a body and of the one below take turns. */
typedef struct {
    lane screw[SCREW * DOF], wrenches[2][(VECTOR + MOMENT) * DOF], *above, *below, turning[MSFP_TURNING_SIZE * DOF];
} lane_columns;

LANE_INLINE void lane_add_own(lane *column, int k, const lane *own, int field, int count)
{
    for (int f = 0; f < count; ++f)
        for (int i = 0; i < ND; ++i)
            column[f * DOF + (k - 1) * ND + i] += own[i * MINE + field + f];
}

LANE_INLINE void lane_spread_screws(const lane_work *w, const lane *seed, lane *screw)
{
    lane tilts[PAIR * SCREW];
    for (int k = 1; k <= NB; ++k) {
        lane_screws(seed, w->out.body[k - 1], w->out.body[k], tilts);
        for (int f = 0; f < SCREW; ++f)
            for (int i = 0; i < ND; ++i)
                screw[f * DOF + (k - 1) * ND + i] = i < PAIR ? tilts[i * SCREW + f] : lane_of(0.0);
    }
}

LANE_INLINE void lane_top_columns(lane_work *w, const lane *own, lane_columns *c)
{
    static const lane zero[6 * DOF];
    lane body[MSFP_BODY_SIZE], dbody[MSFP_BODY_SIZE * DOF], dx[MSFP_COORDINATES_SIZE * DOF];
    lane force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    lane_carried_tangent(DOF, w->out.body[NB], at_rest, body, c->screw, dbody);
    memset(dx, 0, sizeof dx);
#if MSFP_SPIN_LOCKED
    (void)own;
#else
    lane_add_own(dbody + MSFP_BODY_WPX * DOF, NB, own, MINE_WP, MOMENT);
    lane_add_own(dbody + MSFP_BODY_ALPX * DOF, NB, own, MINE_WP + MOMENT, MOMENT);
    dx[MSFP_COORDINATES_PHI * DOF + DOF - 1] = w->in.seed.cq;
#endif
    lane_outside(w, force, moment);
#if MSFP_TURNED
    lane upright[MSFP_UPRIGHT_SIZE];
    lane_held(w, upright);
#endif
    lane_top_wrench_tangent(DOF, w->in.top, w->out.body[NB], w->out.x[NB], force, moment TURNED(upright), wrench, dbody, dx, zero, zero, dwrench);
    lane_seen_wrench_tangent(DOF, w->out.body[NB], at_rest, w->out.force[NB], w->out.moment[NB], wrench, c->screw, dwrench, dwrench + VECTOR * DOF, c->above);
}

LANE_INLINE void lane_contact_row(const lane_work *w, const lane *slope, const lane *local, int j, const lane *inputs, lane *row)
{
    for (int c = 0; c < DOF; ++c) {
        lane sum = lane_of(0.0);
        for (int k = 0; k < VECTOR; ++k)
            sum += slope[k] * local[k * DOF + c];
        row[c] = sum;
    }
    for (int i = 0; i < ND; ++i) {
        lane own = lane_of(0.0);
        for (int k = 0; k < INPUTS; ++k)
            own += slope[k] * inputs[k * ND + i];
        row[j * ND + i] += own;
    }
#if MSFP_SPIN_LOCKED
    (void)w;
#else
    if (j > 0)
        row[j * ND - 1] -= slope[MSFP_LOCAL_DWZ] * w->in.seed.cv;
#endif
}

LANE_INLINE void lane_surface_columns(lane_work *w, int j, const lane *own, lane_columns *c)
{
    lane unused[VECTOR], local[VECTOR * DOF], inputs[INPUTS * ND], condensed[(MOMENT + 1) * INPUTS];
    const lane factors[2] = { w->in.seed.cq, w->in.seed.cv }, *rim = w->rim_slope[j];
    for (int k = 0; k < INPUTS; ++k)
        for (int i = 0; i < ND; ++i)
            inputs[k * ND + i] = own[i * MINE + (k < VECTOR ? MINE_P + k : k - VECTOR)];
    for (int i = 0; i < 2 * PAIR && w->any_rim[j]; ++i)
        for (int f = 0; f < VECTOR; ++f)
            inputs[f * ND + i % PAIR] -= factors[i / PAIR] * rim[f * MSFP_RIM_LOCAL + i];
    lane_condense(w, j, condensed);
    lane_force_to_local_tangent(DOF, w->out.body[j], w->out.force[j], unused, c->below, local);
    for (int r = 0; r <= MOMENT; ++r)
        lane_contact_row(w, condensed + r * INPUTS, local, j, inputs, r < MOMENT ? c->below + (VECTOR + r) * DOF : w->dnormal[j]);
    for (int i = 0; i < 2 * PAIR && w->any_rim[j]; ++i)
        for (int r = 0; r < MOMENT; ++r)
            c->below[(VECTOR + r) * DOF + j * ND + i % PAIR] += factors[i / PAIR] * rim[(VECTOR + r) * MSFP_RIM_LOCAL + i];
}

/* From the surface above body k to the one below. */
LANE_INLINE void lane_carry_down(const lane_work *w, int k, const lane *own, lane_columns *c)
{
    lane turning[MSFP_TURNING_SIZE], force[VECTOR];
    for (int f = 0; f < VECTOR; ++f)
        for (int i = k * ND; i < DOF; ++i)
            c->below[f * DOF + i] = c->above[f * DOF + i];
    lane_carried_force_tangent(k * ND, w->in.parts.body[k], w->out.body[k], at_rest, w->out.force[k], force, c->screw, c->above, c->below);
    for (int f = 0; f < MSFP_TURNING_SIZE && k < NB; ++f)
        for (int i = 0; i < ND; ++i)
            c->turning[f * DOF + k * ND + i] = lane_of(0.0);
    lane_felt_tangent(k * ND, w->out.body[k], at_rest, turning, c->screw, c->turning);
#if MSFP_SPIN_LOCKED
    (void)own;
#else
    lane_add_own(c->turning, k, own, MINE_WP, MSFP_TURNING_SIZE);
#endif
}

LANE_INLINE void lane_balance_columns(lane_work *w, int k, const lane *own, const lane_columns *c)
{
    lane turning[MSFP_TURNING_SIZE], out[MSFP_ANGULAR_SIZE], *rows = w->tangent + (k - 1) * ND * DOF;
    lane_felt(w->out.body[k], at_rest, turning);
    lane_turning_balance_tangent(DOF, w->in.parts.body[k], w->out.body[k], turning, w->out.force[k - 1], w->out.moment[k - 1], w->out.force[k],
                                 w->out.moment[k], out, c->turning, c->below, c->below + VECTOR * DOF, c->above, c->above + VECTOR * DOF, rows);
    for (int i = 0; i < ND; ++i)
        for (int r = 0; r < NA; ++r)
            rows[r * DOF + (k - 1) * ND + i] -= own[i * MINE + MINE_M + r];
}

LANE_INLINE void lane_tangent(lane_work *w)
{
    const lane seed[MSFP_SEED_SIZE] = { w->in.seed.cq, w->in.seed.cv, w->in.seed.ca };
    lane own[NB + 1][ND * MINE], moment[MOMENT];
    lane_columns c;
    lane_spread_screws(w, seed, c.screw);
    for (int k = 1; k <= NB; ++k) {
        lane_surface_moment(w, k - 1, moment);
        lane_own(seed, w->out.body[k - 1], w->out.body[k], w->out.x[k], w->out.x[k - 1], w->out.force[k - 1], moment, own[k]);
    }
    c.above = c.wrenches[0];
    c.below = c.wrenches[1];
    lane_top_columns(w, own[NB], &c);
    for (int k = NB; k >= 1; --k) {
        lane_carry_down(w, k, own[k], &c);
        lane_surface_columns(w, k - 1, own[k], &c);
        lane_balance_columns(w, k, own[k], &c);
        lane_add_own(c.below, k, own[k], MINE_F, VECTOR); /* in axes that turn with the body below */
        lane *const next = c.above;
        c.above = c.below;
        c.below = next;
    }
}

#endif
