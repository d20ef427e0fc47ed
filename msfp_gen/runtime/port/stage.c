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
    const double *top = port->committed.parameters.top, *u = ends->of[1][0], *v = ends->of[1][1];
    double rotation[MSFP_ORDERS][3], angles[MSFP_ORDERS][3];
    memset(at->load, 0, sizeof at->load);
    for (int i = 0; i < 2; ++i)
        at->load[i] = top[MSFP_TOP_PARAMETERS_K] * (u[i] - port->step.anchor[i]) + top[MSFP_TOP_PARAMETERS_C] * v[i];
    at->load[2] = top[MSFP_TOP_PARAMETERS_KV] * u[2] + top[MSFP_TOP_PARAMETERS_CV] * v[2] - port->axial_load;
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(rotation[order], ends->of[0][order] + 3, sizeof rotation[order]);
    msfp_end_angles((const double(*)[3])rotation, angles);
    for (int order = 0; order < MSFP_ORDERS; ++order) {
        memcpy(at->base[order], ends->of[0][order], 3 * sizeof(double));
        memcpy(at->base[order] + 3, angles[order], 3 * sizeof(double));
    }
#if MSFP_TOP_ROTATION
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(rotation[order], ends->of[1][order] + 3, sizeof rotation[order]);
    msfp_end_angles((const double(*)[3])rotation, angles);
    for (int order = 0; order < 2; ++order)
        memcpy(at->support[order], angles[order], 3 * sizeof(double));
#endif
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
    port->tried = port->ready = 0;
    run->status_surface = 0;
    run->status_value = 0.0;
    msfp_stages_begin(run, &port->step.stages, h);
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
            msfp_stage_end(run, s, port->step.stage);
        msfp_stage_begin(run, s, i);
        port->step.stage = i;
    }
    port->step.solved = 0;
    set_ends(port, &to, &s->now.at);
    s->now.seed.same_base = again; /* the lower end moves as it does */
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

/* ---- derivatives: the stage equations differentiated ---- */

/* Derivatives [6][6] of force and moment at the top with respect to the rates of end B at a given bearing. */
static void interface_derivatives(const msfp_port *port, const msfp_work *w, double d[FREEDOMS][FREEDOMS])
{
    const double *top = port->committed.parameters.top, beta = port->step.stages.now.beta;
    memset(d, 0, FREEDOMS * sizeof *d);
    for (int i = 0; i < 2; ++i)
        d[i][i] = -(top[MSFP_TOP_PARAMETERS_C] + beta * top[MSFP_TOP_PARAMETERS_K]);
    d[2][2] = -(top[MSFP_TOP_PARAMETERS_CV] + beta * top[MSFP_TOP_PARAMETERS_KV]);
#if MSFP_TOP_ROTATION
    static const int next[3] = { 1, 2, 0 };
    double upright[MSFP_UPRIGHT_SIZE], axis[3], plate[3], turns[3][3], changes[3][3], rotation[2][3];
    for (int order = 0; order < 2; ++order)
        memcpy(rotation[order], port->to.of[1][order] + 3, sizeof rotation[order]);
    msfp_end_turns((const double(*)[3])rotation, turns, changes);
    msfp_support_axis(&port->step.stages.now.at, upright);
    msfp_upright_e_get(upright, axis);
    msfp_body_t3_get(w->body[NB], plate);
    for (int k = 0; k < 3; ++k) {
        double moved[3]; /* the axis turns */
        for (int i = 0; i < 3; ++i)
            moved[i] = turns[k][next[i]] * axis[next[next[i]]] - turns[k][next[next[i]]] * axis[next[i]];
        for (int i = 0; i < 3; ++i) {
            const int j = next[i], l = next[j];
            d[3 + i][3 + k] =
                beta * top[MSFP_TOP_PARAMETERS_KR] * (moved[j] * plate[l] - moved[l] * plate[j]) -
                top[MSFP_TOP_PARAMETERS_CR] * (turns[k][i] + beta * changes[k][i]);
        }
    }
#else
    (void)w;
#endif
}

/* What a change of the rates of the stage changes at the top: force, moment and position of the plate [..][DOF]. */
typedef struct {
    double wrench[FREEDOMS][DOF], centre[3][DOF];
} columns;

static void read_columns(const msfp_work *w, columns *c)
{
    memcpy(c->wrench, w->dforce[NB], 3 * sizeof *c->wrench);
    memcpy(c->wrench + 3, w->dmoment[NB], 3 * sizeof *c->wrench);
    memcpy(c->centre, w->dbody[NB] + MSFP_BODY_CX * DOF, sizeof c->centre);
}

/* Derivatives [DOF][6] of the residual over N with respect to force and moment at the top. */
static void load_derivatives(msfp_run *run, double derivatives[DOF][FREEDOMS])
{
    for (int begin = 0; begin < FREEDOMS; begin += DOF) { /* DOF at a time */
        double dforce[3 * DOF] = { 0.0 }, dmoment[3 * DOF] = { 0.0 }, found[DOF * DOF];
        for (int k = begin; k < FREEDOMS && k < begin + DOF; ++k)
            (k < 3 ? dforce : dmoment)[k % 3 * DOF + k - begin] = 1.0;
        msfp_load_tangent(&run->parameters, &run->work, dforce, dmoment, found);
        for (int i = 0; i < DOF; ++i)
            for (int k = begin; k < FREEDOMS && k < begin + DOF; ++k)
                derivatives[i][k] = found[i * DOF + k - begin] /
                                    (MSFP_UPLIFT ? 1.0 : run->work.contact[i / ND][MSFP_CONTACT_N]);
    }
}

