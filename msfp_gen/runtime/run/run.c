/* run.c: the loop of a run: step size, jumps, events, output. It returns after some steps, so that a caller may
 * interrupt. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "run.h"

enum {
    ROWS_OF_STEP = 10000, /* rows inside one step, at most: those of a long rest need not fit into memory */
    STABILITY_LIMIT_STEPS =
        500 /* consecutive steps; rim contact causes a few (Hairer and Wanner, Solving ODEs II, IV.2: 15) */
};

static int solve_initial_state(msfp_run *run)
{
    msfp_point at;
    msfp_solution solution = { 0, 0, 0.0 };
    double g[NB][2], residual[MSFP_DOF];
    msfp_stage_weights weights = { 0 };
    msfp_to_point(run, &run->now, &at);
    memset(at.a, 0, sizeof at.a);
    if (!MSFP_MASSLESS) {
        const int status = msfp_accelerations(&run->parameters, &at, &run->work, &solution);
        if (status)
            return status;
        if (run->options.method != MSFP_METHOD_DOPRI5 && run->determinant == 0)
            run->determinant = solution.determinant;
    }
    memcpy(weights.fp, at.f, sizeof weights.fp);
    memcpy(g, at.f, sizeof g);
    const int status = msfp_condensed(&run->parameters, &at, &weights, &run->work, g, residual, NULL);
    if (status)
        return status;
    msfp_state_of(run, &at, at.f, &run->now);
    msfp_memory_state(&run->parameters, &run->work, &run->now, 0.0, &run->now);
    msfp_powers_of(run, &at, &run->now);
    msfp_energy_balance_begin(run, &at);
    memset(run->acceleration_slope, 0, sizeof run->acceleration_slope);
    run->have_unknowns = 0;
    run->restart = 1;
    msfp_quasistatic_begin(run, &at, run->now.load_power);
    return msfp_check_state(run, &run->work, &run->now);
}

/* Where the inputs are finite and the solution is not, Newton's method has diverged. */
int msfp_consistent_initial_state(msfp_run *run)
{
    const int status = solve_initial_state(run);
    msfp_point at;
    if (status != MSFP_E_FINITE)
        return status;
    msfp_to_point(run, &run->now, &at);
    const int given = msfp_all_finite(&at.base[0][0], 18) && msfp_all_finite(at.load, 6);
    return given ? MSFP_E_NEWTON : status;
}

/* Copy a history without the state of its last search. */
static void copy_history(msfp_history *own, const msfp_history *given)
{
    *own = *given;
    own->last = own->held = 0;
}

int msfp_run_start(msfp_run *run, const msfp_parameters *p, const msfp_history *motion, const msfp_history *load,
                   const msfp_history *support, const double *jumps, int jump_count, const msfp_options *options,
                   const double *q, const double *v, const double *f)
{
    memset(run, 0, sizeof *run);
    run->parameters = *p;
    copy_history(&run->motion, motion);
    copy_history(&run->load, load);
#if MSFP_TOP_ROTATION
    copy_history(&run->support, support);
#else
    (void)support;
#endif
    run->jumps = jumps;
    run->jump_count = jump_count;
    run->options = *options;
    memcpy(run->now.q, q, sizeof run->now.q);
    memcpy(run->now.v, v, sizeof run->now.v);
    memcpy(run->now.f, f, sizeof run->now.f);
    run->now.t = options->start_time;
#if MSFP_MEMORY
    if (options->memory)
        memcpy(run->now.memory, options->memory, sizeof run->now.memory);
#endif
    while (run->next_jump < jump_count && jumps[run->next_jump] <= run->now.t)
        ++run->next_jump;
    msfp_point at;
    msfp_to_point(run, &run->now, &at);
    if (options->foot)
        memcpy(run->now.foot, options->foot, 2 * sizeof *options->foot);
    else
        msfp_foot_at_rest(p, &at, run->now.foot);
    run->status = msfp_consistent_initial_state(run);
    if (run->status)
        return run->status;
    msfp_row row;
    msfp_observe_state(run, &run->now, &row);
    for (int i = 0; i < 3; ++i)
        run->start[i] = options->origin ? options->origin[i] : row.base[i] - row.top[i];
    run->h = options->first_step > 0.0 ? options->first_step : fmin(1e-4, 1e-3 * (options->duration - run->now.t));
    run->previous_error = 1.0;
    msfp_extremes_begin(run, &row);
    msfp_event_values(run, &run->now, run->events_now);
    msfp_monitor_begin(run);
    run->status = msfp_write_row(run, &run->now);
    if (options->output_step > 0.0)
        run->output_time = msfp_next_output(run);
    return run->status;
}

