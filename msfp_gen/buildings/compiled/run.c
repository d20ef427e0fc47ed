/* run.c: the loop over the steps of a building: their length, jumps of the ground, rows, failures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "building.h"

/* 2^(1/4): free steps have lengths that are whole powers of it, so that few factorisations are needed. */
static const double growth = 1.189207115002721;

enum { LEAST_LENGTHS = 3 };
static const double memory = 1 << 27; /* for factors at the lengths of steps that are kept [bytes] */

/* ---- begin and end ---- */

static int allocate(msfp_building *b)
{
    const size_t n = b->scene.n, r = b->scene.attachments, stages = MSFP_STAGES;
    struct {
        double **to;
        size_t count;
    } arrays[] = { { &b->u, n },           { &b->v, n },        { &b->a, n },       { &b->slope, n },
                   { &b->tangent, r * r }, { &b->force, r },    { &b->Q, n },       { &b->V, n },
                   { &b->driving, n },     { &b->x, r },        { &b->residual, r }, { &b->change, r },
                   { &b->scale, r },       { &b->strain, n - r }, { &b->scaled, (n - r) * r }, { &b->next_u, n },
                   { &b->product, n },     { &b->scratch, 3 * r }, { &b->stage_v, stages * n }, { &b->stage_a, stages * n },
                   { &b->ground, (size_t)b->scene.grounds * MSFP_GROUND }, { &b->peaks, 2 * peak_count(b) } };
    int complete = 1;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        complete &= (*arrays[i].to = calloc(arrays[i].count + 1, sizeof(double))) != NULL;
    b->members = calloc((size_t)b->scene.bearings, sizeof *b->members);
    b->piece = calloc((size_t)b->scene.grounds, sizeof *b->piece);
    b->entries = calloc(entry_count(b), sizeof *b->entries);
    b->faces = calloc((size_t)b->scene.bearings * MSFP_FACES, sizeof *b->faces);
    return complete && b->members && b->piece && b->entries && b->faces ? MSFP_OK : MSFP_E_MEMORY;
}

/* Scale of the forces at the attachments: the weight, with its arms where they are moments. */
static void set_scale(msfp_building *b)
{
    const int r = b->scene.attachments;
    for (int i = 0; i < r; ++i) {
        double most = 0.0;
        for (int k = 0; k < b->scene.bearings * MSFP_WRENCH; ++k)
            most = fmax(most, fabs(b->scene.rows[(size_t)k * r + i]));
        b->scale[i] = b->scene.weight * (most > 0.0 ? most : 1.0);
    }
}

static void restart_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    const msfp_part *part = &b->scene.parts[bearing];
    m->status = part->api->port_jump(part->port, m->ends);
}

static void end_run(msfp_building *b, int status, int bearing)
{
    msfp_progress cause = { status, 0, 0.0, 0.0, 0.0, 0 };
    b->bearing = bearing;
    if (bearing && status != MSFP_E_MEMORY) {
        const msfp_part *part = &b->scene.parts[bearing - 1];
        status = part->api->port_cause(part->port, status, &cause);
    }
    b->status = status;
    b->surface = cause.surface;
    b->value = cause.value;
}

/* The accelerations of the ground jump at the present time. */
static void restart_building(msfp_building *b)
{
    ground_at(b, b->t);
    ends_now(b);
    for_each_bearing(b, restart_bearing);
    for (int i = 0; i < b->scene.bearings && !b->status; ++i)
        if (b->members[i].status)
            end_run(b, b->members[i].status, i + 1);
    memset(b->slope, 0, (size_t)b->scene.n * sizeof *b->slope);
}

static void begin(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    for (int i = 0; i < s->bearings && !b->status; ++i) {
        member *m = &b->members[i];
        const int status = s->parts[i].api->port_wrench(s->parts[i].port, m->wrench);
        if (status)
            end_run(b, status, i + 1);
        memcpy(m->rest, m->wrench + MSFP_WRENCH, sizeof m->rest);
    }
    b->energy = 1e-5 * s->weight; /* that of its weight lifted by 0.01 mm: smaller ones do not matter */
    b->h = s->first_step > 0.0 ? s->first_step : fmin(1e-3, 1e-3 * s->end);
    b->previous_error = 1.0;
    if (b->jump < s->jump_count && s->jumps[b->jump] <= msfp_smallest_step(0.0))
        ++b->jump;
    if (!b->status)
        restart_building(b);
    for (int i = 0; i < s->bearings && !b->status; ++i)
        b->status = read_row(b, i);
    if (!b->status) {
        b->status = write_row(b);
        b->status = b->status ? b->status : write_step(b);
        begin_peaks(b);
        note_peaks(b);
        for (int i = 0; i < s->bearings; ++i)
            note_bearing(b, i);
    }
    b->next_row = 1;
}

