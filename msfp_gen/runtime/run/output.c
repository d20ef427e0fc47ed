/* output.c: rows and events of a run. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "run.h"

void msfp_observe_state(msfp_run *run, const msfp_state *s, msfp_row *row)
{
    msfp_point at;
    msfp_work w;
    msfp_to_point(run, s, &at);
    msfp_observe(&run->parameters, &at, &w, row);
    row->time = s->t;
    memcpy(row->work, s->work, sizeof row->work);
}

/* The array with room for one more item; NULL where there is no memory. */
static void *grown(void *items, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity)
        return items;
    const size_t wider = *capacity ? 2 * *capacity : 256;
    void *more = realloc(items, wider * size);
    *capacity = more ? wider : *capacity; /* without memory the array stays as it is */
    return more;
}

static msfp_row *new_row(msfp_run *run)
{
    msfp_row *rows = grown(run->rows, run->row_count, &run->row_capacity, sizeof *rows);
    if (!rows)
        return NULL;
    run->rows = rows;
    return &rows[run->row_count++];
}

int msfp_write_row(msfp_run *run, const msfp_state *s)
{
    msfp_row *row = new_row(run);
    if (!row)
        return MSFP_E_MEMORY;
    msfp_observe_state(run, s, row);
    return MSFP_OK;
}

/* A row inside a step of an implicit method: the polynomial through the rows at its ends and nodes. Forces are
 * interpolated as such; computed from interpolated angles they would carry the error of a stiff spring. */
static void blend(const msfp_row *rows, const msfp_weights *w, msfp_row *out)
{
    const double *numbers[MSFP_NODES + 2] = { NULL };
    for (int r = 0; r < w->count; ++r)
        numbers[r] = (const double *)&rows[r];
    msfp_weigh(w->of, w->count, numbers, MSFP_ROW_SIZE, (double *)out);
}

/* |(Y, Z)| no larger than in the rows that a row is interpolated from: at a reversal a polynomial may exceed them. */
static void limit_friction(const msfp_row *rows, int count, msfp_row *row, msfp_row_limits *limits)
{
    static const double unit[2] = { 1.0, 0.0 };
    for (int j = 0; j < NB; ++j) {
        const double size = msfp_hypot(row->f[j][0], row->f[j][1]);
        double most = 1.0;
        int largest = MSFP_UNIT;
        for (int r = 0; r < count && size > 1.0; ++r) {
            /* `count` rows are set. NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage) */
            const double other = msfp_hypot(rows[r].f[j][0], rows[r].f[j][1]);
            if (other > most) {
                most = other;
                largest = r;
            }
        }
        limits->row[j] = size > most ? largest : MSFP_KEPT;
        if (size > most)
            msfp_bound_friction(row->f[j], largest < 0 ? unit : rows[largest].f[j]);
    }
}

/* Set `count` numbers of a row to zero. */
static void clear(msfp_row *row, int first, int count, msfp_row_limits *limits)
{
    for (int i = first; i < first + count; ++i) {
        ((double *)row)[i] = 0.0;
        limits->zero[limits->zero_count++] = i;
    }
}

void msfp_limit_row(const msfp_row *rows, int count, double sliding[NB][MSFP_GAP_SIZE], msfp_row *row,
                    msfp_row_limits *limits)
{
    static const int not_negative[] = { MSFP_ROW_KINETIC, MSFP_ROW_RIM_STORED, MSFP_ROW_SEAT_STORED };
    limits->zero_count = 0;
    limit_friction(rows, count, row, limits);
    for (int i = 0; i < 3; ++i)
        if (((double *)row)[not_negative[i]] < 0.0)
            clear(row, not_negative[i], 1, limits);
    for (int j = 0; j < NB; ++j) {
        if (row->normal[j] < 0.0) {
            clear(row, MSFP_ROW_NORMAL + j, 1, limits);
            clear(row, MSFP_ROW_FORCE + 3 * j, 3, limits);
        }
        row->sliding[j] = sliding[j][MSFP_GAP_S]; /* it has a kink at the centre */
        row->gap[j] = MSFP_UPLIFT ? row->gap[j] : sliding[j][MSFP_GAP_G]; /* with uplift it follows the separation too */
        if (row->gap[j] > 0.0 || row->rim[j] < 0.0) /* a rim only pushes, and only in contact */
            clear(row, MSFP_ROW_RIM + j, 1, limits);
    }
}

