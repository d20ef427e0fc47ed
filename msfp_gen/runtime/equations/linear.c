/* linear.c: dense LU factorisation with partial pivoting for the small systems of one step. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over rows of any length */
#endif
#include <math.h>
#include "msfp_model.h"

/* to -= factor * from */
MSFP_INLINE void subtract(double *restrict to, const double *restrict from, double factor, int count)
{
    int j = 0;
    for (; j + MSFP_PACK_SIZE <= count; j += MSFP_PACK_SIZE)
        *(msfp_pack *)(to + j) -= factor * *(const msfp_pack *)(from + j);
    for (; j < count; ++j)
        to[j] -= factor * from[j];
}

MSFP_INLINE int factors(double *matrix, int n, int *pivots)
{
    int sign = 1;
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(matrix[i * n + k]) > fabs(matrix[pivot * n + k]))
                pivot = i;
        pivots[k] = pivot;
        if (!(fabs(matrix[pivot * n + k]) > 0.0))
            return 0;
        if (pivot != k) {
            sign = -sign;
            for (int j = 0; j < n; ++j) {
                const double swap = matrix[k * n + j];
                matrix[k * n + j] = matrix[pivot * n + j];
                matrix[pivot * n + j] = swap;
            }
        }
        if (matrix[k * n + k] < 0.0)
            sign = -sign;
        const double inverse = matrix[k * n + k] = 1.0 / matrix[k * n + k];
        for (int i = k + 1; i < n; ++i) {
            const double factor = matrix[i * n + k] * inverse;
            matrix[i * n + k] = factor;
            if (factor != 0.0)
                subtract(matrix + i * n + k + 1, matrix + k * n + k + 1, factor, n - k - 1);
        }
    }
    return sign;
}

/* Forward substitution runs column by column: its updates do not depend on each other. rhs: [n][width] */
MSFP_INLINE void solution(const double *matrix, int n, const int *pivots, int width, double *rhs)
{
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < width; ++c) {
            const double swap = rhs[pivots[k] * width + c];
            rhs[pivots[k] * width + c] = rhs[k * width + c];
            rhs[k * width + c] = swap;
        }
    for (int j = 0; j < n; ++j)
        for (int i = j + 1; i < n; ++i)
            subtract(rhs + i * width, rhs + j * width, matrix[i * n + j], width);
    for (int i = n - 1; i >= 0; --i) {
        for (int j = i + 1; j < n; ++j)
            subtract(rhs + i * width, rhs + j * width, matrix[i * n + j], width);
        for (int c = 0; c < width; ++c)
            rhs[i * width + c] *= matrix[i * n + i];
    }
}

/* For the size of the step systems, known at compile time, the compiler unrolls the loops. */
MSFP_WIDE int msfp_lu(double *matrix, int n, int *pivots)
{
    return n == MSFP_DOF ? factors(matrix, MSFP_DOF, pivots) : factors(matrix, n, pivots);
}

MSFP_WIDE void msfp_lu_solve(const double *matrix, int n, const int *pivots, double *rhs)
{
    if (n == MSFP_DOF)
        solution(matrix, MSFP_DOF, pivots, 1, rhs);
    else
        solution(matrix, n, pivots, 1, rhs);
}

MSFP_WIDE void msfp_lu_solve_columns(const double *matrix, const int *pivots, int width, double *columns)
{
#if MSFP_GRADIENTS /* with as many columns the compiler unrolls the loops too */
    if (width == MSFP_COLUMNS) {
        solution(matrix, MSFP_DOF, pivots, MSFP_COLUMNS, columns);
        return;
    }
#endif
    solution(matrix, MSFP_DOF, pivots, width, columns);
}
