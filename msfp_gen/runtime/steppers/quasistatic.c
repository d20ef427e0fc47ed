/* quasistatic.c: steps of a planar model without masses, which solve the force balance and integrate nothing.
 *
 * Where no force depends on a rate, the new positions follow from the old ones and from the slip of each surface: in
 * the plane (3.18) is an equation in slip, not in time, with a solution in closed form while the slip does not reverse
 * within a step. A step is therefore one set of moment balances, exact for any length. Rates are those of the parabola
 * through three states; only small damping forces depend on them.
 */
#include <math.h>
#include <string.h>
#include "steppers.h"

int msfp_is_quasistatic(const msfp_run *run)
{
    return MSFP_CLOSED_FORM && run->options.quasistatic;
}

#if MSFP_CLOSED_FORM
enum { ANGLE = 1 }; /* theta, the unknown of a planar body */
static const double largest_change = 0.4; /* of Y in a step, as extrapolated */

/* What the next step uses of the evaluation in `w`. */
static void store_state(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, msfp_step_history *to)
{
    msfp_end_of_load(p, at, w, to->load_end);
    for (int k = 0; k < NB; ++k)
        to->normal[k] = w->contact[k][MSFP_CONTACT_N];
}

void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at, double load_power)
{
    run->step_history.h = run->step_history.span = 0.0;
    memset(run->step_history.jerk, 0, sizeof run->step_history.jerk);
    store_state(&run->parameters, at, &run->work, &run->step_history);
    if (msfp_is_quasistatic(run)) /* the work of the load is summed separately */
        run->now.power[MSFP_WORK_INPUT] -= load_power;
}

/* Q and beta with which q = Q + beta v is the end of the parabola through the last two states whose end slope is v. */
static void parabola(const msfp_run *run, msfp_stage *s, double h)
{
    const double r = run->step_history.h > 0.0 ? h / run->step_history.h : 0.0;
    s->beta = h * (1.0 + r) / (1.0 + 2.0 * r);
    for (int k = 0; k < NB; ++k) {
        const double now = run->now.q[k][ANGLE];
        s->from.q[k][ANGLE] = now + r * r / (1.0 + 2.0 * r) * (now - run->step_history.q[k]);
        s->weights.slip[k][MSFP_SLIP_Y] = run->now.f[k][0];
        s->weights.slip[k][MSFP_SLIP_TURN] = s->from.q[k][ANGLE] - now;
        s->weights.slip[k][MSFP_SLIP_BETA] = s->beta;
    }
    s->weights.q_weight = s->weights.beta = s->beta;
    s->weights.v_weight = 1.0;
    s->weights.closed_form = 1;
}

/* The term that a cubic through the last four states adds to the parabola; 0 where it is large and unreliable. */
static double cubic_term(const msfp_run *run, int k, double h)
{
    const double c = run->step_history.jerk[k] * h * (h + run->step_history.h) * (h + run->step_history.span);
    const double b = 0.5 * run->now.a[k][ANGLE] * h * (h + run->step_history.h);
    return fabs(c) < 0.5 * fabs(b) + 0.02 * fabs(h * run->now.v[k][ANGLE]) ? c : 0.0;
}

/* First guess of Newton's method: rates of the extrapolated motion, or of bodies at rest. */
static void guess(const msfp_run *run, msfp_stage *s, double h, int extrapolate)
{
    for (int k = 0; k < NB; ++k) {
        const double turn =
            extrapolate ? h * (run->now.v[k][ANGLE] + 0.5 * h * run->now.a[k][ANGLE]) + cubic_term(run, k, h) : 0.0;
        s->at.v[k][ANGLE] = (turn - s->weights.slip[k][MSFP_SLIP_TURN]) / s->beta;
    }
}

static int solve(msfp_run *run, msfp_stage *s, double h)
{
    int status = MSFP_E_NEWTON;
    for (int extrapolate = 1; extrapolate >= 0 && status == MSFP_E_NEWTON; --extrapolate) {
        run->counts[MSFP_COUNT_OTHER_STARTS] += !extrapolate;
        guess(run, s, h, extrapolate);
        status = msfp_solve_stage(run, s);
    }
    return status;
}

/* Error of Y of a surface whose slip reverses within the step: the slip of the parabola after its turning point. It
 * grows with the square of the step, where slip reverses sharply with the step itself; it is squared because the step
 * control takes the cube root. */
static double reversal_error(const msfp_run *run, double h)
{
    double worst = 0.0;
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], bend = run->next.a[k][ANGLE];
        const double mean = (run->next.q[k][ANGLE] - run->now.q[k][ANGLE]) / h;
        const double first = mean - 0.5 * h * bend, last = mean + 0.5 * h * bend;
        if (first * last < 0.0) {
            const double v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE];
            double back = 0.5 * fmin(first * first, last * last) / fabs(bend);
            if (v * a < 0.0) /* the reversal was extrapolated already */
                back = fmin(back, 0.5 * v * v / fabs(a));
            worst = fmax(worst, back * par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY]);
        }
    }
    worst /= 10.0 * run->options.rtol;
    return worst * worst;
}

/* Change of Y of surface k when the body turns by `turn` [rad], which is at most the slip over d_y. */
static double friction_change(const msfp_run *run, int k, double turn)
{
    const double *par = run->parameters.surface[k];
    const double bound = fabs(turn) * par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY];
    if (bound <= largest_change)
        return bound;
    return fabs(msfp_friction_after_turn(par, run->now.f[k][0], turn) - run->now.f[k][0]);
}

