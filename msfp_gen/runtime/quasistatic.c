/* quasistatic.c: steps of a planar model without masses, which need no integration.
 *
 * Where no force depends on a rate, where the bodies are follows from where they were and from how far each surface has
 * slipped since: (3.18) in the plane is a law of slip, not of time, and flows in closed form as long as slip does not
 * turn back within a step. So a step is one set of moment balances, exact whatever its length. Rates are those of the
 * parabola through three states; the small forces of dampers are all that sees them.
 */
#include <math.h>
#include <string.h>
#include "newton.h"
#include "stack.h"

#define NQ MSFP_NQ
#define ANGLE 1 /* theta, the unknown of a planar body */

int msfp_is_quasistatic(const msfp_run *run)
{
    return MSFP_FLOW && run->options.quasistatic;
}

#if MSFP_FLOW
/* What the next step wants to know of a state. */
static void pass(msfp_passage *to, const msfp_point *at, const msfp_work *w)
{
    double C[3];
    msfp_body_C_get(w->body[NB], C);
    memcpy(to->load, at->load, sizeof to->load);
    to->tilt = at->base[0][3 + ANGLE];
    for (int i = 0; i < 3; ++i)
        to->top[i] = C[i] - at->base[0][i];
    for (int k = 0; k < NB; ++k) {
        to->tilt += at->q[k][ANGLE];
        to->normal[k] = w->contact[k][MSFP_CONTACT_N];
    }
}

void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at)
{
    run->passage.h = run->passage.span = 0.0;
    memset(run->passage.jerk, 0, sizeof run->passage.jerk);
    pass(&run->passage, at, &run->work);
    if (msfp_is_quasistatic(run)) /* the load's work is counted by itself */
        run->now.power[MSFP_WORK_INPUT] -= msfp_load_power(at, &run->work);
}

/* q = Q + beta v makes v the slope at the end of the parabola through the last two states and the next. */
static void through(const msfp_run *run, msfp_stage *s, double h)
{
    const double r = run->passage.h > 0.0 ? h / run->passage.h : 0.0;
    s->beta = h * (1.0 + r) / (1.0 + 2.0 * r);
    for (int k = 0; k < NB; ++k) {
        const double now = run->now.q[k][ANGLE];
        s->Q[k][ANGLE] = now + r * r / (1.0 + 2.0 * r) * (now - run->passage.q[k]);
        s->seed.turn[k] = s->Q[k][ANGLE] - now;
        s->seed.fp[k][0] = run->now.f[k][0];
    }
    s->seed.cq = s->seed.beta = s->beta;
    s->seed.cv = 1.0;
    s->seed.flow = 1;
}

/* What a cubic through the last four states adds to the parabola, where it adds little. */
static double cube(const msfp_run *run, int k, double h)
{
    const double c = run->passage.jerk[k] * h * (h + run->passage.h) * (h + run->passage.span);
    const double b = 0.5 * run->now.a[k][ANGLE] * h * (h + run->passage.h);
    return fabs(c) < 0.5 * fabs(b) + 0.02 * fabs(h * run->now.v[k][ANGLE]) ? c : 0.0;
}

/* Rates at which Newton starts: those of a motion that goes on as it went, or of bodies that stay. */
static void begin(const msfp_run *run, msfp_stage *s, double h, int on)
{
    for (int k = 0; k < NB; ++k) {
        const double turn = on ? h * (run->now.v[k][ANGLE] + 0.5 * h * run->now.a[k][ANGLE]) + cube(run, k, h) : 0.0;
        s->at.v[k][ANGLE] = (turn - s->seed.turn[k]) / s->beta;
        s->f[k][0] = run->now.f[k][0];
    }
}

static int solve(msfp_run *run, msfp_stage *s, double h)
{
    int status = MSFP_E_NEWTON;
    for (int on = 1; on >= 0 && status == MSFP_E_NEWTON; --on) {
        run->counts[MSFP_COUNT_OTHER_STARTS] += !on;
        begin(run, s, h, on);
        status = msfp_solve_stage(run, s);
    }
    return status;
}

/* How far Y may be off because a surface slips to and fro within the step: the way back of the parabola. Where slip turns
 * sharply that goes with the length of the step, elsewhere with its square; as an error it is squared for the controller,
 * which takes the cube root. */
static double retraced(const msfp_run *run, double h)
{
    double worst = 0.0;
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], bend = run->next.a[k][ANGLE];
        const double mean = (run->next.q[k][ANGLE] - run->now.q[k][ANGLE]) / h;
        const double first = mean - 0.5 * h * bend, last = mean + 0.5 * h * bend;
        if (first * last < 0.0) {
            const double v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE];
            double back = 0.5 * fmin(first * first, last * last) / fabs(bend);
            if (v * a < 0.0) /* it was about to turn back as it was */
                back = fmin(back, 0.5 * v * v / fabs(a));
            worst = fmax(worst, back * par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY]);
        }
    }
    worst /= 10.0 * run->options.rtol;
    return worst * worst;
}

