/* peaks.c: peaks over all steps of a run of a building, which do not depend on the times of the rows. */
#include <math.h>
#include "building.h"

enum { VECTOR = 4, BASE = VECTOR + 1, ENERGY = 2, BEARING = 2 * VECTOR + 2 };

static size_t of_building(const msfp_building *b) { return (size_t)b->scene.vectors * VECTOR + BASE + ENERGY; }

static const double loaded = 0.05; /* N over the load at rest above which the place of a contact counts */

static size_t of_bearing(const msfp_building *b, int bearing)
{
    const int surfaces = b->scene.faces[bearing * MSFP_FACES + MSFP_FACES_SURFACES];
    return BEARING + 2 * ((size_t)b->scene.entry_count[bearing] + surfaces);
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

static double *peaks_of(msfp_building *b, int bearing)
{
    double *at = b->peaks + of_building(b);
    for (int i = 0; i < bearing; ++i)
        at += of_bearing(b, i);
    return at;
}

void begin_peaks(msfp_building *b)
{
    for (size_t i = 0; i < of_building(b); ++i)
        b->peaks[i] = 0.0;
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

static double *take_vector(double *at, const double vector[3])
{
    for (int i = 0; i < 3; ++i)
        at[i] = fmax(at[i], fabs(vector[i]));
    at[3] = fmax(at[3], sqrt(vector[0] * vector[0] + vector[1] * vector[1]));
    return at + VECTOR;
}

/* Sum of the forces of the ground and their torsion. */
static double *take_base(const msfp_building *b, double *at)
{
    double sum[3] = { 0.0 }, torsion = 0.0;
    for (int i = 0; i < b->scene.bearings; ++i) {
        const double *wrench = b->members[i].wrench, *arm = b->scene.arms + 2 * i;
        for (int k = 0; k < 3; ++k)
            sum[k] += wrench[k];
        torsion += arm[0] * wrench[1] - arm[1] * wrench[0] + wrench[5];
    }
    at = take_vector(at, sum);
    *at = fmax(*at, fabs(torsion));
    return at + 1;
}

void note_peaks(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    const double *motions[3] = { b->u, b->v, b->a }, *row = s->vector_rows;
    double *at = b->peaks;
    for (int k = 0; k < s->vectors; ++k) {
        double vector[3];
        int count;
        const int *columns = columns_of(&b->watched, k, &count);
        for (int i = 0; i < 3; ++i, row += s->n) {
            vector[i] = dot_at(count, columns, row, motions[s->vector_orders[k]]);
            for (int g = 0; g < s->grounds; ++g)
                vector[i] -= s->vector_grounds[k * s->grounds + g] * b->ground[g * MSFP_GROUND + i];
        }
        at = take_vector(at, vector);
    }
    at = take_base(b, at);
    for (int i = 0; i < ENERGY; ++i)
        at[i] = fmax(at[i], b->next_energies[i]);
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
static void note_faces(const msfp_building *b, int bearing, double *at)
{
    static const double upright[2] = { 0.0, 0.0 };
    const member *m = &b->members[bearing];
    const int *f = b->faces + bearing * MSFP_FACES;
    if (!f[MSFP_FACES_CHECKED])
        return;
    for (int j = 0; j < f[MSFP_FACES_SURFACES]; ++j, at += 2) {
        double n[3], t[3];
        if (m->row[f[MSFP_FACES_NORMAL] + j] <= -loaded * m->rest[2])
            continue;
        axis_of(m->row + f[MSFP_FACES_ANGLES] + 2 * j, n);
        axis_of(j < f[MSFP_FACES_UPWARD] ? m->row + f[MSFP_FACES_TILTS] + f[MSFP_FACES_STRIDE] * j : upright, t);
        const double x = n[1] * t[2] - n[2] * t[1], y = n[2] * t[0] - n[0] * t[2], z = n[0] * t[1] - n[1] * t[0];
        const double sine = sqrt(x * x + y * y + z * z);
        if (sine > at[0]) {
            at[0] = sine;
            at[1] = b->t;
        }
    }
}

void note_bearing(msfp_building *b, int bearing)
{
    const member *m = &b->members[bearing];
    const double *upper = m->ends + 3 * MSFP_WRENCH, *force = m->wrench + MSFP_WRENCH;
    const int count = b->scene.entry_count[bearing], *entries = b->entries;
    double *at = peaks_of(b, bearing), across[3];
    for (int i = 0; i < bearing; ++i)
        entries += b->scene.entry_count[i];
    for (int i = 0; i < 3; ++i)
        across[i] = m->ends[i] - upper[i];
    at = take_vector(at, across);
    at = take_vector(at, force);
    at[0] = fmin(at[0], -force[2]);
    at[1] = fmax(at[1], -force[2]);
    at += 2;
    for (int k = 0; k < count; ++k) {
        at[k] = fmin(at[k], kept(m, entries[k]));
        at[count + k] = fmax(at[count + k], kept(m, entries[k]));
    }
    note_faces(b, bearing, at + 2 * count);
}
