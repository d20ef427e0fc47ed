/* gradients.c: the derivatives of a run: their inputs, the hooks in the loop of the run. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
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
    g->energies = in->energies;
    g->event_time = -INFINITY;
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
    if (!run->gradients || parameter < 0 || parameter >= run->gradients->count)
        return;
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

void msfp_gradients_powers(msfp_run *run, const msfp_stages *s, int ringing)
{
    if (!run->gradients)
        return;
    memcpy(run->gradients->trail.power, s->power, sizeof s->power);
    memcpy(run->gradients->trail.prescribed, s->prescribed, sizeof s->prescribed);
    run->gradients->trail.ringing = ringing;
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
