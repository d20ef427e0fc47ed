/* Runs of two models and of one bearing in several threads at once: bit by bit those of one thread. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "values.h"

#define THREADS 4

typedef struct {
    const msfp_api *api;
    const msfp_bearing *bearing;
    double *last;
    int status;
} task;

static void *work(void *given)
{
    task *t = given;
    static const double knots[2] = { 0.0, 0.5 };
    double motion[6][MSFP_DEGREE + 1] = { { 0.0 } }, load[6][MSFP_DEGREE + 1] = { { 0.0 } };
    msfp_scene scene;
    msfp_run *run;
    msfp_progress progress;
    size_t count;
    motion[0][2] = 0.1;
    load[2][0] = -500e3;
    t->api->scene_default(&scene);
    scene.bearing = t->bearing;
    scene.motion = (msfp_piecewise){ 1, knots, &motion[0][0] };
    scene.load = (msfp_piecewise){ 1, knots, &load[0][0] };
    scene.end_time = 0.5;
    t->status = t->api->run_new(&scene, &run, NULL);
    if (t->status)
        return NULL;
    while (t->api->run_advance(run, 7))
        ;
    t->api->run_progress(run, &progress);
    t->status = progress.status;
    const double *rows = t->api->run_rows(run, &count);
    memcpy(t->last, rows + (count - 1) * t->api->row_size, t->api->row_size * sizeof(double));
    t->api->run_free(run);
    return NULL;
}

static int together(const msfp_api *api, const double *bodies, const double *surfaces, const double *top, task *tasks)
{
    msfp_bearing *bearing;
    if (api->bearing_new(9.8, bodies, surfaces, top, &bearing, NULL))
        return 1;
    for (int i = 0; i < THREADS; ++i)
        tasks[i] = (task){ api, bearing, malloc(api->row_size * sizeof(double)), -1 };
    return 0;
}

int main(void)
{
    pthread_t threads[2 * THREADS];
    task tasks[2 * THREADS], alone;
    int failed = together(msfp_5_2_2(), &bodies_of_msfp_5_2_2[0][0], &surfaces_of_msfp_5_2_2[0][0], top_of_msfp_5_2_2,
                          tasks)
                 || together(msfp_3_1_1(), &bodies_of_msfp_3_1_1[0][0], &surfaces_of_msfp_3_1_1[0][0], top_of_msfp_3_1_1,
                             tasks + THREADS);
    for (int i = 0; i < 2 * THREADS; ++i)
        failed |= pthread_create(threads + i, NULL, work, tasks + i);
    for (int i = 0; i < 2 * THREADS; ++i)
        failed |= pthread_join(threads[i], NULL);
    for (int i = 0; i < 2 * THREADS; ++i) {
        const size_t size = tasks[i].api->row_size * sizeof(double);
        alone = tasks[i];
        alone.last = malloc(size);
        work(&alone);
        failed |= tasks[i].status != MSFP_OK || memcmp(alone.last, tasks[i].last, size);
        free(alone.last);
        free(tasks[i].last);
    }
    tasks[0].api->bearing_free((msfp_bearing *)tasks[0].bearing);
    tasks[THREADS].api->bearing_free((msfp_bearing *)tasks[THREADS].bearing);
    puts(failed ? "different" : "same");
    return failed;
}
