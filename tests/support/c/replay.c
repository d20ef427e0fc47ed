/* A run from numbers on standard input, through the public interface alone: for sanitizers, valgrind, and comparison
 * with Python bit by bit.
 *
 * Reads what tests/support/replay.py writes: gravity; bodies; surfaces; top; motion, load (count of pieces, knots,
 * coefficients); jumps; q, v, f; options. Everything variable is on the heap, so that no slip goes unseen. Halfway the
 * run is taken over by another, as from a checkpoint. Prints the last row, or with an argument all of them as a callback
 * receives them, and with a second one the callback ends every call; then steps, then the status. MODEL is the function that returns the table.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "msfp.h"

const msfp_api *MODEL(void);

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

static msfp_piecewise history(void)
{
    msfp_piecewise h;
    h.pieces = count();
    h.knots = numbers(h.pieces + 1);
    h.coefficients = numbers((size_t)h.pieces * 6 * (MSFP_DEGREE + 1));
    return h;
}

static void read_options(msfp_scene *s)
{
    double *x = numbers(7);
    s->method = (int)x[0];
    s->rtol = x[1];
    s->atol_angle = x[2];
    s->max_steps = x[3];
    s->end_time = x[4];
    s->output_step = x[5];
    s->sampled = (int)x[6];
    free(x);
    s->stop_count = count();
    s->stops = numbers(s->stop_count);
    s->span_count = count();
    s->span_ends = numbers(s->span_count);
    s->span_steps = numbers(s->span_count);
}

/* What a checkpoint does: a snapshot of one run, read by another of the same scene. */
static void take_over(const msfp_api *api, msfp_run *run, msfp_run *from)
{
    const size_t size = api->snapshot_size(from, -1);
    char *snapshot = malloc(size);
    msfp_run *opened;
    if (!snapshot)
        exit(3);
    api->snapshot_write(from, -1, snapshot);
    if (api->snapshot_read(run, snapshot, size) || api->snapshot_open(snapshot, size, &opened))
        exit(5);
    if (api->run_advance(opened, 1)) /* it is for reading alone */
        exit(6);
    api->run_free(opened);
    free(snapshot);
}

static int print_rows(void *user, const double *rows, size_t row_count)
{
    const int size = ((const msfp_api *)user)->row_size;
    for (size_t i = 0; i < row_count * size; ++i)
        printf("%.17g%c", rows[i], (i + 1) % size ? ' ' : '\n');
    return 0;
}

/* The same, and run_advance is to return. */
static int print_and_end(void *user, const double *rows, size_t row_count)
{
    print_rows(user, rows, row_count);
    return 1;
}

int main(int argc, char **argv)
{
    const msfp_api *api = MODEL();
    double *gravity = numbers(1), *bodies = numbers(api->n * api->body_size);
    double *surfaces = numbers(api->surfaces * api->surface_size), *top = numbers(api->top_size);
    msfp_scene scene;
    msfp_bearing *bearing;
    msfp_run *first, *run;
    msfp_progress progress;
    int64_t counts[MSFP_COUNTS];
    size_t row_count;
    (void)argv;
    if (api->bearing_new(*gravity, bodies, surfaces, top, &bearing, NULL))
        exit(3);
    api->scene_default(&scene);
    scene.bearing = bearing;
    scene.motion = history();
    scene.load = history();
    scene.jump_count = count();
    double *jumps = numbers(scene.jump_count);
    scene.jumps = jumps;
    double *q = numbers(api->surfaces * api->coordinates), *v = numbers(api->surfaces * api->coordinates);
    double *f = numbers(api->surfaces * 2);
    scene.q = q, scene.v = v, scene.f = f;
    read_options(&scene);
    if (api->run_new(&scene, &first, NULL) || api->run_new(&scene, &run, NULL))
        exit(3);
    api->bearing_free(bearing); /* a run does not need it */
    free(q), free(v), free(f);
    api->run_advance(first, 20);
    api->run_progress(first, &progress);
    if (progress.status == MSFP_OK)
        take_over(api, run, first);
    if (argc > 1)
        api->run_on_rows(run, argc > 2 ? print_and_end : print_rows, (void *)api);
    while (api->run_advance(run, 1000))
        ;
    const double *rows = api->run_rows(run, &row_count);
    if (argc == 1)
        print_rows((void *)api, rows + (row_count - 1) * api->row_size, 1);
    api->run_counts(run, counts);
    api->run_progress(run, &progress);
    printf("%ld\n%s\n", (long)counts[MSFP_COUNT_STEPS], api->status_name(progress.status));
    api->run_free(first);
    api->run_free(run);
    free(gravity), free(bodies), free(surfaces), free(top), free(jumps);
    free((void *)scene.stops), free((void *)scene.span_ends), free((void *)scene.span_steps);
    free((void *)scene.motion.knots), free((void *)scene.motion.coefficients);
    free((void *)scene.load.knots), free((void *)scene.load.coefficients);
    return 0;
}
