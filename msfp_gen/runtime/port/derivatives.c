/* derivatives.c: derivatives of the wrenches of a trial: central differences of the trial with its steps held.
 *
 * With held steps the wrenches are smooth functions of the motion of the ends, up to the switches of friction and rims.
 * The stages are solved to a tighter tolerance than in the trial, so that the differences hold no noise of Newton's
 * method.
 */
#include <math.h>
#include <string.h>
#include "port.h"

enum { NB = MSFP_NB, FREEDOMS = MSFP_PORT_FREEDOMS };
static const double tolerance = 1e-7; /* rtol of the repeated trials */
static const double share = 2e-3;     /* of the smallest yield displacement: perturbation of an end */

/* Perturbation of a freedom of an end [m] or [rad]: the slip that it causes is no more than `share` of the yield
 * displacement. */
static double perturbation(const msfp_parameters *p, int freedom)
{
    double yield = p->surface[0][MSFP_SURFACE_PARAMETERS_DY], radius = p->surface[0][MSFP_SURFACE_PARAMETERS_R];
    for (int j = 1; j < NB; ++j) {
        yield = fmin(yield, p->surface[j][MSFP_SURFACE_PARAMETERS_DY]);
        radius = fmax(radius, p->surface[j][MSFP_SURFACE_PARAMETERS_R]);
    }
    return freedom < 3 ? share * yield : share * yield / radius;
}

/* Wrenches at the end of the trial with the ends at `to`, by the steps of the trial. */
static int repeat(msfp_port *port, msfp_run *run, const msfp_ends *to, double *wrench)
{
    double error;
    msfp_port_prepare(port, run, port->times[port->time_count - 1], to);
    run->options.rtol = fmin(run->options.rtol, tolerance);
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

int msfp_port_derivative(msfp_port *port, int order, double *derivative)
{
    /* A derivative of the motion moves the path inside the step less than the motion itself does. */
    static const double enlarged[MSFP_ORDERS] = { 1.0, 5.0, 50.0 };
    const double h = port->run.now.t - port->committed.now.t;
    msfp_run run = port->run; /* with rows and events that no step of this file writes */
    double wrench[2][FREEDOMS];
    for (int end = 0; end < MSFP_ENDS; ++end)
        for (int freedom = 0; freedom < MSFP_END_FREEDOMS; ++freedom) {
            const double step = enlarged[order] * perturbation(&run.parameters, freedom) / pow(h, order);
            double width = 0.0;
            for (int side = 0; side < 2; ++side) {
                msfp_ends to = port->to;
                double *moved = &to.of[end][order][freedom];
                *moved += side ? step : -step;
                width += side ? *moved : -*moved;
                const int status = repeat(port, &run, &to, wrench[side]);
                if (status)
                    return status;
            }
            for (int i = 0; i < FREEDOMS; ++i)
                derivative[i * FREEDOMS + end * MSFP_END_FREEDOMS + freedom] = (wrench[1][i] - wrench[0][i]) / width;
        }
    return MSFP_OK;
}
