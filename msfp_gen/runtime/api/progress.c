/* progress.c: what a run states about itself, and its snapshots, for the table of functions. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "api.h"

void msfp_api_run_progress(const msfp_run *run, msfp_progress *progress)
{
    *progress = (msfp_progress){ run->status, run->status_surface, run->status_value, run->now.t, run->h,
                                  run->rows_before };
}

static void give(double *to, const void *from, size_t size)
{
    if (to)
        memcpy(to, from, size);
}

/* The friction state of a run exceeds the unit disc by the error of a step; a run that starts from it must not. */
static void give_friction(const double f[NB][2], double *to)
{
    for (int j = 0; j < NB; ++j) {
        const double size = sqrt(f[j][0] * f[j][0] + f[j][1] * f[j][1]), factor = size > 1.0 ? 1.0 / size : 1.0;
        to[2 * j] = factor * f[j][0];
        to[2 * j + 1] = factor * f[j][1];
    }
}

void msfp_api_run_state(const msfp_run *run, msfp_run_state *state)
{
    const msfp_state *now = &run->now;
    state->time = now->t;
    give(state->q, now->q, sizeof now->q);
    give(state->v, now->v, sizeof now->v);
    if (state->f)
        give_friction(now->f, state->f);
    give(state->foot, now->foot, 2 * sizeof *now->foot);
#if MSFP_MEMORY
    give(state->memory, now->memory, sizeof now->memory);
#endif
    static const msfp_row none; /* for a run that failed before its first row */
    const msfp_row *last = run->row_count ? &run->rows[run->row_count - 1] : &none;
    give(state->force, last->force, sizeof last->force);
    give(state->rim_force, last->rim, sizeof last->rim);
    give(state->base_angles, last->base_angles, sizeof last->base_angles);
    give(state->origin, run->start, sizeof run->start);
    give(state->monitor_heat, run->monitor.heat, sizeof run->monitor.heat);
}

void msfp_api_run_hold_rows(msfp_run *run, size_t rows) { run->options.row_limit = rows; }

void msfp_api_run_counts(const msfp_run *run, int64_t *counts)
{
    for (int i = 0; i < MSFP_COUNTS; ++i)
        counts[i] = run->counts[i];
}

void msfp_api_run_extremes(const msfp_run *run, double *extremes, double *times)
{
    give(extremes, &run->extremes, sizeof run->extremes);
    give(times, &run->extreme_times, sizeof run->extreme_times);
}

void msfp_api_run_trips(const msfp_run *run, msfp_trip *trips)
{
    memcpy(trips, run->monitor.trips, sizeof run->monitor.trips);
}

const msfp_event *msfp_api_run_events(const msfp_run *run, size_t *count)
{
    *count = run->event_count;
    return run->events;
}

const double *msfp_api_run_rows(const msfp_run *run, size_t *count)
{
    *count = run->row_count;
    return (const double *)run->rows;
}

/* The statuses of runs tell a scene that fails from bytes that are no snapshot. */
static int status_of_snapshot(int status) { return status == MSFP_E_FINITE ? MSFP_E_SNAPSHOT : status; }

int msfp_api_snapshot_read(msfp_run *run, const void *snapshot, size_t size)
{
    if (!run)
        return MSFP_E_ARGUMENT;
#if MSFP_GRADIENTS
    if (run->gradients) /* a snapshot holds none */
        return MSFP_E_ARGUMENT;
#endif
    return snapshot ? status_of_snapshot(msfp_snapshot_read(run, snapshot, size)) : MSFP_E_SNAPSHOT;
}

int msfp_api_snapshot_open(const void *snapshot, size_t size, msfp_run **run)
{
    if (!run)
        return MSFP_E_ARGUMENT;
    *run = calloc(1, sizeof **run);
    if (!*run)
        return MSFP_E_MEMORY;
    (*run)->options.start_time = -INFINITY; /* of a run of any scene */
    (*run)->options.duration = INFINITY;
    (*run)->jump_count = INT_MAX;
    const int status = msfp_api_snapshot_read(*run, snapshot, size);
    if (status) {
        free(*run);
        *run = NULL;
        return status;
    }
    (*run)->jump_count = 0;
    (*run)->options.duration = -INFINITY; /* it is at its end: it takes no steps */
    return MSFP_OK;
}
