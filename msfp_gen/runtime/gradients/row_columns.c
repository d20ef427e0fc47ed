/* row_columns.c: derivatives of rows: of a state, at the end of a step, and inside it. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

/* The evaluation of a state, with the derivatives of its contacts. */
static void observe(msfp_run *run, const msfp_state *s, msfp_observation *o)
{
    msfp_to_point(run, s, &o->at);
    msfp_evaluate_state(&run->parameters, &o->at, &o->weights, &o->work, o->g);
    msfp_contact_slopes(&run->parameters, &o->weights, &o->work, (const double (*)[2])o->g, 1, &o->slopes);
}

/* Columns of the row of an observed state. */
static void observed_columns(msfp_run *run, msfp_parameter_batch *batch, const msfp_observation *o,
                             const msfp_state *s, const msfp_state_columns *ds, msfp_row_columns d)
{
    const msfp_parameters *p = &run->parameters;
    msfp_work_columns *dw = &run->gradients->recording.work;
    msfp_point_columns dat;
    memset(&dat, 0, sizeof dat);
    msfp_inputs_columns(run, batch, s->t, ds->t, &dat);
    memcpy(dat.q, ds->q, sizeof dat.q);
    memcpy(dat.v, ds->v, sizeof dat.v);
    memcpy(dat.a, ds->a, sizeof dat.a);
    memcpy(dat.f, ds->f, sizeof dat.f);
    memcpy(dat.foot, ds->foot, sizeof dat.foot);
    msfp_memory_point_columns(p, &batch->parameters, s, ds, 0.0, &dat);
    msfp_condensed_columns(p, &batch->parameters, &o->at, &dat, &o->weights, &o->work, &o->slopes, MSFP_OF_ROW, dw);
    msfp_record_columns(p, &batch->parameters, &o->at, &dat, &o->work, dw, d);
    memcpy(d[MSFP_ROW_WORK], ds->work, sizeof ds->work);
}

void msfp_observe_columns(msfp_run *run, msfp_parameter_batch *batch, const msfp_state *s, const msfp_state_columns *ds,
                          msfp_row_columns d)
{
    msfp_observation *o = &run->gradients->recording.own;
    observe(run, s, o);
    observed_columns(run, batch, o, s, ds, d);
}

/* Columns of row `index` of those at the start of the step and at its nodes; ds: of its state. */
static void node_columns(msfp_run *run, msfp_parameter_batch *batch, int index, const msfp_state_columns *ds,
                         msfp_row_columns d)
{
    msfp_recording *r = &run->gradients->recording;
    msfp_state s = run->now;
    if (index > 0)
        msfp_interpolate(run, run->node[index - 1].share, &s);
    if (!r->node_known[index])
        observe(run, &s, &r->node[index]);
    r->node_known[index] = 1;
    observed_columns(run, batch, &r->node[index], &s, ds, d);
}

/* Columns of the rows at the ends and nodes of the step, into the recording, unless they are there. */
static void all_node_columns(msfp_run *run, msfp_parameter_batch *batch)
{
    msfp_recording *r = &run->gradients->recording;
    const int last = run->node_count + 1;
    if (r->columns_known)
        return;
    if (!batch->start_known)
        node_columns(run, batch, 0, &batch->now, batch->start_row);
    memcpy(r->d[0], batch->start_row, sizeof batch->start_row);
    for (int i = 1; i < last; ++i) {
        const double share = run->node[i - 1].share;
        msfp_state_columns *node = &batch->node[i - 1];
        for (int c = 0; c < C; ++c)
            node->t[c] = batch->now.t[c] + share * batch->h[c];
        msfp_linear_rates((const double *)&batch->now, (const double *)&batch->next, share, C, (double *)node);
        node_columns(run, batch, i, node, r->d[i]);
    }
    msfp_row_reached_columns(run, batch);
    memcpy(r->d[last], batch->end_row, sizeof batch->end_row);
    r->columns_known = batch->start_known = 1;
}

/* Derivatives of the weights of msfp_weights_at with respect to the share. */
static void weight_slopes(const msfp_run *run, double share, double *slopes)
{
    double nodes[MSFP_NODES + 2] = { 0.0 };
    const int count = run->node_count + 2;
    for (int i = 0; i < run->node_count; ++i)
        nodes[i + 1] = run->node[i].share;
    nodes[count - 1] = 1.0;
    for (int i = 0; i < count; ++i) {
        slopes[i] = 0.0;
        for (int m = 0; m < count; ++m) {
            double product = m == i ? 0.0 : 1.0 / (nodes[i] - nodes[m]);
            for (int j = 0; j < count && m != i; ++j)
                product *= j == i || j == m ? 1.0 : (share - nodes[j]) / (nodes[i] - nodes[j]);
            slopes[i] += product;
        }
    }
}

