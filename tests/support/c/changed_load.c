/* A load that another program decides: the axial force rises linearly from t = 1 s.
 * Printed once as a history of two pieces, and once with the coefficients of its only piece changed between two calls.
 */
#include <stdio.h>
#include <string.h>
#include "values.h" /* bodies, surfaces, top: those of example.c */

#define LOAD 500e3
#define RISE 400e3 /* [N/s] */

static void run_once(const char *name, int pieces, int change)
{
    static msfp_parameters parameters;
    static msfp_run run;
    const double knots[2] = { 0.0, 2.0 }, load_knots[3] = { 0.0, pieces == 2 ? 1.0 : 2.0, 2.0 }, stops[1] = { 1.0 };
    double moved[6][MSFP_DEGREE + 1] = { { 0.0 } }, force[2][6][MSFP_DEGREE + 1] = { { { 0.0 } } };
    const double zero[MSFP_NB * MSFP_NQ] = { 0.0 };
    msfp_options options;
    memset(&options, 0, sizeof options);
    options.method = MSFP_METHOD_IMPLICIT;
    options.rtol = 1e-5;
    options.atol_angle = 1e-7;
    options.max_steps = 1e6;
    options.duration = 2.0;
    options.output_step = 0.1;
    options.stops = stops;
    options.stop_count = 1;
    moved[0][2] = 0.025;
    force[0][2][0] = force[1][2][0] = -LOAD;
    force[1][2][1] = -RISE;
    const msfp_history motion = { .pieces = 1, .knots = knots, .coefficients = &moved[0][0] };
    const msfp_history load = { .pieces = pieces, .knots = load_knots, .coefficients = &force[0][0][0] };
    msfp_set_parameters(&parameters, 9.8, &bodies[0][0], &surfaces[0][0], top);
    msfp_run_start(&run, &parameters, &motion, &load, NULL, 0, &options, zero, zero, zero);
    while (run.now.t < 1.0 && msfp_run_advance(&run, 1))
        ;
    if (change) {
        force[0][2][0] = -LOAD + RISE; /* - LOAD - RISE (t - 1) in powers of t */
        force[0][2][1] = -RISE;
    }
    while (msfp_run_advance(&run, 1))
        ;
    for (size_t i = 0; i < run.row_count; ++i)
        printf("%s %.17g %.17g %.17g\n", name, run.rows[i].time, run.rows[i].normal[0], run.rows[i].top_force[0]);
    printf("%s status %d\n", name, run.status);
    msfp_run_free(&run);
}

int main(void)
{
    run_once("pieces", 2, 0);
    run_once("changed", 1, 1);
    run_once("constant", 1, 0);
    return 0;
}
