/* implicit.c: one step of a stiffly accurate ESDIRK method on the condensed equations.
 *
 * Unknowns of a stage are the angular rates v; q = Q + beta v and a = (v - V)/beta with beta = gamma h follow
 * from the method's own formula, and Y, Z from theirs, surface by surface. Rates stay out of the error norm.
 */
#include <math.h>
#include <string.h>
#include "newton.h"
#include "heat.h"
#include "tableau.h"

#define DOF MSFP_DOF
#define NB MSFP_NB
#define ND MSFP_ND
#define NQ MSFP_NQ

#define STAGES MSFP_STAGES

static const int unknown[ND] = MSFP_FREE;

typedef struct {
    const msfp_tableau *method;
    double v[STAGES][NB][NQ], a[STAGES][NB][NQ], df[STAGES][NB][2], power[STAGES][MSFP_WORKS], moved[STAGES];
    msfp_stage now; /* the one at work */
} stages;

MSFP_INLINE void add(double *restrict sum, const double *restrict rates, double weight, int count)
{
    for (int i = 0; i < count; ++i)
        sum[i] += weight * rates[i];
}

/* What the first stages add to coordinates, their rates, and Y, Z. */
static void advance(const stages *s, const double *weights, int count, double h, double q[NB][NQ], double v[NB][NQ], double f[NB][2])
{
    for (int j = 0; j < count; ++j) {
        add(&q[0][0], &s->v[j][0][0], h * weights[j], NB * NQ);
        add(&v[0][0], &s->a[j][0][0], h * weights[j], NB * NQ);
        add(&f[0][0], &s->df[j][0][0], h * weights[j], 2 * NB);
    }
}

/* What the stages before leave: q = Q + beta v, v = V + beta a, f = fp + beta df. */
static void prepare(const msfp_run *run, stages *s, int i, double h)
{
    memcpy(s->now.Q, run->now.q, sizeof s->now.Q);
    memcpy(s->now.V, run->now.v, sizeof s->now.V);
    memcpy(s->now.seed.fp, run->now.f, sizeof s->now.seed.fp);
    advance(s, s->method->a[i], i, h, s->now.Q, s->now.V, s->now.seed.fp);
}

/* A rate as it goes on from those of the stages before. */
static double carried(const msfp_run *run, const stages *s, int i, int k, int j, double h)
{
    const double *c = s->method->c;
    const double slope = i > 1 ? (s->v[1][k][j] - s->v[0][k][j]) / c[1] : h * run->now.a[k][j];
    double v = run->now.v[k][j] + c[i] * slope;
    if (i > 2) /* as curved as the last stage says */
        v += c[i] * (c[i] - c[1]) / (c[i - 1] * (c[i - 1] - c[1])) * (s->v[i - 1][k][j] - s->v[0][k][j] - c[i - 1] * slope);
    return v;
}

/* A rate by an acceleration that goes on as it has changed: what a base acceleration linear in time asks for. */
static double driven(const msfp_run *run, const stages *s, int i, int k, int j, double h)
{
    const double *c = s->method->c;
    const double change = i > 1 ? (s->a[i - 1][k][j] - s->a[0][k][j]) / c[i - 1] : h * run->slope[k][j];
    return s->now.V[k][j] + s->now.beta * (s->a[0][k][j] + c[i] * change);
}

static void guess(const msfp_run *run, stages *s, int i, double h, int extrapolate)
{
    const int sampled = run->options.stop_at_knots;
    memcpy(s->now.at.v, run->now.v, sizeof s->now.at.v);
    if (i == 1)
        memcpy(s->now.f, run->now.f, sizeof s->now.f);
    for (int k = 0; k < NB && extrapolate; ++k)
        for (int d = 0; d < ND; ++d)
            s->now.at.v[k][unknown[d]] = (sampled ? driven : carried)(run, s, i, k, unknown[d], h);
}

/* Starts are tried in their order; the last only once a shorter step has not helped either. */
static int solve(msfp_run *run, stages *s, int i, double h)
{
    int status = MSFP_E_NEWTON;
    for (int start = 0; start < MSFP_STARTS && status == MSFP_E_NEWTON; ++start) {
        if (start == MSFP_START_QUASISTATIC && (MSFP_MASSLESS || !run->shortened))
            break;
        run->counts[MSFP_COUNT_OTHER_STARTS] += start == MSFP_START_PLAIN;
        run->counts[MSFP_COUNT_QUASISTATIC_STARTS] += start == MSFP_START_QUASISTATIC;
        guess(run, s, i, h, (run->restart ? MSFP_START_PLAIN : MSFP_START_PREDICTED) == start);
        if (start == MSFP_START_QUASISTATIC)
            msfp_quasistatic_start(run, &s->now);
        status = msfp_solve_stage(run, &s->now);
    }
    return status;
}