double msfp_limit_step(const msfp_run *run, double h)
{
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE];
        const double per_turn = par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY];
        if (v * (v + a * h) < 0.0 && 0.5 * v * v / fabs(a) * per_turn > 5.0 * run->options.rtol)
            h = fmax(-v / a, 0.02 * h);
    }
    for (int k = 0; k < NB; ++k) {
        const double v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE];
        for (int i = 0; i < 20 && friction_change(run, k, h * (v + 0.5 * h * a)) > largest_change; ++i)
            h *= 0.7;
    }
    return h;
}

void msfp_quasistatic_restart(msfp_run *run)
{
    if (!msfp_is_quasistatic(run))
        return;
    run->next_step_history.h = run->next_step_history.span = 0.0;
    memset(run->next_step_history.jerk, 0, sizeof run->next_step_history.jerk);
    run->h *= 0.1;
}

void msfp_parabola_works(const double *before, const double *now, const double *next, double last, double h, int width,
                         double *work)
{
    for (int i = 0; i < MSFP_WORKS * width; ++i) {
        const double bend = last > 0.0 ? ((next[i] - now[i]) / h - (now[i] - before[i]) / last) / (h + last) : 0.0;
        if (i / width != MSFP_WORK_FRICTION_DISSIPATED && i / width != MSFP_WORK_FRICTION_STORED)
            work[i] += 0.5 * h * (now[i] + next[i]) - bend * h * h * h / 6.0;
    }
}

/* Work stored and dissipated by friction in the step, in closed form with the mean of mu N. */
static void friction_work(const msfp_run *run, double work[MSFP_WORKS])
{
    for (int k = 0; k < NB; ++k) {
        const double slip[MSFP_SLIP_SIZE] = { [MSFP_SLIP_Y] = run->now.f[k][0],
                                              [MSFP_SLIP_TURN] = run->next.q[k][ANGLE] - run->now.q[k][ANGLE] };
        const double end[MSFP_SLIP_END_SIZE] = {
            run->next.f[k][0], 0.5 * (run->step_history.normal[k] + run->next_step_history.normal[k])
        };
        double done[MSFP_SLIP_WORK_SIZE];
        msfp_work_of_slip(run->parameters.surface[k], slip, end, done);
        work[MSFP_WORK_FRICTION_STORED] += done[MSFP_SLIP_WORK_STORED];
        work[MSFP_WORK_FRICTION_DISSIPATED] += done[MSFP_SLIP_WORK_LOST];
    }
}

/* Work of the step: of friction and load from slip and displacement, exact for any length; of the remaining input and
 * of small dampers from the parabola through three powers. */
static void count_work(msfp_run *run, const msfp_stage *s, double h)
{
    msfp_state *next = &run->next;
    next->mechanical = msfp_mechanical_energy(&run->parameters, &s->at, &run->work);
    const msfp_input_parts parts =
        msfp_powers(&run->parameters, &s->at, &run->work, &next->mechanical, next->power);
    next->power[MSFP_WORK_INPUT] -= parts.load;
    msfp_parabola_works(run->step_history.power, run->now.power, next->power, run->step_history.h, h, 1, next->work);
    friction_work(run, next->work);
    next->work[MSFP_WORK_INPUT] += msfp_work_of_load(run->step_history.load_end, run->next_step_history.load_end);
}

static void finish(msfp_run *run, msfp_stage *s, double h)
{
    const msfp_state *now = &run->now;
    msfp_state *next = &run->next;
    *next = *now;
    next->t = now->t + h;
    memcpy(s->at.f, s->f, sizeof s->f);
    run->reached = s->at;
    memcpy(next->q, s->at.q, sizeof next->q);
    memcpy(next->v, s->at.v, sizeof next->v);
    memcpy(next->f, s->f, sizeof next->f);
    msfp_friction_rates(&run->work, next->df);
    for (int k = 0; k < NB; ++k) {
        const double mean = (next->q[k][ANGLE] - now->q[k][ANGLE]) / h;
        next->a[k][ANGLE] = 2.0 * (next->v[k][ANGLE] - mean) / h;
        run->next_step_history.q[k] = now->q[k][ANGLE];
        run->next_step_history.jerk[k] =
            run->step_history.span > 0.0 ? 0.5 * (next->a[k][ANGLE] - now->a[k][ANGLE]) / (h + run->step_history.span)
                                         : 0.0;
    }
    run->next_step_history.h = h;
    run->next_step_history.span = run->step_history.h > 0 ? h + run->step_history.h : 0.0;
    memcpy(run->next_step_history.power, now->power, sizeof now->power);
    store_state(&run->parameters, &s->at, &run->work, &run->next_step_history);
}

int msfp_step_quasistatic(msfp_run *run, double h, double *error)
{
    msfp_stage s;
    memset(&s, 0, sizeof s);
    parabola(run, &s, h);
    memcpy(s.at.foot, run->now.foot, sizeof s.at.foot); /* no mass rests on a spring: its end is fixed */
    msfp_point_at(run, run->now.t + h, &s.at);
    run->node_count = 0;
    const int status = solve(run, &s, h);
    if (status)
        return status;
    finish(run, &s, h);
    MSFP_HOOK(run, stage_solved(run, 1, &s, &run->next), (void)0);
    *error = fmax(msfp_friction_jump_error(&run->now, &run->next), reversal_error(run, h));
    count_work(run, &s, h);
    return MSFP_OK;
}
#else
void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at, double load_power)
{
    (void)run;
    (void)at;
    (void)load_power;
}

double msfp_limit_step(const msfp_run *run, double h)
{
    (void)run;
    return h;
}

void msfp_quasistatic_restart(msfp_run *run) { (void)run; }

int msfp_step_quasistatic(msfp_run *run, double h, double *error)
{
    return msfp_step_implicit(run, h, error);
}
#endif
