/* linear.c: the linear equations of a stage. With M a + C v + K u + P f = 0, u = Q + beta v and a = (v - V)/beta,
 * the rates v = A^-1 (M V/beta - K Q) - A^-1 P f follow from the forces f at the attachments. */
#include <stdlib.h>
#include <string.h>
#include "building.h"

void multiply(int n, const double *matrix, const double *x, int add, double *y)
{
    for (int i = 0; i < n; ++i) {
        double sum = 0.0;
        for (int j = 0; j < n; ++j)
            sum += matrix[(size_t)i * n + j] * x[j];
        y[i] = add ? y[i] + sum : sum;
    }
}

double dot(int n, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
        sum += x[i] * y[i];
    return sum;
}

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
            l->mobility[(size_t)k * r + i] = l->follow[(size_t)k * n + s->attached[i]];
    memcpy(l->mobility_factors, l->mobility, (size_t)r * r * sizeof(double));
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
    int r = b->scene.attachments, info;
    for (int k = 0; k < r; ++k) /* by columns; the mobility is symmetric */
        for (int i = 0; i < r; ++i) {
            double sum = i == k;
            for (int l = 0; l < r; ++l)
                sum += b->now->mobility[(size_t)i * r + l] * b->tangent[(size_t)l * r + k];
            b->matrix[(size_t)k * r + i] = sum;
        }
    b->scene.lapack.getrf(&r, &r, b->matrix, &r, b->pivots, &info);
    return info ? MSFP_E_IRREGULAR : MSFP_OK;
}

void solve_tangent(msfp_building *b, double *x)
{
    int r = b->scene.attachments, one = 1, info;
    char plain[] = "N";
    b->scene.lapack.getrs(plain, &r, &one, b->matrix, &r, b->pivots, x, &r, &info);
}
