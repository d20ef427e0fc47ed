/* two_port.c: a bearing between two moving ends, for the table of functions. */
#include <math.h>
#include <string.h>
#include "api.h"

static int new_port(const msfp_scene *scene, double axial_load, int loaded, msfp_port **port)
{
    static const double centred[MSFP_NB * MSFP_NQ] = { 0.0 };
    msfp_options options = msfp_scene_options(scene);
    options.duration = options.start_time + 1.0;
    *port = msfp_port_new(&scene->bearing->parameters, &options, axial_load, scene->q ? scene->q : centred, loaded);
    if (!*port)
        return MSFP_E_MEMORY;
    (*port)->committed.identity = msfp_port_identity(scene, axial_load, loaded);
    return (*port)->committed.status;
}

int msfp_api_port_new(const msfp_scene *scene, double axial_load, msfp_port **port, const char **message)
{
    if (!port)
        return msfp_refuse(message, "port: give the address of a handle");
    *port = NULL;
    const int wrong = msfp_check_port(scene, axial_load, message);
    return wrong ? wrong : new_port(scene, axial_load, 0, port);
}

int msfp_api_port_new_loaded(const msfp_scene *scene, msfp_port **port, const char **message)
{
    if (!port)
        return msfp_refuse(message, "port: give the address of a handle");
    *port = NULL;
    const int wrong = msfp_check_port_loaded(scene, message);
    return wrong ? wrong : new_port(scene, 0.0, 1, port);
}

int msfp_api_port_trial(msfp_port *port, double time, const double *ends, const char **message)
{
    const int wrong = msfp_check_trial(port, time, ends, message);
    return wrong ? wrong : msfp_port_trial(port, time, ends);
}

/* Whether results of a two-port can be written to `to`. */
static int check_results(const msfp_port *port, const double *to)
{
    if (port && port->committed.status)
        return port->committed.status;
    return port && to ? MSFP_OK : MSFP_E_ARGUMENT;
}

int msfp_api_port_wrench(const msfp_port *port, double *wrench)
{
    const int wrong = check_results(port, wrench);
    if (!wrong)
        msfp_port_wrench(port, wrench);
    return wrong;
}

static int check_direction(const msfp_port *port, const double *direction)
{
    if (!port || !direction || port->trial_state != TRIAL_SOLVED)
        return MSFP_E_ARGUMENT;
    if (!msfp_all_finite(direction, MSFP_ORDERS))
        return MSFP_E_FINITE;
    return direction[0] == 0.0 && direction[1] == 0.0 && direction[2] == 0.0 ? MSFP_E_ARGUMENT : MSFP_OK;
}

int msfp_api_port_derivative(msfp_port *port, const double *direction, double *derivative)
{
    const int wrong = check_direction(port, direction);
    if (wrong)
        return wrong;
    return derivative ? msfp_port_derivative(port, direction, derivative, NULL) : MSFP_E_ARGUMENT;
}

int msfp_api_port_row_derivative(msfp_port *port, const double *direction, double *derivative, double *rows)
{
    const int wrong = check_direction(port, direction);
    if (wrong)
        return wrong;
    return derivative && rows ? msfp_port_derivative(port, direction, derivative, rows) : MSFP_E_ARGUMENT;
}

int msfp_api_port_row(const msfp_port *port, double *row)
{
    const int wrong = check_results(port, row);
    if (!wrong)
        memcpy(row, msfp_port_row(port), sizeof(msfp_row));
    return wrong;
}

void msfp_api_port_progress(const msfp_port *port, msfp_progress *trial)
{
    const msfp_run *run = &port->run;
    *trial = (msfp_progress){ run->status, run->status_surface, run->status_value, run->now.t, run->h, 0 };
}

void msfp_api_port_counts(const msfp_port *port, int64_t *counts)
{
    for (int i = 0; i < MSFP_COUNTS; ++i)
        counts[i] = port->run.counts[i];
}

double msfp_api_port_time(const msfp_port *port) { return port->committed.now.t; }

int msfp_api_port_commit(msfp_port *port) { return port ? msfp_port_commit(port) : MSFP_E_ARGUMENT; }

