/* tangent.c: the tangent at the top, and, without uplift, the fast tangent of the condensed equations: an unknown moves
 * its body and all bodies above it as one rigid body.
 *
 * Columns are formed from the top down in body-fixed frames (generator/columns.py). Of a body above an unknown only the
 * angular velocity and acceleration vary, of a body below only the interface force.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* unrolls and vectorises the short loops over columns */
#endif
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

MSFP_WIDE void msfp_top_tangent(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    msfp_blocks s;
    msfp_block_tangents ds;
    msfp_set_loads(p, at, &s);
    memset(ds.load_force, 0, sizeof ds.load_force);
    memset(ds.load_moment, 0, sizeof ds.load_moment);
    msfp_top_tangents(p, w, &s, &ds);
}

#if !MSFP_FORWARD_TANGENT
enum { LANES = MSFP_LANES };
/* Fields of the local variation of a body: the inputs of the contact beside its force come first. */
enum {
    TWIST = MSFP_TWIST_SIZE,
    VARIATION = MSFP_VARIATION_SIZE,
    VARIATION_P = MSFP_CONTACT_FRAME_SIZE - FORCE,
    VARIATION_F = VARIATION_P + FORCE,
    VARIATION_M = VARIATION_F + FORCE,
    VARIATION_WP = VARIATION_M + MOMENT
};
enum { INPUTS = MSFP_CONTACT_FRAME_SIZE };
#if MSFP_GRADIENTS
#define RATE_ROW(w, j, i) (w)->drates[j][i]
#else
#define RATE_ROW(w, j, i) (w)->dnormal[j] /* there are no such rows */
#endif
static const double no_twist[TWIST]; /* columns are derivatives at zero twist */

/* All columns at one body, [field][column], and at the surfaces next to it. */
typedef struct {
    double twist[TWIST * DOF]; /* of the unknowns of this body and of those below it; zero for unknowns above */
    double above[FORCE * DOF], moment_above[MOMENT * DOF]; /* body-fixed frame; basis of the body */
    double below[FORCE * DOF], moment_below[MOMENT * DOF]; /* body-fixed frame; basis of the body below */
    double turning[MSFP_TURNING_SIZE * DOF];
} columns;

/* Add the local variation of body k to the columns of `count` fields, from its field `field` on. */
MSFP_INLINE void add_variation(double *column, int k, const double *variation, int field, int count)
{
    for (int i = 0; i < ND; ++i)
        for (int f = 0; f < count; ++f)
            column[f * DOF + (k - 1) * ND + i] += variation[i * VARIATION + field + f];
}

/* The axis about which tilt angle i turns body k (2.4), (2.5): t1 of the body below for psi, t2 of the body for theta. */
MSFP_INLINE void axis(const msfp_work *w, int k, int i, double *block)
{
    const int theta = i == PAIR - 1;
    const double *carrier = w->body[theta ? k : k - 1], *below = w->body[k - 1];
    double vector[3];
    if (theta)
        msfp_body_t2_get(carrier, vector);
    else
        msfp_body_t1_get(carrier, vector);
    msfp_axis_t_put(block, vector);
    msfp_body_w_get(carrier, vector);
    msfp_axis_w_put(block, vector);
    msfp_body_al_get(carrier, vector);
    msfp_axis_al_put(block, vector);
    msfp_body_C_get(below, vector);
    msfp_axis_C_put(block, vector);
    msfp_body_V_get(below, vector);
    msfp_axis_V_put(block, vector);
    msfp_body_A_get(below, vector);
    msfp_axis_A_put(block, vector);
}

/* Twists of all unknowns, [field][DOF]; zero for spins. */
MSFP_INLINE void twists(const msfp_work *w, const double *seed, double *twist)
{
    double axes[MSFP_AXIS_SIZE * DOF], seeds[MSFP_SEED_SIZE * DOF], one[MSFP_AXIS_SIZE];
    if (ND > PAIR)
        memset(axes, 0, sizeof axes);
    for (int k = 1; k <= NB; ++k)
        for (int i = 0; i < PAIR; ++i) {
            axis(w, k, i, one);
            for (int f = 0; f < MSFP_AXIS_SIZE; ++f)
                axes[f * DOF + (k - 1) * ND + i] = one[f];
        }
    for (int f = 0; f < MSFP_SEED_SIZE; ++f)
        for (int c = 0; c < DOF; ++c)
            seeds[f * DOF + c] = seed[f];
    msfp_twist_lanes(seeds, axes, twist);
}

