/* gradients.h: derivatives of a run with respect to parameters, by direct differentiation of its steps
 * (docs/gradients.md). Private to the runtime; only models with gradients have it.
 *
 * "Columns" are derivatives with respect to MSFP_COLUMNS parameters, stored [field][column]. A "d" before a name means
 * the columns of that quantity.
 */
#ifndef MSFP_GRADIENTS_H
#define MSFP_GRADIENTS_H
#include <string.h>
#include "run.h"

#if MSFP_GRADIENTS
enum { C = MSFP_COLUMNS };
typedef double msfp_columns[MSFP_COLUMNS];

/* ---- columns.c: one evaluation of the equations ---- */

/* Of the parameters: blocks of msfp_parameters. */
typedef struct {
    double body[MSFP_NB + 1][MSFP_BODY_PARAMETERS_SIZE * MSFP_COLUMNS];
    double surface[MSFP_NB][MSFP_SURFACE_PARAMETERS_SIZE * MSFP_COLUMNS];
    double top[MSFP_TOP_PARAMETERS_SIZE * MSFP_COLUMNS];
} msfp_parameter_columns;

/* Of a state and its inputs, and of the stage formula of Y, Z: f is fp and slip that of msfp_stage_weights. */
typedef struct {
    msfp_columns base[3][6], load[6];
    int base_moves; /* whether those of the base may differ from zero */
    msfp_columns q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], a[MSFP_NB][MSFP_NQ], f[MSFP_NB][2];
    msfp_columns foot[2], foot_beta, beta;
    double slip[MSFP_NB][MSFP_SLIP_SIZE * MSFP_COLUMNS]; /* of a quasi-static step, instead of f */
#if MSFP_MEMORY
    msfp_columns past[MSFP_NB], gain[MSFP_GAINS];
#endif
#if MSFP_TOP_ROTATION
    msfp_columns support[2][6];
#endif
} msfp_point_columns;

/* Of the results of one evaluation: blocks of msfp_work. */
typedef struct {
    double x[MSFP_NB + 1][MSFP_COORDINATES_SIZE * MSFP_COLUMNS], body[MSFP_NB + 1][MSFP_BODY_SIZE * MSFP_COLUMNS];
    double force[MSFP_NB + 1][MSFP_FORCE_SIZE * MSFP_COLUMNS], moment[MSFP_NB + 1][MSFP_MOMENT_SIZE * MSFP_COLUMNS];
    double contact_frame[MSFP_NB][MSFP_CONTACT_FRAME_SIZE * MSFP_COLUMNS],
        friction_stage[MSFP_NB][MSFP_FRICTION_STAGE_SIZE * MSFP_COLUMNS],
        contact[MSFP_NB][MSFP_CONTACT_SIZE * MSFP_COLUMNS];
    double rim[MSFP_NB][MSFP_RIM_SIZE * MSFP_COLUMNS], foot[MSFP_FOOT_SIZE * MSFP_COLUMNS];
    double lock[MSFP_NB][MSFP_LOCK_SIZE * MSFP_COLUMNS];
#if MSFP_UPLIFT
    double unilateral[MSFP_NB][MSFP_UNILATERAL_SIZE * MSFP_COLUMNS];
#endif
    msfp_columns residual[MSFP_DOF];
    int base_moves; /* whether those of body 0 may differ from zero; 0 in a new work, which is zero */
} msfp_work_columns;

/* Columns of the blocks of an evaluation that msfp_work_columns has not (msfp_directions.h). */
typedef struct msfp_block_directions msfp_block_directions;

#if MSFP_TOP_ROTATION
/* Columns of the axis of a rotating support and of its angular velocity, as the block `upright`. */
void msfp_support_columns(const msfp_point *at, const msfp_point_columns *dat, double *dupright);
#endif
/* Columns of the motion of the foot, after those of the top plate. */
void msfp_foot_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                       const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d);