/* The integrals of the energy balance as far as a stage, by the weights of the method. */
static void works(const msfp_run *run, const stages *s, int i, double h, double *work)
{
    memcpy(work, run->now.work, sizeof run->now.work);
    for (int j = 0; j <= i; ++j) {
        const double weight = j == i ? s->method->gamma : s->method->a[i][j];
        for (int e = 0; e < MSFP_WORKS; ++e)
            work[e] += h * weight * s->power[j][e];
    }
}

/* Where stiff springs carry the load, angles have no error to speak of and steps are as long as the motion allows, over
 * which a force times a rate is curved: the embedded weights see that, where theirs is the higher order. Rates that ring
 * add up to the right way by the method's own weights alone; those that are prescribed never ring. */
static void refine(const stages *s, double h, int ringing, double *work)
{
    const msfp_tableau *method = s->method;
    for (int j = 0; j < method->stages && method->order <= 3.0; ++j)
        if (ringing)
            work[MSFP_WORK_INPUT] -= h * method->e[j] * s->moved[j];
        else
            for (int e = 0; e < MSFP_WORKS; ++e) /* what stuck friction stores rings whatever the angles do */
                work[e] -= e == MSFP_WORK_FRICTION_STORED ? 0.0 : h * method->e[j] * s->power[j][e];
}

static int stage(msfp_run *run, stages *s, int i, double h)
{
    prepare(run, s, i, h);
    msfp_point_at(run, run->now.t + s->method->c[i] * h, &s->now.at);
    s->now.seed.same_base = 0;
    msfp_heat_prepare(run, s->method->a[i], i, h, s->now.beta, &s->now.at);
    const int status = solve(run, s, i, h);
    if (status)
        return status;
    memcpy(s->v[i], s->now.at.v, sizeof s->v[i]);
    memcpy(s->a[i], s->now.at.a, sizeof s->a[i]);
    msfp_friction_rates(&run->work, s->df[i]);
    run->next.masses = msfp_weigh(&run->parameters, &s->now.at, &run->work);
    msfp_powers(&run->parameters, &s->now.at, s->now.f, &run->work, &run->next.masses, s->power[i]);
    s->moved[i] = msfp_moved_power(&run->parameters, &s->now.at, &run->work);
    msfp_heat_stage(run, i, s->now.beta);
    if (run->middles < MSFP_MIDDLES && i == s->method->middle[run->middles]) {
        msfp_middle *m = &run->middle[run->middles++];
        m->share = s->method->c[i];
        msfp_heat_middle(run, m);
        memcpy(m->q, s->now.at.q, sizeof m->q);
        memcpy(m->v, s->now.at.v, sizeof m->v);
        memcpy(m->f, s->now.f, sizeof m->f);
        works(run, s, i, h, m->work);
    }
    return MSFP_OK;
}

/* Y, Z beyond the unit disc are integration error. How far a step takes them out counts like any other error, the more so
 * the further out they are; being out from before does not, since no shorter step would mend it: sliding brings them back. */
static double beyond_disc(const msfp_run *run, const double f[MSFP_NB][2])
{
    const double rtol = run->options.rtol;
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double *now = run->now.f[j], square = f[j][0] * f[j][0] + f[j][1] * f[j][1];
        if (square <= 1.0)
            continue;
        const double before = fmax(1.0, sqrt(now[0] * now[0] + now[1] * now[1]));
        const double room = fmax(0.05, 1.0 - 0.2 * (before - 1.0) / rtol);
        worst = fmax(worst, (sqrt(square) - before) / (rtol * room));
    }
    return worst;
}

/* A step over a whole reversal has an estimate that may be anything, and nothing to interpolate inside it: Y, Z go half
 * a unit a step at most. As an error, it is cubed for the controller, which takes the cube root. */
double msfp_leap(const double now[MSFP_NB][2], const double next[MSFP_NB][2])
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double y = next[j][0] - now[j][0], z = next[j][1] - now[j][1];
        worst = fmax(worst, y * y + z * z);
    }
    worst = 2.0 * sqrt(worst);
    return worst > 1.0 ? worst * worst * worst : 0.0;
}

