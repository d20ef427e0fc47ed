/* state.c: rows of a run of a building, and its snapshots. */
#include <stdlib.h>
#include <string.h>
#include "building.h"

/* ---- rows ---- */

static size_t head_size(const msfp_building_scene *s)
{
    return 1 + 3 * (size_t)s->n + (size_t)s->grounds * MSFP_GROUND + ENERGIES;
}

size_t msfp_building_row_size(const msfp_building *b)
{
    size_t size = head_size(&b->scene);
    for (int i = 0; i < b->scene.bearings; ++i)
        size += 2 * MSFP_WRENCH + b->scene.entry_count[i];
    return size;
}

const double *msfp_building_rows(const msfp_building *b) { return b->rows.data; }

static size_t step_size(const msfp_building *b) { return 1 + (size_t)b->scene.nodes * MSFP_WRENCH; }

size_t msfp_building_step_count(const msfp_building *b) { return b->steps.count; }

const double *msfp_building_steps(const msfp_building *b) { return b->steps.data; }

/* Room for so many rows of that size. */
static int room_for(table *t, size_t rows, size_t size)
{
    if (rows <= t->capacity)
        return MSFP_OK;
    const size_t wider = rows > 2 * t->capacity ? rows : 2 * t->capacity;
    double *more = realloc(t->data, wider * size * sizeof *more);
    if (!more)
        return MSFP_E_MEMORY;
    t->data = more;
    t->capacity = wider;
    return MSFP_OK;
}

static double *put(double *to, const double *from, size_t count)
{
    memcpy(to, from, count * sizeof *to);
    return to + count;
}

int read_row(msfp_building *b, int bearing)
{
    const msfp_part *part = &b->scene.parts[bearing];
    member *m = &b->members[bearing];
    if (!m->row && !(m->row = malloc((size_t)part->api->row_size * sizeof *m->row)))
        return MSFP_E_MEMORY;
    return part->api->port_row(part->port, m->row);
}

int write_row(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    if (room_for(&b->rows, b->rows.count + 1, msfp_building_row_size(b)))
        return MSFP_E_MEMORY;
    double *row = b->rows.data + b->rows.count * msfp_building_row_size(b);
    const int *entries = b->entries;
    row = put(row, &b->t, 1);
    row = put(row, b->u, s->n);
    row = put(row, b->v, s->n);
    row = put(row, b->a, s->n);
    row = put(row, b->ground, (size_t)s->grounds * MSFP_GROUND);
    row = put(row, b->energies, ENERGIES);
    for (int i = 0; i < s->bearings; ++i) {
        row = put(row, b->members[i].wrench, 2 * MSFP_WRENCH);
        for (int k = 0; k < s->entry_count[i]; ++k)
            *row++ = kept(&b->members[i], *entries++);
    }
    ++b->rows.count;
    return MSFP_OK;
}

int write_step(msfp_building *b)
{
    const double *motion = b->scene.node_rows;
    if (room_for(&b->steps, b->steps.count + 1, step_size(b)))
        return MSFP_E_MEMORY;
    double *row = b->steps.data + b->steps.count++ * step_size(b);
    *row++ = b->t;
    for (int k = 0; k < b->scene.nodes; ++k) {
        int count;
        const int *columns = columns_of(&b->of_node, k, &count);
        for (int i = 0; i < MSFP_WRENCH; ++i, motion += b->scene.n)
            *row++ = dot_at(count, columns, motion, b->a);
    }
    return MSFP_OK;
}

/* ---- snapshots ---- */

static const uint64_t magic = 0x6d73667062756935; /* "msfpbui5" */
enum { HEAD = 4 };        /* that, the identity, and the numbers of rows and of steps */

size_t entry_count(const msfp_building *b)
{
    size_t count = 0;
    for (int i = 0; i < b->scene.bearings; ++i)
        count += b->scene.entry_count[i];
    return count;
}

uint64_t identity_of(const msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n, r = s->attachments, k = s->bearings, g = s->grounds, size = sizeof(double);
    const struct {
        const void *data;
        size_t size;
    } parts[] = {
        { &n, sizeof n },
        { &r, sizeof r },
        { &k, sizeof k },
        { &g, sizeof g },
        { s->mass, r * r * size },
        { s->damping, r * r * size },
        { s->stiffness, r * r * size },
        { s->shares, r * (n - r) * size },
        { s->dampers, (n - r) * size },
        { s->springs, (n - r) * size },
        { s->rows, k * MSFP_WRENCH * r * size },
        { s->ground_of, k * sizeof(int) },
        { s->entry_count, k * sizeof(int) },
        { s->entries, entry_count(b) * sizeof(int) },
        { s->faces, k * MSFP_FACES * sizeof(int) },
        { &s->weight, size },
        { &s->vectors, sizeof(int) },
        { s->vector_orders, (size_t)s->vectors * sizeof(int) },
        { s->vector_rows, (size_t)s->vectors * 3 * n * size },
        { s->vector_grounds, (size_t)s->vectors * g * size },
        { &s->nodes, sizeof(int) },
        { s->node_rows, (size_t)s->nodes * MSFP_WRENCH * n * size },
        { s->arms, k * 2 * size },
        { &s->stop_count, sizeof(int) },
        { s->stops, (size_t)s->stop_count * size },
        { &s->jump_count, sizeof(int) },
        { s->jumps, (size_t)s->jump_count * size },
        { &s->span_count, sizeof(int) },
        { s->span_ends, (size_t)s->span_count * size },
        { s->span_steps, (size_t)s->span_count * size },
        { &s->method, sizeof(int) },
        { &s->rtol, size },
        { &s->max_step, size },
        { &s->first_step, size },
        { &s->max_steps, size },
        { &s->end, size },
        { &s->output_step, size },
    };
    uint64_t sum = MSFP_HASH_START;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i)
        sum = msfp_hash(sum, parts[i].data, parts[i].size);
    for (size_t i = 0; i < g; ++i) {
        const msfp_piecewise *h = &s->ground[i];
        sum = msfp_hash(sum, &h->pieces, sizeof h->pieces);
        sum = msfp_hash(sum, h->knots, ((size_t)h->pieces + 1) * size);
        sum = msfp_hash(sum, h->coefficients, (size_t)h->pieces * 6 * (MSFP_DEGREE + 1) * size);
    }
    return sum;
}

