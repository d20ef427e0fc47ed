/* run.c: the loop of a run: step size, events, jumps, output. Resumable, so that a caller can look in between. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "run.h"
#include "heat.h"

#define SMALLEST_STEP 1e-9     /* [s], far below any period of a bearing */
#define AT_LIMIT 500           /* steps in a row; fewer pass by where a rim is met (Hairer and Wanner, Solving ODEs II, IV.2: 15) */
#define SHORTEST_TO_EVENT 1e-6 /* [s]; an event nearer than this is stepped over: rounding would drown a step to it */


static const int unknown[MSFP_ND] = MSFP_FREE;

const char *msfp_status_name(int status)
{
    static const char *const names[] = { "ok", "stopped", "newton", "step", "irregular", "uplift", "angle", "steps", "finite", "memory", "guard", "parted", "stiff" };
    return names[status];
}

void msfp_point_at(msfp_run *run, double t, msfp_point *at)
{
    /* Up to a jump the motion is that of the piece before it. */
    if (run->next_jump < run->jump_count && t >= run->jumps[run->next_jump])
        t = nextafter(run->jumps[run->next_jump], -INFINITY);
    msfp_history_at(&run->motion, t, 3, at->base);
    msfp_history_at(&run->load, t, 1, (double(*)[6])at->load);
#if MSFP_TURNED
    msfp_history_at(&run->support, t, 2, at->support);
#endif
}

/* Absolute tolerance of a coordinate: the solver's for angles; a separation's that of the force it stands for, as for Y, Z. */
double msfp_absolute(const msfp_run *run, int j, int d)
{
    if (d < 3)
        return run->options.atol_angle;
    return 10.0 * run->options.rtol * run->work.reference / run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_KS];
}

double msfp_error_norm(const msfp_run *run, const double dq[MSFP_NB][MSFP_NQ], const double dv[MSFP_NB][MSFP_NQ], const double df[MSFP_NB][2])
{
    const double rtol = run->options.rtol;
    double worst = 0.0;
    for (int k = 0; k < NB; ++k) {
        for (int i = 0; i < MSFP_ND; ++i) {
            const int d = unknown[i];
            const double atol = msfp_absolute(run, k, d);
            const double q = fmax(fabs(run->now.q[k][d]), fabs(run->next.q[k][d]));
            worst = fmax(worst, fabs(dq[k][d]) / (atol + rtol * q));
            if (dv)
                worst = fmax(worst, fabs(dv[k][d]) / (atol + rtol * fabs(run->now.v[k][d])));
        }
        for (int d = 0; d < 2; ++d)
            worst = fmax(worst, fabs(df[k][d]) / (10.0 * rtol));
    }
    return worst;
}

/* ---- the loop ------------------------------------------------------------------------------------------------ */

/* Accelerations, friction rates and powers of the present state: at the start and after a jump of the base acceleration. */
static int settle(msfp_run *run)
{
    msfp_point at;
    msfp_solution solution = { 0, 0, 0.0 };
    double f[NB][2], residual[MSFP_DOF];
    msfp_seed seed = { 0 };
    msfp_to_point(run, &run->now, &at);
    memset(at.a, 0, sizeof at.a);
    if (!MSFP_MASSLESS) {
        const int status = msfp_accelerations(&run->parameters, &at, &run->work, &solution);
        if (status)
            return status;
        if (run->options.method != MSFP_DOPRI5 && run->determinant == 0)
            run->determinant = solution.determinant;
    }
    memcpy(seed.fp, at.f, sizeof seed.fp);
    memcpy(f, at.f, sizeof f);
    const int status = msfp_condensed(&run->parameters, &at, &seed, &run->work, f, residual, NULL);
    if (status)
        return status;
    memcpy(run->now.a, at.a, sizeof at.a);
    msfp_friction_rates(&run->work, run->now.df);
    msfp_heat_settle(run);
    run->now.masses = msfp_weigh(&run->parameters, &at, &run->work);
    msfp_powers(&run->parameters, &at, at.f, &run->work, &run->now.masses, run->now.power);
    run->now.moved = msfp_moved_power(&run->parameters, &at, &run->work);
    msfp_balance_begin(run, &at);
    memset(run->slope, 0, sizeof run->slope);
    run->have_unknowns = 0;
    run->restart = 1;
    msfp_quasistatic_begin(run, &at);
    return msfp_check_state(run, &run->work, &run->now);
}