/* Derivatives of the results of the contacts of one evaluation with respect to their inputs. Unless Y follows the closed
 * form, local unknowns (friction, and its coefficient where it follows a law) are eliminated. */
typedef struct {
    double of[MSFP_CONTACT_RESULTS][MSFP_CONTACT_INPUTS][MSFP_LANES]; /* the last index is the surface */
} msfp_slopes;

#if MSFP_UPLIFT
/* Columns of the motion of all bodies, of which `w` has the values: blocks `x` and `body`. */
void msfp_motion_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                         const msfp_point_columns *dat, const msfp_work *w, msfp_work_columns *d);
#endif
/* Columns of the rim of surface j [MSFP_RIM_SIZE][MSFP_COLUMNS], whether it pushes or not. */
void msfp_rim_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w, int j,
                      const msfp_work_columns *d, double *columns);

/* What an evaluation is for: the residual with the rates of Y, Z; a row, with all results of the contacts. */
enum { MSFP_OF_RESIDUAL = 1, MSFP_OF_ROW = 2 };
/* Columns of the condensed equations at the evaluation in `w`. */
void msfp_condensed_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                            const msfp_point_columns *dat, const msfp_stage_weights *weights, const msfp_work *w,
                            const msfp_slopes *slopes, int wanted, msfp_work_columns *d);
/* Columns of the rates of Y, Z, and where f is given of Y, Z. */
void msfp_friction_columns(const msfp_work_columns *d, msfp_columns df[MSFP_NB][2], msfp_columns f[MSFP_NB][2]);

/* ---- contact_columns.c ---- */

/* g: the friction force over -mu N; all: of all results, otherwise of the moments and of the rates of Y, Z. */
void msfp_contact_slopes(const msfp_parameters *p, const msfp_stage_weights *weights, const msfp_work *w,
                         const double g[MSFP_NB][2], int all, msfp_slopes *slopes);
/* Tangent of the condensed equations at the evaluation in `w`, with the derivatives of its contacts; all: as before.
 * Returns a status. */
int msfp_tangent_with_slopes(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                             msfp_work *w, double g[MSFP_NB][2], int all, msfp_slopes *slopes, double *tangent);
/* Columns of all contacts, after those of their local blocks; all: as before. */
void msfp_contact_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                          const msfp_point_columns *dat, const msfp_slopes *slopes, const msfp_stage_weights *weights,
                          int all, msfp_work_columns *d);

/* ---- observation.c: what is recorded ---- */

/* Columns of a row [MSFP_ROW_SIZE] at the evaluation in `w`, but for its integrals. */
void msfp_record_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                         const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d,
                         msfp_columns *row);
/* The block `rim_motion` of surface j; where its gap is closed with columns. */
void msfp_rim_motion_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                             const msfp_work_columns *d, int j, double *closed, double *dclosed);
/* Value of what decides an event of surface j, and its columns: the compression of its contact for lift-off and landing,
 * otherwise the gap of its rim [m]. kind: of the event. */
double msfp_event_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                          msfp_point_columns *dat, int kind, int j, double *columns);
/* Sliding displacements and gaps at given coordinates, and their columns. */
void msfp_gaps_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const double q[MSFP_NB][MSFP_NQ],
                       msfp_columns dq[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE],
                       msfp_columns gaps[MSFP_NB][MSFP_GAP_SIZE]);

/* ---- a run ---- */

typedef msfp_columns msfp_row_columns[MSFP_ROW_SIZE];

/* Columns of a state; of works and powers where they are computed, else zero. */
typedef struct {
    MSFP_STATE_FIELDS(msfp_columns)
} msfp_state_columns;
MSFP_STATIC_ASSERT(sizeof(msfp_state_columns) == MSFP_COLUMNS * offsetof(msfp_state, energy), state_columns);

