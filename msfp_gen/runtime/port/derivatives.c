/* derivatives.c: derivatives of the wrenches of a trial: central differences of the trial with its steps held.
 *
 * With held steps the wrenches are smooth functions of the motion of the ends, up to the switches of friction and rims.
 * The stages are solved to a tighter tolerance than in the trial, so that the differences hold no noise of Newton's
 * method. Where that fails, as at a rim that is being met, a larger perturbation makes up for the tolerance of the
 * trial.
 */
#include <math.h>
#include <string.h>
#include "port.h"

enum { NB = MSFP_NB, FREEDOMS = MSFP_PORT_FREEDOMS };
/* A perturbation accelerates a supported mass by no more than its share of this [m/s^2]. */
static const double mild_acceleration = 0.1;

/* rtol of the repeated trials [-], and the slip that a perturbation causes, over the smallest yield displacement. */
typedef struct {
    double rtol, share;
} precision;
static const precision precisions[] = { { 1e-7, 2e-3 }, { 1.0, 2e-2 } }; /* rtol is no larger than in the trial */

/* Perturbation of a freedom of an end [m] or [rad] that causes no larger slip than `share` of a yield displacement; of a
 * load [N] or [N m] the force that accelerates the mass mildly, at an arm of a radius. */
static double perturbation(const msfp_parameters *p, int freedom, double share, int load)
{
    double yield = p->surface[0][MSFP_SURFACE_PARAMETERS_DY], radius = p->surface[0][MSFP_SURFACE_PARAMETERS_R];
    for (int j = 1; j < NB; ++j) {
        yield = fmin(yield, p->surface[j][MSFP_SURFACE_PARAMETERS_DY]);
        radius = fmax(radius, p->surface[j][MSFP_SURFACE_PARAMETERS_R]);
    }
    if (load) {
        const double force = share * mild_acceleration * p->top[MSFP_TOP_PARAMETERS_M];
        return freedom < 3 ? force : force * radius;
    }
    return freedom < 3 ? share * yield : share * yield / radius;
}

/* Wrenches at the end of the trial with the ends at `to`, by the steps of the trial. */
static int repeat(msfp_port *port, msfp_run *run, const msfp_ends *to, double rtol, double *wrench)
{
    double error;
    msfp_port_prepare(port, run, port->times[port->time_count - 1], to);
    run->options.rtol = fmin(port->run.options.rtol, rtol);
    for (size_t i = 0; i < port->time_count; ++i) {
        const int status = msfp_step_implicit(run, port->times[i] - run->now.t, &error);
        if (status)
            return status;
        run->next.t = port->times[i];
        run->now = run->next;
        run->restart = run->retry_after_newton = 0;
    }
    msfp_port_wrench_of(port, run, to, wrench);
    return MSFP_OK;
}

/* Rows and wrenches with one freedom of an end moved by minus and plus a step. rows: NULL where they are not asked. */
static int beside(msfp_port *port, msfp_run *run, const double direction[MSFP_ORDERS], int column, precision by,
                  double *step, msfp_row *rows, double wrench[2][FREEDOMS])
{
    const int end = column / MSFP_END_FREEDOMS, freedom = column % MSFP_END_FREEDOMS;
    const double h = port->run.now.t - port->committed.now.t;
    /* Rates and accelerations move the path inside the step less than displacements do. */
    const double path = fabs(direction[0]) + 0.2 * h * fabs(direction[1]) + 0.02 * h * h * fabs(direction[2]);
    *step = perturbation(&run->parameters, freedom, by.share, port->loaded && end) / path;
    if (port->loaded && !end) { /* it feels the accelerations of the path */
        const double most = 20.0 * fabs(direction[0]) + 8.0 * h * fabs(direction[1]) + h * h * fabs(direction[2]);
        const double radius = freedom < 3 ? 1.0 : run->parameters.surface[0][MSFP_SURFACE_PARAMETERS_R];
        *step = fmin(*step, by.share * mild_acceleration * h * h / (most * radius));
    }
    for (int side = 0; side < 2; ++side) {
        msfp_ends to = port->to;
        for (int order = 0; order < MSFP_ORDERS; ++order)
            to.of[end][order][freedom] += (side ? *step : -*step) * direction[order];
        const int status = repeat(port, run, &to, by.rtol, wrench[side]);
        if (status)
            return status;
        if (rows)
            msfp_observe_state(run, &run->now, &rows[side]);
    }
    return MSFP_OK;
}

int msfp_port_beside(msfp_port *port, const double direction[MSFP_ORDERS], int column, double *step, msfp_row rows[2],
                     double wrenches[2][FREEDOMS])
{
    msfp_run run = port->run; /* with rows and events that no step of this file writes */
    int status = MSFP_E_NEWTON;
    for (size_t i = 0; status && i < sizeof precisions / sizeof *precisions; ++i)
        status = beside(port, &run, direction, column, precisions[i], step, rows, wrenches);
    if (status)
        return status;
    const int finite = msfp_all_finite(&wrenches[0][0], 2 * FREEDOMS)
                       && (!rows || msfp_all_finite((const double *)rows, 2 * sizeof *rows / sizeof(double)));
    return finite ? MSFP_OK : MSFP_E_FINITE;
}

int msfp_port_derivative(msfp_port *port, const double direction[MSFP_ORDERS], double *derivative)
{
    double step, pair[2][FREEDOMS], found[FREEDOMS * FREEDOMS];
    for (int j = 0; j < FREEDOMS; ++j) {
        const int status = msfp_port_beside(port, direction, j, &step, NULL, pair);
        if (status)
            return status;
        for (int i = 0; i < FREEDOMS; ++i)
            found[i * FREEDOMS + j] = (pair[1][i] - pair[0][i]) / (2.0 * step);
    }
    memcpy(derivative, found, sizeof found);
    return MSFP_OK;
}
