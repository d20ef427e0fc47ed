/* peaks.c: peaks over all steps of a run of a building, and when each was reached, which do not depend on the rows. */
#include <math.h>
#include "building.h"

enum { VECTOR = 4, BASE = VECTOR + 1, ENERGY = 2, BEARING = 2 * VECTOR + 2 };

static size_t of_building(const msfp_building *b) { return (size_t)b->scene.vectors * VECTOR + BASE + ENERGY; }

static const double loaded = 0.05; /* N over the load at rest above which the place of a contact counts */

static size_t of_bearing(const msfp_building *b, int bearing)
{
    const int surfaces = b->scene.faces[bearing * MSFP_FACES + MSFP_FACES_SURFACES];
    return BEARING + 2 * (size_t)b->scene.entry_count[bearing] + surfaces + 1;
}

size_t peak_count(const msfp_building *b)
{
    size_t count = of_building(b);
    for (int i = 0; i < b->scene.bearings; ++i)
        count += of_bearing(b, i);
    return count;
}

size_t msfp_building_peak_count(const msfp_building *b) { return peak_count(b); }

const double *msfp_building_peaks(const msfp_building *b) { return b->peaks; }

const double *msfp_building_peak_times(const msfp_building *b) { return b->peaks + peak_count(b); }

static double *peaks_of(msfp_building *b, int bearing)
{
    double *at = b->peaks + of_building(b);
    for (int i = 0; i < bearing; ++i)
        at += of_bearing(b, i);
    return at;
}

void begin_peaks(msfp_building *b)
{
    const size_t peaks = peak_count(b);
    for (size_t i = 0; i < of_building(b); ++i)
        b->peaks[i] = 0.0;
    for (size_t i = 0; i < peaks; ++i)
        b->peaks[peaks + i] = b->t;
    for (int i = 0; i < b->scene.bearings; ++i) {
        double *at = peaks_of(b, i);
        const int count = b->scene.entry_count[i];
        for (int k = 0; k < 2 * VECTOR; ++k)
            *at++ = 0.0;
        *at++ = INFINITY;
        *at++ = -INFINITY;
        for (int k = 0; k < 2 * count; ++k)
            *at++ = k < count ? INFINITY : -INFINITY;
        for (const double *end = peaks_of(b, i) + of_bearing(b, i); at < end; ++at)
            *at = 0.0;
    }
}

/* The peaks of one kind: the next of them, and its time. */
typedef struct {
    double *peak, *time, now;
} cursor;

static cursor cursor_at(msfp_building *b, double *peak) { return (cursor){ peak, peak + peak_count(b), b->t }; }

static void keep(cursor *at, int beyond, double value)
{
    if (beyond) {
        *at->peak = value;
        *at->time = at->now;
    }
    ++at->peak;
    ++at->time;
}

static void most(cursor *at, double value) { keep(at, value > *at->peak, value); }

static void least(cursor *at, double value) { keep(at, value < *at->peak, value); }

static void take_vector(cursor *at, const double vector[3])
{
    for (int i = 0; i < 3; ++i)
        most(at, fabs(vector[i]));
    most(at, sqrt(vector[0] * vector[0] + vector[1] * vector[1]));
}

/* Sum of the forces of the ground and their torsion. */
static void take_base(const msfp_building *b, cursor *at)
{
    double sum[3] = { 0.0 }, torsion = 0.0;
    for (int i = 0; i < b->scene.bearings; ++i) {
        const double *wrench = b->members[i].wrench, *arm = b->scene.arms + 2 * i;
        for (int k = 0; k < 3; ++k)
            sum[k] += wrench[k];
        torsion += arm[0] * wrench[1] - arm[1] * wrench[0] + wrench[5];
    }
    take_vector(at, sum);
    most(at, fabs(torsion));
}

void note_peaks(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    const double *motions[3] = { b->u, b->v, b->a }, *row = s->vector_rows;
    cursor at = cursor_at(b, b->peaks);
    for (int k = 0; k < s->vectors; ++k) {
        double vector[3];
        int count;
        const int *columns = columns_of(&b->watched, k, &count);
        for (int i = 0; i < 3; ++i, row += s->n) {
            vector[i] = dot_at(count, columns, row, motions[s->vector_orders[k]]);
            for (int g = 0; g < s->grounds; ++g)
                vector[i] -= s->vector_grounds[k * s->grounds + g] * b->ground[g * MSFP_GROUND + i];
        }
        take_vector(&at, vector);
    }
    take_base(b, &at);
    for (int i = 0; i < ENERGY; ++i)
        most(&at, b->next_energies[i]);
    b->energy = fmax(b->energy, b->next_energies[0] + b->next_energies[1]);
}

/* The third axis t3 of (2.6) for two angles. */
static void axis_of(const double angles[2], double t[3])
{
    const double s = msfp_sin(angles[0]), c = msfp_cos(angles[0]), across = msfp_cos(angles[1]);
    t[0] = msfp_sin(angles[1]);
    t[1] = -s * across;
    t[2] = c * across;
}

/* Where the contacts of a bearing are on the faces of its sliders. */
static void note_faces(const msfp_building *b, int bearing, cursor *at)
{
    static const double upright[2] = { 0.0, 0.0 };
    const member *m = &b->members[bearing];
    const int *f = b->faces + bearing * MSFP_FACES;
    for (int j = 0; j < f[MSFP_FACES_SURFACES]; ++j) {
        double n[3], t[3];
        if (!f[MSFP_FACES_CHECKED] || m->row[f[MSFP_FACES_NORMAL] + j] <= -loaded * m->rest[2]) {
            keep(at, 0, 0.0);
            continue;
        }
        axis_of(m->row + f[MSFP_FACES_ANGLES] + 2 * j, n);
        axis_of(j < f[MSFP_FACES_UPWARD] ? m->row + f[MSFP_FACES_TILTS] + f[MSFP_FACES_STRIDE] * j : upright, t);
        const double x = n[1] * t[2] - n[2] * t[1], y = n[2] * t[0] - n[0] * t[2], z = n[0] * t[1] - n[1] * t[0];
        most(at, sqrt(x * x + y * y + z * z));
    }
}

/* Rims that are met at one time. */
static void note_rims(const msfp_building *b, int bearing, cursor *at)
{
    const double *row = b->members[bearing].row;
    const int *f = b->faces + bearing * MSFP_FACES;
    int met = 0;
    for (int j = 0; j < f[MSFP_FACES_SURFACES]; ++j)
        met += row[f[MSFP_FACES_GAP] + j] <= 0.0 || row[f[MSFP_FACES_RIM] + j] > 0.0;
    most(at, met);
}

void note_bearing(msfp_building *b, int bearing)
{
    const member *m = &b->members[bearing];
    const double *upper = m->ends + 3 * MSFP_WRENCH, *force = m->wrench + MSFP_WRENCH;
    const int count = b->scene.entry_count[bearing], *entries = b->entries;
    cursor at = cursor_at(b, peaks_of(b, bearing));
    double across[3];
    for (int i = 0; i < bearing; ++i)
        entries += b->scene.entry_count[i];
    for (int i = 0; i < 3; ++i)
        across[i] = m->ends[i] - upper[i];
    take_vector(&at, across);
    take_vector(&at, force);
    least(&at, -force[2]);
    most(&at, -force[2]);
    for (int k = 0; k < count; ++k)
        least(&at, kept(m, entries[k]));
    for (int k = 0; k < count; ++k)
        most(&at, kept(m, entries[k]));
    note_faces(b, bearing, &at);
    note_rims(b, bearing, &at);
}
