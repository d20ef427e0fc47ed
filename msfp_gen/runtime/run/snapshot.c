/* snapshot.c: the state of a run as bytes that hold no pointer, and a run that continues from them.
 *
 * A snapshot is a header, the part of msfp_run from MSFP_SNAPSHOT_BEGIN to MSFP_SNAPSHOT_END, rows, and events. It is
 * read by a run of the same scene and the same build only. Nothing that is read is trusted: the checksum finds damage, and every
 * number that is used as an index, a count or a state is checked, so that a forged file cannot corrupt memory.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "run.h"

#define VERSION 3

static const char magic[8] = { 'M', 'S', 'F', 'P', 'S', 'N', 'A', 'P' };

typedef struct {
    char magic[8];
    uint64_t version, row_size, event_size;
    uint64_t identity; /* of all that the run computes from */
    uint64_t state_size, row_count, event_count;
    uint64_t checksum; /* of all that follows */
} header;

static size_t state_size(void) { return MSFP_SNAPSHOT_END - MSFP_SNAPSHOT_BEGIN; }

/* Rows that a snapshot holds: the last `most`, all where that is negative. */
static size_t kept_rows(const msfp_run *run, long most)
{
    return most < 0 || (size_t)most > run->row_count ? run->row_count : (size_t)most;
}

static size_t body_size(size_t rows, size_t events)
{
    return state_size() + rows * sizeof(msfp_row) + events * sizeof(msfp_event);
}

size_t msfp_snapshot_size(const msfp_run *run, long rows)
{
    return sizeof(header) + body_size(kept_rows(run, rows), rows < 0 ? run->event_count : 0);
}

void msfp_snapshot_write(const msfp_run *run, long rows, void *snapshot)
{
    header h = { .version = VERSION, .row_size = sizeof(msfp_row), .event_size = sizeof(msfp_event), .identity = run->identity };
    unsigned char *body = (unsigned char *)snapshot + sizeof h, *to = body;
    memcpy(h.magic, magic, sizeof magic);
    h.state_size = state_size();
    h.row_count = kept_rows(run, rows);
    h.event_count = rows < 0 ? run->event_count : 0;
    const size_t rows_before = run->rows_before + (run->row_count - h.row_count);
    memcpy(to, (const char *)run + MSFP_SNAPSHOT_BEGIN, state_size());
    memcpy(to + (offsetof(msfp_run, rows_before) - MSFP_SNAPSHOT_BEGIN), &rows_before, sizeof rows_before);
    to += state_size();
    if (h.row_count)
        memcpy(to, run->rows + (run->row_count - h.row_count), h.row_count * sizeof(msfp_row));
    to += h.row_count * sizeof(msfp_row);
    if (h.event_count)
        memcpy(to, run->events, h.event_count * sizeof(msfp_event));
    h.checksum = msfp_hash(MSFP_HASH_START, body, body_size(h.row_count, h.event_count));
    memcpy(snapshot, &h, sizeof h);
}

/* ---- what is read ------------------------------------------------------------------------------------------ */

int msfp_all_finite(const double *values, size_t count)
{
    double sum = 0.0; /* 0 x infinity and 0 x NaN are NaN */
    for (size_t i = 0; values && i < count; ++i)
        sum += 0.0 * values[i];
    return sum == 0.0;
}

static int only_finite(const void *numbers, size_t size) { return msfp_all_finite(numbers, size / sizeof(double)); }

#define FINITE(field) only_finite(&(field), sizeof(field))

static int in_range(long value, long least, long most) { return value >= least && value <= most; }

static int valid_integers(const msfp_run *run)
{
    int valid = in_range(run->next_jump, 0, run->jump_count) && in_range(run->node_count, 0, MSFP_NODES);
    valid = valid && in_range(run->status, 0, MSFP_STATUSES - 1);
    valid = valid && in_range(run->status_surface, 0, MSFP_NB) && in_range(run->worst_surface, 0, MSFP_NB);
    valid = valid && in_range(run->determinant, -1, 1) && in_range(run->work_sign, -1, 1);
    valid = valid && in_range(run->have_unknowns, 0, 1) && in_range(run->restart, 0, 1);
    valid = valid && in_range(run->retry_after_newton, 0, 1) && run->stability_limit_steps >= 0;
    valid = valid && run->rows_before < SIZE_MAX / 2 && run->rows_taken <= run->rows_before + run->row_count;
    for (int i = 0; i < MSFP_DOF; ++i)
        valid = valid && in_range(run->pivots[i], 0, MSFP_DOF - 1);
    for (int i = 0; i < MSFP_COUNTS; ++i)
        valid = valid && run->counts[i] >= 0;
    for (int i = 0; i < MSFP_MONITORS; ++i)
        valid = valid && in_range(run->monitor.trips[i].surface, 0, MSFP_NB);
    return valid;
}

