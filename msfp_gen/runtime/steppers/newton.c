/* newton.c: Newton's method on the equations of one stage. docs/robustness.md lists what is tried where it fails. */
#include <math.h>
#include <string.h>
#include "steppers.h"

enum {
    MAX_ITERATIONS = 30,
    JUMP_ITERATIONS = 10 /* from this iteration on a residual up to the jump of the rim force is accepted */
};
static const double largest_residual = 1e-3; /* no larger residual is ever accepted */

static const int unknown[ND] = MSFP_FREE;

/* Whether friction is a function of the slip of the step. */
static int closed_form(const msfp_stage *s)
{
#if MSFP_CLOSED_FORM
    return s->weights.closed_form;
#else
    (void)s;
    return 0;
#endif
}

/* Coordinates and accelerations from the rates. */
static void update_point(msfp_stage *s)
{
    msfp_stage_formula(s->from.q[0], s->from.v[0], s->beta, s->inertia / s->beta, s->at.v[0], MSFP_COORDINATES,
                       s->at.q[0], s->at.a[0]);
}

/* Newton's method solves for moments over N, which have the same root. The moment of a light slider is N times a lever
 * arm that nearly vanishes, and under a heavy top N depends strongly on the rates; the division removes this product.
 */
static void divide_by_normal(const msfp_work *w, double *residual)
{
    if (MSFP_UPLIFT) /* N follows from the compression, not from the rates, and may vanish */
        return;
    for (int k = 0; k < NB; ++k)
        for (int i = k * ND; i < (k + 1) * ND; ++i)
            residual[i] /= w->contact[k][MSFP_CONTACT_N];
}

/* The tangent of the divided residual. */
static void divide_tangent_by_normal(const msfp_work *w, const double *residual, double *tangent)
{
    if (MSFP_UPLIFT)
        return;
    for (int k = 0; k < NB; ++k)
        msfp_divide_columns(w->contact[k][MSFP_CONTACT_N], residual + k * ND, w->dnormal[k], DOF,
                            tangent + k * ND * DOF);
}

/* Residual over N, its largest entry relative to its natural size and the tangent (or NULL). Returns a status. */
static int evaluate(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual, double *tangent, double *size)
{
    ++run->counts[MSFP_COUNT_EVALUATIONS];
    int worst = -1;
    const int status = msfp_condensed(&run->parameters, &s->at, &s->weights, w, s->g, residual, tangent);
    if (status)
        return status;
    msfp_friction_state(w, s->f);
    s->weights.same_base = 1;
    *size = msfp_residual_size(&run->parameters, w, residual, &worst);
    run->worst_surface = worst < 0 ? run->worst_surface : worst / ND + 1;
    divide_by_normal(w, residual);
    if (tangent)
        divide_tangent_by_normal(w, residual, tangent);
    return MSFP_OK;
}

double msfp_stage_residual(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual)
{
    double size;
    update_point(s);
    if (evaluate(run, s, w, residual, NULL, &size))
        return INFINITY;
    return size < INFINITY ? size : INFINITY;
}

void msfp_stage_move(msfp_stage *s, const double *step, double factor)
{
    msfp_move_rates(s->at.v[0], step, factor, 1);
}

int msfp_factorise_stage(msfp_run *run, msfp_stage *s, double *residual, double *size)
{
    update_point(s);
    ++run->counts[MSFP_COUNT_FACTORISATIONS];
    run->factored_beta = 0.0;
    const int status = evaluate(run, s, &run->work, residual, run->factors, size);
    if (status)
        return status;
    run->work_sign = msfp_lu(run->factors, DOF, run->pivots);
    if (run->work_sign == 0)
        return MSFP_E_IRREGULAR;
    run->factored_beta = s->beta;
    return MSFP_OK;
}

/* Newton step from the residual, which is replaced by that after the step; returns its size. A full step with a fresh
 * tangent that does not reduce the residual is halved. */
static double take_step(msfp_run *run, msfp_stage *s, double *residual, double *step, double size, int fresh)
{
    double factor = 1.0;
    memcpy(step, residual, DOF * sizeof *step);
    msfp_lu_solve(run->factors, DOF, run->pivots, step);
    msfp_stage_move(s, step, 1.0);
    double next = msfp_stage_residual(run, s, &run->work, residual);
    while (fresh && next > size && factor > 0.05) {
        ++run->counts[MSFP_COUNT_HALVED_NEWTON_STEPS];
        msfp_stage_move(s, step, -0.5 * factor);
        factor *= 0.5;
        next = msfp_stage_residual(run, s, &run->work, residual);
    }
    if (!fresh && !(next < size)) { /* old factors gave no descent: take the step back */
        msfp_stage_move(s, step, -1.0);
        next = msfp_stage_residual(run, s, &run->work, residual);
    }
    return next;
}

void msfp_quasistatic_start(msfp_run *run, msfp_stage *s)
{
    double residual[DOF], step[DOF];
    const double with_inertia = s->weights.a_weight;
    s->inertia = s->weights.a_weight = 0.0;
    double size = msfp_stage_residual(run, s, &run->work, residual);
    for (int i = 0; i < 10 && size > 1e-2 && size < INFINITY; ++i) {
        if (msfp_factorise_stage(run, s, residual, &size))
            break;
        size = take_step(run, s, residual, step, size, 1);
    }
    s->inertia = 1.0;
    s->weights.a_weight = with_inertia;
    run->factored_beta = 0.0;
}