msfp_building *msfp_building_new(const msfp_building_scene *scene)
{
    msfp_building *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->scene = *scene;
    const double each = 3.0 * scene->attachments * scene->attachments * sizeof(double);
    b->lengths = (int)fmin(LENGTHS, fmax(LEAST_LENGTHS, memory / each));
    if (allocate(b) || find_patterns(b) || pool_begin(b)) {
        msfp_building_free(b);
        return NULL;
    }
    set_scale(b);
    for (size_t i = 0; i < (size_t)scene->attachments * scene->attachments; ++i)
        b->damped |= scene->damping[i] != 0.0;
    b->identity = identity_of(b);
    memcpy(b->entries, scene->entries, entry_count(b) * sizeof *b->entries);
    memcpy(b->faces, scene->faces, (size_t)scene->bearings * MSFP_FACES * sizeof *b->faces);
    b->status = scene->parts[0].api->port_method(scene->method, &b->method);
    begin(b);
    return b;
}

void msfp_building_free(msfp_building *b)
{
    if (!b)
        return;
    pool_end(b);
    linear_free(b);
    for (int i = 0; b->members && i < b->scene.bearings; ++i)
        free(b->members[i].row);
    void *all[] = { b->u,       b->v,      b->a,       b->slope,  b->tangent, b->force,   b->Q,       b->V,
                    b->driving, b->x,      b->residual, b->change, b->scale,  b->strain,  b->scaled,  b->next_u, b->product,
                    b->scratch, b->ground, b->stage_v, b->stage_a, b->members, b->piece,   b->rows.data, b->steps.data,
                    b->entries, b->faces,  b->peaks,   b->moved.begin, b->moved.columns, b->coupled.begin,
                    b->coupled.columns, b->watched.begin, b->watched.columns, b->of_node.begin, b->of_node.columns };
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        free(all[i]);
    free(b);
}

/* ---- the length of a step ---- */

static double next_row_time(const msfp_building *b) { return b->next_row * b->scene.output_step; }

/* The time at which the next step must end at the latest [s]. */
static double latest_end(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    const double end = fmin(s->end, next_row_time(b));
    double stop = msfp_next_stop(s->stops, s->stop_count, &b->stop, b->t);
    if (b->jump < s->jump_count)
        stop = fmin(stop, s->jumps[b->jump]);
    return stop <= end + msfp_smallest_step(end) ? stop : end; /* the given time, also where a row lies before it by rounding */
}

/* The step h, no longer than permitted at the present time. */
static double allowed(msfp_building *b, double h)
{
    const msfp_building_scene *s = &b->scene;
    h = msfp_allowed_step(s->span_ends, s->span_steps, s->span_count, &b->span, b->t, h);
    return s->max_step > 0.0 ? fmin(h, s->max_step) : h;
}

/* A step of at most h [s], of which a whole number reaches `left`: few different lengths mean few factorisations. */
static double divided(double h, double left)
{
    const double count = ceil(left / h * (1.0 - 1e-9));
    return count <= 8.0 ? left / fmax(count, 1.0) : fmin(h, msfp_pow(growth, floor(msfp_log(h) / msfp_log(growth) + 1e-9)));
}

/* The next length after a step of length h. A step that was cut to end at a given time leaves the proposal as it is,
 * unless its error alone permits a longer one: with the error of the step before, as for a bearing, ten seconds of the
 * hospital take 3641 steps in place of 2767. */
static double next_length(const msfp_building *b, double h, double error)
{
    if (h < 0.9 * b->h && error < 0.5)
        return fmax(b->h, h * fmin(5.0, 0.9 * msfp_pow(fmax(error, 1e-6), -1.0 / b->method.order)));
    return h * msfp_step_factor(error, b->previous_error, b->method.order);
}

/* ---- steps ---- */

static void commit_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    const msfp_part *part = &b->scene.parts[bearing];
    m->status = part->api->port_step_commit(part->port, b->t);
    m->status = m->status ? m->status : read_row(b, bearing);
    if (!m->status)
        note_bearing(b, bearing);
}

