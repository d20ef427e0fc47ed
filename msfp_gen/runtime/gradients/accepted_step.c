/* accepted_step.c: the derivatives of a step that the run has accepted: tangents of its stages, its length, events. */
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { NB = MSFP_NB, NQ = MSFP_NQ, DOF = MSFP_DOF, C = MSFP_COLUMNS };

/* Whether the row of the end of the step enters what is recorded. */
static int end_is_recorded(const msfp_run *run)
{
    const struct msfp_gradients *g = run->gradients;
    return msfp_is_quasistatic(run) || run->row_count > g->row_count ||
           memcmp(&run->extremes, &g->extremes, sizeof g->extremes) != 0;
}

/* Factored tangents of the stages of the step, at the evaluations that solved them. */
static int factorise(msfp_run *run)
{
    msfp_trail *trail = &run->gradients->trail;
    const int last = msfp_last_stage(run), energies = run->gradients->energies;
    trail->all_slopes = energies || end_is_recorded(run);
    for (int i = 1; i <= last; ++i) {
        msfp_stage *s = &trail->stage[i];
        const int status =
            msfp_tangent_with_slopes(&run->parameters, &s->at, &s->seed, &trail->work[i], s->g,
                                     energies || (i == last && trail->all_slopes), &trail->slopes[i], trail->factors[i]);
        if (status)
            return status;
        if (msfp_lu(trail->factors[i], DOF, trail->pivots[i]) == 0)
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

/* Whether the end of the step is a time that does not depend on the parameters. Other steps keep their length, so that
 * all steps after an event move with it: their errors then depend on the time since the event, which does not change. */
static int ends_at_fixed_time(const msfp_run *run)
{
    const msfp_options *o = &run->options;
    const double t = run->next.t;
    return t == o->duration || (run->stop < o->stop_count && t == o->stops[run->stop]) ||
           (run->next_jump < run->jump_count && t == run->jumps[run->next_jump]);
}

/* The first stage with the damping force of a rim that the step only just meets; 0: none. This force begins at the end
 * of the step and must not count as an acceleration of a longer step. */
static int stage_in_new_contact(const msfp_run *run, int rim, const double *before)
{
    const int stages = rim >= 0 && before[rim] > 0.0 ? msfp_tableau_of(run->options.method)->stages : 0;
    for (int i = 1; i < stages; ++i)
        if (run->gradients->trail.work[i].rim_active[rim])
            return i;
    return 0;
}

void msfp_event_time_columns(const msfp_run *run, msfp_group *group, int j, double *dt)
{
    static const msfp_parameter_columns constant;
    msfp_columns gaps[NB][MSFP_GAP_SIZE], rates[NB][MSFP_GAP_SIZE], v[NB][NQ];
    double sliding[NB][MSFP_GAP_SIZE];
    const double *now = msfp_rates_of_stage(run, msfp_last_stage(run));
    memset(v, 0, sizeof v);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < NQ; ++i)
            v[k][i][0] = now[k * NQ + i];
    msfp_gaps_columns(&run->parameters, &group->parameters, run->next.q, group->next.q, sliding, gaps);
    msfp_gaps_columns(&run->parameters, &constant, run->next.q, v, sliding, rates);
    const double rate = rates[j][MSFP_GAP_G][0];
    for (int c = 0; c < C; ++c)
        dt[c] = rate != 0.0 ? -gaps[j][MSFP_GAP_G][c] / rate : 0.0;
}

/* Columns of the accepted step. rim: the surface whose rim is met or left at its end, -1: none. */
static int step_columns(msfp_run *run, int rim, int prescribed)
{
    struct msfp_gradients *g = run->gradients;
    const int fixed = prescribed || ends_at_fixed_time(run);
    const int status = factorise(run);
    if (status)
        return status;
    for (int i = 0; i < g->groups; ++i) {
        msfp_group *group = &g->group[i];
        for (int c = 0; c < C; ++c)
            group->h[c] = fixed ? -group->now.t[c] : 0.0;
        group->end_known = 0;
        msfp_step_columns(run, group);
        if (rim >= 0) { /* the step ends where the gap is zero, so that its length depends on the parameters */
            msfp_columns dt;
            msfp_event_time_columns(run, group, rim, dt);
            msfp_add_columns(&group->h, (const msfp_columns *)&dt, 1.0, 1);
            msfp_step_columns(run, group);
        }
        for (int c = 0; c < C; ++c)
            group->next.t[c] = group->now.t[c] + group->h[c];
    }
    return MSFP_OK;
}

/* The same of massless bodies whose step only just meets a rim. Their rates jump there, within the last stages, and the
 * columns of positions with them: those of the step are those without the rim. */
static int step_before_rim(msfp_run *run, int rim)
{
    double *par = run->parameters.surface[rim];
    const double stiffness = par[MSFP_SURFACE_PARAMETERS_KC], damping = par[MSFP_SURFACE_PARAMETERS_CC];
    par[MSFP_SURFACE_PARAMETERS_KC] = par[MSFP_SURFACE_PARAMETERS_CC] = 0.0;
    const int status = step_columns(run, rim, 0);
    par[MSFP_SURFACE_PARAMETERS_KC] = stiffness;
    par[MSFP_SURFACE_PARAMETERS_CC] = damping;
    return status;
}

int msfp_gradients_step(msfp_run *run, const double *before, const double *after)
{
    struct msfp_gradients *g = run->gradients;
    if (!g)
        return MSFP_OK;
    ++g->step;
    if (g->count == 0)
        return MSFP_OK;
    const int prescribed = g->step_count > 0 || msfp_is_quasistatic(run);
    const int rim = prescribed ? -1 : rim_at_end(run, before, after);
    g->trail.meets_rim = stage_in_new_contact(run, rim, before);
    const int jumps = MSFP_MASSLESS && g->trail.meets_rim;
    const int status = jumps ? step_before_rim(run, rim) : step_columns(run, rim, prescribed);
    return status ? status : msfp_record_step_columns(run);
}
#endif
