/* run.h: between the loop of a run and its output. Private to the runtime. */
#ifndef MSFP_RUN_H
#define MSFP_RUN_H
#include "msfp_kernels.h"

#define NB MSFP_NB

/* A state inside the last step, at a share of it. */
void msfp_interpolate(const msfp_run *run, double s, msfp_state *out);
void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at);
void msfp_observe_state(msfp_run *run, const msfp_state *s, msfp_row *row);
/* Displacement across the bearing, less its start. */
void msfp_across(const msfp_run *run, const msfp_row *row, double *displacement);
/* Absolute tolerance of a coordinate of body j: of an angle, or of a separation (d = 3). */
double msfp_absolute(const msfp_run *run, int j, int d);
void msfp_event_values(msfp_run *run, const msfp_state *s, double *g);
double msfp_first_event(msfp_run *run, const double *before, const double *after);
int msfp_record_events(msfp_run *run, const double *before, const double *after);
/* Whether the step just made leaves what the model holds for, and the run is to stop for it. */
int msfp_guarded(msfp_run *run, const double *gaps);
void msfp_guard_begin(msfp_run *run);
/* 0 or MSFP_E_MEMORY. */
int msfp_write_row(msfp_run *run, const msfp_state *s);
/* Time of the next row where rows are wanted at even times. */
double msfp_next_output(const msfp_run *run);
int msfp_write_step(msfp_run *run);
/* Whether the step just made, by an energy that nothing gave it, went over what it cannot have seen. */
int msfp_balanced(msfp_run *run);
void msfp_balance_begin(msfp_run *run, const msfp_point *at);
/* The status of a run that cannot go on for want of a shorter step: that, or what lies behind it. */
int msfp_last_word(msfp_run *run, int status);
int msfp_write_event(msfp_run *run, const msfp_state *s, int surface, int kind);

#endif