int msfp_api_port_snapshot_read(msfp_port *port, const void *snapshot, size_t size)
{
    if (!port)
        return MSFP_E_ARGUMENT;
    return snapshot ? msfp_port_snapshot_read(port, snapshot, size) : MSFP_E_SNAPSHOT;
}

/* ---- steps by stages ---- */

int msfp_api_port_step_begin(msfp_port *port, double step, const double *expected)
{
    if (!port)
        return MSFP_E_ARGUMENT;
    if (port->committed.status)
        return port->committed.status;
    if (port->loaded || !(step > 0.0 && step < INFINITY) || !expected || !msfp_all_finite(expected, 2))
        return MSFP_E_ARGUMENT;
    msfp_port_step_begin(port, step, expected);
    return MSFP_OK;
}

int msfp_api_port_stage(msfp_port *port, int stage, const double *ends, double *wrench)
{
    const int now = port ? port->step.stage : MSFP_NO_STEP;
    if (now < 0 || stage < 1 || (stage != now && (stage != now + 1 || !port->step.solved)) || stage >= port->step.stages.method->stages ||
        !wrench)
        return MSFP_E_ARGUMENT;
    if (!ends || !msfp_valid_ends(ends, 0))
        return MSFP_E_FINITE;
    return msfp_port_stage(port, stage, ends, wrench);
}

int msfp_api_port_stage_derivative(msfp_port *port, double *derivative)
{
    if (!port || port->step.stage < 1 || !port->step.solved || !derivative)
        return MSFP_E_ARGUMENT;
    return msfp_port_stage_derivative(port, derivative);
}

int msfp_api_port_step_end(msfp_port *port, double *error, double *share)
{
    const msfp_port_step *step = port ? &port->step : NULL;
    if (!step || step->stage < 1 || step->stage != step->stages.method->stages - 1 || !step->solved || !error || !share)
        return MSFP_E_ARGUMENT;
    return msfp_port_step_end(port, error, share);
}

int msfp_api_port_step_commit(msfp_port *port, double time)
{
    return port && time > port->committed.now.t && time < INFINITY ? msfp_port_step_commit(port, time) : MSFP_E_ARGUMENT;
}

int msfp_api_port_jump(msfp_port *port, const double *ends)
{
    if (!port)
        return MSFP_E_ARGUMENT;
    if (port->committed.status)
        return port->committed.status;
    return !port->loaded && ends && msfp_valid_ends(ends, 0) ? msfp_port_jump(port, ends) : MSFP_E_ARGUMENT;
}

int msfp_api_port_cause(msfp_port *port, int status, msfp_progress *cause)
{
    if (!port || port->loaded || !cause)
        return MSFP_E_ARGUMENT;
    msfp_run *run = &port->committed;
    status = run->status ? run->status : msfp_port_cause(port, status);
    *cause = (msfp_progress){ status, run->status_surface, run->status_value, run->now.t, run->h, 0 };
    return status;
}

/* ---- monitors, and the change of models that they ask for ---- */

int msfp_api_port_tripped(msfp_port *port) { return msfp_port_tripped(port); }

void msfp_api_port_trips(const msfp_port *port, msfp_trip *trips) { msfp_api_run_trips(&port->committed, trips); }

void msfp_api_port_state(const msfp_port *port, msfp_run_state *state) { msfp_api_run_state(&port->committed, state); }

int msfp_api_port_enter(msfp_port *port, const msfp_scene *state, const double *ends)
{
    const int wrong = msfp_check_entry(port, state, ends);
    if (wrong)
        return wrong;
    msfp_options options = port->committed.options;
    options.start_time = state->start_time;
    options.duration = state->start_time + 1.0;
    options.origin = state->origin;
    options.foot = state->foot;
    options.memory = state->memory;
    const int status = msfp_port_enter(port, &options, state->q, state->v, state->f, state->monitor_heat, ends);
    port->committed.options.origin = port->committed.options.foot = port->committed.options.memory = NULL;
    port->run.options.origin = port->run.options.foot = port->run.options.memory = NULL;
    return status;
}
