/* extreme_columns.c: derivatives of the extremes of a run. */
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

/* Column c of the displacement across the bearing. */
MSFP_INLINE double across_columns(const msfp_parameter_batch *batch, const msfp_row_columns d, int axis, int c)
{
    return d[MSFP_ROW_BASE + axis][c] - d[MSFP_ROW_TOP + axis][c] - batch->start[axis][c];
}

/* Columns of extreme `index` at a row with the columns d. */
static void take(const msfp_run *run, msfp_parameter_batch *batch, const msfp_row *row, const msfp_row_columns d,
                 int index)
{
    double across[3], pair[MSFP_PAIR_SIZE], dpair[MSFP_PAIR_SIZE * C] = { 0.0 }, *to = batch->extremes[index];
    int of;
    msfp_displacement_across(run, row, across);
    const int count = msfp_extreme_pair(index, row, across, &of, pair);
    for (int i = 0; i < (count ? count : 1); ++i)
        for (int c = 0; c < C; ++c) {
            const int axis = of + i - MSFP_ACROSS;
            dpair[i * C + c] = axis < 0 ? d[of + i][c] : across_columns(batch, d, axis, c);
        }
    if (count)
        msfp_extreme_length_direction(pair, dpair, to);
    else
        memcpy(to, dpair, sizeof(msfp_columns));
}

/* The row at a share of the step and its columns. */
static const msfp_columns *row_at(msfp_run *run, msfp_parameter_batch *batch, double share, msfp_row *row)
{
    msfp_columns *d = run->gradients->recording.row;
    if (share == 1.0) {
        msfp_record(&run->parameters, &run->reached, &run->work, &run->next.mechanical, row);
        msfp_row_reached_columns(run, batch);
        return (const msfp_columns *)batch->end_row;
    }
    if (run->node_count) {
        msfp_row_inside(run, share, row);
        msfp_row_between_columns(run, batch, share, 0, d);
    } else
        msfp_row_of_cubic_columns(run, batch, share, row, d);
    return (const msfp_columns *)d;
}

int msfp_step_has_extreme(const msfp_run *run)
{
    const double *time = (const double *)&run->extreme_times;
    int found = 0;
    for (int i = 0; i < MSFP_EXTREME_COUNT; ++i)
        found |= time[i] > run->now.t;
    return found;
}

void msfp_extremes_of_step(msfp_run *run, msfp_parameter_batch *batch)
{
    const double *time = (const double *)&run->extreme_times, now = run->now.t;
    int done[MSFP_EXTREME_COUNT] = { 0 };
    msfp_row row;
    for (int i = 0; i < MSFP_EXTREME_COUNT; ++i) {
        if (done[i] || time[i] <= now)
            continue;
        const msfp_columns *d = row_at(run, batch, fmin(1.0, (time[i] - now) / (run->next.t - now)), &row);
        for (int k = i; k < MSFP_EXTREME_COUNT; ++k)
            if (time[k] == time[i]) {
                take(run, batch, &row, d, k);
                done[k] = 1;
            }
    }
}

void msfp_extremes_of_first_row(const msfp_run *run, msfp_parameter_batch *batch, const msfp_row *row,
                                const msfp_row_columns d)
{
    for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < C; ++c)
            batch->start[axis][c] = d[MSFP_ROW_BASE + axis][c] - d[MSFP_ROW_TOP + axis][c];
    for (int i = 0; i < MSFP_EXTREME_COUNT; ++i)
        take(run, batch, row, d, i);
}
#endif
