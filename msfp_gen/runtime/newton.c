/* newton.c: Newton's method on the equations of one stage. The ladder it is part of is in docs/stability.md. */
#include <math.h>
#include <string.h>
#include "newton.h"
#if MSFP_BATCH
#include "batch.h"
#endif

#define DOF MSFP_DOF
#define NB MSFP_NB
#define ND MSFP_ND
#define NQ MSFP_NQ

#if MSFP_FLOW
#define FLOWS(s) ((s)->seed.flow)
#else
#define FLOWS(s) 0
#endif

#define MOST 30      /* steps */
#define PATIENT 10   /* steps before a residual may be that of a jump */
#define ARRIVED 1e-3 /* a residual above this is never the last */

static const int unknown[ND] = MSFP_FREE;

static void place(msfp_stage *s)
{
    if (FLOWS(s)) { /* the plane, no masses */
        for (int k = 0; k < NB; ++k)
            s->at.q[k][unknown[0]] = s->Q[k][unknown[0]] + s->beta * s->at.v[k][unknown[0]];
        return;
    }
    const double rate = s->inertia / s->beta;
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < NQ; ++d)
            s->at.q[k][d] = s->Q[k][d] + s->beta * s->at.v[k][d];
        for (int i = 0; i < ND; ++i)
            s->at.a[k][unknown[i]] = rate * (s->at.v[k][unknown[i]] - s->V[k][unknown[i]]);
    }
}

/* Newton works on moments over N, which has the same root: the balance of a light slider is N times a lever that
 * nearly vanishes, and a heavy top makes N itself depend strongly on the rates. Dividing removes that product. */
static void over_normal(const msfp_work *w, double *residual)
{
    if (MSFP_UPLIFT) /* N follows from the seat, not from the rates, and may vanish */
        return;
    for (int k = 0; k < NB; ++k)
        for (int i = k * ND; i < (k + 1) * ND; ++i)
            residual[i] /= w->contact[k][MSFP_CONTACT_N];
}

static void tangent_over_normal(const msfp_work *w, const double *residual, double *tangent)
{
    if (MSFP_UPLIFT)
        return;
    for (int k = 0; k < NB; ++k) {
        const double inverse = 1.0 / w->contact[k][MSFP_CONTACT_N];
        for (int i = k * ND; i < (k + 1) * ND; ++i)
            for (int c = 0; c < DOF; ++c)
                tangent[i * DOF + c] = inverse * (tangent[i * DOF + c] - residual[i] * w->dnormal[k][c]);
    }
}

/* Residual over N, its largest entry relative to its natural size and the tangent (or NULL). Returns a status. */
static int evaluate(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual, double *tangent, double *size)
{
    ++run->counts[MSFP_COUNT_EVALUATIONS];
#if MSFP_BATCH
    msfp_request request = { &run->parameters, 0, &s->at, &s->seed, w, s->f, residual, tangent, 1, s->keep, MSFP_OK, -1, INFINITY,
                             s->descend ? s : NULL, run->factors, run->pivots, s->descend, 0 };
    s->taken = 0;
    if (!FLOWS(s) && msfp_batch_asked(&request)) {
        s->descend = 0;
        run->counts[MSFP_COUNT_NEWTON] += s->taken;
        run->counts[MSFP_COUNT_EVALUATIONS] += request.more;
        if (request.more)
            place(s);
        if (!request.status) {
            *size = request.size;
            run->worst_surface = request.worst < 0 ? run->worst_surface : request.worst / ND + 1;
        }
        return request.status;
    }
#endif
    int worst = -1;
    const int status = msfp_condensed(&run->parameters, &s->at, &s->seed, w, s->f, residual, tangent);
    if (status)
        return status;
    s->seed.same_base = 1;
    *size = msfp_residual_size(&run->parameters, w, residual, &worst);
    run->worst_surface = worst < 0 ? run->worst_surface : worst / ND + 1;
    over_normal(w, residual);
    if (tangent)
        tangent_over_normal(w, residual, tangent);
    return MSFP_OK;
}

double msfp_stage_residual(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual)
{
    double size;
    place(s);
    if (evaluate(run, s, w, residual, NULL, &size))
        return INFINITY;
    return size < INFINITY ? size : INFINITY;
}

