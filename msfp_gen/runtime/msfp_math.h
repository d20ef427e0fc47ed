/* msfp_math.h: elementary functions of the runtime and the kernels.
 *
 * The functions of C libraries differ in the last digit from system to system. These consist of additions, products,
 * quotients and square roots alone, which every processor rounds alike, so that the same inputs give the same numbers on
 * every system and in a browser. Errors in units of the last digit: one for exp, log, asin up to 1/2, sin and cos up to pi/4;
 * four for all others, but for pow 1 + 2 |y log x|. The polynomials are printed by tools/polynomials.py.
 */
#ifndef MSFP_MATH_H
#define MSFP_MATH_H
#include <math.h>
#include <stdint.h>
#include <string.h>

/* A kernel, and a sum over columns, is always inlined, so that it is compiled for the vectors of its caller. */
#if defined(__GNUC__)
#define MSFP_INLINED __attribute__((always_inline))
#else
#define MSFP_INLINED
#endif
#define MSFP_INLINE MSFP_INLINED static inline

#define MSFP_HALF_PI 1.5707963267948966

/* ---- polynomials: what remains after the first terms ---- */

static inline double msfp_sin_rest(double z) /* sin x = x + x z P(z), z = x^2, |x| <= pi/4 */
{
    const double w = z * z;
    return -0.16666666666666666 + w * (-0.00019841269841265065 + w * (-2.5052106232447578e-08 + w *
               (-7.586697117706918e-13))) + z * (0.008333333333333331 + w * (2.7557319219339167e-06 + w *
               (1.6058531618986147e-10)));
}

static inline double msfp_cos_rest(double z) /* cos x = 1 - z/2 + z^2 P(z), z = x^2, |x| <= pi/4 */
{
    const double w = z * z;
    return 0.041666666666666664 + w * (2.480158729876569e-05 + w * (2.08761462684032e-09)) + z *
               (-0.0013888888888887398 + w * (-2.7557317271729793e-07 + w * (-1.1382632425521717e-11)));
}

static inline double msfp_asin_rest(double z) /* asin x = x + x z P(z), z = x^2, |x| <= 1/2 */
{
    const double w = z * z;
    return 0.16666666666666669 + w * (0.04464285714635543 + w * (0.02237217294214989 + w * (0.013971212973552933 + w
               * (0.01032281435018578 + w * (0.01740087944269402 + w * (0.028757851367421566)))))) + z *
               (0.07499999999998433 + w * (0.030381944138531247 + w * (0.017352392720869973 + w *
               (0.011479177415184906 + w * (0.005457506718640358 + w * (-0.014851887071247204))))));
}

static inline double msfp_exp_rest(double z) /* exp z = 1 + z + z^2 P(z), |z| <= log(2)/2 */
{
    const double w = z * z;
    return 0.5 + w * (0.04166666666666667 + w * (0.0013888888888883752 + w * (2.4801587325533363e-05 + w *
               (2.7557273661348637e-07 + w * (2.0914679376583935e-09))))) + z * (0.1666666666666667 + w *
               (0.008333333333326141 + w * (0.00019841269874800493 + w * (2.7557255425746435e-06 + w *
               (2.510520637395701e-08)))));
}

static inline double msfp_log_rest(double z) /* atanh s = s + s z P(z), z = s^2, |s| <= 0.172 */
{
    const double w = z * z;
    return 0.3333333333333335 + w * (0.14285714312987743 + w * (0.09091444562630861 + w * (0.07308224842521703))) +
               z * (0.19999999999949752 + w * (0.1111110556739754 + w * (0.07665860800278021)));
}

/* ---- sine and cosine ---- */

/* The nearest whole number of a small one, and 2^n of a whole one from -1022 to 1023. */
static inline double msfp_nearest(double x)
{
    const double large = 6755399441055744.0; /* 1.5 2^52: its last digit is one */
    return (x + large) - large;
}

