/* columns.c: the tangent of the condensed equations: an unknown turns its body and all that stands on it as one.
 *
 * From the top down, in axes that turn with the body at hand (generator/columns.py): bodies above an unknown feel only the
 * rates of its turning, those below only the force that it asks for.
 */
#include <string.h>
#include "stack.h"

#if !MSFP_UPLIFT
enum { INPUTS = MSFP_LOCAL_SIZE };
static const double at_rest[SCREW]; /* where columns are taken: no screw yet */

/* All columns at one body, [field][column], and at the surfaces next to it. */
typedef struct {
    double screw[SCREW * DOF];                        /* of the unknowns of this body and those below it; zero above */
    double above[VECTOR * DOF], moment_above[MOMENT * DOF]; /* axes that turn with the body; its basis */
    double below[VECTOR * DOF], moment_below[MOMENT * DOF]; /* the same axes; basis of the body below */
    double turning[MSFP_TURNING_SIZE * DOF];
} columns;

/* What the unknowns of body k change by themselves, added to the columns of `count` fields. */
MSFP_INLINE void add_own(double *column, int k, const double *own, int field, int count)
{
    for (int i = 0; i < ND; ++i)
        for (int f = 0; f < count; ++f)
            column[f * DOF + (k - 1) * ND + i] += own[i * MINE + field + f];
}

MSFP_INLINE void screws(const msfp_work *w, const double *seed, double *screw)
{
    double tilts[PAIR * SCREW];
    for (int k = 1; k <= NB; ++k) {
        msfp_screws(seed, w->body[k - 1], w->body[k], tilts);
        for (int f = 0; f < SCREW; ++f)
            for (int i = 0; i < ND; ++i)
                screw[f * DOF + (k - 1) * ND + i] = i < PAIR ? tilts[i * SCREW + f] : 0.0;
    }
}

/* Force and moment at the top, whose springs stand in axes that do not turn. */
MSFP_INLINE void top(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w, const double *own, columns *c)
{
    double body[MSFP_BODY_SIZE], wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    msfp_carried_tangent(w->body[NB], at_rest, body, c->screw, w->dbody[NB]);
    memset(w->dx[NB], 0, sizeof w->dx[NB]);
#if MSFP_SPIN_LOCKED
    (void)seed;
    (void)own;
#else
    add_own(w->dbody[NB] + MSFP_BODY_WPX * DOF, NB, own, MINE_WP, MOMENT);
    add_own(w->dbody[NB] + MSFP_BODY_ALPX * DOF, NB, own, MINE_WP + MOMENT, MOMENT);
    w->dx[NB][MSFP_COORDINATES_PHI * DOF + DOF - 1] = seed->cq;
#endif
    msfp_top_columns(p, at, w, NULL);
    msfp_seen_wrench_tangent(w->body[NB], at_rest, w->force[NB], w->moment[NB], wrench, c->screw, w->dforce[NB], w->dmoment[NB], dwrench);
    memcpy(c->above, dwrench, sizeof c->above);
    memcpy(c->moment_above, dwrench + VECTOR * DOF, sizeof c->moment_above);
}

/* Contact force of surface j and its slip by the body's own unknowns: [inputs of the contact][ND]. */
MSFP_INLINE void own_inputs(const msfp_work *w, const msfp_seed *seed, const double *rim, int j, const double *own, double *inputs)
{
    const double factors[2] = { seed->cq, seed->cv };
    for (int k = 0; k < INPUTS; ++k)
        for (int i = 0; i < ND; ++i)
            inputs[k * ND + i] = own[i * MINE + (k < VECTOR ? MINE_P + k : k - VECTOR)];
    for (int i = 0; i < 2 * PAIR && w->rim_active[j]; ++i)
        for (int f = 0; f < VECTOR; ++f)
            inputs[f * ND + i % PAIR] -= factors[i / PAIR] * rim[f * MSFP_RIM_LOCAL + i];
}

/* One row of the contact of surface j, of its moment or of N, from the columns of the force. */
MSFP_INLINE void contact_row(const double *restrict slope, const double *restrict local, int j, const double *restrict inputs, double cv, double *restrict row)
{
    double own[ND] = { 0 };
    for (int k = 0; k < INPUTS; ++k)
        for (int i = 0; i < ND; ++i)
            own[i] += slope[k * MSFP_LANES] * inputs[k * ND + i];
    for (int c = 0; c < DOF; ++c) {
        double sum = 0.0;
        for (int k = 0; k < VECTOR; ++k)
            sum += slope[k * MSFP_LANES] * local[k * DOF + c];
        row[c] = sum;
    }
    for (int i = 0; i < ND; ++i)
        row[j * ND + i] += own[i];
#if MSFP_SPIN_LOCKED
    (void)cv;
#else
    if (j > 0) /* spin of the body below */
        row[j * ND - 1] -= slope[MSFP_LOCAL_DWZ * MSFP_LANES] * cv;
#endif
}

