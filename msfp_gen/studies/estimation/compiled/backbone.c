#include "backbone.h"

#include <math.h>

/* Force over the load at a displacement u; `slipped` holds the displacement at which every element has no force. */
static void restoring(const msfp_backbone *model, const double u[2], double slipped[][2], double force[2])
{
    force[0] = model->spring * u[0];
    force[1] = model->spring * u[1];
    for (int i = 0; i < model->count; i++) {
        const double k = model->stiffness[i], most = model->strength[i];
        double x = k * (u[0] - slipped[i][0]), y = k * (u[1] - slipped[i][1]);
        const double square = x * x + y * y;
        if (square > most * most) {
            const double share = most / sqrt(square);
            x *= share;
            y *= share;
            slipped[i][0] = u[0] - x / k;
            slipped[i][1] = u[1] - y / k;
        }
        force[0] += x;
        force[1] += y;
    }
    const double distance = sqrt(u[0] * u[0] + u[1] * u[1]);
    for (int i = 0; i < model->gaps; i++) {
        if (distance > model->gap[i]) {
            const double share = model->gap_stiffness[i] * (distance - model->gap[i]) / distance;
            force[0] += share * u[0];
            force[1] += share * u[1];
        }
    }
}

msfp_backbone_peaks msfp_backbone_run(const msfp_backbone *model, const double *ground, long steps, double step)
{
    double u[2] = {0.0, 0.0}, v[2] = {0.0, 0.0}, force[2], slipped[MSFP_BACKBONE_MOST][2] = {{0.0}};
    double farthest = 0.0, largest = 0.0;
    long taken = 0;
    while (taken < steps) {
        const double *a = ground + 3 * taken++;
        const double load = model->gravity + a[2] > 0.0 ? model->gravity + a[2] : 0.0;
        restoring(model, u, slipped, force);
        const double distance = u[0] * u[0] + u[1] * u[1];
        const double square = load * load * (force[0] * force[0] + force[1] * force[1]);
        if (distance > farthest)
            farthest = distance;
        if (square > largest)
            largest = square;
        if (model->stop > 0.0 && distance >= model->stop * model->stop)
            break;
        for (int i = 0; i < 2; i++) {
            v[i] -= step * (load * force[i] + a[i]);
            u[i] += step * v[i];
        }
    }
    return (msfp_backbone_peaks){sqrt(farthest), sqrt(largest), taken};
}
