/* A load that another program decides: the axial force rises linearly from t = 1 s.
 * Printed once as a history of two pieces, and once with the coefficients of its only piece changed between two calls.
 */
#include <stdio.h>
#include "values.h" /* header of the model; bodies, surfaces, top: those of example.c */

#define LOAD 500e3
#define RISE 400e3 /* [N/s] */

static double now(const msfp_api *api, const msfp_run *run)
{
    msfp_progress progress;
    api->run_progress(run, &progress);
    return progress.time;
}

static void run_once(const char *name, int pieces, int change)
{
    const msfp_api *api = msfp_5_2_2();
    const double knots[2] = { 0.0, 2.0 }, load_knots[3] = { 0.0, pieces == 2 ? 1.0 : 2.0, 2.0 }, stops[1] = { 1.0 };
    double moved[6][MSFP_DEGREE + 1] = { { 0.0 } }, force[2][6][MSFP_DEGREE + 1] = { { { 0.0 } } };
    msfp_bearing *bearing;
    msfp_run *run;
    msfp_scene scene;
    msfp_progress progress;
    size_t count;
    moved[0][2] = 0.025;
    force[0][2][0] = force[1][2][0] = -LOAD;
    force[1][2][1] = -RISE;
    if (api->bearing_new(9.8, &bodies_of_msfp_5_2_2[0][0], &surfaces_of_msfp_5_2_2[0][0], top_of_msfp_5_2_2, &bearing,
                         NULL))
        return;
    api->scene_default(&scene);
    scene.bearing = bearing;
    scene.motion = (msfp_piecewise){ 1, knots, &moved[0][0] };
    scene.load = (msfp_piecewise){ pieces, load_knots, &force[0][0][0] };
    scene.rtol = 1e-5;
    scene.atol_angle = 1e-7;
    scene.end_time = 2.0;
    scene.output_step = 0.1;
    scene.stops = stops;
    scene.stop_count = 1;
    if (api->run_new(&scene, &run, NULL))
        return;
    while (now(api, run) < 1.0 && api->run_advance(run, 1))
        ;
    if (change) {
        force[0][2][0] = -LOAD + RISE; /* - LOAD - RISE (t - 1) in powers of t */
        force[0][2][1] = -RISE;
    }
    while (api->run_advance(run, 1))
        ;
    const msfp_5_2_2_row *rows = (const msfp_5_2_2_row *)api->run_rows(run, &count);
    for (size_t i = 0; i < count; ++i)
        printf("%s %.17g %.17g %.17g\n", name, rows[i].time, rows[i].normal[0], rows[i].top_force[0]);
    api->run_progress(run, &progress);
    printf("%s status %d\n", name, progress.status);
    api->run_free(run);
    api->bearing_free(bearing);
}

int main(void)
{
    run_once("pieces", 2, 0);
    run_once("changed", 1, 1);
    run_once("constant", 1, 0);
    return 0;
}
