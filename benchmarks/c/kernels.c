/* One evaluation, one tangent and one Newton iteration of a built model, timed at a state read from the standard input:
 * beta; gravity; bodies; surfaces; top; base 3x6; load 6; q, v, a [NB][3] each; Y, Z [NB][2].
 * Prints nanoseconds: value, tangent, Newton iteration (residual, tangent, solve), accelerations. With two arguments, a
 * count and the number of one of these, only makes so many calls of it.
 */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "msfp_model.h"

#define DOF MSFP_DOF
#define NB MSFP_NB
#define BATCHES 15

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void numbers(double *out, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        if (scanf("%lf", out + i) != 1)
            exit(1);
}

static msfp_parameters parameters;
static msfp_point at;
static msfp_stage_weights weights;
static msfp_work work;
static double residual[DOF], tangent[DOF * DOF], sink;

static void start(double f[NB][2]) { memcpy(f, at.f, sizeof at.f); }

static int value(void)
{
    double f[NB][2];
    start(f);
    const int status = msfp_condensed(&parameters, &at, &weights, &work, f, residual, NULL);
    sink += residual[0];
    return status;
}

static int newton(void)
{
    double f[NB][2];
    int pivots[DOF];
    start(f);
    int status = msfp_condensed(&parameters, &at, &weights, &work, f, residual, tangent);
    status += msfp_lu(tangent, DOF, pivots) == 0;
    msfp_lu_solve(tangent, DOF, pivots, residual);
    sink += residual[0];
    return status;
}

static int tangents(void)
{
    double f[NB][2];
    start(f);
    const int status = msfp_condensed(&parameters, &at, &weights, &work, f, residual, tangent);
    sink += tangent[0];
    return status;
}

static int accelerations(void)
{
    msfp_solution solution;
    msfp_point there = at;
    memset(there.a, 0, sizeof there.a);
    const int status = msfp_accelerations(&parameters, &there, &work, &solution);
    sink += there.a[0][1];
    return status;
}

/* A name for what watches instructions; nonzero where a call fails. */
__attribute__((noinline)) int repeated(int (*what)(void), int count)
{
    for (int i = 0; i < count; ++i)
        if (what())
            return 1;
    return 0;
}

static double fastest(int (*what)(void), int count)
{
    double best = 1e30;
    for (int batch = 0; batch < BATCHES; ++batch) {
        const double begin = now();
        if (repeated(what, count))
            return -1.0;
        const double each = (now() - begin) / count;
        best = each < best ? each : best;
    }
    return best;
}

int main(int argc, char **argv)
{
    static double bodies[NB + 1][MSFP_BODY_VALUES_SIZE], surfaces[NB][MSFP_SURFACE_VALUES_SIZE], top[MSFP_TOP_VALUES_SIZE], head[2], state[3][NB][3];
    const int count = argc > 1 ? atoi(argv[1]) : 4000;
    numbers(head, 2);
    numbers(&bodies[0][0], sizeof bodies / sizeof(double));
    numbers(&surfaces[0][0], sizeof surfaces / sizeof(double));
    numbers(top, MSFP_TOP_VALUES_SIZE);
    msfp_set_parameters(&parameters, head[1], &bodies[0][0], &surfaces[0][0], top);
    numbers(&at.base[0][0], 18);
    numbers(at.load, 6);
    numbers(&state[0][0][0], sizeof state / sizeof(double));
    numbers(&at.f[0][0], 2 * NB);
    for (int k = 0; k < NB; ++k) {
        memcpy(at.q[k], state[0][k], sizeof state[0][k]);
        memcpy(at.v[k], state[1][k], sizeof state[1][k]);
        memcpy(at.a[k], state[2][k], sizeof state[2][k]);
    }
    weights.q_weight = weights.beta = head[0];
    weights.v_weight = 1.0;
    weights.a_weight = 1.0 / head[0];
    weights.accuracy = 1e-8;
    memcpy(weights.fp, at.f, sizeof weights.fp);
    int (*const all[])(void) = { value, tangents, newton, accelerations };
    if (argc > 2)
        return repeated(all[atoi(argv[2])], count);
    printf("%.1f %.1f %.1f %.1f\n", fastest(value, count), fastest(tangents, count), fastest(newton, count), fastest(accelerations, count));
    return sink == 12345.678;
}