#if MSFP_CLOSED_FORM
/* Of what the work of a quasi-static step follows from (msfp_step_history): powers before it, and at its end. */
typedef struct {
    msfp_columns power[MSFP_WORKS], normal[MSFP_NB];
    double load_end[MSFP_LOAD_END_SIZE * MSFP_COLUMNS];
} msfp_history_columns;
#endif

/* MSFP_COLUMNS parameters of a run. */
typedef struct {
    msfp_parameter_columns parameters;
    msfp_history motion[MSFP_COLUMNS], load[MSFP_COLUMNS]; /* pieces 0: does not depend on the parameter */
    msfp_state_columns now, next, node[MSFP_NODES];
    msfp_columns h;               /* of the length of the step */
    msfp_columns start[3];        /* of r_01 - r_nn at the start */
    msfp_columns before[MSFP_NB]; /* theta before the step that led to `now`, of quasi-static steps */
    msfp_point_columns point;     /* of the last stage of the step */
    msfp_work_columns work;       /* of its evaluation: at constant rates until `complete` */
    int complete;
    msfp_row_columns start_row, end_row; /* of the rows at the ends of the step, where they are known */
    int start_known, end_known;
    msfp_columns extremes[MSFP_EXTREME_COUNT];
#if MSFP_CLOSED_FORM
    msfp_history_columns history;
#endif
} msfp_parameter_batch;

/* The stages of a step as the method solved them, and their factored tangents. */
typedef struct {
    msfp_stage stage[MSFP_STAGES];
    msfp_state state[MSFP_STAGES]; /* 0: the start of the step */
    msfp_work work[MSFP_STAGES];
    msfp_slopes slopes[MSFP_STAGES];
    int all_slopes; /* whether those of the last stage are complete */
    double factors[MSFP_STAGES][MSFP_DOF * MSFP_DOF];
    int pivots[MSFP_STAGES][MSFP_DOF];
} msfp_stage_history;

/* The evaluation of a state outside of a step; g: the friction force over -mu N. */
typedef struct {
    msfp_point at;
    msfp_stage_weights weights;
    double g[MSFP_NB][2];
    msfp_work work;
    msfp_slopes slopes;
} msfp_observation;

/* Evaluations at the start of the last step and at its interpolation nodes; columns of the rows there and at its end,
 * of one batch. */
typedef struct {
    msfp_observation node[MSFP_NODES + 1], own;
    int node_known[MSFP_NODES + 1]; /* whether `node` is */
    msfp_row_columns d[MSFP_NODES + 2], row;
    int columns_known; /* whether `d` is */
    msfp_work_columns work;
} msfp_recording;

struct msfp_gradients {
    int count, batches; /* parameters, and batches of MSFP_COLUMNS of them */
    int energies;      /* whether columns of the works are computed */
    msfp_parameter_batch *batch;
    msfp_stage_history stage_history;
    msfp_recording recording;
    double *rows; /* [row][parameter][MSFP_ROW_SIZE] */
    size_t row_count, row_capacity;
    double *events; /* [event][parameter]: time, displacement, top force */
    size_t event_count, event_capacity;
    double event_time; /* of the last rim contact or release [s] */
    msfp_run own;      /* the run, while a step to an event is taken once more */
};

/* ---- initial_columns.c, step_columns.c: states ---- */