/* Rates of the stage that follow those of end B: -(dr/dv)^-1 dr/d(force, moment) d(force, moment)/d(end B). */
static void solve_moves(msfp_port *port, double of_load[DOF][FREEDOMS], double of_end[FREEDOMS][FREEDOMS])
{
    msfp_run *run = &port->committed;
    for (int k = 0; k < FREEDOMS; ++k) {
        double rhs[DOF] = { 0.0 };
        for (int i = 0; i < DOF; ++i)
            for (int l = 0; l < FREEDOMS; ++l)
                rhs[i] -= of_load[i][l] * of_end[l][k];
        msfp_lu_solve(run->factors, DOF, run->pivots, rhs);
        for (int i = 0; i < DOF; ++i)
            port->step.moves[i][k] = rhs[i];
    }
    port->step.moved = 1;
}

int msfp_port_stage_derivative(msfp_port *port, double *derivative)
{
    msfp_run *run = &port->committed;
    msfp_stage *s = &port->step.stages.now;
    const msfp_work *w = &run->work;
    double residual[DOF], size, of_load[DOF][FREEDOMS], of_end[FREEDOMS][FREEDOMS], arm[3], force[3];
    static const int next[3] = { 1, 2, 0 };
    columns c;
    int status = msfp_factorise_stage(run, s, residual, &size);
    if (status)
        return status;
    read_columns(w, &c);
    interface_derivatives(port, w, of_end);
    load_derivatives(run, of_load);
    solve_moves(port, of_load, of_end);
    msfp_body_C_get(w->body[NB], arm);
    msfp_force_F_get(w->force[NB], force);
    for (int i = 0; i < 3; ++i)
        arm[i] -= port->plate[i] + port->to.of[1][0][i];
    for (int k = 0; k < FREEDOMS; ++k) { /* end B exerts -F, and -M and the moment of -F about its position */
        double change[FREEDOMS], moved[3];
        for (int i = 0; i < FREEDOMS; ++i) {
            change[i] = -of_end[i][k];
            for (int l = 0; l < DOF; ++l)
                change[i] -= c.wrench[i][l] * port->step.moves[l][k];
        }
        for (int i = 0; i < 3; ++i) {
            moved[i] = i == k ? -s->beta : 0.0;
            for (int l = 0; l < DOF; ++l)
                moved[i] += c.centre[i][l] * port->step.moves[l][k];
        }
        for (int i = 0; i < 3; ++i) {
            const int j = next[i], l = next[j];
            derivative[i * FREEDOMS + k] = change[i];
            derivative[(3 + i) * FREEDOMS + k] = change[3 + i] + arm[j] * change[l] - arm[l] * change[j] -
                                                 moved[j] * force[l] + moved[l] * force[j];
        }
    }
    return msfp_all_finite(derivative, FREEDOMS * FREEDOMS) ? MSFP_OK : MSFP_E_FINITE;
}

/* ---- the end of a step ---- */

/* The histories of the committed run between the ends of a step of length h [s]. */
static void set_histories(msfp_port *port, const msfp_ends *to, double h)
{
    msfp_run *run = &port->committed;
    port->knots[0] = run->now.t;
    port->knots[1] = run->now.t + h;
    port->knots[2] = run->now.t + 2.0 * h;
    msfp_base_path(&port->from, to, h, &port->motion);
    msfp_interface_path(&run->parameters, &port->from, to, h, port->axial_load, &port->load);
    run->motion.held = run->load.held = 0;
#if MSFP_TOP_ROTATION
    msfp_support_path(&port->from, to, h, &port->support);
    run->support.held = 0;
#endif
}

int msfp_port_step_end(msfp_port *port, double *error, double *share)
{
    msfp_run *run = &port->committed;
    msfp_port_step *step = &port->step;
    const double energy = run->now.energy;
    *share = 1.0;
    msfp_stage_end(run, &step->stages, step->stage);
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
    set_histories(port, &port->to, step->stages.h); /* event functions read them there */
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
    row->time = t;
    memcpy(row->work, run->now.work, sizeof row->work);
    return MSFP_OK;
}

void msfp_port_hold(msfp_port *port)
{
    msfp_run *run = &port->committed;
    set_histories(port, &port->from, 1.0);
    msfp_port_move_anchor(port, run, run->rows[0].top, port->from.of[1][0], port->from.of[1][0]);
}

int msfp_port_jump(msfp_port *port, const double *ends)
{
    memcpy(&port->from, ends, sizeof port->from);
    msfp_port_hold(port);
    const int status = msfp_consistent_initial_state(&port->committed);
    if (status == MSFP_OK)
        msfp_port_wrench_of(port, &port->committed, &port->from, port->wrench);
    return status;
}

int msfp_port_cause(msfp_port *port, int status)
{
    msfp_port_hold(port);
    return msfp_classify_failure(&port->committed, status);
}
