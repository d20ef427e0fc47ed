/* What the interface refuses: each case spoils one thing, and prints the status and the message. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "values.h"

static const msfp_api *api;
static double bodies[5][MSFP_5_2_2_BODY_SIZE], surfaces[4][MSFP_5_2_2_SURFACE_SIZE], top[MSFP_5_2_2_TOP_SIZE];

static void print(const char *name, int status, const char *message)
{
    printf("%s|%s|%s\n", name, api->status_name(status), message ? message : "");
}

static void restore(void)
{
    memcpy(bodies, bodies_of_msfp_5_2_2, sizeof bodies);
    memcpy(surfaces, surfaces_of_msfp_5_2_2, sizeof surfaces);
    memcpy(top, top_of_msfp_5_2_2, sizeof top);
}

#define BEARING(spoil)                                                                                                 \
    do {                                                                                                               \
        const char *message = NULL;                                                                                    \
        msfp_bearing *made = (msfp_bearing *)1;                                                                        \
        double gravity = 9.8;                                                                                          \
        restore();                                                                                                     \
        spoil;                                                                                                         \
        const int status = api->bearing_new(gravity, &bodies[0][0], &surfaces[0][0], top, &made, &message);            \
        print(#spoil, status, message);                                                                                \
        if (made)                                                                                                      \
            puts("a handle");                                                                                          \
    } while (0)

#define SCENE(spoil)                                                                                                   \
    do {                                                                                                               \
        const char *message = NULL;                                                                                    \
        msfp_run *made = (msfp_run *)1;                                                                                \
        msfp_scene s;                                                                                                  \
        api->scene_default(&s);                                                                                        \
        s.bearing = bearing;                                                                                           \
        s.motion = (msfp_piecewise){ 1, knots, &coefficients[0][0] };                                                  \
        s.end_time = 1.0;                                                                                              \
        spoil;                                                                                                         \
        const int status = api->run_new(&s, &made, &message);                                                          \
        print(#spoil, status, message);                                                                                \
        if (made)                                                                                                      \
            puts("a handle");                                                                                          \
    } while (0)

int main(void)
{
    static const double knots[2] = { 0.0, 1.0 }, falling[2] = { 1.0, 0.0 }, one[1] = { 0.5 }, zero[1] = { 0.0 };
    double coefficients[6][MSFP_DEGREE + 1] = { { 0.0 } }, broken[6][MSFP_DEGREE + 1] = { { NAN } }, state[12];
    msfp_bearing *bearing;
    msfp_run *run;
    msfp_inputs at;
    double a[12];
    api = msfp_5_2_2();
    memset(state, 0, sizeof state);
    BEARING(gravity = NAN);
    BEARING(gravity = -1.0);
    BEARING(bodies[1][MSFP_5_2_2_BODY_HEIGHT] = 0.0);
    BEARING(bodies[2][MSFP_5_2_2_BODY_MASS] = 0.0);
    BEARING(bodies[4][MSFP_5_2_2_BODY_INERTIA_AXIAL] = INFINITY);
    BEARING(surfaces[3][MSFP_5_2_2_SURFACE_RADIUS] = -1.0);
    BEARING(surfaces[0][MSFP_5_2_2_SURFACE_FRICTION] = -0.1);
    BEARING(surfaces[0][MSFP_5_2_2_SURFACE_YIELD_DISPLACEMENT] = 0.0);
    BEARING(top[MSFP_5_2_2_TOP_STIFFNESS] = -1.0);
    restore();
    print("no bodies", api->bearing_new(9.8, NULL, &surfaces[0][0], top, &bearing, NULL), NULL);
    print("no handle", api->bearing_new(9.8, &bodies[0][0], &surfaces[0][0], top, NULL, NULL), NULL);
    if (api->bearing_new(9.8, &bodies[0][0], &surfaces[0][0], NULL, &bearing, NULL))
        return 1;
    SCENE(s.bearing = NULL);
    SCENE(s.end_time = NAN);
    SCENE(s.end_time = 2.0);
    SCENE(s.start_time = -1.0);
    SCENE(s.motion.knots = falling);
    SCENE(s.motion.coefficients = &broken[0][0]);
    SCENE(s.load.pieces = -1);
    SCENE(s.support = s.motion);
    SCENE(s.jump_count = 1);
    SCENE((s.span_ends = one, s.span_steps = zero, s.span_count = 1));
    SCENE(s.method = 7);
    SCENE(s.rtol = 0.0);
    SCENE(s.atol_angle = NAN);
    SCENE(s.max_steps = NAN);
    SCENE(s.output_step = -1.0);
    SCENE(s.monitors = 1 << 30);
    SCENE(s.memory = state);
    state[3] = NAN;
    SCENE(s.q = state);
    memset(&at, 0, sizeof at);
    print("accelerations of nothing", api->accelerations(NULL, &at, 0, a, NULL, NULL, NULL, NULL), NULL);
    at.v = state;
    print("accelerations at NaN", api->accelerations(bearing, &at, 0, a, NULL, NULL, NULL, NULL), NULL);
    print("no snapshot", api->snapshot_open("msfp", 4, &run), NULL);
    print("no status", -1, api->status_text(-1));
    api->run_free(NULL);
    api->bearing_free(NULL);
    api->bearing_free(bearing);
    return 0;
}