/* Columns of force and moment at the top, whose springs act along fixed axes. */
MSFP_INLINE void top_tangent(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                             msfp_work *w, const double *variation, columns *c)
{
    double body[MSFP_BODY_SIZE], wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    msfp_transported_twist_tangent(w->body[NB], no_twist, body, c->twist, w->dbody[NB]);
    memset(w->dx[NB], 0, sizeof w->dx[NB]);
#if MSFP_SPIN_LOCKED
    (void)weights;
    (void)variation;
#else
    add_variation(w->dbody[NB] + MSFP_BODY_WPX * DOF, NB, variation, VARIATION_WP, MOMENT);
    add_variation(w->dbody[NB] + MSFP_BODY_ALPX * DOF, NB, variation, VARIATION_WP + MOMENT, MOMENT);
    w->dx[NB][MSFP_COORDINATES_PHI * DOF + DOF - 1] = weights->q_weight;
#endif
    msfp_top_tangent(p, at, w);
    msfp_transported_wrench_tangent(w->body[NB], no_twist, w->force[NB], w->moment[NB], wrench, c->twist, w->dforce[NB],
                                    w->dmoment[NB], dwrench);
    memcpy(c->above, dwrench, sizeof c->above);
    memcpy(c->moment_above, dwrench + FORCE * DOF, sizeof c->moment_above);
}

/* Derivatives of the inputs of the contact of surface j with respect to the unknowns of the body above:
 * [inputs][ND][lane], with the surface in lane j. */
MSFP_INLINE void local_inputs(const msfp_work *w, const msfp_stage_weights *weights, const double *rim, int j,
                              const double *variation, double *inputs)
{
    const double factors[2] = { weights->q_weight, weights->v_weight };
    for (int k = 0; k < INPUTS; ++k)
        for (int i = 0; i < ND; ++i)
            inputs[(k * ND + i) * LANES + j] = variation[i * VARIATION + (k < FORCE ? VARIATION_P + k : k - FORCE)];
    for (int i = 0; i < 2 * PAIR && w->rim_active[j]; ++i)
        for (int f = 0; f < FORCE; ++f)
            inputs[(f * ND + i % PAIR) * LANES + j] -= factors[i / PAIR] * rim[f * MSFP_RIM_LOCAL + i];
}

/* Derivatives of the results of all contacts with respect to the unknowns of the body above, at constant force on it:
 * [MSFP_CONTACT_ROWS][ND][lane]. */
MSFP_INLINE void local_parts(const msfp_work *w, const msfp_stage_weights *weights,
                             double variation[NB + 1][ND * VARIATION], double *restrict parts)
{
    double inputs[INPUTS * ND * LANES] = { 0.0 };
    for (int j = 0; j < NB; ++j)
        local_inputs(w, weights, w->jacobians.rim[j], j, variation[j + 1], inputs);
    for (int r = 0; r < MSFP_CONTACT_ROWS; ++r) {
        const double *slopes = w->jacobians.contact + r * INPUTS * LANES;
        for (int i = 0; i < ND; ++i) {
            double sum[LANES] = { 0.0 };
            for (int k = 0; k < INPUTS; ++k)
                for (int s = 0; s < LANES; ++s)
                    sum[s] += slopes[k * LANES + s] * inputs[(k * ND + i) * LANES + s];
            memcpy(parts + (r * ND + i) * LANES, sum, sizeof sum);
        }
    }
}

/* Columns of one result of the contact of surface j, from those of its force and `part`, that of local_parts. */
MSFP_INLINE void contact_row(const double *restrict slope, const double *restrict local, int j,
                             const double *restrict part, double v_weight, double *restrict row)
{
    for (int c = 0; c < DOF; ++c) {
        double sum = 0.0;
        for (int k = 0; k < FORCE; ++k)
            sum += slope[k * LANES] * local[k * DOF + c];
        row[c] = sum;
    }
    for (int i = 0; i < ND; ++i)
        row[j * ND + i] += part[i * LANES];
#if MSFP_SPIN_LOCKED
    (void)v_weight;
#else
    if (j > 0) /* spin of the body below */
        row[j * ND - 1] -= slope[MSFP_CONTACT_FRAME_DWZ * LANES] * v_weight;
#endif
}

/* Columns of the moment of surface j, in the basis of the body below, of N and in models with gradients of the rates. */
MSFP_INLINE void surface_tangent(msfp_work *w, const msfp_stage_weights *weights, int j, const double *parts,
                                 columns *c)
{
    double unused[FORCE], local[FORCE * DOF];
    const double *rim = w->jacobians.rim[j], factors[2] = { weights->q_weight, weights->v_weight };
    msfp_force_to_local_tangent(w->body[j], w->force[j], unused, c->below, local);
    for (int r = 0; r < MSFP_CONTACT_ROWS; ++r)
        contact_row(w->jacobians.contact + r * INPUTS * LANES + j, local, j, parts + r * ND * LANES + j,
                    weights->v_weight,
                    r < MOMENT    ? c->moment_below + r * DOF
                    : r == MOMENT ? w->dnormal[j]
                                  : RATE_ROW(w, j, r - MOMENT - 1));
    for (int i = 0; i < 2 * PAIR && w->rim_active[j]; ++i)
        for (int r = 0; r < MOMENT; ++r)
            c->moment_below[r * DOF + j * ND + i % PAIR] += factors[i / PAIR] * rim[(FORCE + r) * MSFP_RIM_LOCAL + i];
}

