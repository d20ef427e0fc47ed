/* A two-port in C: reads a bearing and motions of its ends, prints the wrenches and a tangent; then what is refused.
 *
 * Halfway a second two-port goes on from a snapshot of the first, after a trial that it does not commit.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "msfp_5_2_2.h"

static const msfp_api *api;

static double number(void)
{
    double x;
    if (scanf("%lf", &x) != 1)
        exit(3);
    return x;
}

static void numbers(double *to, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        to[i] = number();
}

static void require(int status)
{
    if (status != MSFP_OK) {
        printf("failed: %s\n", api->status_text(status));
        exit(4);
    }
}

static void print(const double *values, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        printf("%.17g ", values[i]);
    puts("");
}

/* A two-port in the committed state of another one, which is released. */
static msfp_port *moved(msfp_port *port, const msfp_scene *scene, double axial_load)
{
    msfp_port *other;
    const size_t size = api->port_snapshot_size(port);
    unsigned char *snapshot = malloc(size);
    if (!snapshot)
        exit(5);
    api->port_snapshot_write(port, snapshot);
    require(api->port_new(scene, axial_load, &other, NULL));
    for (size_t i = 0; i < size; i += 997) { /* also of the ends, which come first */
        snapshot[i] ^= 1;
        if (api->port_snapshot_read(other, snapshot, size) != MSFP_E_SNAPSHOT)
            printf("byte %zu may be damaged\n", i);
        snapshot[i] ^= 1;
    }
    if (api->port_snapshot_read(other, snapshot, size - 1) != MSFP_E_SNAPSHOT || api->port_time(other) != 0.0)
        puts("a short snapshot is read");
    require(api->port_snapshot_read(other, snapshot, size));
    free(snapshot);
    api->port_free(port);
    return other;
}

static void refused(const char *what, int status, const char *message)
{
    printf("%s|%s|%s\n", what, api->status_name(status), message ? message : "");
}