/* sum += weight * columns, of `count` numbers */
MSFP_INLINE void msfp_add_columns(msfp_columns *sum, const msfp_columns *columns, double weight, int count)
{
    msfp_add(sum[0], columns[0], weight, count * MSFP_COLUMNS);
}
/* sum += values * factor: columns of a product whose other factor has the columns `factor`. */
MSFP_INLINE void msfp_add_scaled(msfp_columns *restrict sum, const double *restrict values, const msfp_columns factor,
                                 double weight, int count)
{
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < MSFP_COLUMNS; ++c)
            sum[i][c] += weight * values[i] * factor[c];
}
/* Sum of weights[i stride] times columns[i], of `count` rows of columns, in vectors. */
MSFP_INLINE void msfp_combine_columns(const double *weights, int stride, const double *columns, int count, double *sum)
{
    enum { PACKS = MSFP_COLUMNS / MSFP_PACK_SIZE };
    const msfp_pack *packs = (const msfp_pack *)columns;
    msfp_pack total[PACKS];
    for (int k = 0; k < PACKS; ++k)
        total[k] = weights[0] * packs[k];
    for (int i = 1; i < count; ++i)
        for (int k = 0; k < PACKS; ++k)
            total[k] += weights[i * stride] * packs[i * PACKS + k];
    memcpy(sum, total, sizeof total);
}
/* Whether a column is not zero. */
MSFP_INLINE int msfp_any_column(const double *columns)
{
    for (int c = 0; c < MSFP_COLUMNS; ++c)
        if (columns[c] != 0.0)
            return 1;
    return 0;
}

/* The columns of a polar vector of a block along E1, E2, E3. */
MSFP_INLINE void msfp_get_polar(const double *block, msfp_columns *vector)
{
    if (MSFP_PLANAR)
        memset(vector[1], 0, sizeof *vector);
    for (int i = 0; i < MSFP_FORCE_SIZE; ++i)
        memcpy(vector[MSFP_PLANAR ? 2 * i : i], block + i * MSFP_COLUMNS, sizeof *vector);
}
/* The inverse. */
MSFP_INLINE void msfp_put_polar(double *block, const msfp_columns *vector)
{
    for (int i = 0; i < MSFP_FORCE_SIZE; ++i)
        memcpy(block + i * MSFP_COLUMNS, vector[MSFP_PLANAR ? 2 * i : i], sizeof *vector);
}
/* The same of an axial vector, which in the plane has E2 only. */
MSFP_INLINE void msfp_put_axial(double *block, const msfp_columns *vector)
{
    for (int i = 0; i < MSFP_MOMENT_SIZE; ++i)
        memcpy(block + i * MSFP_COLUMNS, vector[MSFP_PLANAR ? 1 : i], sizeof *vector);
}

MSFP_INLINE int msfp_last_stage(const msfp_run *run)
{
    return msfp_is_quasistatic(run) ? 1 : msfp_tableau_of(run->options.method)->stages - 1;
}
/* Columns of base motion and load at time t [s], whose columns are dt, into `dat`. */
void msfp_inputs_columns(msfp_run *run, msfp_parameter_batch *batch, double t, const double *dt,
                         msfp_point_columns *dat);
/* Columns of accelerations and rates that are consistent with the present state, after those of q, v, f and the foot;
 * first: at the start of the run, where the columns of the foot follow too. Returns a status. */
int msfp_initial_columns(msfp_run *run, msfp_parameter_batch *batch, int first);
/* Columns of the accepted step, whose stages are in the stage history; batch->h is given. */
void msfp_step_columns(msfp_run *run, msfp_parameter_batch *batch);
/* Complete the columns of the evaluation that ended the step. */
void msfp_complete_columns(msfp_run *run, msfp_parameter_batch *batch);

/* ---- memory_columns.c: memories of the surfaces, as the functions of memory.c without "columns" ---- */
#if MSFP_MEMORY
/* Into `dat`, after its columns of beta. from: what the earlier stages give. */
void msfp_memory_point_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_state *from,
                               const msfp_state_columns *dfrom, double beta, msfp_point_columns *dat);
/* At the evaluation in `w`, whose columns are d. */
void msfp_memory_state_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                               const msfp_work_columns *d, const msfp_state *from, const msfp_state_columns *dfrom,
                               double beta, const double *dbeta, msfp_state_columns *ds);
#else
#undef msfp_memory_point_columns /* its prefixed name, see msfp_symbols.h */
#define msfp_memory_point_columns(...) ((void)0)
#endif

