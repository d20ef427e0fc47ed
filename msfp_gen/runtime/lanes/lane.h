/* lane.h: numbers of several runs side by side, and the functions that equations take of them.
 *
 * A `lane` is one vector register of the processor that the file is compiled for: MSFP_WIDTH runs. Sums, products,
 * quotients and square roots are those of IEEE 754, as for one run; sine and cosine are polynomials, within 2 units in
 * the last place up to 10 rad and 3 beyond (tests/test_batch.py), or the library's own where MSFP_EXACT is defined.
 */
#ifndef MSFP_LANE_H
#define MSFP_LANE_H
#include <immintrin.h>
#include <math.h>
#include <string.h>

#define LANES_ALL for (int lane_index = 0; lane_index < MSFP_WIDTH; ++lane_index)
#define LANE_BITS ((1u << MSFP_WIDTH) - 1)
typedef double lane __attribute__((vector_size(8 * MSFP_WIDTH), aligned(8 * MSFP_WIDTH)));
typedef long long lane_mask __attribute__((vector_size(8 * MSFP_WIDTH), aligned(8 * MSFP_WIDTH)));
#define LANE_INLINE __attribute__((always_inline)) static inline

/* A statement may be a number without any lane in it: less a vector of zeros it is one, and nothing else changes. */
#define LANE(name, value) const lane name __attribute__((unused)) = (value) - (lane){ 0 }
#define PUT(place, value) place = (value) - (lane){ 0 }

LANE_INLINE lane lane_of(double x) { return x - (lane){ 0 }; }

LANE_INLINE lane lane_choose(lane_mask where, lane yes, lane no)
{
    return (lane)((where & (lane_mask)yes) | (~where & (lane_mask)no));
}

LANE_INLINE lane lane_sqrt(lane x)
{
#if MSFP_WIDTH == 8
    return (lane)_mm512_sqrt_pd((__m512d)x);
#elif MSFP_WIDTH == 4
    return (lane)_mm256_sqrt_pd((__m256d)x);
#else
    return (lane)_mm_sqrt_pd((__m128d)x);
#endif
}

LANE_INLINE lane lane_abs(lane x) { return (lane)((lane_mask)x & ~(lane_mask)lane_of(-0.0)); }

/* The larger one; the first where the second is no number. */
LANE_INLINE lane lane_max(lane x, lane y) { return lane_choose(y > x, y, x); }
LANE_INLINE lane lane_min(lane x, lane y) { return lane_choose(y < x, y, x); }

/* Powers that are no products are rare: run by run. */
LANE_INLINE lane lane_pow(lane x, double exponent)
{
    LANES_ALL x[lane_index] = pow(x[lane_index], exponent);
    return x;
}

LANE_INLINE lane lane_step(lane x) { return lane_choose(x > 0.0, lane_of(1.0), lane_of(0.0)); }

/* A bit for every lane. */
LANE_INLINE unsigned lane_bits(lane_mask where)
{
#if MSFP_WIDTH == 8
    return _mm512_movepi64_mask((__m512i)where);
#elif MSFP_WIDTH == 4
    return (unsigned)_mm256_movemask_pd((__m256d)where);
#else
    return (unsigned)_mm_movemask_pd((__m128d)where);
#endif
}

#ifdef MSFP_EXACT
#define lane_each(function) LANE_INLINE lane lane_##function(lane x) { lane y = x; LANES_ALL y[lane_index] = function(x[lane_index]); return y; }
lane_each(sin)
lane_each(cos)
#else

#define REACH 1e5 /* [rad]: beyond, the multiple of pi/2 is no longer exact; no bearing turns so far */

/* x less the nearest multiple of pi/2, and in the last bits of `turns` which one. Three parts of pi/2, the first two short
 * enough for their products with it to be exact. */
LANE_INLINE lane lane_reduced(lane x, lane_mask *turns)
{
    const double magic = 6755399441055744.0; /* 1.5 * 2^52: adding it leaves an integer in the last bits */
    const lane shifted = x * 0.63661977236758134308 + magic, n = shifted - magic;
    *turns = (lane_mask)shifted;
    return ((x - n * 0x1.921fb544p0) - n * 0x1.0b4611a6p-34) - n * 0x1.3198a2e037073p-69;
}

/* Taylor's series on |x| <= pi/4: what is left out is below 1e-19. */
LANE_INLINE lane lane_sine(lane x, lane z)
{
    const lane high = -1.0 / 39916800 + z * (1.0 / 6227020800.0 + z * (-1.0 / 1307674368000.0 + z * (1.0 / 355687428096000.0)));
    return x + x * z * (-1.0 / 6 + z * (1.0 / 120 + z * (-1.0 / 5040 + z * (1.0 / 362880 + z * high))));
}

LANE_INLINE lane lane_cosine(lane z)
{
    const lane high = -1.0 / 3628800 + z * (1.0 / 479001600 + z * (-1.0 / 87178291200.0 + z * (1.0 / 20922789888000.0)));
    return 1.0 - (0.5 * z - z * z * (1.0 / 24 + z * (-1.0 / 720 + z * (1.0 / 40320 + z * high))));
}

/* sin(x + quarters pi/2); no number beyond REACH. */
LANE_INLINE lane lane_turned(lane x, int quarters)
{
    lane_mask turns;
    const lane r = lane_reduced(x, &turns), z = r * r;
    turns += quarters;
    const lane value = lane_choose((turns & 1) == 0, lane_sine(r, z), lane_cosine(z));
    const lane signed_value = (lane)((lane_mask)value ^ ((turns & 2) << 62));
    return lane_choose(lane_abs(x) <= REACH, signed_value, lane_of(NAN));
}

LANE_INLINE lane lane_sin(lane x) { return lane_turned(x, 0); }
LANE_INLINE lane lane_cos(lane x) { return lane_turned(x, 1); }
#endif

#endif
