/* output.c: what a run records: dense output, rows, events. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "run.h"
#include "heat.h"

/* ---- dense output ------------------------------------------------------------------------------------- */

static double hermite(double y0, double d0, double y1, double d1, double h, double s)
{
    const double r = 1.0 - s;
    return r * r * (1.0 + 2.0 * s) * y0 + s * s * (3.0 - 2.0 * s) * y1 + s * r * h * (r * d0 - s * d1);
}

/* Weights of the start of the step, its middles and its end in the polynomial through all of them, at the share s. */
typedef struct {
    double of[MSFP_MIDDLES + 2];
    int count;
} weights;

static weights weights_at(const msfp_run *run, double s)
{
    double nodes[MSFP_MIDDLES + 2] = { 0.0 };
    weights w = { { 0.0 }, run->middles + 2 };
    for (int i = 0; i < run->middles; ++i)
        nodes[i + 1] = run->middle[i].share;
    nodes[run->middles + 1] = 1.0;
    for (int i = 0; i < w.count; ++i) {
        w.of[i] = 1.0;
        for (int j = 0; j < w.count; ++j)
            w.of[i] *= j == i ? 1.0 : (s - nodes[j]) / (nodes[i] - nodes[j]);
    }
    return w;
}

/* A value inside the step: through the stages in its middle where the method has some (the rates at the ends of a stiff
 * step carry ringing that the values do not), else cubic through values and rates. `middle` is the value in the first
 * middle; in the others it lies as far on as they do. */
static double inside(const weights *w, double y0, double d0, const double *middle, double y1, double d1, double h, double s)
{
    if (w->count == 2)
        return hermite(y0, d0, y1, d1, h, s);
    double y = w->of[0] * y0 + w->of[w->count - 1] * y1;
    for (int i = 1; i < w->count - 1; ++i)
        y += w->of[i] * middle[(size_t)(i - 1) * (sizeof(msfp_middle) / sizeof(double))];
    return y;
}

void msfp_interpolate(const msfp_run *run, double s, msfp_state *out)
{
    const msfp_state *a = &run->now, *b = &run->next;
    const msfp_middle *m = run->middle;
    const weights w = weights_at(run, s);
    const double h = b->t - a->t;
    out->t = a->t + s * h;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < MSFP_NQ; ++d) {
            out->q[k][d] = inside(&w, a->q[k][d], a->v[k][d], &m->q[k][d], b->q[k][d], b->v[k][d], h, s);
            out->v[k][d] = inside(&w, a->v[k][d], a->a[k][d], &m->v[k][d], b->v[k][d], b->a[k][d], h, s);
            out->a[k][d] = (1.0 - s) * a->a[k][d] + s * b->a[k][d];
        }
        for (int d = 0; d < 2; ++d)
            out->f[k][d] = inside(&w, a->f[k][d], a->df[k][d], &m->f[k][d], b->f[k][d], b->df[k][d], h, s);
    }
#if MSFP_HEAT
    double da[NB][MSFP_HEAT], db[NB][MSFP_HEAT];
    msfp_heat_rates(a->heat, a->flux, da);
    msfp_heat_rates(b->heat, b->flux, db);
    for (int k = 0; k < NB; ++k) {
        out->flux[k] = (1.0 - s) * a->flux[k] + s * b->flux[k];
        for (int i = 0; i < MSFP_HEAT; ++i)
            out->heat[k][i] = inside(&w, a->heat[k][i], da[k][i], &m->heat[k][i], b->heat[k][i], db[k][i], h, s);
    }
#endif
    for (int i = 0; i < MSFP_WORKS; ++i)
        out->work[i] = inside(&w, a->work[i], a->power[i], &m->work[i], b->work[i], b->power[i], h, s);
}

void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at)
{
    memset(at, 0, sizeof *at);
    msfp_point_at(run, s->t, at);
    memcpy(at->q, s->q, sizeof at->q);
    memcpy(at->v, s->v, sizeof at->v);
    memcpy(at->a, s->a, sizeof at->a);
    memcpy(at->f, s->f, sizeof at->f);
    msfp_heat_point(s, at);
}

void msfp_observe_state(msfp_run *run, const msfp_state *s, msfp_row *row)
{
    msfp_point at;
    msfp_work w;
    msfp_to_point(run, s, &at);
    msfp_observe(&run->parameters, &at, &w, row);
    row->time = s->t;
    memcpy(row->work, s->work, sizeof row->work);
}

/* ---- output -------------------------------------------------------------------------------------------- */

