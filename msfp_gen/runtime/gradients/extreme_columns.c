/* extreme_columns.c: derivatives of the extremes of a run. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { EXTREMES = sizeof(msfp_extremes) / sizeof(double) };
#define EXTREME(name) (offsetof(msfp_extremes, name) / sizeof(double))

/* Magnitudes along the axes and in the horizontal plane, with their columns. */
static void magnitudes(const double u[3], msfp_columns *const du, size_t first, double *value, msfp_columns *d)
{
    const double radial = sqrt(u[0] * u[0] + u[1] * u[1]);
    for (int i = 0; i < 3; ++i)
        value[first + i] = fabs(u[i]);
    value[first + 3] = radial;
    for (int c = 0; c < C; ++c) {
        for (int i = 0; i < 3; ++i)
            d[first + i][c] = u[i] < 0.0 ? -du[i][c] : u[i] > 0.0 ? du[i][c] : 0.0;
        d[first + 3][c] = radial > 0.0 ? (u[0] * du[0][c] + u[1] * du[1][c]) / radial : 0.0;
    }
}

/* What a row contributes to the extremes; positions: only what follows from positions, NAN elsewhere. */
static void contributions(const msfp_run *run, const msfp_parameter_batch *batch, const msfp_row *row,
                          const msfp_row_columns d, int positions, double *value, msfp_columns *columns)
{
    double across[3];
    msfp_columns dacross[3], dslip[3] = { 0 };
    for (int i = 0; i < EXTREMES; ++i)
        value[i] = NAN;
    msfp_displacement_across(run, row, across);
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < C; ++c)
            dacross[i][c] = d[MSFP_ROW_BASE + i][c] - d[MSFP_ROW_TOP + i][c] - batch->start[i][c];
    magnitudes(across, dacross, EXTREME(displacement), value, columns);
    for (int j = 0; j < NB; ++j) {
        value[EXTREME(sliding) + j] = row->sliding[j];
        memcpy(columns[EXTREME(sliding) + j], d[MSFP_ROW_SLIDING + j], sizeof *columns);
        value[EXTREME(gap) + j] = row->gap[j];
        memcpy(columns[EXTREME(gap) + j], d[MSFP_ROW_GAP + j], sizeof *columns);
    }
    if (positions)
        return;
    magnitudes(row->top_force, (msfp_columns *)d + MSFP_ROW_TOP_FORCE, EXTREME(top_force), value, columns);
    for (int j = 0; j < NB; ++j) {
        const double slip[3] = { row->slip[j][0], row->slip[j][1], 0.0 };
        double sizes[4];
        msfp_columns dsizes[4];
        memcpy(dslip, d[MSFP_ROW_SLIP + 2 * j], 2 * sizeof *dslip);
        magnitudes(slip, dslip, 0, sizes, dsizes);
        value[EXTREME(slip_speed) + j] = sizes[3];
        memcpy(columns[EXTREME(slip_speed) + j], dsizes[3], sizeof *columns);
        value[EXTREME(least_normal) + j] = value[EXTREME(most_normal) + j] = row->normal[j];
        memcpy(columns[EXTREME(least_normal) + j], d[MSFP_ROW_NORMAL + j], sizeof *columns);
        memcpy(columns[EXTREME(most_normal) + j], d[MSFP_ROW_NORMAL + j], sizeof *columns);
#if MSFP_LAW
        value[EXTREME(least_friction) + j] = value[EXTREME(most_friction) + j] = row->mu[j];
        memcpy(columns[EXTREME(least_friction) + j], d[MSFP_ROW_MU + j], sizeof *columns);
        memcpy(columns[EXTREME(most_friction) + j], d[MSFP_ROW_MU + j], sizeof *columns);
#endif
#if MSFP_HEAT
        value[EXTREME(temperature) + j] = row->temperature[j];
        memcpy(columns[EXTREME(temperature) + j], d[MSFP_ROW_TEMPERATURE + j], sizeof *columns);
#endif
    }
}

/* Take the columns of the extremes that a row gave: changed[i] is then 0. Returns how many remain. */
static int take(const msfp_run *run, msfp_parameter_batch *batch, const double *value, msfp_columns *columns,
                int *changed)
{
    const double *now = (const double *)&run->extremes;
    int left = 0;
    for (int i = 0; i < EXTREMES; ++i) {
        if (changed[i] && fabs(now[i] - value[i]) <= 1e-13 * fabs(now[i])) {
            memcpy(batch->extremes[i], columns[i], sizeof *columns);
            changed[i] = 0;
        }
        left += changed[i];
    }
    return left;
}

/* Rate of the squared displacement goes through zero inside the step: the share there (extremes.c). */
static double turning_share(const msfp_run *run)
{
    const double before = run->gradients->outward_rate, after = run->outward_rate;
    return before > 0.0 && after < 0.0 ? before / (before - after) : 1.0;
}

/* As take_nodes of extremes.c, at one node. Returns how many remain. */
static int take_node(msfp_run *run, msfp_parameter_batch *batch, int node, int *changed)
{
    msfp_recording *s = &run->gradients->recording;
    double value[EXTREMES], force[EXTREMES];
    msfp_row row;
    msfp_row_inside(run, run->node[node].share, &row);
    msfp_row_between_columns(run, batch, run->node[node].share, 0, s->row);
    contributions(run, batch, &row, (const msfp_columns *)s->row, 0, value, s->contributed);
    for (int i = 0; i < EXTREMES; ++i)
        force[i] = NAN;
    memcpy(force + EXTREME(top_force), value + EXTREME(top_force), sizeof run->extremes.top_force);
    return take(run, batch, force, s->contributed, changed);
}

void msfp_extremes_of_step(msfp_run *run, msfp_parameter_batch *batch)
{
    msfp_recording *s = &run->gradients->recording;
    const double *now = (const double *)&run->extremes, *before = (const double *)&run->gradients->extremes;
    int changed[EXTREMES], any = 0;
    double value[EXTREMES];
    msfp_row row;
    for (int i = 0; i < EXTREMES; ++i)
        any |= changed[i] = now[i] != before[i];
    if (!any)
        return;
    msfp_record(&run->parameters, &run->reached, &run->work, &run->next.mechanical, &row);
    msfp_row_reached_columns(run, batch);
    contributions(run, batch, &row, (const msfp_columns *)batch->end_row, 0, value, s->contributed);
    int left = take(run, batch, value, s->contributed, changed);
    for (int i = 0; i < run->node_count && left; ++i)
        left = take_node(run, batch, i, changed);
    const double share = turning_share(run);
    if (!left || share >= 1.0)
        return;
    if (run->node_count) {
        msfp_row_inside(run, share, &row);
        msfp_row_between_columns(run, batch, share, 0, s->row);
    } else
        msfp_row_of_cubic_columns(run, batch, share, &row, s->row);
    contributions(run, batch, &row, (const msfp_columns *)s->row, 1, value, s->contributed);
    take(run, batch, value, s->contributed, changed);
}

void msfp_extremes_of_first_row(const msfp_run *run, msfp_parameter_batch *batch, const msfp_row *row,
                                const msfp_row_columns d)
{
    double value[EXTREMES];
    for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < C; ++c)
            batch->start[axis][c] = d[MSFP_ROW_BASE + axis][c] - d[MSFP_ROW_TOP + axis][c];
    contributions(run, batch, row, d, 0, value, batch->extremes);
}
#endif