/* Whether the step ends where a prescribed history has a jump or a kink. */
static int at_stop(const msfp_run *run)
{
    const msfp_options *o = &run->options;
    return run->stop < o->stop_count && fabs(run->next.t - o->stops[run->stop]) <= msfp_smallest_step(run->next.t);
}

/* The step h, shortened to what histories, rows and the scene allow. */
static double allowed_step(msfp_run *run, double h)
{
    const msfp_options *o = &run->options;
    h = msfp_allowed_step(o->span_ends, o->span_steps, o->span_count, &run->span, run->now.t, h);
    if (o->output_step > 0.0)
        h = fmin(h, ROWS_OF_STEP * o->output_step);
    return o->max_step > 0.0 ? fmin(h, o->max_step) : h;
}

/* Latest time [s] at which the next step may end. */
static double latest_end(msfp_run *run)
{
    const msfp_options *o = &run->options;
    double end = fmin(o->duration, msfp_next_stop(o->stops, o->stop_count, &run->stop, run->now.t));
    if (run->next_jump < run->jump_count)
        end = fmin(end, run->jumps[run->next_jump]);
    if (run->options.output_step > 0.0 && msfp_is_quasistatic(run)) /* a step costs no more than a row */
        end = fmin(end, run->output_time);
    return end;
}

/* One step of length h of the method. */
static int step_of_method(msfp_run *run, double h, double *error)
{
#if MSFP_DOPRI5 /* other models refuse it */
    if (run->options.method == MSFP_METHOD_DOPRI5)
        return msfp_step_dopri5(run, h, error);
#endif
    return msfp_is_quasistatic(run) ? msfp_step_quasistatic(run, h, error) : msfp_step_implicit(run, h, error);
}

/* The same, with what a step must satisfy; it is not accepted yet. A prescribed step repeats one of another run, so that
 * derivatives follow by differences: it is not refused for its energy balance. */
static int try_step(msfp_run *run, double h, int prescribed, double *error)
{
    run->status_surface = 0;
    run->status_value = 0.0;
    const int status = step_of_method(run, h, error);
    if (status)
        return status;
    if (!(*error < INFINITY))
        return MSFP_E_FINITE;
    if (*error > 1.0)
        return MSFP_OK;
    return prescribed || msfp_energy_consistent(run) ? msfp_check_state(run, &run->work, &run->next) : MSFP_E_STEP;
}

/* Shorten the step after a failure. Returns 1 where the step is already the smallest: the run ends. */
static int shorten_step(msfp_run *run, double h, double factor, int status)
{
    /* The time at which a body leaves the stack is known well enough before steps are lost in roundoff. */
    const double smallest = status == MSFP_E_SEPARATED ? MSFP_SHORTEST_TO_EVENT : MSFP_CLOSE;
    run->h = h * factor;
    if (run->h >= smallest * fmax(1.0, run->now.t))
        return 0;
    run->status = msfp_classify_failure(run, status);
    return 1;
}

/* Accept the step: record it and make its end the present state. */
static int accept(msfp_run *run, const double *before, double *after, int located, double error, double h)
{
    ++run->counts[MSFP_COUNT_STEPS];
    /* A step that was cut to end at a given time says little about the step size: the earlier proposal stands. */
    const int cut = h < 0.9 * run->h && error < 0.5;
    const double factor = msfp_step_factor(error, run->previous_error, msfp_control_order(run->options.method));
    run->h = fmax(h * factor, cut ? run->h : 0.0);
    run->previous_error = error;
    run->restart = run->retry_after_newton = 0;
    if (run->stability_limit_steps >= STABILITY_LIMIT_STEPS)
        run->status = msfp_classify_failure(run, MSFP_E_STIFF);
    const int stop = msfp_record_events(run, before, after, located);
    if (run->status == MSFP_OK)
        run->status = msfp_write_step(run);
    if (run->status)
        return 0;
    msfp_extremes_step(run);
    if (stop && run->options.output_step > 0.0)
        run->status = msfp_write_row(run, &run->next);
    if (run->status == MSFP_OK)
        run->status = MSFP_HOOK(run, step_accepted(run, before, after), MSFP_OK);
    if (run->status)
        return 0;
    if (run->options.sampled && at_stop(run)) /* the slope of the accelerations changes here */
        memset(run->acceleration_slope, 0, sizeof run->acceleration_slope);
    run->now = run->next;
#if MSFP_CLOSED_FORM
    run->step_history = run->next_step_history;
#endif
    memcpy(run->events_now, after, sizeof run->events_now);
    if (stop)
        run->status = MSFP_STOPPED;
    else if (run->next_jump < run->jump_count && run->now.t >= run->jumps[run->next_jump] - msfp_smallest_step(run->now.t)) {
        run->now.t = fmax(run->now.t, run->jumps[run->next_jump++]);
        run->status = msfp_consistent_initial_state(run);
        if (run->status == MSFP_OK)
            run->status = MSFP_HOOK(run, jumped(run), MSFP_OK);
        run->h = fmin(run->h, 1e-4);
    }
    return run->status == MSFP_OK;
}