static void accept(msfp_building *b, double h, double t, double error)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n, last = b->method.count - 1;
    const double *v = b->stage_v + last * n, *a = b->stage_a + last * n;
    for (size_t c = 0; c < n; ++c) {
        b->slope[c] = (a[c] - b->a[c]) / h;
        b->u[c] = b->next_u[c];
        b->v[c] = v[c];
        b->a[c] = a[c];
    }
    for (size_t j = 0; j <= last; ++j)
        msfp_add(b->energies, b->power[j], h * (j < last ? b->method.weights[last][j] : b->method.diagonal), ENERGIES);
    memcpy(b->power[0], b->power[last], sizeof b->power[0]);
    b->t = t;
    ++b->counts[MSFP_BUILDING_STEPS];
    for_each_bearing(b, commit_bearing);
    b->status = first_failure(b);
    b->h = next_length(b, h, error);
    b->previous_error = error;
    ground_at(b, t);
    note_peaks(b);
    b->status = b->status ? b->status : write_step(b);
    if (!b->status && (t >= next_row_time(b) - msfp_smallest_step(t) || t >= s->end - msfp_smallest_step(t))) {
        b->next_row += t >= next_row_time(b) - msfp_smallest_step(t);
        b->status = write_row(b);
    }
    if (!b->status && b->jump < s->jump_count && t >= s->jumps[b->jump] - msfp_smallest_step(t)) {
        ++b->jump;
        restart_building(b);
        b->h = fmin(b->h, 1e-3);
    }
}

/* Shorten the step after a failure; the run ends where it is the shortest already. */
static void shorten(msfp_building *b, double h, double factor, int status, int bearing)
{
    b->h = h * factor;
    ++b->counts[MSFP_BUILDING_REJECTED];
    if (b->h < msfp_smallest_step(b->t) || status == MSFP_E_MEMORY)
        end_run(b, status, bearing);
}

/* The first bearing, from 1, of which a monitor stops the step; 0: none. */
static int tripped_bearing(msfp_building *b)
{
    int first = 0;
    for (int i = b->scene.bearings - 1; i >= 0; --i)
        if (b->scene.parts[i].api->port_tripped(b->scene.parts[i].port))
            first = i + 1;
    return first;
}

/* One step, or the rejection of one. */
static void one_step(msfp_building *b)
{
    const double end = latest_end(b), left = end - b->t;
    double h = divided(allowed(b, b->h), left), error, share;
    int worst;
    for (int relocations = 0;; ++relocations) {
        const int status = try_step(b, h, &error, &share, &worst);
        if (status) {
            shorten(b, h, 0.25, status, b->bearing);
            return;
        }
        if (error > 1.0) {
            shorten(b, h, msfp_shrink_factor(error, b->method.order), MSFP_E_STEP, worst);
            return;
        }
        if (share >= 1.0 || relocations >= MSFP_RELOCATIONS)
            break;
        h = msfp_step_to_event(h, share);
    }
    if ((b->bearing = tripped_bearing(b))) {
        b->status = MSFP_E_MONITOR;
        return;
    }
    accept(b, h, fabs(b->t + h - end) <= msfp_smallest_step(end) ? end : b->t + h, error);
}

/* ---- a bearing continues with another model ---- */

void msfp_building_ends(msfp_building *b, int bearing, double *ends)
{
    ground_at(b, b->t);
    ends_now(b);
    memcpy(ends, b->members[bearing].ends, sizeof b->members[bearing].ends);
}

int msfp_building_replaced(msfp_building *b, int bearing, const int *entries, const int *faces)
{
    const msfp_part *part = &b->scene.parts[bearing];
    member *m = &b->members[bearing];
    int *to = b->entries;
    for (int i = 0; i < bearing; ++i)
        to += b->scene.entry_count[i];
    memcpy(to, entries, (size_t)b->scene.entry_count[bearing] * sizeof *to);
    memcpy(b->faces + bearing * MSFP_FACES, faces, MSFP_FACES * sizeof *faces);
    free(m->row);
    m->row = NULL;
    b->tangent_beta = 0.0;
    b->h = fmin(b->h, 1e-3);
    memset(b->slope, 0, (size_t)b->scene.n * sizeof *b->slope);
    b->status = part->api->port_wrench(part->port, m->wrench);
    b->status = b->status ? b->status : read_row(b, bearing);
    b->bearing = b->status ? bearing + 1 : 0;
    b->surface = 0;
    b->value = 0.0;
    return b->status;
}

static int finished(const msfp_building *b) { return b->t >= b->scene.end - msfp_smallest_step(b->scene.end); }

int msfp_building_advance(msfp_building *b, long steps)
{
    for (long i = 0; i < steps && !b->status && !finished(b); ++i) {
        if ((double)(b->counts[MSFP_BUILDING_STEPS] + b->counts[MSFP_BUILDING_REJECTED]) >= b->scene.max_steps) {
            b->status = MSFP_E_STEPS;
            b->bearing = 0;
        } else
            one_step(b);
    }
    return !b->status && !finished(b);
}

void msfp_building_state(const msfp_building *b, msfp_building_progress *progress)
{
    *progress = (msfp_building_progress){ b->status, b->status ? b->bearing : 0, b->surface, b->value, b->t,
                                          b->rows.count };
}

void msfp_building_counts(const msfp_building *b, long *counts) { memcpy(counts, b->counts, sizeof b->counts); }
