/* accepted_step.c: the derivatives of a step that the run has accepted: tangents of its stages, its length, events. */
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
static const double shortest_settling = 0.02, longest_settling = 0.1; /* of what follows a rim contact [s] */
static const double slight_pull = 1e-3; /* of the normal force: a pull that does not change the motion */

/* Whether the row of the end of the step enters what is recorded. */
static int end_is_recorded(const msfp_run *run)
{
    return msfp_is_quasistatic(run) || run->row_count > run->gradients->row_count || msfp_step_has_extreme(run);
}

/* Factored tangents of the stages of the step, at the evaluations that solved them. */
static int factorise(msfp_run *run)
{
    msfp_stage_history *stage_history = &run->gradients->stage_history;
    const int last = msfp_last_stage(run), energies = run->gradients->energies;
    stage_history->all_slopes = energies || end_is_recorded(run);
    for (int i = 1; i <= last; ++i) {
        msfp_stage *s = &stage_history->stage[i];
        const int status = msfp_tangent_with_slopes(&run->parameters, &s->at, &s->weights, &stage_history->work[i],
                                                    s->g, energies || (i == last && stage_history->all_slopes),
                                                    &stage_history->slopes[i], stage_history->factors[i]);
        if (status)
            return status;
        if (msfp_lu(stage_history->factors[i], DOF, stage_history->pivots[i]) == 0)
            return MSFP_E_IRREGULAR;
    }
    return MSFP_OK;
}

/* Surface whose rim the slider meets or leaves at the end of the step, to which the step was shortened; -1: none. A
 * fast slider may end beyond the tolerance, because no step to an event is shorter than a microsecond. */
static int rim_at_end(const msfp_run *run, const double *before, const double *after)
{
    for (int j = 0; j < NB && MSFP_RIMS; ++j) {
        const double tolerance = 1e-6 * run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_SC];
        const int crosses = (before[j] > 0.0) != (after[j] > 0.0);
        if (fabs(before[j]) > tolerance && (crosses || fabs(after[j]) <= fmax(tolerance, 1e-3 * fabs(before[j]))))
            return j;
    }
    return -1;
}

/* Whether the end of the step is a time that does not depend on the parameters. Steps that follow an event keep their
 * length, so that they move with it: their errors then depend on the time since the event, which does not change. Once
 * the event has settled, and steps have grown with the time since it, they move no longer: errors of long steps, and of
 * rows inside them, depend on where the steps are. The step that ends the motion must itself be short. */
static int ends_at_fixed_time(const msfp_run *run)
{
    const msfp_options *o = &run->options;
    const double t = run->next.t, since_event = t - run->gradients->event_time;
    const double share = (t - run->now.t) / since_event;
    const int settled = since_event > longest_settling ||
                        (since_event > shortest_settling && share > 0.1 && share < 0.5);
    return settled || t == o->duration || (run->stop < o->stop_count && t == o->stops[run->stop]) ||
           (run->next_jump < run->jump_count && t == run->jumps[run->next_jump]);
}

/* Columns of the state at the end of the step, whose length has the columns batch->h. */
static void step_columns(msfp_run *run, msfp_parameter_batch *batch)
{
    batch->end_known = 0;
    msfp_step_columns(run, batch);
    for (int c = 0; c < C; ++c)
        batch->next.t[c] = batch->now.t[c] + batch->h[c];
}

/* Columns of the accepted step, and of the rows inside it, up to row `rows` of the run. rim: the surface whose rim is met or left at its end, -1:
 * none. The step then ends where the gap is zero, so that its length depends on the parameters, but not its rows. */
static int accepted_columns(msfp_run *run, size_t rows, int rim, int fixed)
{
    struct msfp_gradients *g = run->gradients;
    memset(g->recording.node_known, 0, sizeof g->recording.node_known);
    int status = factorise(run);
    if (status)
        return status;
    for (int i = 0; i < g->batches; ++i) {
        for (int c = 0; c < C; ++c)
            g->batch[i].h[c] = fixed ? -g->batch[i].now.t[c] : 0.0;
        step_columns(run, &g->batch[i]);
    }
    if (rows > g->row_count)
        status = msfp_record_rows_columns(run, rows);
    for (int i = 0; i < g->batches && rim >= 0; ++i) {
        msfp_columns dt;
        msfp_event_time_columns(run, &g->batch[i], MSFP_EVENT_RIM_CONTACT, rim, dt);
        msfp_add_columns(&g->batch[i].h, (const msfp_columns *)&dt, 1.0, 1);
        step_columns(run, &g->batch[i]);
    }
    return status;
}