/* A history as its maker describes it; what is at hand of it is ours. */
static void take(msfp_history *own, const msfp_history *given)
{
    *own = *given;
    own->last = own->held = 0;
}

int msfp_run_start(msfp_run *run, const msfp_parameters *p, const msfp_history *motion, const msfp_history *load,
#if MSFP_TURNED
                   const msfp_history *support,
#endif
                   const double *jumps, int jump_count, const msfp_options *options,
                   const double *q, const double *v, const double *f)
{
    memset(run, 0, sizeof *run);
    run->parameters = *p;
    take(&run->motion, motion);
    take(&run->load, load);
#if MSFP_TURNED
    take(&run->support, support);
#endif
    run->jumps = jumps;
    run->jump_count = jump_count;
    run->options = *options;
    memcpy(run->now.q, q, sizeof run->now.q);
    memcpy(run->now.v, v, sizeof run->now.v);
    memcpy(run->now.f, f, sizeof run->now.f);
    run->now.t = options->start_time;
#if MSFP_HEAT
    if (options->heat)
        memcpy(run->now.heat, options->heat, sizeof run->now.heat);
#endif
    while (run->next_jump < jump_count && jumps[run->next_jump] <= run->now.t)
        ++run->next_jump;
    run->status = settle(run);
    if (run->status)
        return run->status;
    msfp_row row;
    msfp_observe_state(run, &run->now, &row);
    for (int i = 0; i < 3; ++i)
        run->start[i] = options->origin ? options->origin[i] : row.base[i] - row.top[i];
    run->h = options->first_step > 0.0 ? options->first_step : fmin(1e-4, 1e-3 * (options->duration - run->now.t));
    run->previous_error = 1.0;
    msfp_event_values(run, &run->now, run->events_now);
    msfp_guard_begin(run);
    run->status = msfp_write_row(run, &run->now);
    if (options->output_step > 0.0)
        run->output_time = msfp_next_output(run);
    return run->status;
}

/* Times closer than this are one time: what rounding leaves of a step that was to land there [s]. */
static double same_time(double t) { return 1e-12 * fmax(1.0, t); }

/* Whether the base acceleration may have a kink where the run is. */
static int at_knot(const msfp_run *run)
{
    const msfp_history *m = &run->motion;
    return fabs(run->now.t - m->knots[m->last]) <= same_time(run->now.t) || fabs(run->now.t - m->knots[m->last + 1]) <= same_time(run->now.t);
}

/* The knot of a history that comes next. */
static double next_knot(const msfp_history *h, double t)
{
    int i = h->last;
    while (i > 0 && h->knots[i] > t)
        --i;
    while (i < h->pieces && h->knots[i] <= t + same_time(t))
        ++i;
    return h->knots[i] > t ? h->knots[i] : INFINITY;
}

static double target(const msfp_run *run)
{
    double end = run->options.duration;
    if (run->options.stop_at_knots)
        end = fmin(end, next_knot(&run->motion, run->now.t));
    if (run->options.stop_at_loads)
        end = fmin(end, next_knot(&run->load, run->now.t));
    if (run->next_jump < run->jump_count)
        end = fmin(end, run->jumps[run->next_jump]);
    if (run->options.output_step > 0.0 && msfp_is_quasistatic(run)) /* a step is as cheap as a row */
        end = fmin(end, run->output_time);
    return end;
}

static int try_step(msfp_run *run, double h, double *error)
{
    run->status_surface = 0;
    run->status_value = 0.0;
    const int status = run->options.method == MSFP_DOPRI5 ? msfp_step_dopri5(run, h, error)
                       : msfp_is_quasistatic(run)           ? msfp_step_quasistatic(run, h, error)
                                                            : msfp_step_implicit(run, h, error);
    if (status)
        return status;
    if (!(*error < INFINITY))
        return MSFP_E_FINITE;
    if (*error > 1.0)
        return MSFP_OK;
    return msfp_balanced(run) ? msfp_check_state(run, &run->work, &run->next) : MSFP_E_STEP;
}

static double controlled(const msfp_run *run, double error)
{
    const double order = msfp_order(run->options.method);
    const double e = fmax(error, 1e-6), last = fmax(run->previous_error, 1e-6);
    return fmin(5.0, fmax(0.2, 0.9 * pow(e, -0.7 / order) * pow(last, 0.4 / order)));
}

