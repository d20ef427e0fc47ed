/* gradients.c: the derivatives of a run: their inputs, the hooks in the loop of the run, the times of events. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { NB = MSFP_NB, NQ = MSFP_NQ, DOF = MSFP_DOF, C = MSFP_COLUMNS };

/* Column c of a block of `count` numbers. */
static void put_column(double *block, const double *values, int count, int c)
{
    for (int i = 0; i < count; ++i)
        block[i * C + c] = values[i];
}

/* Parameters of column c. The blocks that msfp_set_parameters fills are linear in the values, so that it makes their
 * derivatives from those of the values; whether the top is sprung is that of the run. */
static void parameters(const msfp_run *run, const msfp_gradient_inputs *in, int index, int c,
                       msfp_parameter_columns *to)
{
    msfp_parameters one;
    msfp_set_parameters(&one, in->gravity[index], in->bodies + (size_t)index * (NB + 1) * MSFP_BODY_VALUES,
                        in->surfaces + (size_t)index * NB * MSFP_SURFACE_VALUES,
                        in->top + (size_t)index * MSFP_TOP_VALUES);
    one.top[MSFP_TOP_PARAMETERS_MZ] = msfp_top_is_sprung(&run->parameters) ? 0.0 : one.top[MSFP_TOP_PARAMETERS_M];
    for (int j = 0; j < NB; ++j)
        one.surface[j][MSFP_SURFACE_PARAMETERS_SIGN] = one.surface[j][MSFP_SURFACE_PARAMETERS_CA] =
            one.surface[j][MSFP_SURFACE_PARAMETERS_SA] = 0.0;
    for (int k = 0; k <= NB; ++k)
        put_column(to->body[k], one.body[k], MSFP_BODY_PARAMETERS_SIZE, c);
    for (int j = 0; j < NB; ++j)
        put_column(to->surface[j], one.surface[j], MSFP_SURFACE_PARAMETERS_SIZE, c);
    put_column(to->top, one.top, MSFP_TOP_PARAMETERS_SIZE, c);
}

/* A history with other coefficients on the knots of `of`; none where index < 0. */
static msfp_history history(const msfp_history *of, const double *coefficients, int index)
{
    msfp_history found;
    memset(&found, 0, sizeof found);
    if (index < 0)
        return found;
    found.pieces = of->pieces;
    found.knots = of->knots;
    found.coefficients = coefficients + (size_t)index * (size_t)of->pieces * 6 * (MSFP_DEGREE + 1);
    return found;
}

static void fill_group(const msfp_run *run, const msfp_gradient_inputs *in, int first, msfp_group *group)
{
    for (int c = 0; c < C && first + c < in->count; ++c) {
        const int i = first + c;
        parameters(run, in, i, c, &group->parameters);
        group->motion[c] = history(&run->motion, in->motions, (int)in->motion[i]);
        group->load[c] = history(&run->load, in->loads, (int)in->load[i]);
        put_column(group->now.q[0][0], in->q + (size_t)i * NB * NQ, NB * NQ, c);
        put_column(group->now.v[0][0], in->v + (size_t)i * NB * NQ, NB * NQ, c);
        put_column(group->now.f[0][0], in->f + (size_t)i * NB * 2, NB * 2, c);
    }
}

int msfp_gradients_start(msfp_run *run, const msfp_gradient_inputs *in)
{
    struct msfp_gradients *g = calloc(1, sizeof *g);
    if (!g)
        return run->status = MSFP_E_MEMORY;
    run->gradients = g;
    g->count = in->count;
    g->groups = (in->count + C - 1) / C;
    g->steps = in->steps;
    g->step_count = in->step_count;
    g->group = calloc(g->groups ? (size_t)g->groups : 1, sizeof *g->group);
    if (!g->group)
        return run->status = MSFP_E_MEMORY;
    for (int i = 0; i < g->groups; ++i)
        fill_group(run, in, i * C, &g->group[i]);
    for (int i = 0; i < g->groups && run->status == MSFP_OK; ++i)
        run->status = msfp_initial_columns(run, &g->group[i], 1);
    if (run->status == MSFP_OK && g->count)
        run->status = msfp_record_present_columns(run, 1);
    return run->status;
}

void msfp_gradients_free(msfp_run *run)
{
    if (!run->gradients)
        return;
    free(run->gradients->group);
    free(run->gradients->rows);
    free(run->gradients->events);
    free(run->gradients);
    run->gradients = NULL;
}