/* Take the step once more, to where the gap of rim j is zero while the contact is as it was before: without this rim,
 * or with a rim that holds the slider. Into run->next and the stage history; returns a status. */
static int take_step_to_event(msfp_run *run, int j, int meets)
{
    const double tolerance = 1e-9 * run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_SC];
    double error, rate, gap = INFINITY, h = run->next.t - run->now.t;
    if (meets)
        run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_KC] =
            run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_CC] = 0.0;
    else
        run->parameters.rim_cosine[j] = 2.0; /* a rim that pulls too */
    for (int i = 0; i < 4 && fabs(gap) > tolerance; ++i) {
        const int status = msfp_step_implicit(run, h, &error);
        if (status)
            return status;
        gap = msfp_event_at_end(run, MSFP_EVENT_RIM_CONTACT, j, &rate);
        if (meets ? rate >= 0.0 : rate <= 0.0)
            return MSFP_E_STEP;
        h = fmax(0.5 * h, h - gap / rate);
    }
    const double pull = fmax(0.0, run->work.rim[j][MSFP_RIM_FC]);
    return pull > slight_pull * run->work.contact[j][MSFP_CONTACT_N] ? MSFP_E_STEP : MSFP_OK;
}

/* Columns of a step at whose end a rim is met or left. The run finds the event to the tolerance of the gap, and the
 * last stages of its step may be beyond it, where rates of light sliders and of massless bodies have changed. The
 * columns are therefore those of a step that ends at the event, with the contact as it was before; where the damper of
 * a rim that is left would pull, those of the step as it was taken. */
static int columns_to_event(msfp_run *run, size_t rows, int rim, int fixed, int meets)
{
    struct msfp_gradients *g = run->gradients;
    int status;
    double error;
    g->own = *run;
    status = take_step_to_event(run, rim, meets);
    if (status) {
        *run = g->own;
        status = msfp_step_implicit(run, run->next.t - run->now.t, &error);
    }
    if (!status)
        status = accepted_columns(run, rows, rim, fixed);
    *run = g->own;
    memset(g->recording.node_known, 0, sizeof g->recording.node_known);
    g->event_time = run->next.t;
    return status;
}

int msfp_accepted_step_columns(msfp_run *run, const double *before, const double *after)
{
    struct msfp_gradients *g = run->gradients;
    if (g->count == 0)
        return MSFP_OK;
    const int stopped = run->event_count > g->event_count && run->events[run->event_count - 1].kind == MSFP_EVENT_STOP;
    const int last_row = stopped && run->options.output_step > 0.0; /* the last row is that of the state at the end */
    const size_t rows = run->row_count - last_row;
    const int prescribed = run->end_count > 0 || msfp_is_quasistatic(run);
    const int rim = prescribed ? -1 : rim_at_end(run, before, after);
    const int fixed = prescribed || ends_at_fixed_time(run);
    g->stage_history.state[0] = run->now;
    int status = rim < 0 ? accepted_columns(run, rows, rim, fixed)
                         : columns_to_event(run, rows, rim, fixed, before[rim] > 0.0);
    if (!status)
        status = msfp_record_extremes_columns(run);
    if (!status && last_row)
        status = msfp_record_state_columns(run, 0);
    for (int i = 0; i < g->batches; ++i) {
        msfp_parameter_batch *batch = &g->batch[i];
        batch->now = batch->next;
        batch->start_known = batch->end_known && rim < 0; /* the next step starts after the event */
        if (batch->start_known)
            memcpy(batch->start_row, batch->end_row, sizeof batch->end_row);
    }
    return status;
}
#endif
