/* recording.c: the derivatives of rows and events that a run keeps. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3")
#endif
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { EVENT = 7 }; /* numbers of an event: time, displacement, top force */

/* `*items` with room for `wanted` items of `size` doubles for each parameter. */
static int reserve(const struct msfp_gradients *g, double **items, size_t wanted, size_t *capacity, size_t size)
{
    if (wanted <= *capacity)
        return MSFP_OK;
    const size_t room = wanted > 2 * *capacity ? wanted + 256 : 2 * *capacity;
    double *grown = realloc(*items, room * (size_t)g->count * size * sizeof *grown);
    if (!grown)
        return MSFP_E_MEMORY;
    *items = grown;
    *capacity = room;
    return MSFP_OK;
}

/* Put the columns of a batch into item `index` of `items`, [item][parameter][size]. */
static void store(const struct msfp_gradients *g, double *items, size_t index, int batch, int size,
                  const msfp_columns *d)
{
    const int used = g->count - batch * C; /* of the columns, where fewer than all */
    double *const to = items + (index * (size_t)g->count + (size_t)(batch * C)) * (size_t)size;
    for (int i = 0; i < size && used >= C; ++i) {
        MSFP_UNROLL
        for (int c = 0; c < C; ++c)
            to[c * size + i] = d[i][c];
    }
    for (int c = 0; c < used && used < C; ++c)
        for (int i = 0; i < size; ++i)
            to[c * size + i] = d[i][c];
}

double msfp_event_at_end(msfp_run *run, int kind, int j, double *rate)
{
    static const msfp_parameter_columns constant;
    msfp_columns rates;
    msfp_point at;
    msfp_point_columns dat; /* column 0: derivatives with respect to time */
    memset(&dat, 0, sizeof dat);
    msfp_to_point(run, &run->next, &at);
    dat.base_moves = 1;
    for (int i = 0; i < 6; ++i) {
        dat.base[0][i][0] = at.base[1][i];
        dat.base[1][i][0] = at.base[2][i];
    }
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < NQ; ++i) {
            dat.q[k][i][0] = at.v[k][i];
            dat.v[k][i][0] = at.a[k][i];
        }
    const double value = msfp_event_columns(&run->parameters, &constant, &at, &dat, kind, j, rates);
    *rate = rates[0];
    return value;
}

void msfp_event_time_columns(msfp_run *run, msfp_parameter_batch *batch, int kind, int j, double *dt)
{
    msfp_columns value;
    msfp_point at;
    msfp_point_columns dat;
    double rate;
    memset(&dat, 0, sizeof dat);
    msfp_to_point(run, &run->next, &at);
    msfp_inputs_columns(run, batch, run->next.t, batch->next.t, &dat);
    memcpy(dat.q, batch->next.q, sizeof dat.q);
    memcpy(dat.v, batch->next.v, sizeof dat.v);
    msfp_event_columns(&run->parameters, &batch->parameters, &at, &dat, kind, j, value);
    msfp_event_at_end(run, kind, j, &rate);
    for (int c = 0; c < C; ++c)
        dt[c] = rate != 0.0 ? -value[c] / rate : 0.0;
}

/* Columns of an event at the end of the step. Where a surface lifts off or lands, and in a quasi-static run, the end of
 * a step does not move with the parameters: the state at the event moves along the solution. */
static void event_columns(msfp_run *run, msfp_parameter_batch *batch, int kind, int j, msfp_row_columns d,
                          msfp_columns *event)
{
    const msfp_state *next = &run->next;
    msfp_state_columns at = batch->next;
    msfp_columns dt;
    if (msfp_is_quasistatic(run) || kind == MSFP_EVENT_LIFT_OFF || kind == MSFP_EVENT_LANDING) {
        msfp_event_time_columns(run, batch, kind, j, dt);
        msfp_add_columns(&at.t, (const msfp_columns *)&dt, 1.0, 1);
        msfp_add_scaled(at.q[0], next->v[0], dt, 1.0, NB * NQ);
        msfp_add_scaled(at.v[0], next->a[0], dt, 1.0, NB * NQ);
        msfp_add_scaled(at.f[0], next->df[0], dt, 1.0, NB * 2);
        msfp_add_scaled(at.foot, next->dfoot, dt, 1.0, 2);
        if (!MSFP_MASSLESS)
            msfp_add_scaled(at.a[0], run->acceleration_slope[0], dt, 1.0, NB * NQ);
    }
    msfp_observe_columns(run, batch, next, &at, d);
    memcpy(event[0], at.t, sizeof *event);
    for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < C; ++c)
            event[1 + axis][c] = d[MSFP_ROW_BASE + axis][c] - d[MSFP_ROW_TOP + axis][c] - batch->start[axis][c];
    memcpy(event + 4, d + MSFP_ROW_TOP_FORCE, 3 * sizeof *event);
}

