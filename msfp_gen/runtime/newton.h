/* newton.h: the equations of one stage of an implicit step, and what solves them. Private to the runtime. */
#ifndef MSFP_NEWTON_H
#define MSFP_NEWTON_H
#include "msfp_model.h"

/* Unknowns are the rates at.v; q = Q + beta v and a = inertia (v - V)/beta follow, Y and Z from the seed. */
typedef struct {
    double Q[MSFP_NB][MSFP_NQ], V[MSFP_NB][MSFP_NQ];
    double beta;
    double inertia; /* 1; 0 leaves all inertia out */
    double goal;    /* residual at which Newton has arrived */
    double keep;    /* residual up to which an evaluation may be the last: a batch leaves no other in the work area */
    int descend;    /* how many steps a batch may take from the next evaluation on, with the factors at hand; 0: none .. */
    int taken;      /* .. and how many steps it then took, .. */
    double before;  /* .. the residual before the evaluation, or before the last of those steps */
    msfp_seed seed;
    msfp_point at;
    double f[MSFP_NB][2];
} msfp_stage;

/* Where Newton starts, in the order in which starts are tried. */
enum { MSFP_START_PREDICTED, MSFP_START_PLAIN, MSFP_START_QUASISTATIC, MSFP_STARTS };

/* Residual over N at the present rates, and its largest entry relative to its natural size; infinite where it cannot be
 * formed. The evaluation is left in `w`. */
double msfp_stage_residual(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual);
void msfp_stage_move(msfp_stage *s, const double *step, double factor);
/* Rates that balance all forces but inertia: where rates from before lead nowhere, Newton starts from them. */
void msfp_quasistatic_start(msfp_run *run, msfp_stage *s);
int msfp_solve_stage(msfp_run *run, msfp_stage *s);

/* implicit.c: an error where Y, Z go further than half a unit. */
double msfp_leap(const double now[MSFP_NB][2], const double next[MSFP_NB][2]);

#endif