const double *msfp_gradient_rows(const msfp_run *run, size_t *count)
{
    *count = run->gradients ? run->gradients->row_count : 0;
    return run->gradients ? run->gradients->rows : NULL;
}

const double *msfp_gradient_events(const msfp_run *run, size_t *count)
{
    *count = run->gradients ? run->gradients->event_count : 0;
    return run->gradients ? run->gradients->events : NULL;
}

void msfp_gradient_extremes(const msfp_run *run, int parameter, double *out)
{
    const msfp_group *group = &run->gradients->group[parameter / C];
    for (size_t i = 0; i < sizeof(msfp_extremes) / sizeof(double); ++i)
        out[i] = group->extremes[i][parameter % C];
}

/* ---- hooks ---- */

double msfp_prescribed_step(const msfp_run *run)
{
    const struct msfp_gradients *g = run->gradients;
    return g && g->step < g->step_count ? g->steps[g->step] - run->now.t : 0.0;
}

void msfp_gradients_stage(msfp_run *run, int i, const msfp_stage *stage)
{
    if (!run->gradients)
        return;
    run->gradients->trail.stage[i] = *stage;
    memcpy(&run->gradients->trail.work[i], &run->work, offsetof(msfp_work, dx)); /* without derivatives */
}

msfp_observation *msfp_gradients_node(msfp_run *run, int index)
{
    return run->gradients ? &run->gradients->recording.node[index] : NULL;
}

void msfp_gradients_row(msfp_run *run, int index, const msfp_row *row)
{
    if (!run->gradients)
        return;
    msfp_recording *r = &run->gradients->recording;
    r->value[index] = *row;
    r->sloped[index] = 0;
    r->known = index == run->node_count + 1;
}

void msfp_gradients_before_step(msfp_run *run)
{
    if (!run->gradients)
        return;
    run->gradients->recording.known = 0;
    run->gradients->extremes = run->extremes;
    run->gradients->outward_rate = run->outward_rate;
}

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
    const int last = msfp_is_quasistatic(run) ? 1 : msfp_tableau_of(run->options.method)->stages - 1;
    trail->all_slopes = end_is_recorded(run);
    for (int i = 1; i <= last; ++i) {
        msfp_stage *s = &trail->stage[i];
        const int status =
            msfp_tangent_with_slopes(&run->parameters, &s->at, &s->seed, &trail->work[i], s->g,
                                     i == last && trail->all_slopes, &trail->slopes[i], trail->factors[i]);
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
    memset(v, 0, sizeof v);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < NQ; ++i)
            v[k][i][0] = run->next.v[k][i];
    msfp_gaps_columns(&run->parameters, &group->parameters, run->next.q, group->next.q, gaps);
    msfp_gaps_columns(&run->parameters, &constant, run->next.q, v, rates);
    const double rate = rates[j][MSFP_GAP_G][0];
    for (int c = 0; c < C; ++c)
        dt[c] = rate != 0.0 ? -gaps[j][MSFP_GAP_G][c] / rate : 0.0;
}

int msfp_gradients_step(msfp_run *run, const double *before, const double *after)
{
    struct msfp_gradients *g = run->gradients;
    if (!g)
        return MSFP_OK;
    ++g->step;
    if (g->count == 0)
        return MSFP_OK;
    const int status = factorise(run);
    if (status)
        return status;
    const int prescribed = g->step_count > 0 || msfp_is_quasistatic(run);
    const int fixed = prescribed || ends_at_fixed_time(run);
    const int rim = prescribed ? -1 : rim_at_end(run, before, after);
    g->trail.meets_rim = stage_in_new_contact(run, rim, before);
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
    return msfp_record_step_columns(run);
}

void msfp_gradients_accept(msfp_run *run)
{
    for (int i = 0; run->gradients && i < run->gradients->groups; ++i) {
        msfp_group *group = &run->gradients->group[i];
        group->now = group->next;
        group->start_known = group->end_known;
        if (group->end_known)
            memcpy(group->start_row, group->end_row, sizeof group->end_row);
    }
}

int msfp_gradients_jump(msfp_run *run)
{
    int status = MSFP_OK;
    for (int i = 0; run->gradients && i < run->gradients->groups && status == MSFP_OK; ++i) {
        run->gradients->group[i].start_known = 0;
        status = msfp_initial_columns(run, &run->gradients->group[i], 0);
    }
    return status;
}

int msfp_gradients_last_row(msfp_run *run)
{
    return run->gradients && run->gradients->count ? msfp_record_present_columns(run, 0) : MSFP_OK;
}
#endif
