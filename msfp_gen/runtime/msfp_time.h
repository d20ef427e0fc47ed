/* msfp_time.h: time in the runs of a bearing and of a building: pieces of histories, stages, ends and lengths of steps.
 * It stands after msfp_math.h. */
#ifndef MSFP_TIME_H
#define MSFP_TIME_H
#include <math.h>
#include <stddef.h>

#define MSFP_CLOSE 1e-9             /* [s], far below any period of a bearing; closer times count as equal */
#define MSFP_SHORTEST_TO_EVENT 1e-6 /* [s]; a shorter step to an event would be lost in roundoff */
enum { MSFP_RELOCATIONS = 4 };      /* of the end of a step to an event */

/* The shortest step at time t, and the difference below which two times are the same [s]. */
static inline double msfp_smallest_step(double t) { return MSFP_CLOSE * fmax(1.0, t); }

/* sum += weight * rates, of `count` numbers. */
MSFP_INLINE void msfp_add(double *restrict sum, const double *restrict rates, double weight, int count)
{
    for (int i = 0; i < count; ++i)
        sum[i] += weight * rates[i];
}

/* sum += h times the weighted rates of the first `count` stages, of `numbers` each; size: numbers from one stage to the
 * next. */
MSFP_INLINE void msfp_sum_stages(double *sum, const double *rates, size_t size, const double *weights, int count, double h,
                                 int numbers)
{
    for (int j = 0; j < count; ++j)
        msfp_add(sum, rates + j * size, h * weights[j], numbers);
}

/* First guess of a rate at stage i, from an acceleration that goes on linearly, as one of the base that is linear in time
 * causes. c: shares of the stages; V: what the earlier stages give; first, last: accelerations at the start and at the
 * stage before; slope: change of the acceleration per step before. */
MSFP_INLINE double msfp_guess_rate(const double *c, int i, double V, double beta, double first, double last, double slope)
{
    const double change = i > 1 ? (last - first) / c[i - 1] : slope;
    return V + beta * (first + c[i] * change);
}

/* The stage formula: q = q0 + beta v, a = rate (v - v0) with rate = 1/beta, or 0 without inertia. Of `count` numbers. */
MSFP_INLINE void msfp_stage_formula(const double *restrict q0, const double *restrict v0, double beta, double rate,
                                    const double *restrict v, int count, double *restrict q, double *restrict a)
{
    for (int i = 0; i < count; ++i) {
        q[i] = q0[i] + beta * v[i];
        a[i] = rate * (v[i] - v0[i]);
    }
}

/* The piece that holds t, searched from the piece `last`. */
static inline int msfp_piece_at(const double *knots, int pieces, int last, double t)
{
    while (last + 1 < pieces && t >= knots[last + 1])
        ++last;
    while (last > 0 && t < knots[last])
        --last;
    return last;
}

/* The first time of rising `stops` after t, from the place *at [s]; infinite if there is none. */
static inline double msfp_next_stop(const double *stops, int count, int *at, double t)
{
    while (*at < count && stops[*at] <= t + msfp_smallest_step(t))
        ++*at;
    return *at < count ? stops[*at] : INFINITY;
}

/* The step h at time t, shortened to what the prescribed histories allow: each interval of time, to ends[i], has a longest
 * step, and a step may enter an interval only if it is no longer than the longest step of that interval. *at: interval
 * where the search begins. */
static inline double msfp_allowed_step(const double *ends, const double *steps, int count, int *at, double t, double h)
{
    while (*at + 1 < count && ends[*at] <= t + msfp_smallest_step(t))
        ++*at;
    if (count)
        h = fmin(h, steps[*at]);
    for (int i = *at; i + 1 < count && t + h > ends[i]; ++i)
        h = fmin(h, fmax(ends[i] - t, steps[i + 1]));
    return h;
}

/* Factor of the length after an accepted step, of errors over the tolerance: its own, and that of the step before. */
static inline double msfp_step_factor(double error, double last, double order)
{
    error = fmax(error, 1e-6);
    last = fmax(last, 1e-6);
    return fmin(5.0, fmax(0.2, 0.9 * msfp_pow(error, -0.7 / order) * msfp_pow(last, 0.4 / order)));
}

/* The same after a step that was rejected for its error. */
static inline double msfp_shrink_factor(double error, double order)
{
    return fmax(0.1, 0.9 * msfp_pow(error, -1.0 / order));
}

/* The length with which a step ends at its first event, which lies at a share of h. */
static inline double msfp_step_to_event(double h, double share)
{
    return fmin(0.99 * h, fmax(h * share, MSFP_SHORTEST_TO_EVENT));
}

#endif
