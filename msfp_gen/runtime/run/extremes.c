/* extremes.c: extremes over every accepted step, so that peaks do not depend on the times of the rows. */
#include <math.h>
#include <string.h>
#include "run.h"

static void take_largest(double *extreme, double value)
{
    if (value > *extreme)
        *extreme = value;
}

static void take_least(double *extreme, double value)
{
    if (value < *extreme)
        *extreme = value;
}

static double length(const double *v) { return sqrt(v[0] * v[0] + v[1] * v[1]); }

/* Largest magnitudes along the axes and in the horizontal plane. */
static void take_vector(double extreme[4], const double vector[3])
{
    for (int i = 0; i < 3; ++i)
        take_largest(&extreme[i], fabs(vector[i]));
    take_largest(&extreme[3], length(vector));
}

/* What follows from the positions alone. */
static void take_positions(msfp_run *run, const msfp_row *row)
{
    double displacement[3];
    msfp_displacement_across(run, row, displacement);
    take_vector(run->extremes.displacement, displacement);
    for (int j = 0; j < NB; ++j) {
        take_largest(&run->extremes.sliding[j], row->sliding[j]);
        take_least(&run->extremes.gap[j], row->gap[j]);
    }
}

static void take_row(msfp_run *run, const msfp_row *row)
{
    msfp_extremes *e = &run->extremes;
    take_positions(run, row);
    take_vector(e->top_force, row->top_force);
    for (int j = 0; j < NB; ++j) {
        take_least(&e->least_normal[j], row->normal[j]);
        take_largest(&e->most_normal[j], row->normal[j]);
        if (row->normal[j] > 0.0) /* of a closed surface */
            take_largest(&e->slip_speed[j], length(row->slip[j]));
#if MSFP_LAW
        take_least(&e->least_friction[j], row->mu[j]);
        take_largest(&e->most_friction[j], row->mu[j]);
#endif
#if MSFP_HEAT
        take_largest(&e->temperature[j], row->temperature[j]);
#endif
    }
}

static double across(const msfp_run *run, const msfp_row *row)
{
    double displacement[3];
    msfp_displacement_across(run, row, displacement);
    return length(displacement);
}

/* Rate of the squared horizontal displacement, over 2 [m^2/s], at the evaluation in run->work. */
static double outward_rate(const msfp_run *run, const msfp_point *at, const msfp_row *row)
{
    double displacement[3], top[3], rate = 0.0;
    msfp_displacement_across(run, row, displacement);
    msfp_body_V_get(run->work.body[NB], top);
    top[1] += MSFP_PLANAR ? at->base[1][1] : 0.0;
    for (int i = 0; i < 2; ++i)
        rate += displacement[i] * (at->base[1][i] - top[i]);
    return rate;
}

void msfp_extremes_begin(msfp_run *run, const msfp_row *row)
{
    msfp_extremes *e = &run->extremes;
    memset(e, 0, sizeof *e);
    for (int j = 0; j < NB; ++j) {
        e->gap[j] = row->gap[j];
        e->least_normal[j] = e->most_normal[j] = row->normal[j];
#if MSFP_LAW
        e->least_friction[j] = e->most_friction[j] = row->mu[j];
#endif
#if MSFP_HEAT
        e->temperature[j] = row->temperature[j];
#endif
    }
    take_row(run, row);
    run->outward_rate = 0.0;
}

static const double near_extreme = 0.95; /* a turning point inside a step is looked at if its end is as near as this */

/* A method of fourth order takes few steps in a period of a vibration: peaks of the force are also sought at the stages
 * between which rows are interpolated. The steps of one of second order are short enough. */
static void take_nodes(msfp_run *run)
{
    msfp_row row;
    for (int i = 0; i < run->node_count && msfp_control_order(run->options.method) > 3.0; ++i)
        if (length(run->node[i].top_force) > run->extremes.top_force[3]) {
            msfp_row_inside(run, run->node[i].share, &row);
            take_vector(run->extremes.top_force, row.top_force);
        }
}

/* Where the bearing turns back inside the step, the positions there count too. */
void msfp_extremes_step(msfp_run *run)
{
    msfp_row own;
    const msfp_row *row = &own;
    if (run->options.output_step <= 0.0) /* the row has just been written */
        row = &run->rows[run->row_count - 1];
    else
        msfp_record(&run->parameters, &run->reached, &run->work, &run->next.mechanical, &own);
    take_row(run, row);
    take_nodes(run);
    const double before = run->outward_rate, after = outward_rate(run, &run->reached, row);
    run->outward_rate = after;
    if (before > 0.0 && after < 0.0 && across(run, row) > near_extreme * run->extremes.displacement[3]) {
        msfp_row_inside(run, before / (before - after), &own);
        take_positions(run, &own);
    }
}
