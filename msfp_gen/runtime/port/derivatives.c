/* derivatives.c: derivatives of the wrenches of a trial, its steps held, by sensitivities of its stages.
 *
 * The equations of a stage depend on its rates and on what is known there: the state before, the earlier stages, the
 * motion of the ends. Their tangent with respect to the rates is formed and factored once for each stage of the trial;
 * back substitution gives the rates that follow a small finite change of the rest, minus and plus. A trial beside the
 * given one is solved relative to it, so that no tolerance of Newton's method is left in the difference.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "port.h"

enum { FREEDOMS = MSFP_PORT_FREEDOMS, MOST_STEPS = 4 };
/* A perturbation accelerates a supported mass by no more than its share of this [m/s^2]. */
static const double mild_acceleration = 10.0;
/* The slip that a perturbation causes, over the smallest yield displacement: Y and Z are known to 1e-12. */
static const double share = 2e-5;
/* What a step of Newton's method beside the trial may leave of a residual, over its change by the perturbation. */
static const double second_order = 1e-7;

/* Perturbation of a freedom of an end [m] or [rad] that causes no larger slip than `share` of a yield displacement; of a
 * load [N] or [N m] the force that accelerates the mass mildly, at an arm of a radius. */
static double perturbation(const msfp_parameters *p, int freedom, int load)
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

/* Solve stage i and factor its tangent at the solution. */
static int linearise(msfp_run *run, msfp_stages *s, int i, msfp_solved *solved)
{
    double size;
    int status = msfp_stage_solve(run, s, i);
    if (status == MSFP_OK)
        status = msfp_factorise_stage(run, &s->now, solved->residual, &size);
    memcpy(solved->v, s->now.at.v, sizeof solved->v);
    memcpy(solved->g, s->now.g, sizeof solved->g);
    memcpy(solved->factors, run->factors, sizeof solved->factors);
    memcpy(solved->pivots, run->pivots, sizeof solved->pivots);
    return status;
}

/* Change of a residual; returns its largest entry. */
static double change_of(const double *residual, const double *before, double *change)
{
    double most = 0.0;
    for (int i = 0; i < DOF; ++i) {
        change[i] = residual[i] - before[i];
        most = fmax(most, fabs(change[i]));
    }
    return most;
}

/* Solve a stage whose known parts are beside those of the trial, by the tangent of the trial. Its first step leaves what
 * is of second order, which matters under a mass that light sliders carry. */
static int follow(msfp_run *run, msfp_stage *s, const msfp_solved *solved)
{
    double residual[DOF], step[DOF], first = 0.0;
    memcpy(s->at.v, solved->v, sizeof solved->v);
    memcpy(s->g, solved->g, sizeof solved->g);
    for (int i = 0;; ++i) {
        if (!(msfp_stage_residual(run, s, &run->work, residual) < INFINITY))
            return MSFP_E_FINITE;
        const double left = change_of(residual, solved->residual, step);
        if (i == MOST_STEPS || left <= second_order * first)
            return MSFP_OK;
        first = fmax(first, left);
        msfp_lu_solve(solved->factors, DOF, solved->pivots, step);
        msfp_stage_move(s, step, 1.0);
    }
}

/* The steps of the trial with the ends at `to`, and the wrenches at their end. to NULL: those of the trial itself, which
 * are linearised. */
static int repeat(msfp_port *port, msfp_run *run, const msfp_ends *to, double *wrench)
{
    double error;
    msfp_stages s;
    msfp_solved *solved = port->solved;
    msfp_port_prepare(port, run, port->times[port->time_count - 1], to ? to : &port->to);
    for (size_t i = 0; i < port->time_count; ++i) {
        if (to)
            run->factored_beta = 0.0; /* the factors in `run` are of another stage */
        msfp_stages_begin(run, &s, port->times[i] - run->now.t);
        s.now.seed.accuracy = 0.0;
        for (int k = 1; k < s.method->stages; ++k, ++solved) {
            msfp_stage_begin(run, &s, k);
            msfp_point_at(run, run->now.t + s.method->c[k] * s.h, &s.now.at);
            const int status = to ? follow(run, &s.now, solved) : linearise(run, &s, k, solved);
            if (status)
                return status;
            msfp_stage_end(run, &s, k);
        }
        msfp_stages_end(run, &s, &error);
        run->next.t = port->times[i];
        run->now = run->next;
        run->restart = run->retry_after_newton = 0;
    }
    msfp_port_wrench_of(port, run, to ? to : &port->to, wrench);
    return MSFP_OK;
}

/* The stages of the trial, solved and linearised, once for each trial. */
static int linearise_trial(msfp_port *port, msfp_run *run)
{
    const size_t count = port->time_count * (MSFP_STAGES - 1);
    double wrench[2 * FREEDOMS];
    if (port->linearised)
        return MSFP_OK;
    if (count > port->solved_capacity) {
        msfp_solved *more = realloc(port->solved, count * sizeof *more);
        if (!more)
            return MSFP_E_MEMORY;
        port->solved = more;
        port->solved_capacity = count;
    }
    const int status = repeat(port, run, NULL, wrench);
    port->linearised = status == MSFP_OK;
    return status;
}

/* Size of a perturbation of an end along a direction. */
static double step_along(const msfp_port *port, const double direction[MSFP_ORDERS], int column)
{
    const msfp_parameters *p = &port->run.parameters;
    const int end = column / MSFP_END_FREEDOMS, freedom = column % MSFP_END_FREEDOMS;
    const double h = port->run.now.t - port->committed.now.t;
    /* Rates and accelerations move the path inside the step less than displacements do. */
    const double path = fabs(direction[0]) + 0.2 * h * fabs(direction[1]) + 0.02 * h * h * fabs(direction[2]);
    const double step = perturbation(p, freedom, port->loaded && end) / path;
    if (!port->loaded || end)
        return step;
    /* The accelerations of the path act on the mass. */
    const double most = 20.0 * fabs(direction[0]) + 8.0 * h * fabs(direction[1]) + h * h * fabs(direction[2]);
    const double radius = freedom < 3 ? 1.0 : p->surface[0][MSFP_SURFACE_PARAMETERS_R];
    return fmin(step, share * mild_acceleration * h * h / (most * radius));
}

int msfp_port_beside(msfp_port *port, const double direction[MSFP_ORDERS], int column, double *step, msfp_row rows[2],
                     double wrenches[2][FREEDOMS])
{
    const int end = column / MSFP_END_FREEDOMS, freedom = column % MSFP_END_FREEDOMS;
    msfp_run run = port->run; /* with rows and events that no step of this file writes */
    int status = linearise_trial(port, &run);
    *step = step_along(port, direction, column);
    for (int side = 0; side < 2 && status == MSFP_OK; ++side) {
        msfp_ends to = port->to;
        for (int order = 0; order < MSFP_ORDERS; ++order)
            to.of[end][order][freedom] += (side ? *step : -*step) * direction[order];
        status = repeat(port, &run, &to, wrenches[side]);
        if (rows && status == MSFP_OK)
            msfp_observe_state(&run, &run.now, &rows[side]);
    }
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
    if (!msfp_all_finite(found, FREEDOMS * FREEDOMS)) /* along a direction beyond all measure */
        return MSFP_E_FINITE;
    memcpy(derivative, found, sizeof found);
    return MSFP_OK;
}
