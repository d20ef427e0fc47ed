/* observation.c: directional derivatives of what a run records, and of the powers whose integrals are its works. Where a
 * damper or a contact switches they are those of the branch taken. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_directions.h"

MSFP_WIDE void msfp_gaps_columns(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                 const double q[MSFP_NB][MSFP_NQ], msfp_columns dq[MSFP_NB][MSFP_NQ],
                                 double sliding[MSFP_NB][MSFP_GAP_SIZE],
                                 msfp_columns gaps[MSFP_NB][MSFP_GAP_SIZE])
{
    double x[MSFP_COORDINATES_SIZE] = { 0 }, dx[MSFP_COORDINATES_SIZE * C] = { 0 };
    for (int j = 0; j < NB; ++j) {
#if !MSFP_PLANAR
        x[MSFP_COORDINATES_PSI] = q[j][0];
        memcpy(dx + MSFP_COORDINATES_PSI * C, dq[j][0], sizeof(msfp_columns));
#endif
        x[MSFP_COORDINATES_THETA] = q[j][1];
        memcpy(dx + MSFP_COORDINATES_THETA * C, dq[j][1], sizeof(msfp_columns));
        msfp_gap_at(p->surface[j], x, sliding[j]);
        msfp_gap_at_direction(p->surface[j], x, dp->surface[j], dx, gaps[j][0]);
    }
}

#if MSFP_UPLIFT
/* Columns of the compression of surface j. */
static void compression_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                const msfp_work_columns *d, int j, double *columns)
{
    double depth[MSFP_UNILATERAL_DEPTH_SIZE], contact[MSFP_UNILATERAL_SIZE * C];
    const int slider = msfp_slider(j);
    msfp_unilateral_depth(p->surface[j], w->body[slider], w->x[j + 1], depth);
    if (depth[MSFP_UNILATERAL_DEPTH_BEYOND] > 0.0)
        msfp_unilateral_edge_direction(p->surface[j], w->body[slider], w->x[j + 1], dp->surface[j], d->body[slider],
                                       d->x[j + 1], contact);
    else
        msfp_unilateral_inside_direction(p->surface[j], w->body[slider], w->x[j + 1], dp->surface[j], d->body[slider],
                                         d->x[j + 1], contact);
    memcpy(columns, contact + MSFP_UNILATERAL_PENETRATION * C, sizeof(msfp_columns));
}
#endif

double msfp_event_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                          msfp_point_columns *dat, int kind, int j, double *columns)
{
#if MSFP_UPLIFT
    msfp_work w;
    msfp_work_columns d;
    memset(&d, 0, sizeof d);
    msfp_motion(p, at, &w);
    msfp_motion_columns(p, dp, at, dat, &w, &d);
    if (kind == MSFP_EVENT_LIFT_OFF || kind == MSFP_EVENT_LANDING) {
        compression_columns(p, dp, &w, &d, j, columns);
        return msfp_compression(p, &w, j);
    }
#endif
#if MSFP_UPLIFT && MSFP_RIMS
    double rim[MSFP_RIM_SIZE * C];
    msfp_rim_force(p, &w, j, NULL);
    msfp_rim_columns(p, dp, &w, j, &d, rim);
    memcpy(columns, rim + MSFP_RIM_G * C, sizeof(msfp_columns));
    return w.rim_gap[j];
#else
    msfp_columns gaps[NB][MSFP_GAP_SIZE];
    double sliding[NB][MSFP_GAP_SIZE];
    (void)kind;
    msfp_gaps_columns(p, dp, at->q, dat->q, sliding, gaps);
    memcpy(columns, gaps[j][MSFP_GAP_G], sizeof(msfp_columns));
    return sliding[j][MSFP_GAP_G];
#endif
}