static void *grown(void *items, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity)
        return items;
    *capacity = *capacity ? 2 * *capacity : 256;
    return realloc(items, *capacity * size);
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

/* A recorded row inside a step of an implicit method: polynomial through what is recorded of its ends and middles.
 * Forces are interpolated as they are: made from interpolated angles they would carry a stiff spring's error. */
static void blend(const msfp_row *rows, const weights *w, msfp_row *out)
{
    double *values = (double *)out;
    for (size_t i = 0; i < MSFP_ROW_SIZE; ++i) {
        values[i] = 0.0;
        for (int r = 0; r < w->count; ++r)
            values[i] += w->of[r] * ((const double *)&rows[r])[i];
    }
}

/* Friction has its limit inside a step as at the values that the row comes from: a polynomial may pass it at a reversal. */
static void limit(const msfp_row *rows, int count, msfp_row *row)
{
    for (int j = 0; j < NB; ++j) {
        double most = 1.0, size = hypot(row->f[j][0], row->f[j][1]);
        for (int r = 0; r < count; ++r)
            most = fmax(most, hypot(rows[r].f[j][0], rows[r].f[j][1]));
        for (int d = 0; d < 2 && size > most; ++d)
            row->f[j][d] *= most / size;
    }
}

/* Sliding is a distance, with a kink at the centre: made from the angles of its own row. */
static void measure(const msfp_run *run, msfp_row *row)
{
    double sliding[NB][MSFP_GAP_SIZE];
    msfp_gaps_at(&run->parameters, row->q, sliding);
    for (int j = 0; j < NB; ++j) {
        row->sliding[j] = sliding[j][MSFP_GAP_S];
        row->gap[j] = sliding[j][MSFP_GAP_G];
        row->rim[j] = row->gap[j] > 0.0 ? 0.0 : fmax(row->rim[j], 0.0); /* a rim pushes, and only where it is met */
    }
}

double msfp_next_output(const msfp_run *run)
{
    const double step = run->options.output_step;
    return step * (floor(run->options.start_time / step + 1e-9) + (double)run->row_count);
}

int msfp_write_now(msfp_run *run)
{
    if (run->row_count && run->rows[run->row_count - 1].time >= run->now.t)
        return MSFP_OK;
    return msfp_write_row(run, &run->now);
}

static int write_between(msfp_run *run, double last)
{
    msfp_row rows[MSFP_MIDDLES + 2], *row;
    msfp_state s;
    const double h = run->next.t - run->now.t;
    if (run->middles) {
        msfp_observe_state(run, &run->now, &rows[0]);
        for (int i = 0; i < run->middles; ++i) {
            msfp_interpolate(run, run->middle[i].share, &s);
            msfp_observe_state(run, &s, &rows[i + 1]);
        }
        msfp_observe_state(run, &run->next, &rows[run->middles + 1]);
    }
    for (; run->output_time <= last; run->output_time = msfp_next_output(run)) {
        const double share = fmin(1.0, (run->output_time - run->now.t) / h);
        if (!(row = new_row(run)))
            return MSFP_E_MEMORY;
        msfp_interpolate(run, share, &s);
        if (run->middles) {
            const weights w = weights_at(run, share);
            blend(rows, &w, row);
            limit(rows, w.count, row);
            measure(run, row);
        } else
            msfp_observe_state(run, &s, row);
        row->time = run->output_time;
        memcpy(row->work, s.work, sizeof row->work);
    }
    return MSFP_OK;
}

/* The end of the step: the evaluation that ended it is still there. */
static int write_reached(msfp_run *run)
{
    msfp_row *row = new_row(run);
    if (!row)
        return MSFP_E_MEMORY;
    msfp_record(&run->parameters, &run->reached, &run->work, &run->next.masses, row);
    row->time = run->next.t;
    memcpy(row->work, run->next.work, sizeof row->work);
    return MSFP_OK;
}

int msfp_write_step(msfp_run *run)
{
    const double last = run->next.t * (1.0 + 1e-14);
    if (run->options.output_step <= 0.0)
        return write_reached(run);
    if (run->next.t == run->output_time && msfp_is_quasistatic(run)) {
        const int status = write_reached(run);
        run->output_time = msfp_next_output(run);
        return status;
    }
    return run->output_time <= last ? write_between(run, last) : MSFP_OK;
}

void msfp_across(const msfp_run *run, const msfp_row *row, double *displacement)
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
    msfp_across(run, &row, event->displacement);
    memcpy(event->top_force, row.top_force, sizeof event->top_force);
    ++run->counts[MSFP_COUNT_EVENTS];
    return MSFP_OK;
}
