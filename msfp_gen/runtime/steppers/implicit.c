/* implicit.c: one step of a stiffly accurate ESDIRK method on the condensed equations.
 *
 * Unknowns of a stage are the angular rates v. The stage formula gives q = from.q + beta v and a = (v - from.v)/beta with
 * beta = gamma h, and surface by surface Y, Z. Rates do not enter the error norm.
 */
#include <math.h>
#include <string.h>
#include "steppers.h"

static const int unknown[ND] = MSFP_FREE;

void msfp_stage_begin(msfp_run *run, msfp_stages *s, int i)
{
    msfp_state *from = &s->now.from;
    memcpy(from, &run->now, offsetof(msfp_state, a)); /* without rates */
    msfp_add_rates(from, s->stage, s->method->a[i], i, s->h);
    msfp_known_of_stage((const double *)from, s->now.beta, 1, s->now.weights.fp[0], s->now.at.foot);
    s->now.at.foot_beta = s->now.beta;
    s->now.weights.same_base = 0;
    msfp_memory_point(&run->parameters, from, s->now.beta, &s->now.at);
}

/* Rate j of body k at stage i, extrapolated from the earlier stages. */
static double extrapolated_rate(const msfp_run *run, const msfp_stages *s, int i, int k, int j, double h)
{
    const double *c = s->method->c;
    const msfp_state *stage = s->stage;
    const double slope = i > 1 ? (stage[1].v[k][j] - stage[0].v[k][j]) / c[1] : h * run->now.a[k][j];
    double v = run->now.v[k][j] + c[i] * slope;
    if (i > 2) /* curvature from the last stage */
        v += c[i] * (c[i] - c[1]) / (c[i - 1] * (c[i - 1] - c[1])) *
             (stage[i - 1].v[k][j] - stage[0].v[k][j] - c[i - 1] * slope);
    return v;
}

/* The same from its acceleration, where the motion is sampled. */
static double rate_of_extrapolated_acceleration(const msfp_run *run, const msfp_stages *s, int i, int k, int j, double h)
{
    return msfp_guess_rate(s->method->c, i, s->now.from.v[k][j], s->now.beta, s->stage[0].a[k][j], s->stage[i - 1].a[k][j],
                           h * run->acceleration_slope[k][j]);
}

/* First guess of stage i. */
static void guess(const msfp_run *run, msfp_stages *s, int i, double h, int extrapolate)
{
    const int sampled = run->options.sampled;
    memcpy(s->now.at.v, run->now.v, sizeof s->now.at.v);
    for (int k = 0; k < NB && i == 1; ++k)
        for (int d = 0; d < 2; ++d)
            s->now.g[k][d] =
                run->now.f[k][d] + run->parameters.surface[k][MSFP_SURFACE_PARAMETERS_TD] * run->now.df[k][d];
    for (int k = 0; k < NB && extrapolate; ++k)
        for (int d = 0; d < ND; ++d)
            s->now.at.v[k][unknown[d]] =
                (sampled ? rate_of_extrapolated_acceleration : extrapolated_rate)(run, s, i, k, unknown[d], h);
}

/* First guesses are tried in the order of enum msfp_start, the last one only if a shorter step has failed as well. */
int msfp_stage_solve(msfp_run *run, msfp_stages *s, int i)
{
    int status = MSFP_E_NEWTON;
    for (int start = 0; start < MSFP_STARTS && status == MSFP_E_NEWTON; ++start) {
        if (start == MSFP_START_QUASISTATIC && (MSFP_MASSLESS || !run->retry_after_newton))
            break;
        run->counts[MSFP_COUNT_OTHER_STARTS] += start == MSFP_START_PLAIN;
        run->counts[MSFP_COUNT_QUASISTATIC_STARTS] += start == MSFP_START_QUASISTATIC;
        guess(run, s, i, s->h, (run->restart ? MSFP_START_PLAIN : MSFP_START_PREDICTED) == start);
        if (start == MSFP_START_QUASISTATIC)
            msfp_quasistatic_start(run, &s->now);
        status = msfp_solve_stage(run, &s->now);
    }
    return status;
}

int msfp_stage_take(msfp_run *run, msfp_stages *s, int i)
{
    msfp_stage_begin(run, s, i);
    msfp_point_at(run, run->now.t + s->method->c[i] * s->h, &s->now.at);
    return msfp_stage_solve(run, s, i);
}

/* Where the solution is smooth, third-order weights integrate the work: they see the curvature of power over a long
 * step. Rates that ring are integrated correctly by the weights of the method alone; prescribed rates never ring. */
void msfp_refine_works(const msfp_tableau *method, const double *stages, size_t size, double h, int ringing, int width,
                       double *work)
{
    for (int j = 0; j < method->stages && method->order <= 3.0; ++j, stages += size) {
        const double *power = ringing ? MSFP_FROM(stages, prescribed_power, width) : MSFP_FROM(stages, power, width);
        for (int e = 0; e < (ringing ? MSFP_WORK_INPUT + 1 : MSFP_WORKS); ++e)
            if (e != MSFP_WORK_FRICTION_STORED) /* which always rings where friction is stuck */
                msfp_add(work + e * width, power + e * width, -h * method->e[j], width);
    }
}
MSFP_STATIC_ASSERT(MSFP_WORK_INPUT == 0, input_comes_first);

/* Error of Y, Z outside the unit disc. Only the distance by which this step moves them outwards counts, with a weight
 * that grows with the distance already reached: a shorter step cannot reduce what was there before, and sliding does.
 */
