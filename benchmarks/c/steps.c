/* CPU time of a step [ns] of the example of an exported library, the best of many runs: rows kept; handed to a callback;
 * one step a call. values.h: the bearings of example.c. See embedding.py.
 */
#include <stdio.h>
#include <time.h>
#include "values.h"

#define ROUNDS 200

static int count_rows(void *user, const double *rows, size_t count)
{
    (void)rows;
    *(size_t *)user += count;
    return 0;
}

static double run_once(const msfp_api *api, const msfp_scene *scene, long steps, int callback)
{
    int64_t counts[MSFP_COUNTS];
    size_t rows = 0;
    msfp_run *run;
    const clock_t begin = clock();
    if (api->run_new(scene, &run, NULL))
        return -1.0;
    if (callback)
        api->run_on_rows(run, count_rows, &rows);
    while (api->run_advance(run, steps))
        ;
    const double time = 1e9 * (double)(clock() - begin) / CLOCKS_PER_SEC;
    api->run_counts(run, counts);
    api->run_free(run);
    return time / (double)counts[MSFP_COUNT_STEPS];
}

static double best(const msfp_api *api, const msfp_scene *scene, long steps, int callback)
{
    double least = 1e300;
    for (int i = 0; i < ROUNDS; ++i) {
        const double time = run_once(api, scene, steps, callback);
        least = time < least ? time : least;
    }
    return least;
}

int main(void)
{
    const msfp_api *api = msfp_5_2_2();
    const double knots[2] = { 0.0, 2.0 };
    double motion[6][MSFP_DEGREE + 1] = { { 0.0 } }, load[6][MSFP_DEGREE + 1] = { { 0.0 } };
    msfp_bearing *bearing;
    msfp_scene scene;
    motion[0][2] = 0.025;
    load[2][0] = -500e3;
    if (api->bearing_new(9.8, &bodies_of_msfp_5_2_2[0][0], &surfaces_of_msfp_5_2_2[0][0], top_of_msfp_5_2_2, &bearing, NULL))
        return 1;
    api->scene_default(&scene);
    scene.bearing = bearing;
    scene.motion = (msfp_piecewise){ 1, knots, &motion[0][0] };
    scene.load = (msfp_piecewise){ 1, knots, &load[0][0] };
    scene.end_time = 2.0;
    printf("%g %g %g\n", best(api, &scene, 1000, 0), best(api, &scene, 1000, 1), best(api, &scene, 1, 0));
    api->bearing_free(bearing);
    return 0;
}