/* The numbers of the state in order, in both directions. */
typedef struct {
    char *at;
    int reading;
} tape;

static void pass(tape *t, void *data, size_t size)
{
    memcpy(t->reading ? data : t->at, t->reading ? t->at : data, size);
    t->at += size;
}

static void pass_state(msfp_building *b, tape *t)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n * sizeof(double), r = s->attachments * sizeof(double);
    double *numbers[] = { &b->t, &b->h, &b->previous_error, &b->energy, &b->tangent_beta, &b->clock };
    int *indices[] = { &b->stop, &b->jump, &b->span, &b->next_row };
    double *arrays[] = { b->u, b->v, b->a, b->slope };
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; ++i)
        pass(t, numbers[i], sizeof(double));
    for (size_t i = 0; i < sizeof indices / sizeof *indices; ++i)
        pass(t, indices[i], sizeof(int));
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        pass(t, arrays[i], n);
    for (int i = 0; i < b->lengths; ++i) {
        pass(t, &b->linear[i].length, sizeof(double));
        pass(t, &b->linear[i].used, sizeof(double));
    }
    pass(t, b->energies, sizeof b->energies);
    pass(t, b->power[0], sizeof b->power[0]);
    pass(t, b->counts, sizeof b->counts);
    pass(t, b->tangent, r * s->attachments);
    pass(t, b->peaks, 2 * peak_count(b) * sizeof *b->peaks);
    for (int i = 0; i < s->bearings; ++i)
        pass(t, b->members[i].wrench, sizeof b->members[i].wrench);
}

/* Bytes of that state. */
static size_t state_size(const msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    return (6 + 2 * (size_t)b->lengths) * sizeof(double) + 4 * sizeof(int) + 4 * (size_t)s->n * sizeof(double) + sizeof b->energies +
           sizeof b->power[0] + sizeof b->counts + (size_t)s->attachments * s->attachments * sizeof(double) +
           (size_t)s->bearings * sizeof b->members[0].wrench + 2 * peak_count(b) * sizeof *b->peaks;
}

static size_t fixed_size(const msfp_building *b)
{
    size_t size = HEAD * sizeof(uint64_t) + state_size(b);
    for (int i = 0; i < b->scene.bearings; ++i)
        size += b->scene.parts[i].api->port_snapshot_size(b->scene.parts[i].port);
    return size;
}

static size_t rows_size(const msfp_building *b, size_t rows) { return rows * msfp_building_row_size(b) * sizeof(double); }

static size_t steps_size(const msfp_building *b, size_t steps) { return steps * step_size(b) * sizeof(double); }

size_t msfp_building_snapshot_size(const msfp_building *b)
{
    return fixed_size(b) + rows_size(b, b->rows.count) + steps_size(b, b->steps.count);
}

void msfp_building_snapshot_write(const msfp_building *b, void *snapshot)
{
    tape t = { snapshot, 0 };
    uint64_t head[HEAD] = { magic, b->identity, b->rows.count, b->steps.count };
    pass(&t, head, sizeof head);
    pass_state((msfp_building *)b, &t); /* which only reads it here */
    for (int i = 0; i < b->scene.bearings; ++i) {
        const msfp_part *part = &b->scene.parts[i];
        part->api->port_snapshot_write(part->port, t.at);
        t.at += part->api->port_snapshot_size(part->port);
    }
    pass(&t, b->rows.data, rows_size(b, b->rows.count));
    pass(&t, b->steps.data, steps_size(b, b->steps.count));
}

int msfp_building_snapshot_read(msfp_building *b, const void *snapshot, size_t size)
{
    tape t = { (char *)snapshot, 1 }; /* read only */
    uint64_t head[HEAD];
    if (size < fixed_size(b))
        return MSFP_E_SNAPSHOT;
    pass(&t, head, sizeof head);
    if (head[0] != magic || head[1] != b->identity || head[2] > size || !head[2] || head[3] > size || !head[3] ||
        size != fixed_size(b) + rows_size(b, head[2]) + steps_size(b, head[3]))
        return MSFP_E_SNAPSHOT;
    if (room_for(&b->rows, head[2], msfp_building_row_size(b)) || room_for(&b->steps, head[3], step_size(b)))
        return MSFP_E_MEMORY;
    pass_state(b, &t);
    for (int i = 0; i < b->lengths; ++i)
        b->linear[i].factored = 0;
    for (int i = 0; i < b->scene.bearings; ++i) {
        const msfp_part *part = &b->scene.parts[i];
        const size_t own = part->api->port_snapshot_size(part->port);
        const int status = part->api->port_snapshot_read(part->port, t.at, own);
        if (status)
            return status;
        t.at += own;
    }
    pass(&t, b->rows.data, rows_size(b, head[2]));
    pass(&t, b->steps.data, steps_size(b, head[3]));
    b->rows.count = head[2];
    b->steps.count = head[3];
    b->status = MSFP_OK;
    return MSFP_OK;
}