static double unit_disc_error(const msfp_run *run, const msfp_stage *s)
{
    const double rtol = run->options.rtol;
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double *now = run->now.f[j], *f = s->f[j], square = f[0] * f[0] + f[1] * f[1];
        if (square <= 1.0)
            continue;
        const double before = fmax(1.0, sqrt(now[0] * now[0] + now[1] * now[1]));
        const double room = fmax(0.05, 1.0 - 0.2 * (before - 1.0) / rtol);
        worst = fmax(worst, (sqrt(square) - before) / (rtol * room));
    }
    return worst;
}

void msfp_stage_end(msfp_run *run, msfp_stages *s, int i)
{
    memcpy(s->now.at.f, s->now.f, sizeof s->now.at.f);
    msfp_state *stage = &s->stage[i];
    stage->t = run->now.t + s->method->c[i] * s->h;
    stage->energy = 0.0; /* known once the step is accepted */
    msfp_state_of(run, &s->now.at, s->now.f, stage);
    msfp_powers_of(run, &s->now.at, stage);
    msfp_memory_state(&run->parameters, &run->work, &s->now.from, s->now.beta, stage);
    for (int e = 0; e < MSFP_WORKS; ++e)
        stage->work[e] = s->now.from.work[e] + s->h * s->method->gamma * stage->power[e];
    if (run->node_count < MSFP_NODES && i == s->method->nodes[run->node_count]) {
        msfp_node *node = &run->node[run->node_count++];
        node->share = s->method->c[i];
        node->state = *stage;
        msfp_force_F_get(run->work.force[NB], node->top_force);
    }
    s->other = fmax(s->other, unit_disc_error(run, &s->now));
    MSFP_HOOK(run, stage_solved(run, i, &s->now, stage), (void)0);
}

/* The embedded estimate of an undamped fast mode is as large as its ringing, although the method damps it. As Hosea and
 * Shampine (1996) do, it is filtered by (1 - beta J)^-1: the last stage is solved with its history moved by the
 * estimate, with the present factors. */
static void filter(msfp_run *run, const msfp_stages *s, msfp_state *estimate)
{
    msfp_stage moved = s->now;
    msfp_work w; /* separate, so that run->work keeps the end of the step */
    double residual[DOF];
    moved.weights.same_base = 0;
#if MSFP_LAW
    memcpy(w.coefficient, run->work.coefficient, sizeof w.coefficient);
#endif
    if (run->factored_beta != moved.beta)
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d) {
            moved.from.q[k][d] += estimate->q[k][d];
            moved.from.v[k][d] += estimate->v[k][d];
        }
        for (int d = 0; d < 2; ++d)
            moved.weights.fp[k][d] += estimate->f[k][d];
    }
    moved.at.foot[0] += estimate->foot[0] + moved.beta * estimate->foot[1];
    moved.at.foot[1] += estimate->foot[1];
    if (!(msfp_stage_residual(run, &moved, &w, residual) < INFINITY))
        return;
    msfp_lu_solve(run->factors, DOF, run->pivots, residual);
    msfp_stage_move(&moved, residual, 1.0);
    if (!(msfp_stage_residual(run, &moved, &w, residual) < INFINITY))
        return;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d)
            estimate->q[k][d] = moved.at.q[k][d] - s->now.at.q[k][d];
        for (int d = 0; d < 2; ++d)
            estimate->f[k][d] = moved.f[k][d] - s->now.f[k][d];
    }
    estimate->foot[0] = w.foot[MSFP_FOOT_Y] - run->work.foot[MSFP_FOOT_Y];
}

void msfp_stages_begin(msfp_run *run, msfp_stages *s, double h)
{
    s->method = msfp_tableau_of(run->options.method);
    const double beta = s->method->gamma * h;
    run->node_count = run->nodes_observed = 0;
    s->h = h;
    s->other = 0.0;
    s->now.beta = beta;
    s->now.inertia = 1.0;
    s->now.weights.q_weight = s->now.weights.beta = beta;
    s->now.weights.v_weight = 1.0;
#if MSFP_CLOSED_FORM
    s->now.weights.closed_form = 0;
#endif
    s->now.weights.a_weight = 1.0 / beta;
    s->now.weights.accuracy = 1e-5 * run->options.rtol;
    memset(s->now.at.a, 0, sizeof s->now.at.a);
    s->stage[0] = run->now;
}

void msfp_stages_end(msfp_run *run, msfp_stages *s, double *error)
{
    msfp_state estimate = { 0 };
    const msfp_state *now = &run->now;
    msfp_state *next = &run->next;
    const msfp_tableau *method = s->method;
    const int last = method->stages - 1;
    const double h = s->h;
    *next = s->stage[last];
    next->t = now->t + h;
    run->reached = s->now.at;
    msfp_add_rates(&estimate, s->stage, method->e, last + 1, h);
    for (int k = 0; k < NB; ++k)
        for (int d = 0; d < NQ; ++d)
            run->acceleration_slope[k][d] = (next->a[k][d] - now->a[k][d]) / h;
    double other = fmax(s->other, msfp_friction_jump_error(now, next));
    other = fmax(other, msfp_memory_error(run, &estimate, next, s->now.beta));
    *error = fmax(other, msfp_error_norm(run, &estimate, 0));
    run->ringing = *error > 1.0;
    msfp_refine_works(method, (const double *)s->stage, sizeof *s->stage / sizeof(double), h, run->ringing, 1,
                      next->work);
    if (run->ringing) {
        filter(run, s, &estimate);
        *error = fmax(other, msfp_error_norm(run, &estimate, 0));
    }
}

int msfp_step_implicit(msfp_run *run, double h, double *error)
{
    msfp_stages s;
    msfp_stages_begin(run, &s, h);
    for (int i = 1; i < s.method->stages; ++i) {
        const int status = msfp_stage_take(run, &s, i);
        if (status)
            return status;
        msfp_stage_end(run, &s, i);
    }
    msfp_stages_end(run, &s, error);
    return MSFP_OK;
}
