/* linear.c: the linear equations of a stage. With u = Q + beta v and a = (v - V)/beta the oscillators have the rates
 * (their driving force + e P^T v)/D, with e = d + beta k and D = 1/beta + e. For the rates v of the attachments
 * S v + f = g remains, with the forces f of the bearings and S = M/beta + C + beta K + P e/(1 + beta e) P^T, a sum of
 * matrices without negative eigenvalues. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises products of matrices */
#endif
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "building.h"

static const double rounding = 1e-15; /* of times, relative above 1 s */

/* Four columns at a time, so that a sum is loaded and stored once for four products. */
void add_columns(int n, int columns, const double *restrict matrix, const double *restrict x, double *restrict y)
{
    const size_t height = n;
    int j = 0;
    for (; j + 4 <= columns; j += 4, matrix += 4 * height) {
        const double *p = matrix, *q = p + height, *r = q + height, *s = r + height;
        const double a = x[j], b = x[j + 1], c = x[j + 2], d = x[j + 3];
        for (size_t i = 0; i < height; ++i)
            y[i] = (((y[i] + p[i] * a) + q[i] * b) + r[i] * c) + s[i] * d;
    }
    for (; j < columns; ++j, matrix += height)
        for (size_t i = 0; i < height; ++i)
            y[i] += matrix[i] * x[j];
}

void multiply(int n, const double *matrix, const double *x, double *y)
{
    memset(y, 0, (size_t)n * sizeof *y);
    add_columns(n, n, matrix, x, y);
}

double dot(int n, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
        sum += x[i] * y[i];
    return sum;
}

/* ---- where matrices are not zero ---- */

double dot_at(int count, const int *columns, const double *row, const double *x)
{
    double sum = 0.0;
    for (int i = 0; i < count; ++i)
        sum += row[columns[i]] * x[columns[i]];
    return sum;
}

static int is_zero(const double *column, int height, int n)
{
    for (int i = 0; i < height; ++i)
        if (column[(size_t)i * n] != 0.0)
            return 0;
    return 1;
}

int find_pattern(pattern *p, const double *rows, int sets, int height, int n)
{
    size_t count = 0;
    for (int pass = 0; pass < 2; ++pass) { /* count, then store */
        if (pass) {
            p->begin = calloc((size_t)sets + 1, sizeof *p->begin); /* NOLINT(-Wanalyzer-malloc-leak): kept in p */
            p->columns = calloc(count + 1, sizeof *p->columns); /* NOLINT(-Wanalyzer-malloc-leak): kept in p */
            if (!p->begin || !p->columns)
                return MSFP_E_MEMORY;
            count = 0;
        }
        for (int k = 0; k < sets; ++k) {
            for (int c = 0; c < n; ++c)
                if (!is_zero(rows + (size_t)k * height * n + c, height, n)) {
                    if (pass)
                        p->columns[count] = c;
                    ++count;
                }
            if (pass)
                p->begin[k + 1] = (int)count;
        }
    }
    return MSFP_OK;
}

int find_patterns(msfp_building *b)
{
    const msfp_building_scene *s = &b->scene;
    const size_t r = s->attachments;
    double *shared = calloc(r * r + 1, sizeof *shared); /* 1 where a bearing moves with both */
    int status = shared ? MSFP_OK : MSFP_E_MEMORY;
    status = status ? status : find_pattern(&b->moved, s->rows, s->bearings, MSFP_WRENCH, s->attachments);
    status = status ? status : find_pattern(&b->of_node, s->node_rows, s->nodes, MSFP_WRENCH, s->n);
    status = status ? status : find_pattern(&b->watched, s->vector_rows, s->vectors, 3, s->n);
    for (int j = 0; j < s->bearings && !status; ++j) {
        int count;
        const int *own = columns_of(&b->moved, j, &count);
        for (int i = 0; i < count; ++i)
            for (int k = 0; k < count; ++k)
                shared[own[i] * r + own[k]] = 1.0;
    }
    status = status ? status : find_pattern(&b->coupled, shared, s->attachments, 1, s->attachments);
    free(shared);
    return status;
}

void strain_of(const msfp_building *b, const double *u, double *s)
{
    const int r = b->scene.attachments, m = b->scene.n - r;
    memset(s, 0, (size_t)m * sizeof *s);
    add_columns(m, r, b->scene.shares, u, s);
    for (int k = 0; k < m; ++k)
        s[k] = u[r + k] - s[k];
}

/* ---- factors ---- */

static void release(linear *l)
{
    free(l->system);
    free(l->factors);
    free(l->matrix);
    free(l->pivots);
    free(l->follow);
    free(l->inverse);
    l->system = l->factors = l->matrix = l->follow = l->inverse = NULL;
    l->pivots = NULL;
}