int msfp_record_state_columns(msfp_run *run, int first)
{
    struct msfp_gradients *g = run->gradients;
    msfp_columns *d = g->recording.row;
    if (reserve(g, &g->rows, run->row_count, &g->row_capacity, MSFP_ROW_SIZE)) /* NOLINT(-Wanalyzer-malloc-leak): kept in g */
        return MSFP_E_MEMORY;
    for (int i = 0; i < g->batches; ++i) {
        msfp_parameter_batch *batch = &g->batch[i];
        msfp_observe_columns(run, batch, first ? &run->now : &run->next, first ? &batch->now : &batch->next, d);
        for (size_t r = g->row_count; r < run->row_count; ++r)
            store(g, g->rows, r, i, MSFP_ROW_SIZE, (const msfp_columns *)d);
        if (first) {
            msfp_row row;
            msfp_observe_state(run, &run->now, &row);
            msfp_extremes_of_first_row(run, batch, &row, (const msfp_columns *)d);
        }
    }
    g->row_count = run->row_count;
    return MSFP_OK;
}

/* Columns of a row that the step recorded, at a fixed time: the end of the step, where it is fixed, or inside it. */
static const msfp_columns *row_columns(msfp_run *run, msfp_parameter_batch *batch, double time)
{
    msfp_columns *d = run->gradients->recording.row;
    if (msfp_is_quasistatic(run) || (run->options.output_step <= 0.0 && !msfp_any_column(batch->next.t))) {
        msfp_row_reached_columns(run, batch);
        return (const msfp_columns *)batch->end_row;
    }
    const double share = (time - run->now.t) / (run->next.t - run->now.t);
    msfp_row_between_columns(run, batch, fmin(1.0, share), 1, d);
    return (const msfp_columns *)d;
}

int msfp_record_rows_columns(msfp_run *run, size_t count)
{
    struct msfp_gradients *g = run->gradients;
    if (reserve(g, &g->rows, run->row_count, &g->row_capacity, MSFP_ROW_SIZE)) /* NOLINT(-Wanalyzer-malloc-leak): kept in g */
        return MSFP_E_MEMORY;
    for (int i = 0; i < g->batches; ++i) {
        g->recording.columns_known = 0;
        for (size_t r = g->row_count; r < count; ++r)
            store(g, g->rows, r, i, MSFP_ROW_SIZE, row_columns(run, &g->batch[i], run->rows[r].time));
    }
    g->row_count = count;
    return MSFP_OK;
}

int msfp_record_extremes_columns(msfp_run *run)
{
    struct msfp_gradients *g = run->gradients;
    if (reserve(g, &g->events, run->event_count, &g->event_capacity, EVENT)) /* NOLINT(-Wanalyzer-malloc-leak): kept in g */
        return MSFP_E_MEMORY;
    for (int i = 0; i < g->batches; ++i) {
        msfp_parameter_batch *batch = &g->batch[i];
        msfp_columns event[EVENT];
        for (size_t e = g->event_count; e < run->event_count; ++e) {
            event_columns(run, batch, run->events[e].kind, run->events[e].surface - 1, g->recording.row, event);
            store(g, g->events, e, i, EVENT, (const msfp_columns *)event);
        }
        g->recording.columns_known = 0;
        msfp_extremes_of_step(run, batch);
    }
    g->event_count = run->event_count;
    return MSFP_OK;
}
#endif