static inline double msfp_power_of_two(double n)
{
    const int64_t bits = ((int64_t)n + 1023) * ((int64_t)1 << 52);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* sin(x + quarter pi/2), |x| <= pi/4. */
static inline double msfp_sine_of(double x, double quarter)
{
    const double z = x * x, half = 0.5 * z, left = 1.0 - half;
    const double sine = x + x * (z * msfp_sin_rest(z));
    const double cosine = left + (((1.0 - left) - half) + z * z * msfp_cos_rest(z));
    const double fold = quarter - 4.0 * floor(0.25 * quarter); /* 0, 1, 2 or 3 */
    const double value = fold == 1.0 || fold == 3.0 ? cosine : sine;
    return fold >= 2.0 ? -value : value;
}

/* sin(x + shift pi/2). Beyond 1e5 rad, which no bearing turns, the function of the C library serves. */
static inline double msfp_sine_shifted(double x, double shift)
{
    if (fabs(x) <= 0.7853981633974483)
        return msfp_sine_of(x, shift);
    if (!(fabs(x) < 1e5))
        return shift > 0.0 ? cos(x) : sin(x);
    const double n = msfp_nearest(x * 0.6366197723675814); /* 2/pi */
    /* pi/2 in three parts, of which the first two have few digits, so that their products with n are exact. */
    return msfp_sine_of(((x - n * 1.5707963267341256) - n * 6.077100506303966e-11) - n * 2.0222662487959506e-21, n + shift);
}

static inline double msfp_sin(double x) { return msfp_sine_shifted(x, 0.0); }
static inline double msfp_cos(double x) { return msfp_sine_shifted(x, 1.0); }

/* ---- their inverses ---- */

static inline double msfp_asin(double x)
{
    const double size = fabs(x);
    if (size <= 0.5)
        return x + x * (x * x * msfp_asin_rest(x * x));
    const double z = 0.5 * (1.0 - size), s = sqrt(z); /* NaN beyond 1 */
    return copysign(MSFP_HALF_PI - 2.0 * (s + s * (z * msfp_asin_rest(z))), x);
}

/* Without overflow on the way; infinite where an argument is. */
static inline double msfp_hypot(double x, double y)
{
    const double a = fabs(x), b = fabs(y), most = a > b ? a : b, least = a > b ? b : a;
    if (most == 0.0 || isinf(a) || isinf(b))
        return most;
    const double ratio = least / most;
    return most * sqrt(1.0 + ratio * ratio);
}

/* Of finite arguments. */
static inline double msfp_atan2(double y, double x)
{
    const double radius = msfp_hypot(x, y);
    if (radius == 0.0)
        return atan2(y, x); /* by the signs of the zeros */
    if (fabs(y) > fabs(x))
        return copysign(MSFP_HALF_PI, y) - copysign(1.0, y) * msfp_asin(x / radius);
    const double angle = msfp_asin(fabs(y) / radius);
    return copysign(x > 0.0 ? angle : 2.0 * MSFP_HALF_PI - angle, y);
}

/* Stumpff function c_n(s), the sum over k of (-s)^k/(2k + n)!, s < 10, n > 0: in nested form, from the last term that
 * counts. */
static inline double msfp_stumpff(int n, double s)
{
    double sum = 1.0, factorial = 1.0;
    for (int k = s < 0.1 ? 8 : 20; k > 0; --k)
        sum = 1.0 - s * sum / ((2 * k + n) * (2 * k + n - 1));
    for (int k = 2; k <= n; ++k)
        factorial *= k;
    return sum / factorial;
}

/* ---- exponential, logarithm and what follows from them ---- */

/* 0 below exp(-708), the least number that is not subnormal. */
static inline double msfp_exp(double x)
{
    if (!(x >= -708.0)) /* NaN too */
        return x < 0.0 ? 0.0 : x;
    if (x > 709.0)
        return HUGE_VAL;
    const double n = msfp_nearest(x * 1.4426950408889634); /* 1/log(2) */
    const double r = (x - n * 0.6931471803691238) - n * 1.9082149292705877e-10; /* log(2) in two parts, as pi/2 above */
    return (1.0 + (r + r * r * msfp_exp_rest(r))) * msfp_power_of_two(n);
}

static inline double msfp_log(double x)
{
    int exponent;
    if (!(x > 0.0) || isinf(x))
        return log(x);
    double m = frexp(x, &exponent);
    if (m < 0.7071067811865476) {
        m *= 2.0;
        --exponent;
    }
    const double f = m - 1.0, s = f / (2.0 + f), z = s * s;
    /* log m = 2 atanh(s) = f - s (f - 2 z P(z)), where f is exact. */
    return exponent * 0.6931471803691238 + (f - (s * (f - 2.0 * z * msfp_log_rest(z)) - exponent * 1.9082149292705877e-10));
}

static inline double msfp_pow(double x, double y)
{
    if (y == 0.0)
        return 1.0;
    if (!(x < 0.0)) /* NaN too */
        return msfp_exp(y * msfp_log(x));
    if (y != floor(y))
        return NAN;
    const double size = msfp_exp(y * msfp_log(-x));
    return y - 2.0 * floor(0.5 * y) == 1.0 ? -size : size;
}

static inline double msfp_tanh(double x)
{
    const double size = fabs(x);
    if (size < 0.25) { /* continued fraction */
        const double z = x * x;
        return x / (1.0 + z / (3.0 + z / (5.0 + z / (7.0 + z / (9.0 + z / (11.0 + z / 13.0))))));
    }
    const double e = msfp_exp(-2.0 * size);
    return copysign((1.0 - e) / (1.0 + e), x);
}

#endif
