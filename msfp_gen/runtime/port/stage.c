/* stage.c: a bearing in the stages of a method that another program drives, as that of a building (docs/buildings.md).
 *
 * The other program steps all of its parts with one tableau and one step. In each stage it says how the ends move and
 * receives the wrenches of the bearing in that stage, with their derivatives: the stage equations of the bearing are
 * solved for each motion that it tries.
 */
#include <math.h>
#include <string.h>
#include "port.h"

enum { FREEDOMS = MSFP_END_FREEDOMS };

/* Base motion, load and rotation of the support of a stage. */
static void set_ends(const msfp_port *port, const msfp_ends *ends, msfp_point *at)
{
    double far_end[MSFP_FAR_END_SIZE];
    memset(at->load, 0, sizeof at->load);
    msfp_far_end(port, ends->of[1][0], ends->of[1][1], port->step.anchor, far_end);
    msfp_load_of_interface(&port->committed.parameters, far_end, at->load);
    msfp_end_channels(ends->of[0][0], at->base[0]);
    double upper[MSFP_ORDERS][MSFP_END_FREEDOMS];
    msfp_end_channels(ends->of[1][0], upper[0]);
    for (int order = 0; order < 2; ++order)
        memcpy(at->support[order], upper[order] + 3, 3 * sizeof(double));
}

void msfp_port_step_begin(msfp_port *port, double h, const double *expected)
{
    msfp_run *run = &port->committed;
    memcpy(port->step.anchor, expected, sizeof port->step.anchor);
    /* At the end of a step the springs are fixed where end B then is. */
    port->step.energy =
        run->now.energy + msfp_port_move_anchor(port, run, run->rows[0].top, port->from.of[1][0], port->step.anchor);
    port->step.stage = port->step.finished = 0;
    port->step.solved = 1;
    port->trial_state = NO_TRIAL;
    run->status_surface = 0;
    run->status_value = 0.0;
    msfp_stages_begin(run, &port->step.stages, h);
}

/* The end of the stage that was solved last, the ends at port->to. */
static void end_stage(msfp_port *port)
{
    msfp_run *run = &port->committed;
    msfp_stages *s = &port->step.stages;
    msfp_stage_end(run, s, port->step.stage);
    msfp_port_dampers(port, run, &port->to, s->h * s->method->gamma, &s->stage[port->step.stage]);
}

/* Move the rates of the stage with those of end B: to first order they remain a solution. */
static void follow(msfp_port *port, const msfp_ends *to)
{
    double step[DOF] = { 0.0 };
    for (int i = 0; i < DOF; ++i)
        for (int k = 0; k < FREEDOMS; ++k)
            step[i] += port->step.moves[i][k] * (to->of[1][1][k] - port->to.of[1][1][k]);
    msfp_stage_move(&port->step.stages.now, step, -1.0);
}

int msfp_port_stage(msfp_port *port, int i, const double *ends, double *wrench)
{
    msfp_run *run = &port->committed;
    msfp_stages *s = &port->step.stages;
    msfp_ends to;
    int status = MSFP_E_NEWTON;
    memcpy(&to, ends, sizeof to);
    const int again = i == port->step.stage;
    if (!again) {
        if (port->step.stage > 0)
            end_stage(port);
        msfp_stage_begin(run, s, i);
        port->step.stage = i;
    }
    port->step.solved = 0;
    set_ends(port, &to, &s->now.at);
    s->now.weights.same_base = again; /* the lower end moves as it does */
    if (again) {
        if (port->step.moved)
            follow(port, &to);
        status = msfp_solve_stage(run, &s->now);
    }
    if (status == MSFP_E_NEWTON)
        status = msfp_stage_solve(run, s, i);
    port->to = to;
    run->retry_after_newton |= status == MSFP_E_NEWTON;
    if (status)
        return status;
    port->step.solved = 1;
    msfp_port_wrench_of(port, run, &port->to, wrench);
    return MSFP_OK;
}

/* ---- the end of a step ---- */

int msfp_port_step_end(msfp_port *port, double *error, double *share)
{
    msfp_run *run = &port->committed;
    msfp_port_step *step = &port->step;
    const double energy = run->now.energy;
    *share = 1.0;
    end_stage(port);
    msfp_stages_end(run, &step->stages, error);
    step->stage = MSFP_NO_STEP;
    if (!(*error < INFINITY))
        return MSFP_E_FINITE;
    if (*error > 1.0)
        return MSFP_OK;
    run->now.energy = step->energy; /* with springs as fixed in this step */
    const int consistent = msfp_energy_consistent(run);
    run->now.energy = energy;
    const int status = consistent ? msfp_check_state(run, &run->work, &run->next) : MSFP_E_STEP;
    if (status)
        return status;
    double plate[3];
    msfp_body_C_get(run->work.body[NB], plate);
    step->energy = run->next.energy + msfp_port_move_anchor(port, run, plate, step->anchor, port->to.of[1][0]);
#if MSFP_UPLIFT
    msfp_port_histories(port, &port->to, step->stages.h); /* event functions read them there */
#endif
    msfp_event_values(run, &run->next, step->after);
    *share = msfp_first_event(run, run->events_now, step->after);
    const msfp_monitor_state before = run->monitor;
    step->tripped = msfp_monitor_step(run, step->after);
    step->monitor = run->monitor;
    run->monitor = before; /* until the step is accepted */
    step->finished = 1;
    return MSFP_OK;
}

int msfp_port_tripped(msfp_port *port)
{
    if (!port->step.finished || !port->step.tripped)
        return 0;
    port->committed.monitor = port->step.monitor;
    return 1;
}

int msfp_port_step_commit(msfp_port *port, double t)
{
    msfp_run *run = &port->committed;
    if (!port->step.finished)
        return MSFP_E_ARGUMENT;
    run->next.t = t;
    run->next.energy = port->step.energy;
    ++run->counts[MSFP_COUNT_STEPS];
    memcpy(run->events_now, port->step.after, sizeof run->events_now);
    run->monitor = port->step.monitor;
    run->now = run->next;
    run->restart = run->retry_after_newton = 0;
    port->from = port->to;
    msfp_port_wrench_of(port, run, &port->from, port->wrench);
    port->step.finished = 0;
    msfp_row *row = &run->rows[0];
    msfp_record(&run->parameters, &run->reached, &run->work, &run->now.mechanical, row);
    row->restraint += msfp_port_springs(port, run, &port->from);
    row->time = t;
    memcpy(row->work, run->now.work, sizeof row->work);
    return MSFP_OK;
}

int msfp_port_jump(msfp_port *port, const double *ends)
{
    memcpy(&port->from, ends, sizeof port->from);
    msfp_port_hold(port);
    const int status = msfp_consistent_initial_state(&port->committed);
    if (status == MSFP_OK) {
        msfp_port_dampers(port, &port->committed, &port->from, 0.0, &port->committed.now);
        msfp_port_wrench_of(port, &port->committed, &port->from, port->wrench);
    }
    return status;
}

int msfp_port_cause(msfp_port *port, int status)
{
    msfp_port_hold(port);
    return msfp_classify_failure(&port->committed, status);
}
