/* lane_copy.h: numbers of several runs from where each run has them into lanes, and back. */
#ifndef MSFP_LANE_COPY_H
#define MSFP_LANE_COPY_H
#include "lane.h"

#if MSFP_WIDTH == 8
#define LANE_SEVEN(f, h) { f(0, h), f(1, h), f(2, h), f(3, h), f(4, h), f(5, h), f(6, h), f(7, h) }
#elif MSFP_WIDTH == 4
#define LANE_SEVEN(f, h) { f(0, h), f(1, h), f(2, h), f(3, h) }
#else
#define LANE_SEVEN(f, h) { f(0, h), f(1, h) }
#endif
#define LANE_UPPER(k, h) ((k) & (h) ? MSFP_WIDTH + (k) - (h) : (k))
#define LANE_LOWER(k, h) ((k) & (h) ? MSFP_WIDTH + (k) : (k) + (h))

/* Blocks of `half` rows and columns change places across the diagonal. */
#define LANE_EXCHANGE(rows, half)                                                                                   \
    for (int i = 0; i < MSFP_WIDTH; ++i)                                                                            \
        if (!(i & (half))) {                                                                                        \
            const lane a = rows[i], b = rows[(i + (half)) % MSFP_WIDTH];                                            \
            rows[i] = __builtin_shuffle(a, b, (lane_mask)LANE_SEVEN(LANE_UPPER, half));                             \
            rows[(i + (half)) % MSFP_WIDTH] = __builtin_shuffle(a, b, (lane_mask)LANE_SEVEN(LANE_LOWER, half));     \
        }

/* Rows of a square become columns. */
LANE_INLINE void lane_transpose(lane rows[MSFP_WIDTH])
{
#pragma GCC unroll 8
    LANE_EXCHANGE(rows, 1)
#if MSFP_WIDTH >= 4
#pragma GCC unroll 8
    LANE_EXCHANGE(rows, 2)
#endif
#if MSFP_WIDTH >= 8
#pragma GCC unroll 8
    LANE_EXCHANGE(rows, 4)
#endif
}

/* The first `count` numbers of a vector, the others zero. */
LANE_INLINE lane lane_load(const double *from, int count)
{
#if MSFP_WIDTH == 8
    return (lane)_mm512_maskz_loadu_pd((__mmask8)((1 << count) - 1), from);
#elif MSFP_WIDTH == 4
    return (lane)_mm256_maskload_pd(from, (__m256i)((lane_mask){ 0, 1, 2, 3 } < count));
#else
    return count > 1 ? (lane)_mm_loadu_pd(from) : (lane)_mm_load_sd(from);
#endif
}

LANE_INLINE void lane_store(double *to, lane x, int count)
{
#if MSFP_WIDTH == 8
    _mm512_mask_storeu_pd(to, (__mmask8)((1 << count) - 1), (__m512d)x);
#elif MSFP_WIDTH == 4
    _mm256_maskstore_pd(to, (__m256i)((lane_mask){ 0, 1, 2, 3 } < count), (__m256d)x);
#else
    if (count > 1)
        _mm_storeu_pd(to, (__m128d)x);
    else
        _mm_store_sd(to, (__m128d)x);
#endif
}

LANE_INLINE void lane_gather_some(lane *to, const double *const *from, int first, int count)
{
    lane rows[MSFP_WIDTH];
#pragma GCC unroll 8
    for (int i = 0; i < MSFP_WIDTH; ++i)
        rows[i] = lane_load(from[i] + first, count);
    lane_transpose(rows);
#pragma GCC unroll 8
    for (int i = 0; i < MSFP_WIDTH; ++i)
        if (i < count)
            to[first + i] = rows[i];
}

/* `count` numbers of every run. */
LANE_INLINE void lane_gather(lane *to, const double *const *from, int count)
{
    const int whole = count - count % MSFP_WIDTH;
    for (int first = 0; first < whole; first += MSFP_WIDTH)
        lane_gather_some(to, from, first, MSFP_WIDTH);
    if (whole < count)
        lane_gather_some(to, from, whole, count - whole);
}

LANE_INLINE void lane_scatter_some(double *const *to, const lane *from, int first, int count)
{
    lane rows[MSFP_WIDTH];
#pragma GCC unroll 8
    for (int i = 0; i < MSFP_WIDTH; ++i)
        rows[i] = i < count ? from[first + i] : lane_of(0.0);
    lane_transpose(rows);
#pragma GCC unroll 8
    for (int i = 0; i < MSFP_WIDTH; ++i)
        if (to[i])
            lane_store(to[i] + first, rows[i], count);
}

/* The same back, to the runs that are not NULL. */
LANE_INLINE void lane_scatter(double *const *to, const lane *from, int count)
{
    const int whole = count - count % MSFP_WIDTH;
    for (int first = 0; first < whole; first += MSFP_WIDTH)
        lane_scatter_some(to, from, first, MSFP_WIDTH);
    if (whole < count)
        lane_scatter_some(to, from, whole, count - whole);
}

#endif
