/* api.h: what stands behind the table of functions of msfp.h. Private to the runtime.
 *
 * Functions of the table check what they are given, since a program in C is not Python: no input leads to a NaN, to a
 * wrong number or to damaged memory without a status. `message` receives a constant text, so nothing is formatted.
 */
#ifndef MSFP_API_H
#define MSFP_API_H
#include "port.h"

struct msfp_bearing {
    msfp_parameters parameters;
};

/* ---- checks.c ---- */

/* MSFP_OK, or MSFP_E_ARGUMENT with what is wrong in *message, where message is not NULL. */
int msfp_check_bearing(double gravity, const double *bodies, const double *surfaces, const double *top,
                       const char **message);
int msfp_check_scene(const msfp_scene *scene, const char **message);
#if MSFP_MOVING_ENDS
int msfp_check_port(const msfp_scene *scene, double axial_load, const char **message);
/* Of a state that a port of another model has reached. */
int msfp_check_entry(const msfp_port *port, const msfp_scene *state, const double *ends);
int msfp_check_port_loaded(const msfp_scene *scene, const char **message);
/* Also the status of a two-port that has failed at its start. */
int msfp_check_trial(const msfp_port *port, double time, const double *ends, const char **message);
uint64_t msfp_port_identity(const msfp_scene *scene, double axial_load, int loaded);
#else
void msfp_port_free(msfp_port *port); /* there is none */
#endif
/* Numbers that tell what a run, or a two-port, computes from, as long as histories are not changed; not 0. */
uint64_t msfp_identity(const msfp_scene *scene);
#if MSFP_GRADIENTS
int msfp_check_gradients(const msfp_run *run, const msfp_gradient_inputs *inputs);
#endif
/* Sets *message and returns MSFP_E_ARGUMENT; message: NULL where nothing is asked. */
int msfp_refuse(const char **message, const char *text);

/* ---- bearing.c: evaluations ---- */

int msfp_api_bearing_new(double gravity, const double *bodies, const double *surfaces, const double *top,
                         msfp_bearing **bearing, const char **message);
void msfp_api_bearing_free(msfp_bearing *bearing);
int msfp_api_accelerations(const msfp_bearing *bearing, const msfp_inputs *at, int balances, double *a, double *row,
                           double *rates, double *unknowns, msfp_convergence *how);
int msfp_api_observe(const msfp_bearing *bearing, const msfp_inputs *at, double *row, double *powers, double *rates,
                     int *in_tension);
int msfp_api_condensed(const msfp_bearing *bearing, const msfp_inputs *at, double q_weight, double v_weight,
                       double a_weight, double beta, double gain, double *residual, double *tangent, double *found);
int msfp_api_momentum_balances(const msfp_bearing *bearing, const msfp_inputs *at, const double *unknowns,
                               const msfp_variable *variables, int count, double *residual, double *jacobian,
                               double *rates);
int msfp_api_named_vectors(const msfp_bearing *bearing, const msfp_inputs *at, double *points, double *rotations,
                           double *bases);

/* ---- scene.c: runs ---- */

void msfp_api_scene_default(msfp_scene *scene);
int msfp_api_run_new(const msfp_scene *scene, msfp_run **run, const char **message);
void msfp_api_run_free(msfp_run *run);
int msfp_api_run_record(msfp_run *run);
int msfp_api_run_advance(msfp_run *run, long steps);
void msfp_api_run_on_rows(msfp_run *run, msfp_row_callback callback, void *user);

int msfp_api_port_method(int method, msfp_method_stages *stages);

/* What the scene says of solver, rows and monitors. */
msfp_options msfp_scene_options(const msfp_scene *scene);

/* ---- progress.c: what a run states ---- */

void msfp_api_run_progress(const msfp_run *run, msfp_progress *progress);
void msfp_api_run_state(const msfp_run *run, msfp_run_state *state);
void msfp_api_run_hold_rows(msfp_run *run, size_t rows);
void msfp_api_run_counts(const msfp_run *run, int64_t *counts);
void msfp_api_run_extremes(const msfp_run *run, double *extremes, double *times);
void msfp_api_run_trips(const msfp_run *run, msfp_trip *trips);
const msfp_event *msfp_api_run_events(const msfp_run *run, size_t *count);
const double *msfp_api_run_rows(const msfp_run *run, size_t *count);
int msfp_api_snapshot_read(msfp_run *run, const void *snapshot, size_t size);
#if MSFP_GRADIENTS
int msfp_api_gradients_start(msfp_run *run, const msfp_gradient_inputs *inputs);
#endif
int msfp_api_snapshot_open(const void *snapshot, size_t size, msfp_run **run);

/* ---- two_port.c; in models that are no two-ports the first two, of checks.c, refuse ---- */

int msfp_api_port_new(const msfp_scene *scene, double axial_load, msfp_port **port, const char **message);
int msfp_api_port_new_loaded(const msfp_scene *scene, msfp_port **port, const char **message);
int msfp_api_port_trial(msfp_port *port, double time, const double *ends, const char **message);
int msfp_api_port_wrench(const msfp_port *port, double *wrench);
int msfp_api_port_derivative(msfp_port *port, const double *direction, double *derivative);
int msfp_api_port_row_derivative(msfp_port *port, const double *direction, double *derivative, double *rows);
int msfp_api_port_row(const msfp_port *port, double *row);
void msfp_api_port_progress(const msfp_port *port, msfp_progress *trial);
void msfp_api_port_counts(const msfp_port *port, int64_t *counts);
double msfp_api_port_time(const msfp_port *port);
int msfp_api_port_commit(msfp_port *port);
int msfp_api_port_snapshot_read(msfp_port *port, const void *snapshot, size_t size);
int msfp_api_port_step_begin(msfp_port *port, double step, const double *expected);
int msfp_api_port_stage(msfp_port *port, int stage, const double *ends, double *wrench);
int msfp_api_port_stage_derivative(msfp_port *port, double *derivative);
int msfp_api_port_step_end(msfp_port *port, double *error, double *share);
int msfp_api_port_step_commit(msfp_port *port, double time);
int msfp_api_port_jump(msfp_port *port, const double *ends);
int msfp_api_port_tripped(msfp_port *port);
void msfp_api_port_trips(const msfp_port *port, msfp_trip *trips);
void msfp_api_port_state(const msfp_port *port, msfp_run_state *state);
int msfp_api_port_enter(msfp_port *port, const msfp_scene *state, const double *ends);
int msfp_api_port_cause(msfp_port *port, int status, msfp_progress *cause);

#endif