#define NEW(spoil)                                                                                                     \
    do {                                                                                                               \
        msfp_scene s = *scene;                                                                                         \
        double axial_load = 1e5, q[12] = { 0.0 };                                                                      \
        msfp_port *made = (msfp_port *)1;                                                                              \
        const char *message = NULL;                                                                                    \
        s.q = q;                                                                                                       \
        spoil;                                                                                                         \
        const int status = api->port_new(&s, axial_load, &made, &message);                                             \
        refused(#spoil, status, message);                                                                              \
        if (made)                                                                                                      \
            puts("a handle");                                                                                          \
    } while (0)

#define TRIAL(spoil)                                                                                                   \
    do {                                                                                                               \
        double time = now + 0.01, ends[36];                                                                            \
        const char *message = NULL;                                                                                    \
        memcpy(ends, last, sizeof ends);                                                                               \
        spoil;                                                                                                         \
        const int status = api->port_trial(port, time, ends, &message);                                                \
        refused(#spoil, status, message);                                                                              \
    } while (0)

static void refusals(const msfp_scene *scene, msfp_port *port, const double *last)
{
    static const double knots[2] = { 0.0, 1.0 }, none[3] = { 0.0 }, tangent[3] = { 1.0 };
    const double now = api->port_time(port), jump[1] = { 0.5 }, coefficients[36] = { 0.0 };
    double derivative[144];
    NEW(s.bearing = NULL);
    NEW(s.start_time = NAN);
    NEW(s.method = MSFP_METHOD_DOPRI5);
    NEW(s.rtol = 0.0);
    NEW((s.motion = (msfp_piecewise){ 1, knots, coefficients }));
    NEW((s.jumps = jump, s.jump_count = 1));
    NEW(s.output_step = 0.1);
    NEW(s.v = q);
    NEW(q[3] = 0.1);
    NEW(q[4] = NAN);
    NEW(axial_load = -1.0);
    NEW(axial_load = INFINITY);
    TRIAL(time = now - 0.01);
    TRIAL(time = now + 1e-9);
    TRIAL(time = NAN);
    TRIAL((time = now, ends[0] += 1e-3));
    TRIAL(ends[7] = NAN);
    TRIAL(ends[21] = 2.0);
    refused("no handle", api->port_new(scene, 1e5, NULL, NULL), NULL);
    refused("no place for the cause", api->port_cause(port, MSFP_E_NEWTON, NULL), NULL);
    refused("nothing to commit", api->port_commit(port), NULL);
    refused("no trial", api->port_derivative(port, tangent, derivative), NULL);
    require(api->port_trial(port, now, last, NULL));
    refused("no duration", api->port_derivative(port, tangent, derivative), NULL);
    require(api->port_commit(port));
    require(api->port_trial(port, now + 0.01, last, NULL));
    refused("no direction", api->port_derivative(port, none, derivative), NULL);
    api->port_revert(port);
    refused("reverted", api->port_commit(port), NULL);
    api->port_free(NULL);
}

/* Functions of steps by stages where there is nothing to step: nothing presses the faces of a bearing together. */
static void failed_start(const msfp_scene *scene)
{
    const double ends[36] = { 0.0 };
    msfp_progress cause;
    msfp_port *port;
    const int status = api->port_new(scene, 0.0, &port, NULL);
    if (status == MSFP_OK || status >= MSFP_E_ARGUMENT || !port)
        puts("no failed start");
    else if (api->port_jump(port, ends) != status || api->port_cause(port, MSFP_E_NEWTON, &cause) != status ||
             cause.status != status || api->port_step_begin(port, 0.01, ends) != status)
        puts("the failed start is lost");
    api->port_free(port);
}

int main(void)
{
    static const double tangent[3] = { 1.0, 0.0, 0.0 };
    double bodies[5 * MSFP_5_2_2_BODY_SIZE], surfaces[4 * MSFP_5_2_2_SURFACE_SIZE], top[MSFP_5_2_2_TOP_SIZE], ends[36];
    double wrench[12], derivative[144];
    const char *message;
    msfp_bearing *bearing;
    msfp_scene scene;
    msfp_port *port;
    api = msfp_5_2_2();
    const double gravity = number();
    numbers(bodies, sizeof bodies / sizeof *bodies);
    numbers(surfaces, sizeof surfaces / sizeof *surfaces);
    numbers(top, sizeof top / sizeof *top);
    require(api->bearing_new(gravity, bodies, surfaces, top, &bearing, &message));
    const double axial_load = number(), step = number();
    const int count = (int)number();
    api->scene_default(&scene);
    scene.bearing = bearing;
    scene.rtol = number();
    scene.atol_angle = number();
    require(api->port_new(&scene, axial_load, &port, &message));
    for (int i = 1; i <= count; ++i) {
        numbers(ends, 36);
        require(api->port_trial(port, i * step + 0.3, ends, &message)); /* leaves nothing */
        if (2 * i == count)
            port = moved(port, &scene, axial_load);
        require(api->port_trial(port, i * step, ends, &message));
        require(api->port_wrench(port, wrench));
        print(wrench, 12);
        if (i == count)
            require(api->port_derivative(port, tangent, derivative));
        require(api->port_commit(port));
    }
    print(derivative, 144);
    refusals(&scene, port, ends);
    msfp_bearing *weightless;
    require(api->bearing_new(0.0, bodies, surfaces, top, &weightless, NULL));
    scene.bearing = weightless;
    failed_start(&scene);
    api->bearing_free(weightless);
    top[MSFP_5_2_2_TOP_MASS] = top[MSFP_5_2_2_TOP_INERTIA_TRANSVERSE] = top[MSFP_5_2_2_TOP_INERTIA_AXIAL] = 1.0;
    msfp_bearing *loaded;
    require(api->bearing_new(gravity, bodies, surfaces, top, &loaded, NULL));
    scene.bearing = loaded;
    msfp_port *none;
    const int status = api->port_new(&scene, axial_load, &none, &message);
    refused("mass = 1", status, message);
    api->bearing_free(loaded);
    api->port_free(port);
    api->bearing_free(bearing);
    return 0;
}