/* Moment and N of surface j, in the basis of the body below. */
MSFP_INLINE void surface(msfp_work *w, const msfp_seed *seed, const msfp_slopes *slopes, int j, const double *own, columns *c)
{
    double unused[VECTOR], local[VECTOR * DOF], inputs[ND * INPUTS];
    const double *rim = slopes->rim[j], factors[2] = { seed->cq, seed->cv };
    own_inputs(w, seed, rim, j, own, inputs);
    msfp_force_to_local_tangent(w->body[j], w->force[j], unused, c->below, local);
    for (int r = 0; r <= MOMENT; ++r)
        contact_row(slopes->contact + r * INPUTS * MSFP_LANES + j, local, j, inputs, seed->cv, r < MOMENT ? c->moment_below + r * DOF : w->dnormal[j]);
    for (int i = 0; i < 2 * PAIR && w->rim_active[j]; ++i)
        for (int r = 0; r < MOMENT; ++r)
            c->moment_below[r * DOF + j * ND + i % PAIR] += factors[i / PAIR] * rim[(VECTOR + r) * MSFP_RIM_LOCAL + i];
}

/* From the surface above body k to the one below, as far as the body is rigid and heavy; its turning. */
MSFP_INLINE void descend(const msfp_parameters *p, const msfp_work *w, int k, const double *own, columns *c)
{
    double turning[MSFP_TURNING_SIZE], force[VECTOR];
    msfp_carried_force_tangent(p->body[k], w->body[k], at_rest, w->force[k], force, c->screw, c->above, c->below);
    msfp_felt_tangent(w->body[k], at_rest, turning, c->screw, c->turning);
#if MSFP_SPIN_LOCKED
    (void)own;
#else
    add_own(c->turning, k, own, MINE_WP, MSFP_TURNING_SIZE);
#endif
    for (int f = 0; f < SCREW; ++f)
        memset(c->screw + f * DOF + (k - 1) * ND, 0, ND * sizeof *c->screw);
}

/* Rows of body k. They are linear in forces and moments, so that any will do for their columns. */
MSFP_INLINE void balance(const msfp_parameters *p, const msfp_work *w, int k, const double *own, const columns *c, double *tangent)
{
    double turning[MSFP_TURNING_SIZE], out[MSFP_ANGULAR_SIZE], *rows = tangent + (k - 1) * ND * DOF;
    msfp_felt(w->body[k], at_rest, turning);
    msfp_turning_balance_tangent(p->body[k], w->body[k], turning, w->force[k - 1], w->moment[k - 1], w->force[k], w->moment[k], out,
                                 c->turning, c->below, c->moment_below, c->above, c->moment_above, rows);
    for (int i = 0; i < ND; ++i)
        for (int r = 0; r < NA; ++r)
            rows[r * DOF + (k - 1) * ND + i] -= own[i * MINE + MINE_M + r];
}

MSFP_WIDE void msfp_columns(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w, const msfp_slopes *slopes,
                            double *tangent)
{
    const double factors[MSFP_SEED_SIZE] = { seed->cq, seed->cv, seed->ca };
    double own[NB + 1][ND * MINE], moment[MOMENT];
    columns c;
    screws(w, factors, c.screw);
    for (int k = 1; k <= NB; ++k) {
        msfp_surface_moment(w, k - 1, moment);
        msfp_own(factors, w->body[k - 1], w->body[k], w->x[k], w->x[k - 1], w->force[k - 1], moment, own[k]);
    }
    top(p, at, seed, w, own[NB], &c);
    for (int k = NB; k >= 1; --k) {
        double next[VECTOR * DOF]; /* in axes that turn with the body below */
        descend(p, w, k, own[k], &c);
        memcpy(next, c.below, sizeof next);
        add_own(next, k, own[k], MINE_F, VECTOR);
        surface(w, seed, slopes, k - 1, own[k], &c);
        balance(p, w, k, own[k], &c, tangent);
        memcpy(c.above, next, sizeof c.above);
        memcpy(c.moment_above, c.moment_below, sizeof c.moment_above);
    }
}
#endif
