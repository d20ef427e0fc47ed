/* run.h: what the files of run/ share. Private to the runtime. */
#ifndef MSFP_RUN_H
#define MSFP_RUN_H
#include "steppers.h"

/* ---- run.c ---- */

/* Accelerations, friction rates and powers consistent with the present state: at the start and after a jump of the base
 * acceleration. Returns MSFP_OK or a status. */
int msfp_consistent_initial_state(msfp_run *run);

/* ---- events.c ---- */

/* Event functions [MSFP_EVENTS] of a state [m]. */
void msfp_event_values(msfp_run *run, const msfp_state *s, double *g);
/* Share of the last step at which the first event lies; 1: none. before, after: event functions at its ends. */
double msfp_first_event(msfp_run *run, const double *before, const double *after);
/* Record the events of the accepted step. after: a gap that is zero but for the tolerance gets the sign of its state;
 * located: whether the step was shortened to an event. Returns 1 where the run is to stop. */
int msfp_record_events(msfp_run *run, const double *before, double *after, int located);

/* ---- monitors.c ---- */

/* Whether the model is valid at a state: no tension, no singular angle. Returns MSFP_OK or a status. */
int msfp_check_state(msfp_run *run, const msfp_work *w, const msfp_state *s);
/* Check the last step. Returns 1 where a monitor stops the run. gaps [MSFP_NB]: at its end [m]. */
int msfp_monitor_step(msfp_run *run, const double *gaps);
/* Velocities of the bodies at the start, for the monitor of inertia. */
void msfp_monitor_begin(msfp_run *run);

/* ---- extremes.c ---- */

enum { MSFP_EXTREME_COUNT = sizeof(msfp_extremes) / sizeof(double), MSFP_ACROSS = MSFP_ROW_SIZE };
/* The numbers of a row of which number `index` of the extremes is the length: returns how many, 1 or 2, with a zero in place
 * of the second; 0: the first number itself. across [3]: the displacement there. of: place of the first of these numbers;
 * from MSFP_ACROSS on: displacement across the bearing. */
int msfp_extreme_pair(int index, const msfp_row *row, const double *across, int *of, double pair[2]);
/* Extremes of the first row. */
void msfp_extremes_begin(msfp_run *run, const msfp_row *row);
/* Extremes with those of the accepted step, after its rows are written. */
void msfp_extremes_step(msfp_run *run);

/* ---- energy_balance.c ---- */

/* Whether the last step neither creates energy nor loses most of it. */
int msfp_energy_consistent(msfp_run *run);
void msfp_energy_balance_begin(msfp_run *run, const msfp_point *at);

/* ---- failure.c ---- */

/* Status of a run that cannot continue with a shorter step: `status`, or the cause behind it. */
int msfp_classify_failure(msfp_run *run, int status);

/* ---- output.c; writing returns MSFP_OK or MSFP_E_MEMORY ---- */

/* A row of a state. */
void msfp_observe_state(msfp_run *run, const msfp_state *s, msfp_row *row);
/* Displacement across the bearing less that at the start [3], [m]. */
void msfp_displacement_across(const msfp_run *run, const msfp_row *row, double *displacement);
/* Time of the next row where rows lie at even times [s]. */
double msfp_next_output(const msfp_run *run);
int msfp_write_row(msfp_run *run, const msfp_state *s);
/* Rows of the accepted step. */
int msfp_write_step(msfp_run *run);
/* Bounds of a row inside a step, which its interpolating polynomial may exceed. */
typedef struct {
    int row[MSFP_NB]; /* of those it is interpolated from, that to whose size Y, Z are scaled; or one of these: */
    int zero_count, zero[MSFP_ROW_SIZE]; /* numbers that are set to zero */
} msfp_row_limits;
enum { MSFP_KEPT = -2, MSFP_UNIT }; /* Y, Z are kept, or scaled to the size 1 */
/* Set these in a row that is interpolated from `count` rows; sliding: as of msfp_gaps, at its angles. */
void msfp_limit_row(const msfp_row *rows, int count, double sliding[MSFP_NB][MSFP_GAP_SIZE], msfp_row *row,
                    msfp_row_limits *limits);
/* Rows at the ends of the last step and at its interpolation nodes, which it has, into run->node_rows. */
void msfp_observe_nodes(msfp_run *run);
/* The row at a share of the last step, 0 to 1, but for its time. */
void msfp_row_inside(msfp_run *run, double share, msfp_row *row);
/* kind: enum msfp_event_kind; surface counted from 1, 0: none. */
int msfp_write_event(msfp_run *run, const msfp_state *s, int surface, int kind);

/* ---- snapshot.c ---- */

/* Whether all of `count` numbers are finite; NULL counts as finite. */
int msfp_all_finite(const double *values, size_t count);

#endif