/* Columns of Y, Z where msfp_limit_row has scaled them to the size of others; f: before that. */
static void limit_friction(const msfp_run *run, const double f[NB][2], const msfp_row_limits *limits, msfp_row_columns d)
{
    static const double unit[2] = { 1.0, 0.0 };
    static const msfp_columns constant[2];
    for (int j = 0; j < NB; ++j) {
        const int of = limits->row[j];
        double bounded[MSFP_FRICTION_SIZE * C], *own = d[MSFP_ROW_F + 2 * j];
        if (of == MSFP_KEPT)
            continue;
        msfp_bounded_friction_direction(f[j], of < 0 ? unit : run->node_rows[of].f[j], own,
                                        of < 0 ? constant[0] : run->gradients->recording.d[of][MSFP_ROW_F + 2 * j], bounded);
        memcpy(own, bounded, sizeof bounded);
    }
}

/* Columns of a row with the bounds of msfp_limit_row. */
static void limit_row(msfp_run *run, msfp_parameter_batch *batch, int count, msfp_row *row, msfp_row_columns d)
{
    msfp_columns gaps[NB][MSFP_GAP_SIZE];
    double sliding[NB][MSFP_GAP_SIZE];
    msfp_row_limits limits;
    double f[NB][2];
    memcpy(f, row->f, sizeof f);
    msfp_gaps_columns(&run->parameters, &batch->parameters, (const double(*)[NQ])row->q,
                      (msfp_columns(*)[NQ])(d + MSFP_ROW_Q), sliding, gaps);
    msfp_limit_row(run->node_rows, count, sliding, row, &limits);
    limit_friction(run, (const double(*)[2])f, &limits, d);
    for (int j = 0; j < NB; ++j) {
        memcpy(d[MSFP_ROW_SLIDING + j], gaps[j][MSFP_GAP_S], sizeof *d);
        if (!MSFP_UPLIFT)
            memcpy(d[MSFP_ROW_GAP + j], gaps[j][MSFP_GAP_G], sizeof *d);
    }
    for (int i = 0; i < limits.zero_count; ++i)
        memset(d[limits.zero[i]], 0, sizeof *d);
}

MSFP_WIDE void msfp_row_between_columns(msfp_run *run, msfp_parameter_batch *batch, double share, int moving,
                                        msfp_row_columns d)
{
    msfp_observe_nodes(run);
    all_node_columns(run, batch);
    const msfp_weights w = msfp_weights_at(run, share);
    const double h = run->next.t - run->now.t;
    const double *values[MSFP_NODES + 2] = { NULL }, *columns[MSFP_NODES + 2] = { NULL };
    msfp_columns moved; /* of the share */
    msfp_row blended;
    for (int r = 0; r < w.count; ++r) {
        values[r] = (const double *)&run->node_rows[r];
        columns[r] = run->gradients->recording.d[r][0];
    }
    msfp_weigh(w.of, w.count, values, MSFP_ROW_SIZE, (double *)&blended);
    msfp_weigh(w.of, w.count, columns, MSFP_ROW_SIZE * C, d[0]);
    for (int c = 0; c < C; ++c)
        moved[c] = -(batch->now.t[c] + share * batch->h[c]) / h;
    if (moving && msfp_any_column(moved)) {
        double slopes[MSFP_NODES + 2], slope[MSFP_ROW_SIZE];
        weight_slopes(run, share, slopes);
        msfp_weigh(slopes, w.count, values, MSFP_ROW_SIZE, slope);
        msfp_add_scaled(d, slope, moved, 1.0, MSFP_ROW_SIZE);
    }
    limit_row(run, batch, w.count, &blended, d);
}

void msfp_row_reached_columns(msfp_run *run, msfp_parameter_batch *batch)
{
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const int last = msfp_last_stage(run);
    if (batch->end_known)
        return;
    msfp_complete_columns(run, batch);
    msfp_record_columns(&run->parameters, &batch->parameters, &stage_history->stage[last].at, &batch->point,
                        &stage_history->work[last], &batch->work, batch->end_row);
    memcpy(batch->end_row[MSFP_ROW_WORK], batch->next.work, sizeof batch->next.work);
    batch->end_known = 1;
}

void msfp_row_of_cubic_columns(msfp_run *run, msfp_parameter_batch *batch, double share, msfp_row *row,
                               msfp_row_columns d)
{
    const double *now = (const double *)&batch->now, *next = (const double *)&batch->next;
    msfp_state_columns *ds = &batch->node[0];
    msfp_state s;
    msfp_interpolate(run, share, &s);
    memcpy(ds->t, batch->now.t, sizeof ds->t);
    msfp_cubics(now, next, run->next.t - run->now.t, share, C, (double *)ds);
    msfp_linear_rates(now, next, share, C, (double *)ds);
    msfp_observe_state(run, &s, row);
    msfp_observe_columns(run, batch, &s, ds, d);
}
#endif
