/* A run from numbers on standard input, for compilers and tools that look for slips: sanitizers, valgrind.
 *
 * Reads what tests/unit/runtime/test_sanitizers.py writes: gravity; bodies; surfaces; top; motion, load (count of pieces, knots,
 * coefficients); jumps; q, v, f; options. Everything variable is on the heap, so that no slip goes unseen. Halfway the
 * run is taken over by another, as from a checkpoint. Prints the last row, then steps, then the status.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "msfp_model.h"

static double *numbers(size_t count)
{
    double *values = malloc((count ? count : 1) * sizeof *values);
    if (!values)
        exit(3);
    for (size_t i = 0; i < count; ++i)
        if (scanf("%lf", values + i) != 1)
            exit(4);
    return values;
}

static int count(void)
{
    int value;
    if (scanf("%d", &value) != 1)
        exit(4);
    return value;
}

static msfp_history history(void)
{
    msfp_history h = { .last = 7, .held = 1, .degree = 1 << 20 }; /* as a caller may leave it: a run begins anew */
    h.pieces = count();
    h.knots = numbers(h.pieces + 1);
    h.coefficients = numbers((size_t)h.pieces * 6 * (MSFP_DEGREE + 1));
    return h;
}

static msfp_options options(void)
{
    double *x = numbers(7);
    msfp_options o;
    memset(&o, 0, sizeof o);
    o.method = (int)x[0];
    o.rtol = x[1];
    o.atol_angle = x[2];
    o.max_steps = x[3];
    o.duration = x[4];
    o.output_step = x[5];
    o.sampled = (int)x[6];
    free(x);
    o.stop_count = count();
    o.stops = numbers(o.stop_count);
    o.span_count = count();
    o.span_ends = numbers(o.span_count);
    o.span_steps = numbers(o.span_count);
    return o;
}

/* What a checkpoint does: a snapshot of one run, read by another of the same scene. */
static void take_over(msfp_run *run, msfp_run *from)
{
    const size_t size = msfp_snapshot_size(from, -1);
    char *snapshot = malloc(size);
    if (!snapshot)
        exit(3);
    msfp_snapshot_write(from, -1, snapshot);
    if (msfp_snapshot_read(run, snapshot, size))
        exit(5);
    free(snapshot);
}

int main(void)
{
    double *gravity = numbers(1), *bodies = numbers((MSFP_NB + 1) * MSFP_BODY_VALUES);
    double *surfaces = numbers(MSFP_NB * MSFP_SURFACE_VALUES), *top = numbers(MSFP_TOP_VALUES);
    msfp_history motion = history(), load = history();
    const int jump_count = count();
    double *jumps = numbers(jump_count);
    double *q = numbers(MSFP_NB * MSFP_NQ), *v = numbers(MSFP_NB * MSFP_NQ), *f = numbers(MSFP_NB * 2);
    const msfp_options how = options();
    msfp_parameters *p = malloc(sizeof *p);
    msfp_run *first = malloc(sizeof *first), *run = malloc(sizeof *run);
    if (!p || !first || !run)
        exit(3);
    msfp_set_parameters(p, *gravity, bodies, surfaces, top);
    msfp_run_start(first, p, &motion, &load, jumps, jump_count, &how, q, v, f);
    msfp_run_start(run, p, &motion, &load, jumps, jump_count, &how, q, v, f);
    msfp_run_advance(first, 20);
    if (first->status == MSFP_OK)
        take_over(run, first);
    while (msfp_run_advance(run, 1000))
        ;
    const double *row = (const double *)&run->rows[run->row_count - 1];
    for (size_t i = 0; i < MSFP_ROW_SIZE; ++i)
        printf("%.17g ", row[i]);
    printf("\n%ld\n%s\n", run->counts[MSFP_COUNT_STEPS], msfp_status_name(run->status));
    msfp_run_free(first);
    msfp_run_free(run);
    free(first), free(run), free(p), free(gravity), free(bodies), free(surfaces), free(top), free(jumps);
    free((void *)how.stops), free((void *)how.span_ends), free((void *)how.span_steps);
    free(q), free(v), free(f), free((void *)motion.knots), free((void *)motion.coefficients);
    free((void *)load.knots), free((void *)load.coefficients);
    return 0;
}
