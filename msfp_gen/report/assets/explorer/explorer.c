/* One run of a model for a page: everything that a run takes comes in one array, see `packed` in report/explore.py. */
#include <stdlib.h>
#include <string.h>
#include "msfp_model.h"

#define EXPORTED(name) __attribute__((export_name(#name)))

static msfp_parameters parameters;
static msfp_run run;

EXPORTED(reserve) double *reserve(int count)
{
    static double *block = NULL;
    double *larger = realloc(block, (size_t)count * sizeof(double));
    if (larger)
        block = larger;
    return larger;
}

static const double *take(const double **at, int count)
{
    const double *found = *at;
    *at += count;
    return found;
}

/* Begin a run; `advance` then takes its steps. */
EXPORTED(begin) void begin(const double *input)
{
    const double *at = input;
    const double *number = take(&at, 12);
    const double *count = take(&at, 5);
    const int pieces = (int)count[0], loads = (int)count[1], jumps = (int)count[2], stops = (int)count[3];
    const double *bodies = take(&at, (MSFP_NB + 1) * MSFP_BODY_VALUES_SIZE);
    const double *surfaces = take(&at, MSFP_NB * MSFP_SURFACE_VALUES_SIZE);
    const double *top = take(&at, MSFP_TOP_VALUES_SIZE);
    const double *q = take(&at, MSFP_NB * MSFP_NQ), *v = take(&at, MSFP_NB * MSFP_NQ), *f = take(&at, MSFP_NB * 2);
    msfp_history motion, load;
    msfp_options options;
    memset(&motion, 0, sizeof motion);
    memset(&load, 0, sizeof load);
    memset(&options, 0, sizeof options);
    motion.pieces = pieces;
    motion.knots = take(&at, pieces + 1);
    motion.coefficients = take(&at, pieces * 6 * (MSFP_DEGREE + 1));
    load.pieces = loads;
    load.knots = take(&at, loads + 1);
    load.coefficients = take(&at, loads * 6 * (MSFP_DEGREE + 1));
    const double *jump = take(&at, jumps);
    options.stop_count = stops;
    options.stops = take(&at, stops);
    options.span_count = (int)count[4];
    options.span_ends = take(&at, options.span_count);
    options.span_steps = take(&at, options.span_count);
    options.method = (int)number[1];
    options.rtol = number[2];
    options.atol_angle = number[3];
    options.first_step = number[4];
    options.max_steps = number[5];
    options.duration = number[6];
    options.output_step = number[7];
    options.stop_displacement = number[8];
    options.stop_all_rims = (int)number[9];
    options.sampled = (int)number[10];
    options.quasistatic = (int)number[11];
    msfp_set_parameters(&parameters, number[0], bodies, surfaces, top);
    msfp_run_free(&run);
    memset(&run, 0, sizeof run);
    msfp_run_start(&run, &parameters, &motion, &load, NULL, jump, jumps, &options, q, v, f);
}

/* Take so many steps at most. Returns whether the run goes on. */
EXPORTED(advance) int advance(int steps)
{
    return msfp_run_advance(&run, steps);
}

/* The status, an index into the names of the page. */
EXPORTED(status) int status(void)
{
    return run.status;
}

EXPORTED(rows) const double *rows(void)
{
    return (const double *)run.rows;
}

EXPORTED(row_count) int row_count(void)
{
    return (int)run.row_count;
}

EXPORTED(extremes) const double *extremes(void)
{
    return (const double *)&run.extremes;
}

EXPORTED(reached) double reached(void)
{
    return run.now.t;
}

EXPORTED(start) const double *start(void)
{
    return run.start;
}