void msfp_rim_motion_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                             const msfp_work_columns *d, int j, double *closed, double *dclosed)
{
    msfp_gap_of_rim(w, j, closed);
#if MSFP_RIMS
    double own[MSFP_RIM_SIZE * C];
    const double *rim = d->rim[j];
    if (w->rim_gap[j] >= 0.0)
        return;
    if (!w->rim_active[j]) {
        msfp_rim_columns(p, dp, w, j, d, own);
        rim = own;
    }
    memcpy(dclosed + MSFP_RIM_MOTION_G * C, rim + MSFP_RIM_G * C, C * sizeof *dclosed);
    memcpy(dclosed + MSFP_RIM_MOTION_DG * C, rim + MSFP_RIM_DG * C, C * sizeof *dclosed);
#else
    (void)p;
    (void)dp;
    (void)d;
    (void)dclosed;
#endif
}

/* What energies and powers are given beside the evaluation, and its columns. */
static void set_observed(const msfp_point *at, const msfp_point_columns *dat, msfp_blocks *s, msfp_block_directions *ds)
{
    static const int first[3] = { MSFP_BASE_MOTION_OX, MSFP_BASE_MOTION_UX, MSFP_BASE_MOTION_BX };
    msfp_set_observed(at, s);
    for (int order = 0; order < 3; ++order)
        msfp_put_polar(ds->base_motion + first[order] * C, dat->base[order]);
    msfp_put_polar(ds->load_force, dat->load);
    msfp_put_axial(ds->load_moment, dat->load + 3);
#if MSFP_TOP_ROTATION
    msfp_support_columns(at, dat, ds->upright);
#endif
}

MSFP_WIDE void msfp_columns_of_powers(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                      const msfp_point *at, const msfp_point_columns *dat, const msfp_work *w,
                                      const msfp_work_columns *d, msfp_state_columns *to)
{
    msfp_blocks s;
    msfp_block_directions ds;
    set_observed(at, dat, &s, &ds);
    msfp_mechanical_directions(p, dp, w, (msfp_work_columns *)d, &s, &ds);
    msfp_powers_directions(p, dp, w, (msfp_work_columns *)d, &s, &ds);
    memcpy(to->power, ds.works, sizeof to->power + sizeof to->prescribed_power + sizeof to->load_power);
}

#if MSFP_CLOSED_FORM
void msfp_load_end_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                           const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d, double *columns)
{
    msfp_blocks s;
    msfp_block_directions ds;
    set_observed(at, dat, &s, &ds);
    msfp_loaded_directions(p, dp, w, (msfp_work_columns *)d, &s, &ds);
    memcpy(columns, ds.load_end, sizeof ds.load_end);
}
#endif

/* Quantities of surface j. */
MSFP_INLINE void surface_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                 const msfp_work_columns *d, int j, msfp_columns *row)
{
    const double *contact = w->contact[j], *dcontact = d->contact[j];
    msfp_columns gap[MSFP_GAP_SIZE], *angles = row + MSFP_ROW_ANGLES + 2 * j, *slip = row + MSFP_ROW_SLIP + 2 * j;
    double dangles[MSFP_CONTACT_ANGLES_SIZE * C];
    memcpy(row[MSFP_ROW_NORMAL + j], dcontact + MSFP_CONTACT_N * C, sizeof *row);
    memset(angles[0], 0, sizeof *angles);
    memset(slip[1], 0, sizeof *slip);
    msfp_contact_angles_direction(contact, dcontact, dangles);
    memcpy(angles[1], dangles + MSFP_CONTACT_ANGLES_THETA * C, sizeof *angles);
#if !MSFP_PLANAR
    memcpy(angles[0], dangles + MSFP_CONTACT_ANGLES_PSI * C, sizeof *angles);
#endif
    for (int c = 0; c < C; ++c) {
#if !MSFP_PLANAR
        slip[1][c] = dcontact[MSFP_CONTACT_V * C + c];
#endif
        slip[0][c] = dcontact[MSFP_CONTACT_U * C + c];
        row[MSFP_ROW_RIM + j][c] = w->rim_active[j] ? -d->rim[j][MSFP_RIM_FC * C + c] : 0.0;
#if MSFP_LAW
        row[MSFP_ROW_MU + j][c] = dcontact[MSFP_CONTACT_MU * C + c];
#endif
#if MSFP_MEMORY
        row[MSFP_ROW_REMEMBERED + j][c] = dcontact[MSFP_CONTACT_MEMORY * C + c];
#endif
    }
    msfp_gap_direction(p->surface[j], w->body[j + 1], dp->surface[j], d->body[j + 1], gap[0]);
    memcpy(row[MSFP_ROW_SLIDING + j], gap[MSFP_GAP_S], sizeof *row);
    memcpy(row[MSFP_ROW_GAP + j], gap[MSFP_GAP_G], sizeof *row);
#if MSFP_UPLIFT
    compression_columns(p, dp, w, d, j, row[MSFP_ROW_COMPRESSION + j]);
#if MSFP_RIMS
    double rim[MSFP_RIM_SIZE * C]; /* with uplift the gap follows from the separation too */
    msfp_rim_columns(p, dp, w, j, d, rim);
    memcpy(row[MSFP_ROW_GAP + j], rim + MSFP_RIM_G * C, sizeof *row);
#endif
#endif
    msfp_get_polar(d->force[j], row + MSFP_ROW_FORCE + 3 * j);
}

