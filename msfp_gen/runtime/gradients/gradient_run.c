/* gradient_run.c: the derivatives of a run: their inputs, the hooks in the loop of the run, what was recorded. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

/* Column c of a block of `count` numbers. */
static void put_column(double *block, const double *values, int count, int c)
{
    for (int i = 0; i < count; ++i)
        block[i * C + c] = values[i];
}

/* Columns of the values of a scene. */
typedef struct {
    double body[NB + 1][MSFP_BODY_VALUES_SIZE * C], surface[NB][MSFP_SURFACE_VALUES_SIZE * C];
    double top[MSFP_TOP_VALUES_SIZE * C], gravity[C];
} value_columns;

/* Column c of them, that of parameter `index`. */
static void read_values(const msfp_gradient_inputs *in, int index, int c, value_columns *d)
{
    const size_t i = index;
    d->gravity[c] = in->gravity[i];
    put_column(d->top, in->top + i * MSFP_TOP_VALUES_SIZE, MSFP_TOP_VALUES_SIZE, c);
    for (int k = 0; k <= NB; ++k)
        put_column(d->body[k], in->bodies + (i * (NB + 1) + k) * MSFP_BODY_VALUES_SIZE, MSFP_BODY_VALUES_SIZE, c);
    for (int j = 0; j < NB; ++j)
        put_column(d->surface[j], in->surfaces + (i * NB + j) * MSFP_SURFACE_VALUES_SIZE, MSFP_SURFACE_VALUES_SIZE, c);
}

/* The parameters from the values, as msfp_set_parameters makes them. */
static void parameters(const msfp_parameters *p, const value_columns *d, msfp_parameter_columns *to)
{
    const double dsign[C] = { 0.0 };
    double around[MSFP_AROUND_SIZE * C] = { 0.0 };
    memcpy(around + MSFP_AROUND_GRAVITY * C, d->gravity, sizeof d->gravity);
    for (int k = 0; k <= NB; ++k) {
        double sides[MSFP_SIDES_SIZE * C] = { 0.0 };
        if (k > 0)
            memcpy(sides + MSFP_SIDES_RADIUS_LOWER * C, d->surface[k - 1] + MSFP_SURFACE_VALUES_RADIUS * C, C * sizeof *sides);
        if (k < NB)
            memcpy(sides + MSFP_SIDES_RADIUS_UPPER * C, d->surface[k] + MSFP_SURFACE_VALUES_RADIUS * C, C * sizeof *sides);
        memcpy(sides + MSFP_SIDES_GRAVITY * C, d->gravity, sizeof d->gravity);
        msfp_body_block_direction(p->body_values[k], p->sides[k], d->body[k], sides, to->body[k]);
    }
    for (int j = 0; j < NB; ++j) {
        const int slider = msfp_slider(j);
        const double *values = p->surface_values[j], *sign = p->surface[j] + MSFP_SURFACE_PARAMETERS_SIGN;
        msfp_surface_block_direction(values, p->body_values[slider], sign, d->surface[j], d->body[slider], dsign,
                                     to->surface[j]);
#if MSFP_UPLIFT
        double compliance[C];
        msfp_seat_compliance_direction(values, d->surface[j], compliance);
        msfp_add(around + MSFP_AROUND_COMPLIANCE * C, compliance, 1.0, C);
#endif
    }
    msfp_top_block_direction(p->top_values, p->around, d->top, around, to->top);
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

static void fill_batch(const msfp_run *run, const msfp_gradient_inputs *in, int first, msfp_parameter_batch *batch)
{
    value_columns values = { .gravity = { 0.0 } };
    for (int c = 0; c < C && first + c < in->count; ++c) {
        const int i = first + c;
        read_values(in, i, c, &values);
        batch->motion[c] = history(&run->motion, in->motions, (int)in->motion[i]);
        batch->load[c] = history(&run->load, in->loads, (int)in->load[i]);
        put_column(batch->now.q[0][0], in->q + (size_t)i * NB * NQ, NB * NQ, c);
        put_column(batch->now.v[0][0], in->v + (size_t)i * NB * NQ, NB * NQ, c);
        put_column(batch->now.f[0][0], in->f + (size_t)i * NB * 2, NB * 2, c);
    }
    parameters(&run->parameters, &values, &batch->parameters);
}

/* ---- hooks ---- */

static void stage_solved(msfp_run *run, int i, const msfp_stage *stage, const msfp_state *state)
{
    msfp_stage_history *stage_history = &run->gradients->stage_history;
    stage_history->stage[i] = *stage;
    stage_history->state[i] = *state;
    memcpy(&stage_history->work[i], &run->work, offsetof(msfp_work, dx)); /* without derivatives */
}

static int jumped(msfp_run *run)
{
    int status = MSFP_OK;
    for (int i = 0; i < run->gradients->batches && status == MSFP_OK; ++i) {
        run->gradients->batch[i].start_known = 0;
        status = msfp_initial_columns(run, &run->gradients->batch[i], 0);
    }
    return status;
}

static const struct msfp_hooks hooks = { stage_solved, msfp_accepted_step_columns, jumped };

void msfp_gradients_free(msfp_run *run)
{
    if (!run->gradients)
        return;
    free(run->gradients->batch);
    free(run->gradients->rows);
    free(run->gradients->events);
    free(run->gradients);
    run->gradients = NULL;
    run->hooks = NULL;
}

int msfp_gradients_start(msfp_run *run, const msfp_gradient_inputs *in)
{
    struct msfp_gradients *g = calloc(1, sizeof *g);
    if (!g)
        return run->status = MSFP_E_MEMORY;
    run->gradients = g;
    run->hooks = &hooks;
    g->count = in->count;
    g->batches = (in->count + C - 1) / C;
    g->energies = in->energies;
    g->event_time = -INFINITY;
    run->ends = in->steps;
    run->end_count = in->step_count;
    g->batch = calloc(g->batches ? (size_t)g->batches : 1, sizeof *g->batch);
    if (!g->batch)
        return run->status = MSFP_E_MEMORY;
    for (int i = 0; i < g->batches; ++i)
        fill_batch(run, in, i * C, &g->batch[i]);
    for (int i = 0; i < g->batches && run->status == MSFP_OK; ++i)
        run->status = msfp_initial_columns(run, &g->batch[i], 1);
    if (run->status == MSFP_OK && g->count)
        run->status = msfp_record_state_columns(run, 1);
    return run->status;
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
    const msfp_parameter_batch *batch = &run->gradients->batch[parameter / C];
    for (int i = 0; i < MSFP_EXTREME_COUNT; ++i)
        out[i] = batch->extremes[i][parameter % C];
}
#endif
