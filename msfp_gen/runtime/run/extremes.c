/* extremes.c: extremes over every accepted step, so that peaks do not depend on the times of the rows. */
#include <math.h>
#include <string.h>
#include "run.h"

enum { NB = MSFP_NB };

static void take_largest(double *extreme, double value) { *extreme = fmax(*extreme, value); }
static void take_least(double *extreme, double value) { *extreme = fmin(*extreme, value); }

/* Largest magnitudes along the axes and in the horizontal plane. */
static void take_vector(double extreme[4], const double vector[3])
{
    for (int i = 0; i < 3; ++i)
        take_largest(&extreme[i], fabs(vector[i]));
    take_largest(&extreme[3], hypot(vector[0], vector[1]));
}

/* What follows from the positions alone. */
static void take_positions(msfp_run *run, const msfp_row *row)
{
    double across[3];
    msfp_displacement_across(run, row, across);
    take_vector(run->extremes.displacement, across);
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
            take_largest(&e->slip_speed[j], hypot(row->slip[j][0], row->slip[j][1]));
#if MSFP_LAW
        take_least(&e->least_friction[j], row->mu[j]);
        take_largest(&e->most_friction[j], row->mu[j]);
#endif
#if MSFP_HEAT
        take_largest(&e->temperature[j], row->temperature[j]);
#endif
    }
}

/* Rate of the squared horizontal displacement, over 2 [m^2/s], at the evaluation in run->work. */
static double outward_rate(const msfp_run *run, const msfp_point *at, const msfp_row *row)
{
    double across[3], top[3], rate = 0.0;
    msfp_displacement_across(run, row, across);
    msfp_body_V_get(run->work.body[NB], top);
    top[1] += MSFP_PLANAR ? at->base[1][1] : 0.0;
    for (int i = 0; i < 2; ++i)
        rate += across[i] * (at->base[1][i] - top[i]);
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

/* Where the bearing turns back inside the step, the positions there count too. */
void msfp_extremes_step(msfp_run *run)
{
    msfp_row row;
    msfp_record(&run->parameters, &run->reached, &run->work, &run->next.mechanical, &row);
    take_row(run, &row);
    const double before = run->outward_rate, after = outward_rate(run, &run->reached, &row);
    run->outward_rate = after;
    if (before > 0.0 && after < 0.0) {
        msfp_row_inside(run, before / (before - after), &row);
        take_positions(run, &row);
    }
}