/* Columns of the force below body k from those above, and the variation of its angular velocity and acceleration. */
MSFP_INLINE void force_below(const msfp_parameters *p, const msfp_work *w, int k, const double *variation, columns *c)
{
    double turning[MSFP_TURNING_SIZE], force[FORCE];
    msfp_transported_force_tangent(p->body[k], w->body[k], no_twist, w->force[k], force, c->twist, c->above, c->below);
    msfp_variation_of_rates_tangent(w->body[k], no_twist, turning, c->twist, c->turning);
#if MSFP_SPIN_LOCKED
    (void)variation;
#else
    add_variation(c->turning, k, variation, VARIATION_WP, MSFP_TURNING_SIZE);
#endif
    MSFP_UNROLL
    for (int f = 0; f < TWIST; ++f)
        memset(c->twist + f * DOF + (k - 1) * ND, 0, ND * sizeof *c->twist);
}

/* Rows of body k. They are linear in forces and moments, whose values therefore do not enter the columns. */
MSFP_INLINE void balance(const msfp_parameters *p, const msfp_work *w, int k, const double *variation, const columns *c,
                         double *tangent)
{
    double turning[MSFP_TURNING_SIZE], out[MSFP_ANGULAR_SIZE], *rows = tangent + (k - 1) * ND * DOF;
    msfp_variation_of_rates(w->body[k], no_twist, turning);
    msfp_turning_balance_tangent(p->body[k], w->body[k], turning, w->force[k - 1], w->moment[k - 1], w->force[k],
                                 w->moment[k], out, c->turning, c->below, c->moment_below, c->above, c->moment_above,
                                 rows);
    for (int i = 0; i < ND; ++i)
        for (int r = 0; r < NA; ++r)
            rows[r * DOF + (k - 1) * ND + i] -= variation[i * VARIATION + VARIATION_M + r];
}

/* The tangent from the columns at the top downwards. */
MSFP_INLINE void descend(const msfp_parameters *p, const msfp_stage_weights *weights, msfp_work *w,
                         double variation[NB + 1][ND * VARIATION], columns *c, double *tangent)
{
    double parts[MSFP_CONTACT_ROWS * ND * LANES];
    local_parts(w, weights, variation, parts);
    for (int k = NB; k >= 1; --k) {
        double next[FORCE * DOF]; /* in the frame of the body below */
        force_below(p, w, k, variation[k], c);
        memcpy(next, c->below, sizeof next);
        add_variation(next, k, variation[k], VARIATION_F, FORCE);
        surface_tangent(w, weights, k - 1, parts, c);
        balance(p, w, k, variation[k], c, tangent);
        memcpy(c->above, next, sizeof c->above);
        memcpy(c->moment_above, c->moment_below, sizeof c->moment_above);
    }
}

MSFP_WIDE void msfp_load_tangent(const msfp_parameters *p, msfp_work *w, const double *dforce, const double *dmoment,
                                 double *derivatives)
{
    static const msfp_stage_weights none;
    double variation[NB + 1][ND * VARIATION] = { { 0.0 } };
    double wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    columns c;
    memset(&c, 0, sizeof c);
    msfp_transported_wrench_tangent(w->body[NB], no_twist, w->force[NB], w->moment[NB], wrench, c.twist, dforce, dmoment,
                                    dwrench);
    memcpy(c.above, dwrench, sizeof c.above);
    memcpy(c.moment_above, dwrench + FORCE * DOF, sizeof c.moment_above);
    descend(p, &none, w, variation, &c, derivatives);
}

MSFP_WIDE void msfp_tangent(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                            msfp_work *w, double *tangent)
{
    const double factors[MSFP_SEED_SIZE] = { weights->q_weight, weights->v_weight, weights->a_weight };
    double variation[NB + 1][ND * VARIATION], moment[MOMENT];
    columns c;
    twists(w, factors, c.twist);
    for (int k = 1; k <= NB; ++k) {
        msfp_surface_moment(w->contact[k - 1] MSFP_IF_RIMS(w->rim[k - 1]), moment);
        msfp_local_variation(factors, w->body[k - 1], w->body[k], w->x[k], w->x[k - 1], w->force[k - 1], moment,
                             variation[k]);
    }
    top_tangent(p, at, weights, w, variation[NB], &c);
    descend(p, weights, w, variation, &c, tangent);
}
#endif