void msfp_stage_move(msfp_stage *s, const double *step, double factor)
{
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i)
            s->at.v[k][unknown[i]] -= factor * step[k * ND + i];
}

/* Factors of the tangent at the present rates, with the residual there and its size. */
static int factorise(msfp_run *run, msfp_stage *s, double *residual, double *size)
{
    place(s);
    ++run->counts[MSFP_COUNT_FACTORISATIONS];
    run->factored_beta = 0.0;
    s->descend = 0;
    const int status = evaluate(run, s, &run->work, residual, run->factors, size);
    if (status)
        return status;
    run->work_sign = msfp_lu(run->factors, DOF, run->pivots);
    if (run->work_sign == 0)
        return MSFP_E_IRREGULAR;
    run->factored_beta = s->beta;
    return MSFP_OK;
}

/* Newton step from the residual at hand (scaled in place). Where a full step does not reduce the residual, halve it. */
static double take_step(msfp_run *run, msfp_stage *s, double *residual, double *step, double size, int fresh)
{
    double factor = 1.0;
    memcpy(step, residual, DOF * sizeof *step);
    msfp_lu_solve(run->factors, DOF, run->pivots, step);
    msfp_stage_move(s, step, 1.0);
    double next = msfp_stage_residual(run, s, &run->work, residual);
    while (fresh && next > size && factor > 0.05) {
        ++run->counts[MSFP_COUNT_HALVED_STEPS];
        msfp_stage_move(s, step, -0.5 * factor);
        factor *= 0.5;
        next = msfp_stage_residual(run, s, &run->work, residual);
    }
    if (!fresh && !(next < size)) { /* old factors mislead: back to where they were */
        msfp_stage_move(s, step, -1.0);
        next = msfp_stage_residual(run, s, &run->work, residual);
    }
    return next;
}

void msfp_quasistatic_start(msfp_run *run, msfp_stage *s)
{
    double residual[DOF], step[DOF];
    s->goal = s->keep = 0.0;
    s->descend = 0;
    const double with_inertia = s->seed.ca;
    s->inertia = s->seed.ca = 0.0;
    double size = msfp_stage_residual(run, s, &run->work, residual);
    for (int i = 0; i < 10 && size > 1e-2 && size < INFINITY; ++i) {
        if (factorise(run, s, residual, &size))
            break;
        size = take_step(run, s, residual, step, size, 1);
    }
    s->inertia = 1.0;
    s->seed.ca = with_inertia;
    run->factored_beta = 0.0;
}

/* What rounding leaves of a residual: accelerations of parted bodies are differences of velocities over a short time. */
static double rounding(const msfp_stage *s)
{
    double speed = 0.0;
    for (int k = 0; k < NB; ++k)
        for (int d = 3; d < NQ; ++d)
            speed = fmax(speed, fabs(s->at.v[k][d]));
    return fmax(1e-10, 2e-12 * speed / s->beta);
}

/* A rim with a damper is met with a jump of its force, c dg/dt, and the balance may lie within: where a gap is as small as
 * the spring makes of that, no residual below the jump is asked for. More than 1e-4 would let stages pass that are still on
 * their way: with 1e-3 the inner surfaces of the tutorial's bearing shared a motion wrongly, by 1.6 mm. */
static double jump(const msfp_run *run, const msfp_stage *s)
{
    double worst = 0.0;
    for (int j = 0; j < NB && MSFP_RIMS; ++j) {
        const double *par = run->parameters.surface[j], *q = s->at.q[j], *v = s->at.v[j];
        const double gap = (cos(q[0]) * cos(q[1]) - run->parameters.rim_cosine[j]) * run->parameters.rim_slope[j];
        const double force = par[MSFP_SURFACE_PARAMETERS_CC] * par[MSFP_SURFACE_PARAMETERS_R] * hypot(v[0], v[1]);
        if (fabs(gap) * par[MSFP_SURFACE_PARAMETERS_KC] <= 10.0 * force)
            worst = fmax(worst, force / (run->work.contact[j][MSFP_CONTACT_N] * (par[MSFP_SURFACE_PARAMETERS_MU] + 0.01)));
    }
    return fmin(worst, 1e-4);
}

/* Whether a step of Newton is below the last digits of the rates. Over a short time those are accelerations, and times a
 * heavy mass a residual that no further step makes smaller. */
