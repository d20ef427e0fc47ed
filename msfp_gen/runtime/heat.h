/* heat.h: temperature of the surfaces within a step. Private to the runtime; nothing of it is there without heat. */
#ifndef MSFP_HEAT_H
#define MSFP_HEAT_H
#include "msfp_model.h"

#if MSFP_HEAT
/* dheat/dt = -lambda heat + w flux. */
void msfp_heat_rates(const double heat[MSFP_NB][MSFP_HEAT], const double flux[MSFP_NB], double rates[MSFP_NB][MSFP_HEAT]);
/* The temperature of a state, for an evaluation. */
void msfp_heat_point(const msfp_state *s, msfp_point *at);
/* The flux of the evaluation at hand, into the present state. */
void msfp_heat_settle(msfp_run *run);
/* One step: begin; each stage i prepared (weights of the stages before, beta on its own diagonal) and closed; the end. */
void msfp_heat_begin(msfp_run *run);
void msfp_heat_prepare(msfp_run *run, const double *weights, int i, double h, double beta, msfp_point *at);
void msfp_heat_stage(msfp_run *run, int i, double beta);
void msfp_heat_middle(msfp_run *run, msfp_middle *m); /* this stage serves the dense output */
void msfp_heat_finish(msfp_run *run);
/* Largest error of a temperature over its tolerance; weights: of the method less embedded ones. */
double msfp_heat_error(const msfp_run *run, const double *weights, int stages, double h, double beta);
#else
#define msfp_heat_point(s, at) ((void)0)
#define msfp_heat_settle(run) ((void)0)
#define msfp_heat_begin(run) ((void)0)
#define msfp_heat_prepare(run, weights, i, h, beta, at) ((void)0)
#define msfp_heat_stage(run, i, beta) ((void)0)
#define msfp_heat_middle(run, m) ((void)0)
#define msfp_heat_finish(run) ((void)0)
#define msfp_heat_error(run, weights, stages, h, beta) 0.0
#endif
#endif
