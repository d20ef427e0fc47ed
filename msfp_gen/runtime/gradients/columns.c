/* columns.c: directional derivatives of one evaluation of the condensed equations, parameters included, part by part as
 * generator/schedule.py states them. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3")
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_directions.h"

MSFP_INLINE void put_coordinates(double *block, const msfp_columns *q, const msfp_columns *v, const msfp_columns *a)
{
    const msfp_columns *const orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        memcpy(block + msfp_coordinate_field(order, 0) * C, orders[order] + (MSFP_PLANAR ? 1 : 0),
               (MSFP_PLANAR ? 1 : 3) * sizeof *q);
}

#if MSFP_UPLIFT
MSFP_INLINE void put_separation(double *block, const msfp_columns *q, const msfp_columns *v, const msfp_columns *a)
{
    const msfp_columns *const orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < MSFP_SPACE; ++i)
            memcpy(block + msfp_separation_field(order, i) * C, orders[order][3 + (MSFP_PLANAR ? 2 * i : i)], sizeof *q);
}
#else
#define put_separation(block, q, v, a) ((void)0)
#endif

static const double constant[MSFP_BODY_PARAMETERS_SIZE * C]; /* columns of a body that no parameter changes */

MSFP_INLINE void motion_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                msfp_blocks *s, msfp_block_directions *ds, msfp_work_columns *d)
{
    const msfp_point_columns *dat = ds->point;
    put_coordinates(d->x[0], dat->base[0] + 3, dat->base[1] + 3, dat->base[2] + 3);
    const int moves = dat->base_moves || memcmp(dp->body[0], constant, sizeof constant) != 0;
    if (moves) { /* with few parameters only */
        memset(ds->frame, 0, sizeof ds->frame);
        msfp_put_polar(ds->frame + MSFP_BODY_CX * C, dat->base[0]);
        msfp_put_polar(ds->frame + MSFP_BODY_VX * C, dat->base[1]);
        msfp_put_polar(ds->frame + MSFP_BODY_AX * C, dat->base[2]);
        msfp_inertial_frame(s->at, s->frame);
        msfp_base_directions(p, dp, w, d, s, ds);
    } else if (d->base_moves)
        memset(d->body[0], 0, sizeof d->body[0]);
    d->base_moves = moves;
    for (int k = 1; k <= NB; ++k) {
        put_coordinates(d->x[k], dat->q[k - 1], dat->v[k - 1], dat->a[k - 1]);
        put_separation(d->x[k], dat->q[k - 1], dat->v[k - 1], dat->a[k - 1]);
    }
    msfp_bodies_directions(p, dp, w, d, s, ds);
}

#if MSFP_UPLIFT
void msfp_motion_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                         const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    msfp_blocks s;
    msfp_block_directions ds;
    s.at = at;
    ds.point = dat;
    motion_columns(p, dp, w, &s, &ds, d);
}
#endif

#if MSFP_TOP_ROTATION
void msfp_support_columns(const msfp_point *at, const msfp_point_columns *dat, double *dupright)
{
    double support[MSFP_SUPPORT_SIZE], dsupport[MSFP_SUPPORT_SIZE * C];
    msfp_support(at, support);
    for (int order = 0; order < 2; ++order)
        memcpy(dsupport + order * PAIR * C, dat->support[order] + (MSFP_PLANAR ? 1 : 0), PAIR * sizeof(msfp_columns));
    msfp_upright_direction(support, dsupport, dupright);
}
#endif

/* Columns of the block `foot_stage`, as msfp_foot_stage fills it. */
MSFP_INLINE void foot_stage_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                    const msfp_point_columns *dat, double *d)
{
    const double before[MSFP_FOOT_PREVIOUS_SIZE] = { at->foot[0], at->foot[1], at->foot_beta };
    double dbefore[MSFP_FOOT_PREVIOUS_SIZE * C];
    memcpy(dbefore + MSFP_FOOT_PREVIOUS_Y * C, dat->foot, sizeof dat->foot);
    memcpy(dbefore + MSFP_FOOT_PREVIOUS_BETA * C, dat->foot_beta, sizeof dat->foot_beta);
    if (msfp_top_is_sprung(p))
        msfp_spring_stage_direction(p->top, before, dp->top, dbefore, d);
    else
        memset(d, 0, MSFP_FOOT_STAGE_SIZE * C * sizeof *d);
}

MSFP_INLINE void top_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                             msfp_blocks *s, msfp_block_directions *ds, msfp_work_columns *d)
{
    msfp_put_polar(ds->load_force, ds->point->load);
    msfp_put_axial(ds->load_moment, ds->point->load + 3);
    foot_stage_columns(p, dp, s->at, ds->point, ds->foot_stage);
#if MSFP_TOP_ROTATION
    msfp_support_columns(s->at, ds->point, ds->upright);
#endif
    msfp_top_directions(p, dp, w, d, s, ds);
}