/* The state, at a time of the run, and the numbers that the next step reads. A run that has failed takes no step: what
 * it leaves beside its state may be anything. */
static int valid_numbers(const msfp_run *run)
{
    const double t = run->now.t, start = run->options.start_time, end = run->options.duration;
    int valid = FINITE(run->now) && FINITE(run->start) && FINITE(run->monitor.heat) && FINITE(run->monitor.flux);
    valid = valid && t >= start && t <= end + msfp_smallest_step(end);
    if (run->status != MSFP_OK && run->status != MSFP_STOPPED)
        return valid;
    valid = valid && FINITE(run->events_now) && run->h > 0.0 && run->h < INFINITY && run->previous_error >= 0.0 && run->previous_error < INFINITY;
    valid = valid && FINITE(run->output_time) && FINITE(run->largest_energy) && FINITE(run->acceleration_slope);
    valid = valid && FINITE(run->monitor.velocity);
    valid = valid && (run->factored_beta == 0.0 || (FINITE(run->factors) && FINITE(run->factored_beta)));
    valid = valid && (!run->have_unknowns || FINITE(run->unknowns));
#if MSFP_CLOSED_FORM
    valid = valid && FINITE(run->step_history);
#endif
    return valid;
}

static int valid_records(const msfp_run *run)
{
    for (size_t i = 0; i < run->row_count; ++i)
        if (!(run->rows[i].time < INFINITY) || (i && !(run->rows[i].time > run->rows[i - 1].time)))
            return 0;
    for (size_t i = 0; i < run->event_count; ++i) {
        const msfp_event *event = &run->events[i];
        if (!(fabs(event->time) < INFINITY) || !in_range(event->surface, 0, MSFP_NB)
            || !in_range(event->kind, 0, MSFP_EVENT_KINDS - 1))
            return 0;
    }
    return run->row_count > 0 && run->rows[run->row_count - 1].time <= run->now.t + msfp_smallest_step(run->now.t);
}

/* A copy on the heap; NULL where there is no memory. */
static void *copied(const unsigned char *items, size_t size)
{
    void *copy = malloc(size ? size : 1); /* at least one byte: NULL always means no memory */
    if (copy && size)
        memcpy(copy, items, size);
    return copy;
}

static void release_records(msfp_run *run)
{
    free(run->rows);
    free(run->events);
}

static int valid_header(const header *h, uint64_t identity, const unsigned char *body, size_t size)
{
    if (identity && h->identity != identity)
        return 0;
    if (memcmp(h->magic, magic, sizeof magic) != 0 || h->version != VERSION || h->state_size != state_size()
        || h->row_size != sizeof(msfp_row) || h->event_size != sizeof(msfp_event))
        return 0;
    if (h->row_count > size / sizeof(msfp_row) || h->event_count > size / sizeof(msfp_event)) /* no sum overflows */
        return 0;
    return size == body_size(h->row_count, h->event_count) && msfp_hash(MSFP_HASH_START, body, size) == h->checksum;
}

int msfp_snapshot_read(msfp_run *run, const void *snapshot, size_t size)
{
    header h;
    const unsigned char *body = (const unsigned char *)snapshot + sizeof h;
    msfp_run found = *run;
    if (size < sizeof h)
        return MSFP_E_FINITE;
    memcpy(&h, snapshot, sizeof h);
    if (!valid_header(&h, run->identity, body, size - sizeof h))
        return MSFP_E_FINITE;
    memcpy((char *)&found + MSFP_SNAPSHOT_BEGIN, body, state_size());
    body += state_size();
    found.identity = h.identity;
    found.stop = found.span = 0; /* searches by time begin anew */
    found.rows = copied(body, h.row_count * sizeof(msfp_row));
    found.events = copied(body + h.row_count * sizeof(msfp_row), h.event_count * sizeof(msfp_event));
    found.row_count = found.row_capacity = h.row_count;
    found.event_count = found.event_capacity = h.event_count;
    const int memory = found.rows && found.events;
    if (!memory || !valid_integers(&found) || !valid_numbers(&found) || !valid_records(&found)) {
        release_records(&found);
        return memory ? MSFP_E_FINITE : MSFP_E_MEMORY;
    }
    release_records(run);
    *run = found;
    return MSFP_OK;
}
