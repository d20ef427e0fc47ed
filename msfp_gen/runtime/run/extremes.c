/* extremes.c: extremes over every accepted step and their times, so that peaks do not depend on times of rows. */
#include <math.h>
#include <string.h>
#include "run.h"

/* A field of msfp_extremes: of surfaces, or of a vector along E1, E2, E3 and in the horizontal plane. */
typedef struct {
    int count, of; /* how many numbers; where in a row the first is of */
    enum { MSFP_NUMBER, MSFP_LENGTH, MSFP_VECTOR, MSFP_OPENING } how; /* length of two numbers; opening: below 0 */
    int least;                                          /* whether the least counts, otherwise the largest */
    int positions;                                      /* whether it follows from positions alone */
    int loaded;                                         /* whether only surfaces count that carry a normal force */
} field;

static const field fields[] = { MSFP_EXTREMES };
enum { FIELDS = sizeof fields / sizeof *fields };


/* The numbers of a row that a field is of. */
MSFP_INLINE const double *numbers_of(const field *f, const msfp_row *row, const double *across)
{
    return f->of < MSFP_ACROSS ? (const double *)row + f->of : across;
}

/* The pair of numbers of which number k of a field is the length, and how many of the pair are numbers of a row: one, with
 * zero, for a magnitude; none for a number with its sign, which is the first of the pair. of: place of the first. */
MSFP_INLINE int pair_of(const field *f, const double *u, int k, int *of, double pair[2])
{
    const int radial = f->how == MSFP_VECTOR && k == 3, count = radial || f->how == MSFP_LENGTH ? 2 : 1;
    const int first = radial ? 0 : k * count;
    *of = f->of + first;
    pair[0] = f->how == MSFP_OPENING && !(u[first] < 0.0) ? 0.0 : u[first];
    pair[1] = count > 1 ? u[first + 1] : 0.0;
    return f->how == MSFP_NUMBER ? 0 : count;
}

static double value_of(const field *f, const double *u, int k)
{
    int of;
    double pair[2];
    return pair_of(f, u, k, &of, pair) ? msfp_length_of(pair) : pair[0];
}

int msfp_extreme_pair(int index, const msfp_row *row, const double *across, int *of, double pair[2])
{
    const field *f = fields;
    while (index >= f->count)
        index -= f++->count;
    return pair_of(f, numbers_of(f, row, across), index, of, pair);
}

/* Whether a surface carries a normal force; where it may open, a remainder of N is left that keeps friction defined. */
MSFP_INLINE int is_loaded(const msfp_row *row, int surface)
{
#if MSFP_UPLIFT
    return !(row->compression[surface] < 0.0);
#else
    return row->normal[surface] > 0.0;
#endif
}

/* What is taken of a row: all; what follows from positions alone; the force at the top. */
enum wanted { ALL, OF_POSITIONS, OF_TOP_FORCE };

/* Extremes with a row at a share of the last step. */
static void take(msfp_run *run, const msfp_row *row, double share, enum wanted wanted)
{
    double displacement[3], *extreme = (double *)&run->extremes, *time = (double *)&run->extreme_times;
    const double before = run->now.t, after = run->next.t, at = share < 1.0 ? before + share * (after - before) : after;
    msfp_displacement_across(run, row, displacement);
    for (const field *f = fields; f < fields + FIELDS; extreme += f->count, time += f++->count) {
        if ((wanted == OF_POSITIONS && !f->positions) || (wanted == OF_TOP_FORCE && f->of != MSFP_ROW_TOP_FORCE))
            continue;
        const double *u = numbers_of(f, row, displacement);
        for (int k = 0; k < f->count; ++k) {
            const double value = value_of(f, u, k);
            if ((f->loaded && !is_loaded(row, k)) || !(f->least ? value < extreme[k] : value > extreme[k]))
                continue;
            extreme[k] = value;
            time[k] = at;
        }
    }
}

static double across(const msfp_run *run, const msfp_row *row)
{
    double displacement[3];
    msfp_displacement_across(run, row, displacement);
    return msfp_length_of(displacement);
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
    memset(&run->extremes, 0, sizeof run->extremes);
    double *extreme = (double *)&run->extremes, *time = (double *)&run->extreme_times;
    for (size_t i = 0; i < MSFP_EXTREME_COUNT; ++i)
        time[i] = run->now.t;
    for (const field *f = fields; f < fields + FIELDS; extreme += f++->count)
        for (int k = 0; k < f->count && f->how == MSFP_NUMBER; ++k) /* those with a sign; magnitudes begin at zero */
            extreme[k] = ((const double *)row)[f->of + k];
    take(run, row, 0.0, ALL);
    run->outward_rate = 0.0;
}

static const double near_extreme = 0.95; /* a turning point inside a step is looked at if its end is as near as this */

/* A method of fourth order takes few steps in a period of a vibration: peaks of the force are also sought at the stages
 * between which rows are interpolated. The steps of one of second order are short enough. */
static void take_nodes(msfp_run *run)
{
    msfp_row row;
    for (int i = 0; i < run->node_count && msfp_control_order(run->options.method) > 3.0; ++i)
        if (msfp_length_of(run->node[i].top_force) > run->extremes.top_force[3]) {
            msfp_row_inside(run, run->node[i].share, &row);
            take(run, &row, run->node[i].share, OF_TOP_FORCE);
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
    take(run, row, 1.0, ALL);
    take_nodes(run);
    const double before = run->outward_rate, after = outward_rate(run, &run->reached, row);
    run->outward_rate = after;
    if (before > 0.0 && after < 0.0 && across(run, row) > near_extreme * run->extremes.displacement[3]) {
        const double share = before / (before - after);
        msfp_row_inside(run, share, &own);
        take(run, &own, share, OF_POSITIONS);
    }
}