MSFP_WIDE void msfp_foot_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                 const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d)
{
    if (msfp_top_is_sprung(p)) {
        double stage[MSFP_FOOT_STAGE_SIZE], dstage[MSFP_FOOT_STAGE_SIZE * C];
        msfp_foot_stage(p, at, stage);
        foot_stage_columns(p, dp, at, dat, dstage);
        msfp_foot_direction(p->top, w->body[NB], stage, w->foot, dp->top, d->body[NB], dstage, d->foot);
    } else {
        memcpy(d->foot + MSFP_FOOT_Y * C, d->body[NB] + MSFP_BODY_CZ * C, C * sizeof(double));
        memcpy(d->foot + MSFP_FOOT_Y1 * C, d->body[NB] + MSFP_BODY_VZ * C, C * sizeof(double));
        memcpy(d->foot + MSFP_FOOT_Y2 * C, d->body[NB] + MSFP_BODY_AZ * C, C * sizeof(double));
    }
}

#if MSFP_RIMS
MSFP_WIDE void msfp_rim_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                int j, const msfp_work_columns *d, double *columns)
{
    double x[MSFP_RIM_LOCAL], dx[MSFP_RIM_LOCAL * C];
    msfp_rim_coordinates(w->body[j], w->x[j + 1], x);
    msfp_rim_coordinates_direction(w->body[j], w->x[j + 1], d->body[j], d->x[j + 1], dx);
    msfp_rim_direction(p->surface[j], x, dp->surface[j], dx, columns);
}
#endif

MSFP_WIDE void msfp_condensed_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                      const msfp_point_columns *dat, const msfp_stage_weights *weights,
                                      const msfp_work *w, const msfp_slopes *slopes, int wanted, msfp_work_columns *d)
{
    msfp_blocks s;
    msfp_block_directions ds;
    s.weights = weights;
    s.at = at;
    ds.point = dat;
    ds.slopes = slopes;
    ds.all = wanted & MSFP_OF_ROW;
    msfp_set_loads(p, at, &s);
    motion_columns(p, dp, w, &s, &ds, d);
    top_columns(p, dp, w, &s, &ds, d);
    for (int j = 0; j < NB; ++j) {
        memcpy(ds.friction_previous[j] + MSFP_FRICTION_PREVIOUS_Y * C, dat->f[j],
               MSFP_FRICTION_FORCE_SIZE * sizeof dat->f[j][0]);
        memcpy(ds.friction_previous[j] + MSFP_FRICTION_PREVIOUS_BETA * C, dat->beta, sizeof dat->beta);
#if MSFP_MEMORY
        memcpy(ds.friction_previous[j] + MSFP_FRICTION_PREVIOUS_PAST * C, dat->past[j], sizeof dat->past[j]);
        memcpy(ds.friction_previous[j] + MSFP_FRICTION_PREVIOUS_GAIN * C, dat->gain[MSFP_GAIN(j)],
               sizeof(msfp_columns));
#endif
    }
    msfp_forces_directions(p, dp, w, d, &s, &ds);
    msfp_surfaces_directions(p, dp, w, d, &s, &ds);
    if (!(wanted & MSFP_OF_RESIDUAL))
        return;
    msfp_moments_directions(p, dp, w, d, &s, &ds);
    for (int k = 0; k < NB; ++k) {
        memcpy(d->residual[k * ND], ds.angular[k + 1], NA * sizeof(msfp_columns));
#if MSFP_UPLIFT
        memcpy(d->residual[k * ND + NA], ds.excess[k], MSFP_SPACE * sizeof(msfp_columns));
#endif
        memset(d->lock[k], 0, sizeof d->lock[k]);
        if (!MSFP_PLANAR && MSFP_SPIN_LOCKED)
            memcpy(d->lock[k], ds.angular[k + 1] + (MSFP_ANGULAR_SIZE - 1) * C, sizeof d->lock[k]);
    }
}

MSFP_WIDE void msfp_friction_columns(const msfp_work_columns *d, msfp_columns df[NB][2], msfp_columns f[NB][2])
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_FRICTION_FORCE_SIZE; ++i) {
            memcpy(df[j][i], d->contact[j] + (MSFP_CONTACT_DY + i) * C, sizeof df[j][i]);
            if (f)
                memcpy(f[j][i], d->contact[j] + (MSFP_CONTACT_Y + i) * C, sizeof f[j][i]);
        }
}
#endif
