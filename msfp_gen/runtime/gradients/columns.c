/* columns.c: directional derivatives of one evaluation of the condensed equations, parameters included.
 *
 * The evaluation itself is in msfp_work; the kernels of msfp_gradient_kernels.h carry its derivatives along the same
 * way: kinematics upward, forces from the top down, contacts, angular balances.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3")
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

/* Columns of a vector along E1, E2, E3 into a block of a polar vector, which in the plane has no E2. */
MSFP_INLINE void put_polar(double *block, msfp_columns *const vector)
{
    for (int i = 0; i < FORCE; ++i)
        memcpy(block + i * C, vector[MSFP_PLANAR ? 2 * i : i], sizeof *vector);
}

/* The same of an axial vector, which in the plane has E2 only. */
MSFP_INLINE void put_axial(double *block, msfp_columns *const vector)
{
    for (int i = 0; i < MOMENT; ++i)
        memcpy(block + i * C, vector[MSFP_PLANAR ? 1 : i], sizeof *vector);
}

MSFP_INLINE void put_coordinates(double *block, msfp_columns *const q, msfp_columns *const v, msfp_columns *const a)
{
    msfp_columns *const orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        memcpy(block + msfp_coordinate_field(order, 0) * C, orders[order] + (MSFP_PLANAR ? 1 : 0),
               (MSFP_PLANAR ? 1 : 3) * sizeof *q);
}

static const double constant[MSFP_BODY_PARAMETERS_SIZE * C]; /* columns of a body that no parameter changes */

/* Columns of the base plate. */
static MSFP_COLUMNWISE void base_plate(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                       const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    double below[MSFP_BODY_SIZE], dbelow[MSFP_BODY_SIZE * C] = { 0 };
    msfp_columns(*base)[6] = (msfp_columns(*)[6])dat->base;
    msfp_inertial_frame(at, below);
    put_polar(dbelow + MSFP_BODY_CX * C, base[0]);
    put_polar(dbelow + MSFP_BODY_VX * C, base[1]);
    put_polar(dbelow + MSFP_BODY_AX * C, base[2]);
    msfp_forward_direction(p->body[0], below, w->x[0], w->body[0], dp->body[0], dbelow, d->x[0],
                           d->body[0]);
}

MSFP_INLINE void kinematics(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                            const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    put_coordinates(d->x[0], (msfp_columns *)dat->base[0] + 3, (msfp_columns *)dat->base[1] + 3,
                    (msfp_columns *)dat->base[2] + 3);
    const int moves = dat->base_moves || memcmp(dp->body[0], constant, sizeof constant);
    if (moves) /* with few parameters only */
        base_plate(p, dp, at, dat, w, d);
    else if (d->base_moves)
        memset(d->body[0], 0, sizeof d->body[0]);
    d->base_moves = moves;
    for (int k = 1; k <= NB; ++k) {
        put_coordinates(d->x[k], (msfp_columns *)dat->q[k - 1], (msfp_columns *)dat->v[k - 1],
                        (msfp_columns *)dat->a[k - 1]);
        msfp_forward_direction(p->body[k], w->body[k - 1], w->x[k], w->body[k], dp->body[k], d->body[k - 1], d->x[k],
                               d->body[k]);
    }
}

/* Columns of the block `foot_stage`, as msfp_foot_stage fills it. */
MSFP_INLINE void foot_stage(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                            const msfp_point_columns *dat, double *d)
{
    const double before[MSFP_FOOT_BEFORE_SIZE] = { at->foot[0], at->foot[1], at->foot_beta };
    double dbefore[MSFP_FOOT_BEFORE_SIZE * C];
    memcpy(dbefore + MSFP_FOOT_BEFORE_Y * C, dat->foot, sizeof dat->foot);
    memcpy(dbefore + MSFP_FOOT_BEFORE_BETA * C, dat->foot_beta, sizeof dat->foot_beta);
    if (msfp_top_is_sprung(p))
        msfp_spring_stage_direction(p->top, before, dp->top, dbefore, d);
    else
        memset(d, 0, MSFP_FOOT_STAGE_SIZE * C * sizeof *d);
}

MSFP_INLINE void top(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                     const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    double force[FORCE], moment[MOMENT], dforce[FORCE * C], dmoment[MOMENT * C];
    double stage[MSFP_FOOT_STAGE_SIZE], dstage[MSFP_FOOT_STAGE_SIZE * C];
    double dwrench[MSFP_TOP_WRENCH_SIZE * C];
    msfp_force_F_put(force, at->load);
    msfp_moment_M_put(moment, at->load + 3);
    put_polar(dforce, (msfp_columns *)dat->load);
    put_axial(dmoment, (msfp_columns *)dat->load + 3);
    msfp_foot_stage(p, at, stage);
    foot_stage(p, dp, at, dat, dstage);
#if MSFP_TOP_ROTATION
    double upright[MSFP_UPRIGHT_SIZE], dupright[MSFP_UPRIGHT_SIZE * C] = { 0 }; /* as prescribed */
    msfp_support_axis(at, upright);
#endif
    msfp_top_wrench_direction(p->top, stage, w->body[NB], w->x[NB], force, moment MSFP_IF_TOP_ROTATION(upright), dp->top,
                              dstage, d->body[NB], d->x[NB], dforce,
                              dmoment MSFP_IF_TOP_ROTATION(dupright), dwrench);
    memcpy(d->force[NB], dwrench, sizeof d->force[NB]);
    memcpy(d->moment[NB], dwrench + FORCE * C, sizeof d->moment[NB]);
}