/* All arrays or, where memory ends, none. */
static int allocate(linear *l, size_t r, size_t oscillators)
{
    if (l->system)
        return MSFP_OK;
    l->system = malloc(r * r * sizeof(double));
    l->factors = malloc(r * r * sizeof(double));
    l->matrix = malloc(r * r * sizeof(double));
    l->pivots = malloc(r * sizeof(int));
    l->follow = malloc((oscillators + 1) * sizeof(double));
    l->inverse = malloc((oscillators + 1) * sizeof(double));
    const int all = l->system && l->factors && l->matrix && l->pivots && /* NOLINT(-Wanalyzer-malloc-leak) */
                    l->follow && l->inverse;                             /* NOLINT(-Wanalyzer-malloc-leak) */
    if (all) /* NOLINT(-Wanalyzer-malloc-leak): kept in l */
        return MSFP_OK;
    release(l); /* NOLINT(-Wanalyzer-malloc-leak): what there is of it */
    return MSFP_E_MEMORY;
}

void linear_free(msfp_building *b)
{
    for (int k = 0; k < LENGTHS; ++k)
        release(&b->linear[k]);
}

/* The equations at that length, or those that have not been used for longest. */
static linear *place_for(msfp_building *b, double h, int *known)
{
    linear *oldest = &b->linear[0];
    *known = 1;
    for (int k = 0; k < b->lengths; ++k) {
        if (fabs(b->linear[k].length - h) <= rounding * fmax(1.0, b->t))
            return &b->linear[k];
        if (b->linear[k].used < oldest->used)
            oldest = &b->linear[k];
    }
    *known = 0;
    return oldest;
}

/* S, and how the oscillators follow the attachments. */
static void set_system(msfp_building *b, linear *l, double beta)
{
    const msfp_building_scene *s = &b->scene;
    int r = s->attachments, m = s->n - r;
    for (size_t i = 0; i < (size_t)r * r; ++i)
        l->system[i] = s->mass[i] / beta + s->damping[i] + beta * s->stiffness[i];
    for (int k = 0; k < m; ++k) {
        const double e = s->dampers[k] + beta * s->springs[k], root = sqrt(e / (1.0 + beta * e));
        l->inverse[k] = 1.0 / (1.0 / beta + e);
        l->follow[k] = e * l->inverse[k];
        for (int i = 0; i < r; ++i)
            b->scaled[(size_t)k * r + i] = root * s->shares_turned[(size_t)k * r + i];
    }
    if (m) {
        char lower[] = "L", plain[] = "N";
        double one = 1.0;
        s->lapack.syrk(lower, plain, &r, &m, &one, b->scaled, &r, &one, l->system, &r);
    }
    for (int k = 0; k < r; ++k)
        for (int i = k + 1; i < r; ++i) /* set above. NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
            l->system[(size_t)i * r + k] = l->system[(size_t)k * r + i];
}

int factor_linear(msfp_building *b, double h)
{
    int r = b->scene.attachments, info = 0, known;
    linear *l = b->now = place_for(b, h, &known);
    l->used = ++b->clock;
    if (!known) {
        l->length = h;
        l->factored = 0;
        ++b->counts[MSFP_BUILDING_LENGTHS];
    }
    if (!l->factored) {
        char lower[] = "L";
        l->tangent = 0;
        if (allocate(l, r, b->scene.n - r))
            return MSFP_E_MEMORY;
        set_system(b, l, b->method.diagonal * l->length);
        memcpy(l->factors, l->system, (size_t)r * r * sizeof *l->factors);
        b->scene.lapack.potrf(lower, &r, l->factors, &r, &info);
        if (info)
            return MSFP_E_IRREGULAR;
        l->factored = 1;
    }
    return b->tangent_beta == 0.0 ? MSFP_OK : factor_tangent(b);
}

double tangent_share(const msfp_building *b) { return b->method.diagonal * b->now->length / b->tangent_beta; }

int factor_tangent(msfp_building *b)
{
    int r = b->scene.attachments, info, count;
    linear *l = b->now;
    const double share = tangent_share(b);
    if (l->tangent == b->counts[MSFP_BUILDING_TANGENTS])
        return MSFP_OK;
    memcpy(l->matrix, l->system, (size_t)r * r * sizeof *l->matrix);
    for (int i = 0; i < r; ++i) {
        const int *columns = columns_of(&b->coupled, i, &count);
        for (int k = 0; k < count; ++k)
            l->matrix[(size_t)columns[k] * r + i] += share * b->tangent[(size_t)i * r + columns[k]];
    }
    b->scene.lapack.getrf(&r, &r, l->matrix, &r, l->pivots, &info);
    l->tangent = info ? 0 : b->counts[MSFP_BUILDING_TANGENTS];
    return info ? MSFP_E_IRREGULAR : MSFP_OK;
}

void solve_linear(msfp_building *b, double *x)
{
    int r = b->scene.attachments, one = 1, info;
    char lower[] = "L";
    b->scene.lapack.potrs(lower, &r, &one, b->now->factors, &r, x, &r, &info);
}

void solve_tangent(msfp_building *b, double *x)
{
    int r = b->scene.attachments, one = 1, info;
    char plain[] = "N";
    b->scene.lapack.getrs(plain, &r, &one, b->now->matrix, &r, b->now->pivots, x, &r, &info);
}