/* Residual that rounding leaves: accelerations of separated bodies are differences of velocities over a short time. */
static double roundoff_residual(const msfp_stage *s)
{
    double speed = 0.0;
    for (int k = 0; k < NB; ++k)
        for (int d = 3; d < NQ; ++d)
            speed = fmax(speed, fabs(s->at.v[k][d]));
    return fmax(1e-10, 2e-12 * speed / s->beta);
}

/* The rim force is discontinuous at contact, by c dg/dt, so the residual may have no root there; a residual up to the
 * jump is accepted where the gap is within ten times c dg/dt over the rim stiffness. The bound of 1e-4 is needed: with
 * 1e-3, stages that had not converged were accepted and the sliding of the tutorial's bearing was wrong by 1.6 mm. */
static double rim_force_jump(const msfp_run *run, const msfp_stage *s)
{
    double worst = 0.0;
    for (int j = 0; j < NB && MSFP_RIMS; ++j) {
        const double *par = run->parameters.surface[j], *q = s->at.q[j], *v = s->at.v[j];
        const double gap = (msfp_cos(q[0]) * msfp_cos(q[1]) - run->parameters.rim_cosine[j]) * run->parameters.rim_slope[j];
        const double force = par[MSFP_SURFACE_PARAMETERS_CC] * par[MSFP_SURFACE_PARAMETERS_R] * msfp_hypot(v[0], v[1]);
        if (fabs(gap) * par[MSFP_SURFACE_PARAMETERS_KC] <= 10.0 * force)
            worst =
                fmax(worst, force / (run->work.contact[j][MSFP_CONTACT_N] * (par[MSFP_SURFACE_PARAMETERS_MU] + 0.01)));
    }
    return fmin(worst, 1e-4);
}

/* Whether a Newton step is below the roundoff of the rates. With a short time step this roundoff is an acceleration,
 * and with a heavy mass a residual that no further iteration reduces. */
static int step_below_roundoff(const msfp_stage *s, const double *step)
{
    double speed[2] = { 0.0 }, moved[2] = { 0.0 }; /* of angles, of separations */
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            const int separation = unknown[i] >= 3;
            speed[separation] = fmax(speed[separation], fabs(s->at.v[k][unknown[i]]));
            moved[separation] = fmax(moved[separation], fabs(step[k * ND + i]));
        }
    return moved[0] <= 4e-15 * speed[0] && moved[1] <= 4e-15 * speed[1];
}

/* Whether the sign of the determinant shows that the motion is no longer unique. A mass on massless sliders moves
 * vertically through the slopes only: this inertia is of the order of the tilt squared, friction gives it either sign,
 * and its time scale is shorter than any practical step. */
static int regularity_monitored(const msfp_run *run)
{
    return !MSFP_MASSLESS || run->parameters.top[MSFP_TOP_PARAMETERS_M] == 0.0;
}

/* Record where and how far the equations are not satisfied; returns the status. */
static int failed(msfp_run *run, int status, double size)
{
    run->status_surface = run->worst_surface;
    run->status_value = size;
    return status;
}

/* Check that the determinant at the solution has the sign that it has had in the run. */
static int check_regularity(msfp_run *run, msfp_stage *s, double size)
{
    if (!regularity_monitored(run))
        return MSFP_OK;
    if (run->work_sign && run->determinant == 0)
        run->determinant = run->work_sign;
    if (run->work_sign &&
        run->work_sign != run->determinant) { /* the factors may belong to a distant guess: evaluate at the solution */
        double residual[DOF];
        const int status = msfp_factorise_stage(run, s, residual, &size);
        if (status)
            return failed(run, status, size);
    }
    if (!run->work_sign || run->work_sign == run->determinant)
        return MSFP_OK;
    return failed(run, MSFP_E_IRREGULAR, size);
}

/* Whether the factors of an earlier stage may be used to begin with. */
static int factors_reusable(const msfp_run *run, const msfp_stage *s)
{
    return !closed_form(s) && fabs(run->factored_beta - s->beta) < 0.2 * s->beta;
}

/* Factors are kept, also for other stages and for other steps of similar size, as long as they reduce the residual
 * tenfold. The switches of friction and rims make the method semi-smooth. The sign of the determinant is checked at
 * every factorisation; while old factors contract the residual, the tangent has the same sign. */
int msfp_solve_stage(msfp_run *run, msfp_stage *s)
{
    double goal = fmin(largest_residual, fmax(roundoff_residual(s), (closed_form(s) ? 0.3 : 1e-2) * run->options.rtol));
    double residual[DOF], step[DOF], size = INFINITY;
    int fresh = !factors_reusable(run, s), status = MSFP_OK;
    run->work_sign = 0;
    if (!fresh)
        size = msfp_stage_residual(run, s, &run->work, residual);
    if (fresh)
        status = msfp_factorise_stage(run, s, residual, &size);
    if (status && status != MSFP_E_IRREGULAR) /* the forces cannot be formed at this guess */
        status = MSFP_E_NEWTON;
    for (int i = 0; size > goal; ++i) {
        if (status || i >= MAX_ITERATIONS || !(size < INFINITY))
            return failed(run, status ? status : MSFP_E_NEWTON, size);
        if (i >= JUMP_ITERATIONS)
            goal = fmax(goal, rim_force_jump(run, s));
        ++run->counts[MSFP_COUNT_NEWTON_ITERATIONS];
        const double before = size;
        size = take_step(run, s, residual, step, size, fresh);
        if (fresh && size < largest_residual && step_below_roundoff(s, step))
            break;
        fresh = size > goal && size >= 0.1 * before;
        if (fresh) {
            ++run->counts[MSFP_COUNT_FRESH_TANGENTS];
            status = msfp_factorise_stage(run, s, residual, &size);
        }
    }
    return check_regularity(run, s, size);
}