/* ---- observation.c, work_columns.c: works of the energy balance, where they are asked for ---- */

/* Columns of the powers at the evaluation in `w`, with all results of its contacts, into `to`. */
void msfp_columns_of_powers(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                            const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d,
                            msfp_state_columns *to);
#if MSFP_CLOSED_FORM
/* Columns of the block `load_end` at the same evaluation. */
void msfp_load_end_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                           const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d, double *columns);
#endif
/* Columns of the powers of the present state, at the point and evaluation of msfp_initial_columns. */
void msfp_initial_works(msfp_run *run, msfp_parameter_batch *batch, const msfp_point *at,
                        const msfp_stage_weights *weights, const double g[MSFP_NB][2]);
/* Columns of powers and works of stage i, which is solved, into stages[i]; from: what the earlier ones give. */
void msfp_stage_works(msfp_run *run, msfp_parameter_batch *batch, int i, const msfp_state_columns *from,
                      msfp_state_columns *stages);
/* Columns of the works of a quasi-static step, whose evaluation is complete. */
void msfp_quasistatic_works(msfp_run *run, msfp_parameter_batch *batch);

/* ---- row_columns.c ---- */

/* Columns of the row of a state; ds: columns of the state. */
void msfp_observe_columns(msfp_run *run, msfp_parameter_batch *batch, const msfp_state *s, const msfp_state_columns *ds,
                          msfp_row_columns d);
/* Columns of the row at a share of the last step; moving: whether the share is a fixed time, and so depends on the
 * parameters where the ends of the step do. */
void msfp_row_between_columns(msfp_run *run, msfp_parameter_batch *batch, double share, int moving, msfp_row_columns d);
/* Columns of the row of the end of the step, batch->end_row, unless they are known. */
void msfp_row_reached_columns(msfp_run *run, msfp_parameter_batch *batch);
/* Row and columns at a share of a quasi-static step. */
void msfp_row_of_cubic_columns(msfp_run *run, msfp_parameter_batch *batch, double share, msfp_row *row,
                               msfp_row_columns d);

/* ---- extreme_columns.c ---- */

/* Columns of the extremes that the first row, or the step, has changed. */
void msfp_extremes_of_first_row(const msfp_run *run, msfp_parameter_batch *batch, const msfp_row *row,
                                const msfp_row_columns d);
/* Whether the step has changed some. */
int msfp_step_has_extreme(const msfp_run *run);
void msfp_extremes_of_step(msfp_run *run, msfp_parameter_batch *batch);

/* ---- recording.c ---- */

/* What decides an event of surface j at the end of the step (msfp_event_columns), and its rate [m/s]. */
double msfp_event_at_end(msfp_run *run, int kind, int j, double *rate);
/* Columns of the time from the end of the step to an event there, by those of the state at the end: minus the columns of
 * what decides the event, over its rate. Where that does not change they are zero. */
void msfp_event_time_columns(msfp_run *run, msfp_parameter_batch *batch, int kind, int j, double *dt);
/* Columns of a row that was recorded of a state: of the first one, with those of the extremes, or of the end of the step.
 * Returns MSFP_OK or MSFP_E_MEMORY. */
int msfp_record_state_columns(msfp_run *run, int first);
/* Columns of the first `count` rows of the run, as far as they are new. Returns MSFP_OK or MSFP_E_MEMORY. */
int msfp_record_rows_columns(msfp_run *run, size_t count);
/* Columns of its events and of the extremes that it changed. Returns MSFP_OK or MSFP_E_MEMORY. */
int msfp_record_extremes_columns(msfp_run *run);

/* ---- accepted_step.c ---- */

/* Columns of the step that was accepted and recorded, and of what it recorded. before, after: event functions at its
 * ends. Returns MSFP_OK or a status. */
int msfp_accepted_step_columns(msfp_run *run, const double *before, const double *after);
#endif
#endif
