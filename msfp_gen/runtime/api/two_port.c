/* two_port.c: a bearing between two moving ends, for the table of functions. */
#include <math.h>
#include <string.h>
#include "api.h"

enum { NB = MSFP_NB };
static const double shortest = 1e-8; /* time of a trial [s], or its share of the time: a shorter one holds no step */

/* The part of a scene that a two-port reads. */
static msfp_scene scene_at_rest(const msfp_scene *given)
{
    msfp_scene s;
    msfp_api_scene_default(&s);
    s.bearing = given->bearing;
    s.q = given->q, s.v = given->v, s.f = given->f;
    s.start_time = given->start_time;
    s.end_time = given->start_time + 1.0;
    s.method = given->method;
    s.rtol = given->rtol, s.atol_angle = given->atol_angle;
    s.max_step = given->max_step, s.first_step = given->first_step, s.max_steps = given->max_steps;
    return s;
}

int msfp_api_port_new(const msfp_scene *scene, double axial_load, msfp_port **port, const char **message)
{
    static const double zero[NB * MSFP_NQ + 2 * NB] = { 0.0 };
    if (!port)
        return msfp_refuse(message, "port: give the address of a handle");
    *port = NULL;
    if (!scene)
        return msfp_refuse(message, "scene: give a scene");
    if (MSFP_PLANAR || !MSFP_SPIN_LOCKED || !MSFP_TOP_ROTATION)
        return msfp_refuse(message, "port: this model has no two ends; export it spatial, with locked spin and --top-rotation");
    const msfp_scene s = scene_at_rest(scene);
    const int wrong = msfp_check_scene(&s, message);
    if (wrong)
        return wrong;
    if (s.method == MSFP_METHOD_DOPRI5)
        return msfp_refuse(message, "method: the steps of a two-port are implicit; give MSFP_METHOD_IMPLICIT");
    if (!(fabs(axial_load) < INFINITY))
        return msfp_refuse(message, "axial_load: give a finite number [N]");
    const msfp_options options = msfp_scene_options(&s);
    *port = msfp_port_new(&s.bearing->parameters, &options, axial_load, s.q ? s.q : zero, s.v ? s.v : zero,
                          s.f ? s.f : zero);
    return *port ? (*port)->committed.status : MSFP_E_MEMORY;
}

/* Whether the ends of the committed state are at `ends`. */
static int at_committed_ends(const msfp_port *port, const double *ends)
{
    const double *from = &port->from.of[0][0][0];
    int same = 1;
    for (size_t i = 0; i < sizeof port->from / sizeof *from; ++i)
        same = same && ends[i] == from[i];
    return same;
}

int msfp_api_port_trial(msfp_port *port, double time, const double *ends)
{
    const double now = port->committed.now.t;
    if (port->committed.status)
        return port->committed.status;
    if (!ends)
        return MSFP_E_ARGUMENT;
    if (!(fabs(time) < INFINITY) || !msfp_all_finite(ends, sizeof port->to / sizeof *ends))
        return MSFP_E_FINITE;
    if (time == now ? !at_committed_ends(port, ends) : time - now < shortest * fmax(1.0, fabs(now)))
        return MSFP_E_ARGUMENT;
    return msfp_port_trial(port, time, ends);
}

int msfp_api_port_wrench(const msfp_port *port, double *wrench)
{
    if (port->committed.status)
        return port->committed.status;
    if (!wrench)
        return MSFP_E_ARGUMENT;
    msfp_port_wrench(port, wrench);
    return MSFP_OK;
}

int msfp_api_port_derivative(msfp_port *port, const double *direction, double *derivative)
{
    if (!direction || !derivative || !port->tried || !port->time_count)
        return MSFP_E_ARGUMENT;
    if (!msfp_all_finite(direction, MSFP_ORDERS))
        return MSFP_E_FINITE;
    if (direction[0] == 0.0 && direction[1] == 0.0 && direction[2] == 0.0)
        return MSFP_E_ARGUMENT;
    return msfp_port_derivative(port, direction, derivative);
}

int msfp_api_port_row(const msfp_port *port, double *row)
{
    if (port->committed.status)
        return port->committed.status;
    if (!row)
        return MSFP_E_ARGUMENT;
    memcpy(row, msfp_port_row(port), sizeof(msfp_row));
    return MSFP_OK;
}

/* The run whose end a trial is; that of the start where it failed. */
static const msfp_run *tried(const msfp_port *port) { return port->committed.status ? &port->committed : &port->run; }

void msfp_api_port_progress(const msfp_port *port, msfp_progress *trial)
{
    const msfp_run *run = tried(port);
    *trial = (msfp_progress){ run->status, run->status_surface, run->status_value, run->now.t, run->h, 0 };
}

void msfp_api_port_counts(const msfp_port *port, int64_t *counts)
{
    for (int i = 0; i < MSFP_COUNTS; ++i)
        counts[i] = port->run.counts[i];
}

double msfp_api_port_time(const msfp_port *port) { return port->committed.now.t; }

int msfp_api_port_snapshot_read(msfp_port *port, const void *snapshot, size_t size)
{
    const int status = snapshot ? msfp_port_snapshot_read(port, snapshot, size) : MSFP_E_FINITE;
    return status == MSFP_E_FINITE ? MSFP_E_SNAPSHOT : status;
}