/* A step after which no Y has gone further than half a unit and no surface turns back, as far as the motion goes on as it
 * went. */
double msfp_foreseen(const msfp_run *run, double h)
{
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE];
        const double reach = par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY];
        if (v * (v + a * h) < 0.0 && 0.5 * v * v / fabs(a) * reach > 5.0 * run->options.rtol)
            h = fmax(-v / a, 0.02 * h);
    }
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], v = run->now.v[k][ANGLE], a = run->now.a[k][ANGLE], Y = run->now.f[k][0];
        for (int i = 0; i < 20; ++i) {
            const double slip = msfp_reach(par) * h * (v + 0.5 * h * a);
            if (fabs(slip) <= 0.4 || fabs(msfp_flown(Y, slip) - Y) <= 0.4) /* Y goes no further than the slip */
                break;
            h *= 0.7;
        }
    }
    return h;
}

/* Second divided difference of the last three powers: with it the parabola through them is integrated. */
static double bend(const msfp_run *run, double h, const double *power, int e)
{
    const double last = run->passage.h;
    if (last <= 0.0)
        return 0.0;
    return ((power[e] - run->now.power[e]) / h - (run->now.power[e] - run->passage.power[e]) / last) / (h + last);
}

/* What friction stored and lost in the step, by its flow; mu N by its mean. */
static void flow_work(const msfp_run *run, double work[MSFP_WORKS])
{
    for (int k = 0; k < NB; ++k) {
        const double *par = run->parameters.surface[k], Y = run->now.f[k][0], end = run->next.f[k][0];
        const double turn = run->next.q[k][ANGLE] - run->now.q[k][ANGLE];
        const double scale = 0.5 * (run->passage.normal[k] + run->passing.normal[k]) * par[MSFP_SURFACE_PARAMETERS_MU]
                             * par[MSFP_SURFACE_PARAMETERS_DY];
        work[MSFP_WORK_FRICTION_STORED] += scale * 0.5 * (end * end - Y * Y);
        work[MSFP_WORK_FRICTION] += scale * msfp_flow_loss(Y, msfp_reach(par) * turn);
    }
}

/* What the load did, by how far the top went. */
static double load_work(const msfp_run *run)
{
    const msfp_passage *from = &run->passage, *to = &run->passing;
    double work = 0.5 * (from->load[3 + ANGLE] + to->load[3 + ANGLE]) * (to->tilt - from->tilt);
    for (int i = 0; i < 3; ++i)
        work += 0.5 * (from->load[i] + to->load[i]) * (to->top[i] - from->top[i]);
    return work;
}

/* Work of the step: friction and load by what they went through, whatever its length; the rest of the input and the
 * losses of small dampers by the parabola through three powers. */
static void count_work(msfp_run *run, const msfp_stage *s, double h)
{
    msfp_state *next = &run->next;
    next->masses = msfp_weigh(&run->parameters, &s->at, &run->work);
    msfp_other_powers(&run->parameters, &s->at, &run->work, &next->masses, next->power);
    next->power[MSFP_WORK_INPUT] -= msfp_load_power(&s->at, &run->work);
    for (int e = 0; e < MSFP_WORKS; ++e)
        if (e != MSFP_WORK_FRICTION && e != MSFP_WORK_FRICTION_STORED)
            next->work[e] += 0.5 * h * (run->now.power[e] + next->power[e]) - bend(run, h, next->power, e) * h * h * h / 6.0;
    flow_work(run, next->work);
    next->work[MSFP_WORK_INPUT] += load_work(run);
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
        run->passing.q[k] = now->q[k][ANGLE];
        run->passing.jerk[k] = run->passage.span > 0.0 ? 0.5 * (next->a[k][ANGLE] - now->a[k][ANGLE]) / (h + run->passage.span) : 0.0;
    }
    run->passing.h = h;
    run->passing.span = run->passage.h > 0 ? h + run->passage.h : 0.0;
    memcpy(run->passing.power, now->power, sizeof now->power);
    pass(&run->passing, &s->at, &run->work);
}

int msfp_step_quasistatic(msfp_run *run, double h, double *error)
{
    msfp_stage s;
    memset(&s, 0, sizeof s);
    through(run, &s, h);
    msfp_point_at(run, run->now.t + h, &s.at);
    run->middles = 0;
    const int status = solve(run, &s, h);
    if (status)
        return status;
    finish(run, &s, h);
    *error = fmax(msfp_leap(run->now.f, run->next.f), retraced(run, h));
    if (*error <= 1.0)
        count_work(run, &s, h);
    return MSFP_OK;
}
#else
void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at)
{
    (void)run;
    (void)at;
}

double msfp_foreseen(const msfp_run *run, double h)
{
    (void)run;
    return h;
}

int msfp_step_quasistatic(msfp_run *run, double h, double *error)
{
    return msfp_step_implicit(run, h, error);
}
#endif