MSFP_COLUMNWISE void msfp_foot_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                       const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    double stage[MSFP_FOOT_STAGE_SIZE], dstage[MSFP_FOOT_STAGE_SIZE * C];
    if (msfp_top_is_sprung(p)) {
        msfp_foot_stage(p, at, stage);
        foot_stage(p, dp, at, dat, dstage);
        msfp_foot_direction(p->top, w->body[NB], stage, w->foot, dp->top, d->body[NB], dstage, d->foot);
    } else {
        memcpy(d->foot + MSFP_FOOT_Y * C, d->body[NB] + MSFP_BODY_CZ * C, C * sizeof(double));
        memcpy(d->foot + MSFP_FOOT_Y1 * C, d->body[NB] + MSFP_BODY_VZ * C, C * sizeof(double));
        memcpy(d->foot + MSFP_FOOT_Y2 * C, d->body[NB] + MSFP_BODY_AZ * C, C * sizeof(double));
    }
}

#if MSFP_RIMS
MSFP_COLUMNWISE void msfp_rim_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                      int j, const msfp_work_columns *d, double *columns)
{
    double x[MSFP_RIM_LOCAL], dx[MSFP_RIM_LOCAL * C];
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i) {
            const int field = msfp_coordinate_field(order, i), to = order * PAIR + i;
            x[to] = w->x[j + 1][field];
            memcpy(dx + to * C, d->x[j + 1] + field * C, C * sizeof *dx);
        }
    msfp_rim_direction(p->surface[j], x, dp->surface[j], dx, columns);
}
#endif

MSFP_COLUMNWISE void msfp_condensed_columns(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                            const msfp_point *at, const msfp_point_columns *dat, const msfp_seed *seed,
                                            const msfp_work *w, const msfp_slopes *slopes, int wanted,
                                            msfp_work_columns *d)
{
    static const double no_rim[MSFP_RIM_SIZE * C];
    double moment[MOMENT], dmoment[MOMENT * C], dangular[MSFP_ANGULAR_SIZE * C];
    kinematics(p, dp, at, dat, w, d);
    top(p, dp, at, dat, w, d);
    msfp_foot_columns(p, dp, at, dat, w, d);
    for (int j = NB - 1; j >= 0; --j)
        msfp_interface_force_direction(p->body[j + 1], w->body[j + 1], w->force[j + 1], w->force[j],
                                       dp->body[j + 1], d->body[j + 1], d->force[j + 1], d->force[j]);
    for (int j = 0; j < NB; ++j) {
        const double *drim = w->rim_active[j] ? d->rim[j] : no_rim;
#if MSFP_RIMS
        if (w->rim_active[j])
            msfp_rim_columns(p, dp, w, j, d, d->rim[j]);
#endif
        msfp_surface_local_direction(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], w->rim[j],
                                     w->local[j], d->body[j], d->body[j + 1], d->x[j + 1], d->x[j], d->force[j], drim,
                                     d->local[j]);
        msfp_contact_columns(p, dp, seed, dat, w, slopes, j, wanted & MSFP_OF_ROW, d);
        if (!(wanted & MSFP_OF_RESIDUAL))
            continue;
        msfp_surface_moment(w, j, moment);
        for (int i = 0; i < MOMENT * C; ++i)
            dmoment[i] = d->contact[j][i] + drim[FORCE * C + i];
        msfp_moment_to_world_direction(w->body[j], moment, w->moment[j], d->body[j], dmoment, d->moment[j]);
    }
    for (int k = 1; k <= NB && wanted & MSFP_OF_RESIDUAL; ++k) {
        msfp_angular_balance_direction(p->body[k], w->body[k], w->force[k - 1], w->moment[k - 1], w->force[k],
                                       w->moment[k], dp->body[k], d->body[k], d->force[k - 1], d->moment[k - 1],
                                       d->force[k], d->moment[k], dangular);
        memcpy(d->residual[(k - 1) * ND], dangular, NA * sizeof(msfp_columns));
        memset(d->lock[k - 1], 0, sizeof d->lock[k - 1]);
        if (!MSFP_PLANAR && MSFP_SPIN_LOCKED)
            memcpy(d->lock[k - 1], dangular + (MSFP_ANGULAR_SIZE - 1) * C, sizeof d->lock[k - 1]);
    }
}
#endif