/* Shrink after a failure that a shorter step may cure. Returns nonzero when there is no shorter step. */
static int shrink(msfp_run *run, double h, double factor, int status)
{
    /* The moment in which a body leaves is known well enough before steps in flight are nothing but rounding. */
    const double smallest = status == MSFP_E_PARTED ? SHORTEST_TO_EVENT : SMALLEST_STEP;
    run->h = h * factor;
    if (run->h >= smallest * fmax(1.0, run->now.t))
        return 0;
    run->status = msfp_last_word(run, status);
    return 1;
}

/* After an accepted step: record, move on. */
static int accept(msfp_run *run, const double *before, const double *after, double error, double h)
{
    ++run->counts[MSFP_COUNT_STEPS];
    /* A step cut short to land on a time says little: the one proposed before still stands. */
    const int cut = h < 0.9 * run->h && error < 0.5;
    run->h = fmax(h * controlled(run, error), cut ? run->h : 0.0);
    run->previous_error = error;
    run->restart = run->shortened = 0;
    if (run->at_limit >= AT_LIMIT)
        run->status = msfp_last_word(run, MSFP_E_STIFF);
    const int stop = msfp_record_events(run, before, after);
    if (run->status == MSFP_OK)
        run->status = msfp_write_step(run);
    if (run->status)
        return 0;
    run->now = run->next;
#if MSFP_FLOW
    run->passage = run->passing;
#endif
    if (run->options.stop_at_knots && at_knot(run)) /* a kink */
        memset(run->slope, 0, sizeof run->slope);
    memcpy(run->events_now, after, sizeof run->events_now);
    if (stop) {
        if (run->options.output_step > 0.0)
            msfp_write_row(run, &run->now);
        run->status = MSFP_STOPPED;
        return 0;
    }
    if (run->next_jump < run->jump_count && run->now.t >= run->jumps[run->next_jump]) {
        ++run->next_jump;
        run->status = settle(run);
        run->h = fmin(run->h, 1e-4);
    }
    return run->status == MSFP_OK;
}

static int one_step(msfp_run *run)
{
    double error = 0.0, before[MSFP_EVENTS], after[MSFP_EVENTS];
    const double left = target(run) - run->now.t;
    double h = run->h;
    if (run->options.max_step > 0.0)
        h = fmin(h, run->options.max_step);
    if (msfp_is_quasistatic(run))
        h = msfp_foreseen(run, h);
    h = h > 0.999 * left ? left : h > 0.5 * left ? 0.5 * left : h;
    for (int relocations = 0;; ++relocations) {
        const int status = try_step(run, h, &error);
        if (status) {
            run->counts[MSFP_COUNT_NEWTON_FAILURES] += status == MSFP_E_NEWTON;
            run->shortened |= status == MSFP_E_NEWTON;
            ++run->counts[MSFP_COUNT_REJECTED];
            return !shrink(run, h, 0.25, status);
        }
        if (error > 1.0) {
            ++run->counts[MSFP_COUNT_REJECTED];
            return !shrink(run, h, fmax(0.1, 0.9 * pow(error, -1.0 / msfp_order(run->options.method))), MSFP_E_STEP);
        }
        memcpy(before, run->events_now, sizeof before);
        msfp_event_values(run, &run->next, after);
        const double share = relocations < 4 ? msfp_first_event(run, before, after) : 1.0;
        if (share >= 1.0)
            break;
        h = fmin(0.99 * h, fmax(h * share, SHORTEST_TO_EVENT));
    }
    if (fabs(run->next.t - target(run)) <= same_time(run->next.t)) /* land on the target exactly */
        run->next.t = target(run);
    if (msfp_guarded(run, after)) {
        run->status = MSFP_E_GUARD;
        return 0;
    }
    return accept(run, before, after, error, h);
}

int msfp_run_advance(msfp_run *run, long steps)
{
    for (long i = 0; i < steps && run->status == MSFP_OK; ++i) {
        if (run->now.t >= run->options.duration)
            return 0;
        if ((double)(run->counts[MSFP_COUNT_STEPS] + run->counts[MSFP_COUNT_REJECTED]) >= run->options.max_steps) {
            run->status = MSFP_E_STEPS;
            break;
        }
        if (!one_step(run))
            return 0;
    }
    return run->status == MSFP_OK && run->now.t < run->options.duration;
}

void msfp_run_free(msfp_run *run)
{
    free(run->rows);
    free(run->events);
    run->rows = NULL;
    run->events = NULL;
}