MSFP_WIDE void msfp_record_columns(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                   const msfp_point *at, const msfp_point_columns *dat, const msfp_work *w,
                                   const msfp_work_columns *d, msfp_columns *row)
{
    msfp_blocks s;
    msfp_block_directions ds;
    set_observed(at, dat, &s, &ds);
    msfp_mechanical_directions(p, dp, w, (msfp_work_columns *)d, &s, &ds);
    msfp_springs_directions(p, dp, w, (msfp_work_columns *)d, &s, &ds);
    memcpy(row + MSFP_ROW_Q, dat->q, sizeof dat->q);
    memcpy(row + MSFP_ROW_V, dat->v, sizeof dat->v);
    memcpy(row + MSFP_ROW_A, dat->a, sizeof dat->a);
    for (int j = 0; j < NB; ++j) {
        memcpy(row[MSFP_ROW_F + 2 * j], d->contact[j] + MSFP_CONTACT_Y * C, sizeof *row);
#if !MSFP_PLANAR
        memcpy(row[MSFP_ROW_F + 2 * j + 1], d->contact[j] + MSFP_CONTACT_Z * C, sizeof *row);
#endif
        surface_columns(p, dp, w, d, j, row);
    }
    memcpy(row + MSFP_ROW_BASE, dat->base[0], 3 * sizeof *row);
    memcpy(row + MSFP_ROW_BASE_ANGLES, dat->base[0] + 3, 3 * sizeof *row);
    msfp_get_polar(d->body[NB] + MSFP_BODY_CX * C, row + MSFP_ROW_TOP);
    if (MSFP_PLANAR)
        memcpy(row[MSFP_ROW_TOP + 1], dat->base[0][1], sizeof *row);
    msfp_get_polar(d->force[NB], row + MSFP_ROW_TOP_FORCE);
    for (int i = 0; i < MSFP_MOMENT_SIZE; ++i)
        memcpy(row[MSFP_ROW_TOP_MOMENT + (MSFP_PLANAR ? 1 : i)], d->moment[NB] + i * C, sizeof *row);
    memcpy(row[MSFP_ROW_RESTRAINT], ds.restraint + MSFP_RESTRAINT_STORED * C, sizeof *row);
    memcpy(row[MSFP_ROW_TOP_SETTLEMENT], ds.restraint + MSFP_RESTRAINT_SETTLEMENT * C, sizeof *row);
#if MSFP_RIMS
    memcpy(row[MSFP_ROW_RIM_STORED], ds.rim_energy + MSFP_RIM_ENERGY_STORED * C, sizeof *row);
#endif
#if MSFP_UPLIFT
    memcpy(row[MSFP_ROW_SEAT_STORED], ds.unilateral_energy + MSFP_UNILATERAL_ENERGY_STORED * C, sizeof *row);
#endif
    memcpy(row[MSFP_ROW_KINETIC], ds.energy + MSFP_ENERGY_KINETIC * C, sizeof *row);
    memcpy(row[MSFP_ROW_POTENTIAL], ds.energy + MSFP_ENERGY_POTENTIAL * C, sizeof *row);
}
#endif
