/* linear.c: the linear equations of a stage. With M a + C v + K u + P f = 0, u = Q + beta v and a = (v - V)/beta,
 * the rates v = A^-1 (M V/beta - K Q) - A^-1 P f follow from the forces f at the attachments. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises products of matrices */
#endif
#include <stdlib.h>
#include <string.h>
#include "building.h"

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
            p->begin = calloc((size_t)sets + 1, sizeof *p->begin);
            p->columns = calloc(count + 1, sizeof *p->columns);
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

/* ---- factors ---- */

static void release(linear *l)
{
    free(l->factors);
    free(l->follow);
    free(l->mobility);
    free(l->mobility_factors);
    *l = (linear){ 0 };
}

/* All arrays or, where memory ends, none. */
static int allocate(linear *l, size_t n, size_t r)
{
    if (l->factors)
        return MSFP_OK;
    linear arrays = {
        .used = l->used,
        .factors = malloc(n * n * sizeof(double)),
        .follow = malloc(n * r * sizeof(double)),
        .mobility = malloc(r * r * sizeof(double)),
        .mobility_factors = malloc(r * r * sizeof(double)),
    };
    if (!arrays.factors || !arrays.follow || !arrays.mobility || !arrays.mobility_factors) {
        release(&arrays);
        return MSFP_E_MEMORY;
    }
    *l = arrays;
    return MSFP_OK;
}

void linear_free(msfp_building *b)
{
    for (int k = 0; k < FACTORS; ++k)
        release(&b->linear[k]);
}

/* The factors at that beta, or those that have not been used for longest. */
static linear *place_for(msfp_building *b, double beta)
{
    linear *oldest = &b->linear[0];
    for (int k = 0; k < FACTORS; ++k) {
        if (b->linear[k].beta == beta)
            return &b->linear[k];
        if (b->linear[k].used < oldest->used)
            oldest = &b->linear[k];
    }
    return oldest;
}

int factor_linear(msfp_building *b, double beta)
{
    const msfp_building_scene *s = &b->scene;
    int n = s->n, r = s->attachments, info = 0;
    char lower[] = "L";
    linear *l = b->now = place_for(b, beta);
    l->used = ++b->clock;
    if (l->beta == beta)
        return MSFP_OK;
    l->beta = 0.0;
    if (allocate(l, n, r))
        return MSFP_E_MEMORY;
    for (size_t i = 0; i < (size_t)n * n; ++i)
        l->factors[i] = s->mass[i] / beta + s->damping[i] + beta * s->stiffness[i];
    s->lapack.potrf(lower, &n, l->factors, &n, &info);
    if (info)
        return MSFP_E_IRREGULAR;
    memset(l->follow, 0, (size_t)n * r * sizeof(double));
    for (int k = 0; k < r; ++k)
        l->follow[(size_t)k * n + s->attached[k]] = 1.0;
    s->lapack.potrs(lower, &n, &r, l->factors, &n, l->follow, &n, &info);
    for (int k = 0; k < r; ++k)
        for (int i = 0; i < r; ++i)
            l->mobility_factors[(size_t)k * r + i] = l->mobility[(size_t)i * r + k] =
                l->follow[(size_t)k * n + s->attached[i]];
    s->lapack.potrf(lower, &r, l->mobility_factors, &r, &info);
    if (info)
        return MSFP_E_IRREGULAR;
    l->beta = beta;
    return MSFP_OK;
}

void solve_linear(msfp_building *b, double *x)
{
    int n = b->scene.n, one = 1, info;
    char lower[] = "L";
    b->scene.lapack.potrs(lower, &n, &one, b->now->factors, &n, x, &n, &info);
}

int factor_tangent(msfp_building *b)
{
    int r = b->scene.attachments, info, count;
    if (b->factored_beta == b->now->beta)
        return MSFP_OK;
    memset(b->matrix, 0, (size_t)r * r * sizeof *b->matrix);
    for (int k = 0; k < r; ++k) {
        double *column = b->matrix + (size_t)k * r;
        const int *rows = columns_of(&b->coupled, k, &count);
        column[k] = 1.0;
        for (int l = 0; l < count; ++l)
            add_columns(r, 1, b->now->mobility + (size_t)rows[l] * r, b->tangent + (size_t)rows[l] * r + k, column);
    }
    b->scene.lapack.getrf(&r, &r, b->matrix, &r, b->pivots, &info);
    b->factored_beta = info ? 0.0 : b->now->beta;
    return info ? MSFP_E_IRREGULAR : MSFP_OK;
}

void solve_tangent(msfp_building *b, double *x)
{
    int r = b->scene.attachments, one = 1, info;
    char plain[] = "N";
    b->scene.lapack.getrs(plain, &r, &one, b->matrix, &r, b->pivots, x, &r, &info);
}