/* The embedded estimate of an undamped fast mode is of the size of its ringing, however well the method damps it.
 * Filter it as Hosea and Shampine (1996) do, by (1 - beta J)^-1: the last stage with its history moved by the
 * estimate, solved with the factors at hand. */
static void filter(msfp_run *run, const stages *s, double dq[NB][NQ], double dv[NB][NQ], double df[NB][2])
{
    msfp_stage moved = s->now;
    msfp_work w; /* of its own: that of the run stays as the step ended */
    double residual[DOF];
    moved.seed.same_base = 0;
#if MSFP_LAW
    memcpy(w.coefficient, run->work.coefficient, sizeof w.coefficient);
#endif
    if (run->factored_beta != moved.beta)
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d) {
            moved.Q[k][d] += dq[k][d];
            moved.V[k][d] += dv[k][d];
        }
        for (int d = 0; d < 2; ++d)
            moved.seed.fp[k][d] += df[k][d];
    }
    if (!(msfp_stage_residual(run, &moved, &w, residual) < INFINITY))
        return;
    msfp_lu_solve(run->factors, DOF, run->pivots, residual);
    msfp_stage_move(&moved, residual, 1.0);
    if (!(msfp_stage_residual(run, &moved, &w, residual) < INFINITY))
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d)
            dq[k][d] = moved.at.q[k][d] - s->now.at.q[k][d];
        for (int d = 0; d < 2; ++d)
            df[k][d] = moved.f[k][d] - s->now.f[k][d];
    }
}

int msfp_step_implicit(msfp_run *run, double h, double *error)
{
    stages s;
    double dq[NB][NQ] = { { 0 } }, dv[NB][NQ] = { { 0 } }, df[NB][2] = { { 0 } };
    const msfp_state *now = &run->now;
    msfp_state *next = &run->next;
    const msfp_tableau *method = s.method = msfp_tableau_of(run->options.method);
    const int last = method->stages - 1;
    run->middles = 0;
    const double beta = method->gamma * h;
    s.now.beta = beta;
    s.now.inertia = 1.0;
    s.now.seed.cq = s.now.seed.beta = beta;
    s.now.seed.cv = 1.0;
#if MSFP_FLOW
    s.now.seed.flow = 0;
#endif
    s.now.seed.ca = 1.0 / beta;
    s.now.seed.accuracy = 1e-5 * run->options.rtol;
    memset(s.now.at.a, 0, sizeof s.now.at.a);
    memcpy(s.v[0], now->v, sizeof s.v[0]);
    memcpy(s.a[0], now->a, sizeof s.a[0]);
    memcpy(s.df[0], now->df, sizeof s.df[0]);
    memcpy(s.power[0], now->power, sizeof s.power[0]);
    s.moved[0] = now->moved;
    msfp_heat_begin(run);
    double disc = 0.0;
    for (int i = 1; i <= last; ++i) {
        const int status = stage(run, &s, i, h);
        if (status)
            return status;
        disc = fmax(disc, beyond_disc(run, s.now.f));
    }
    next->t = now->t + h;
    msfp_heat_finish(run);
    memcpy(s.now.at.f, s.now.f, sizeof s.now.f);
    run->reached = s.now.at;
    memcpy(next->q, s.now.at.q, sizeof next->q);
    memcpy(next->v, s.now.at.v, sizeof next->v);
    memcpy(next->a, s.now.at.a, sizeof next->a);
    memcpy(next->f, s.now.f, sizeof next->f);
    memcpy(next->df, s.df[last], sizeof next->df);
    memcpy(next->power, s.power[last], sizeof next->power);
    next->moved = s.moved[last];
    works(run, &s, last, h, next->work);
    advance(&s, method->e, last + 1, h, dq, dv, df);
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < NQ; ++d)
            run->slope[k][d] = (s.a[last][k][d] - s.a[0][k][d]) / h;
    disc = fmax(disc, msfp_leap(now->f, next->f));
    disc = fmax(disc, msfp_heat_error(run, method->e, last + 1, h, beta));
    *error = fmax(disc, msfp_error_norm(run, dq, NULL, df));
    refine(&s, h, *error > 1.0, next->work);
    if (*error > 1.0) {
        filter(run, &s, dq, dv, df);
        *error = fmax(disc, msfp_error_norm(run, dq, NULL, df));
    }
    return MSFP_OK;
}