static int drowned(const msfp_stage *s, const double *step)
{
    double speed[2] = { 0.0 }, moved[2] = { 0.0 }; /* of angles, of separations */
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            const int kind = unknown[i] >= 3;
            speed[kind] = fmax(speed[kind], fabs(s->at.v[k][unknown[i]]));
            moved[kind] = fmax(moved[kind], fabs(step[k * ND + i]));
        }
    return moved[0] <= 4e-15 * speed[0] && moved[1] <= 4e-15 * speed[1];
}

/* Whether the determinant tells of a motion that is no longer unique. The mass of a top on massless sliders moves up and
 * down through slopes alone: that inertia is of the order of the tilt squared, friction gives it either sign, and steps
 * of any use are longer than what it does. */
static int watched(const msfp_run *run)
{
    return !MSFP_MASSLESS || run->parameters.top[MSFP_TOP_PARAMETERS_M] == 0.0;
}

static int failed(msfp_run *run, int status, double size)
{
    run->status_surface = run->worst_surface;
    run->status_value = size;
    return status;
}

/* The sign of the determinant at the solution is that of the run. */
static int regular(msfp_run *run, msfp_stage *s, double size)
{
    if (!watched(run))
        return MSFP_OK;
    if (run->work_sign && run->determinant == 0)
        run->determinant = run->work_sign;
    if (run->work_sign && run->work_sign != run->determinant) { /* perhaps of a guess far off: what counts is the solution's */
        s->keep = INFINITY;
        double residual[DOF];
        const int status = factorise(run, s, residual, &size);
        if (status)
            return failed(run, status, size);
    }
    if (!run->work_sign || run->work_sign == run->determinant)
        return MSFP_OK;
    return failed(run, MSFP_E_IRREGULAR, size);
}

/* Whether the factors at hand may serve a stage to begin with. */
static int trusted(const msfp_run *run, const msfp_stage *s)
{
    return !FLOWS(s) && fabs(run->factored_beta - s->beta) < 0.2 * s->beta;
}

/* Factors serve as long as they reduce the residual tenfold: other stages, other steps of like size. The switches of
 * friction and rims make Newton semi-smooth. The sign of the determinant is looked at with every factorisation; while
 * old factors contract the residual the tangent has theirs. */
int msfp_solve_stage(msfp_run *run, msfp_stage *s)
{
    double goal = fmin(ARRIVED, fmax(rounding(s), (FLOWS(s) ? 0.3 : 1e-2) * run->options.rtol));
    double residual[DOF], step[DOF], size = INFINITY;
    int fresh = !trusted(run, s), status = MSFP_OK;
    s->goal = s->keep = goal;
    s->descend = fresh ? 0 : PATIENT - 1;
    s->taken = 0;
    s->before = INFINITY;
    run->work_sign = 0;
    if (!fresh)
        size = msfp_stage_residual(run, s, &run->work, residual);
    const int taken = s->taken;
    if (taken && size > goal && size >= 0.1 * s->before) { /* size may be infinite: taken back, and no value there either */
        ++run->counts[MSFP_COUNT_FRESH_TANGENTS];
        fresh = 1;
    }
    if (fresh)
        status = factorise(run, s, residual, &size);
    if (status && !taken && status != MSFP_E_IRREGULAR) /* a guess for which forces cannot be formed */
        status = MSFP_E_NEWTON;
    for (int i = taken; size > goal; ++i) {
        if (status || i >= MOST || !(size < INFINITY))
            return failed(run, status ? status : MSFP_E_NEWTON, size);
        if (i >= PATIENT)
            s->goal = goal = fmax(goal, jump(run, s));
        ++run->counts[MSFP_COUNT_NEWTON];
        const double before = size;
        const int late = i >= PATIENT - 1; /* `jump` looks at the work area */
        s->keep = late ? INFINITY : fresh ? ARRIVED : goal;
        s->descend = fresh || late ? 0 : PATIENT - i - 2;
        s->before = before;
        size = take_step(run, s, residual, step, size, fresh);
        if (fresh && size < ARRIVED && drowned(s, step))
            break;
        i += s->taken;
        fresh = size > goal && size >= 0.1 * (s->taken ? s->before : before);
        if (fresh) {
            ++run->counts[MSFP_COUNT_FRESH_TANGENTS];
            status = factorise(run, s, residual, &size);
        }
    }
    s->descend = 0;
    return regular(run, s, size);
}
