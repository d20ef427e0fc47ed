/* CPU time of a committed step of a two-port [ns], without and with its tangent. values.h: the bearing. See embedding.py.
 */
#include <math.h>
#include <stdio.h>
#include <time.h>
#include "values.h"

static void ends_at(double t, double ends[2][3][6])
{
    const double w = 3.14159265358979, s = sin(w * t), c = cos(w * t);
    for (int i = 0; i < 36; ++i)
        (&ends[0][0][0])[i] = 0.0;
    ends[1][0][0] = 0.06 * s * s * s;
    ends[1][1][0] = 0.06 * 3.0 * w * s * s * c;
    ends[1][2][0] = 0.06 * 3.0 * w * w * (2.0 * s * c * c - s * s * s);
}

static double run_once(const msfp_api *api, const msfp_scene *scene, int tangents)
{
    static const double displacements[3] = { 1.0, 0.0, 0.0 };
    double ends[2][3][6], wrench[12], tangent[144];
    msfp_port *port;
    if (api->port_new(scene, LOAD, &port, NULL))
        return -1.0;
    const clock_t begin = clock();
    for (int i = 1; i <= COUNT; ++i) {
        ends_at(STEP * i, ends);
        if (api->port_trial(port, STEP * i, &ends[0][0][0], NULL) || api->port_wrench(port, wrench) ||
            (tangents && api->port_derivative(port, displacements, tangent)) || api->port_commit(port))
            return -1.0;
    }
    const double time = 1e9 * (double)(clock() - begin) / CLOCKS_PER_SEC / COUNT;
    api->port_free(port);
    return time;
}

int main(void)
{
    const msfp_api *api = msfp_5_2_2();
    double least[2] = { 1e300, 1e300 };
    msfp_bearing *bearing;
    msfp_scene scene;
    if (api->bearing_new(GRAVITY, bodies, surfaces, top, &bearing, NULL))
        return 1;
    api->scene_default(&scene);
    scene.bearing = bearing;
    scene.rtol = RTOL;
    scene.atol_angle = ATOL;
    for (int i = 0; i < ROUNDS; ++i)
        for (int tangents = 0; tangents < 2; ++tangents)
            least[tangents] = fmin(least[tangents], run_once(api, &scene, tangents));
    printf("%g %g\n", least[0], least[1]);
    api->bearing_free(bearing);
    return 0;
}