double msfp_next_output(const msfp_run *run)
{
    const double step = run->options.output_step;
    return step * (floor(run->options.start_time / step + 1e-9) + (double)(run->rows_before + run->row_count));
}

void msfp_run_drop_rows(msfp_run *run)
{
    if (run->row_count < 2)
        return;
    run->rows[0] = run->rows[run->row_count - 1];
    run->rows_before += run->row_count - 1;
    run->row_count = 1;
}

int msfp_write_now(msfp_run *run)
{
    const double t = run->now.t; /* closer times count as equal, as where an output time is the end of a segment */
    if (run->row_count && run->rows[run->row_count - 1].time >= t - msfp_smallest_step(t))
        return MSFP_OK;
    return msfp_write_row(run, &run->now);
}

void msfp_observe_nodes(msfp_run *run)
{
    const int last = run->node_count + 1;
    msfp_state inside;
    for (int i = 0; i <= last && !run->nodes_observed; ++i) {
        if (i > 0 && i < last)
            msfp_interpolate(run, run->node[i - 1].share, &inside);
        msfp_observe_state(run, i == 0 ? &run->now : i == last ? &run->next : &inside, &run->node_rows[i]);
    }
    run->nodes_observed = 1;
}

void msfp_row_inside(msfp_run *run, double share, msfp_row *row)
{
    const msfp_row *rows = run->node_rows;
    msfp_state s;
    msfp_interpolate(run, share, &s);
    if (run->node_count) {
        msfp_row_limits limits;
        double sliding[NB][MSFP_GAP_SIZE];
        const msfp_weights w = msfp_weights_at(run, share);
        msfp_observe_nodes(run);
        blend(rows, &w, row);
        msfp_gaps(&run->parameters, (const double(*)[NQ])row->q, sliding);
        msfp_limit_row(rows, w.count, sliding, row, &limits);
    } else
        msfp_observe_state(run, &s, row);
    memcpy(row->work, s.work, sizeof row->work);
}

/* Rows at even times up to `last`, inside the last step. */
static int write_between(msfp_run *run, double last)
{
    const double h = run->next.t - run->now.t;
    for (; run->output_time <= last; run->output_time = msfp_next_output(run)) {
        msfp_row *row = new_row(run);
        if (!row)
            return MSFP_E_MEMORY;
        msfp_row_inside(run, fmin(1.0, (run->output_time - run->now.t) / h), row);
        row->time = run->output_time;
    }
    return MSFP_OK;
}

/* A row of the end of the step, from the evaluation that ended it. */
static int write_reached(msfp_run *run, double time)
{
    msfp_row *row = new_row(run);
    if (!row)
        return MSFP_E_MEMORY;
    msfp_record(&run->parameters, &run->reached, &run->work, &run->next.mechanical, row);
    row->time = time;
    memcpy(row->work, run->next.work, sizeof row->work);
    return MSFP_OK;
}

int msfp_write_step(msfp_run *run)
{
    const double last = run->next.t + msfp_smallest_step(run->next.t);
    if (run->options.output_step <= 0.0)
        return write_reached(run, run->next.t);
    if (fabs(run->next.t - run->output_time) <= msfp_smallest_step(run->next.t) && msfp_is_quasistatic(run)) {
        const int status = write_reached(run, run->output_time);
        run->output_time = msfp_next_output(run);
        return status;
    }
    return run->output_time <= last ? write_between(run, last) : MSFP_OK;
}

void msfp_displacement_across(const msfp_run *run, const msfp_row *row, double *displacement)
{
    for (int i = 0; i < 3; ++i)
        displacement[i] = row->base[i] - row->top[i] - run->start[i];
}

int msfp_write_event(msfp_run *run, const msfp_state *s, int surface, int kind)
{
    msfp_row row;
    msfp_event *events = grown(run->events, run->event_count, &run->event_capacity, sizeof *events);
    if (!events)
        return run->status = MSFP_E_MEMORY;
    run->events = events;
    msfp_event *event = &events[run->event_count++];
    msfp_observe_state(run, s, &row);
    event->time = s->t;
    event->surface = surface;
    event->kind = kind;
    msfp_displacement_across(run, &row, event->displacement);
    memcpy(event->top_force, row.top_force, sizeof event->top_force);
    ++run->counts[MSFP_COUNT_EVENTS];
    return MSFP_OK;
}