/* One accepted step, or a rejected one with a shorter proposal. Returns 0 where the run ends. */
static int one_step(msfp_run *run)
{
    double error = 0.0, before[MSFP_EVENTS], after[MSFP_EVENTS];
    const double end = latest_end(run), left = end - run->now.t;
    double h = allowed_step(run, run->h);
    if (msfp_is_quasistatic(run))
        h = msfp_limit_step(run, h);
    h = h > 0.999 * left ? left : h > 0.5 * left ? 0.5 * left : h;
    const long step = run->counts[MSFP_COUNT_STEPS];
    const double prescribed = step < run->end_count ? run->ends[step] - run->now.t : 0.0;
    if (prescribed > 0.0)
        h = prescribed;
    int relocations = 0;
    for (;; ++relocations) {
        const int status = try_step(run, h, prescribed > 0.0, &error);
        if (status) {
            run->counts[MSFP_COUNT_NEWTON_FAILURES] += status == MSFP_E_NEWTON;
            run->retry_after_newton |= status == MSFP_E_NEWTON;
            ++run->counts[MSFP_COUNT_REJECTED_STEPS];
            return !shorten_step(run, h, prescribed > 0.0 ? 0.0 : 0.25, status); /* a prescribed step stays as it is */
        }
        if (error > 1.0 && !(prescribed > 0.0)) {
            ++run->counts[MSFP_COUNT_REJECTED_STEPS];
            const double factor = msfp_shrink_factor(error, msfp_control_order(run->options.method));
            return !shorten_step(run, h, factor, MSFP_E_STEP);
        }
        memcpy(before, run->events_now, sizeof before);
        msfp_event_values(run, &run->next, after);
        const double share = relocations < MSFP_RELOCATIONS && !(prescribed > 0.0) ? msfp_first_event(run, before, after) : 1.0;
        if (share >= 1.0)
            break;
        h = msfp_step_to_event(h, share);
    }
    if (fabs(run->next.t - end) <= msfp_smallest_step(run->next.t)) /* end exactly there */
        run->next.t = end;
    if (msfp_monitor_step(run, after)) {
        run->status = MSFP_E_MONITOR;
        return 0;
    }
    return accept(run, before, after, relocations > 0, error, h);
}

static int finished(const msfp_run *run)
{
    return run->now.t >= run->options.duration - msfp_smallest_step(run->options.duration);
}

int msfp_run_advance(msfp_run *run, long steps)
{
    /* The caller may have changed coefficients of a history since the last call. */
    run->motion.held = run->load.held = 0;
#if MSFP_TOP_ROTATION
    run->support.held = 0;
#endif
    for (long i = 0; i < steps && run->status == MSFP_OK; ++i) {
        if (finished(run))
            return 0;
        if (run->options.row_limit && run->row_count >= run->options.row_limit)
            break;
        if ((double)(run->counts[MSFP_COUNT_STEPS] + run->counts[MSFP_COUNT_REJECTED_STEPS]) >=
            run->options.max_steps) {
            run->status = MSFP_E_STEPS;
            break;
        }
        if (!one_step(run))
            return 0;
    }
    return run->status == MSFP_OK && !finished(run);
}

void msfp_run_free(msfp_run *run)
{
    free(run->rows);
    free(run->events);
    run->rows = NULL;
    run->events = NULL;
}
