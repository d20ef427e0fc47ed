/* port.h: a bearing whose two ends move as another program says (docs/embedding.md, the two-port).
 *
 * End A holds the base, end B the far side of the interface: springs and dampers on the top plate. The motion of an end
 * is [order][u_1..3 [m], rotation vector [rad]]: values, first and second derivatives. A wrench is force [N] and moment
 * [N m] that an end exerts on the bearing, about the present position of that end. End 0 is A, end 1 is B.
 *
 * In a loaded two-port end B is free: of[1] is then the force [N] and moment [N m] on the top plate
 * at r_nn with two derivatives, and the wrench of end B is that load.
 *
 * A trial goes from the committed state to a given motion of the ends at a later time, with the step control of a run
 * in between. It depends on nothing else, so that trials may be repeated in any order.
 */
#ifndef MSFP_PORT_H
#define MSFP_PORT_H
#include "run.h"

#if MSFP_MOVING_ENDS /* nothing of it is compiled into models that are no two-ports */
enum { MSFP_NO_STEP = -1 };
enum { MSFP_ENDS = 2, MSFP_ORDERS = 3, MSFP_END_FREEDOMS = 6, MSFP_PORT_FREEDOMS = MSFP_ENDS * MSFP_END_FREEDOMS };

/* Of an end [rad]: a run ends at this tilt, next to the singularity of the Euler angles. */
#define MSFP_LARGEST_TURN 1.5

/* Motion of both ends at one time. */
typedef struct {
    double of[MSFP_ENDS][MSFP_ORDERS][MSFP_END_FREEDOMS];
} msfp_ends;

/* Two pieces: the trial, and the motion going on from its end, so that its end is exact. */
enum { MSFP_PORT_PIECES = 2 };
typedef struct {
    double coefficients[MSFP_PORT_PIECES][6][MSFP_DEGREE + 1];
} msfp_polynomials;

/* A step by stages from the committed state: those of `committed.now` and `next`. */
typedef struct {
    msfp_stages stages;
    int stage;         /* that is being solved; 0: none yet, -1: no step was begun */
    int solved;        /* that stage has been; stage 0 is the committed state */
    double anchor[2];  /* where the horizontal springs are fixed in this step [m] */
    double moves[MSFP_DOF][MSFP_END_FREEDOMS]; /* d(rates of the stage)/d(rates of end B) */
    int moved;         /* `moves` has been computed */
    double after[MSFP_EVENTS]; /* event functions at its end */
    double energy;     /* at its end, with springs as in `committed.now` [J] */
    int finished;      /* it may be committed */
    msfp_monitor_state monitor; /* at its end */
    int tripped;       /* a monitor stops it */
} msfp_port_step;

struct msfp_port {
    msfp_run committed; /* state at the end of the last committed step, with its row */
    msfp_run run;       /* the trial: its state is a copy of that of `committed` at first */
    msfp_ends from, to; /* motion of the ends in those states */
    double wrench[MSFP_PORT_FREEDOMS]; /* of the committed state: stages that are given up change committed.work */
    double knots[MSFP_PORT_PIECES + 1]; /* of the trial, and any later one [s] */
    msfp_polynomials motion, load;
    msfp_polynomials support;
    int loaded;        /* end B is free */
    double axial_load; /* that the interface carries at rest [N] */
    double plate[3];   /* r_nn at rest, where end B is with u = 0 [m] */
    double *times;     /* [time_count]: ends of the steps of the trial [s] */
    size_t time_count, time_capacity;
    /* Since the last commit, revert or failure; a trial of no duration has no steps, but may be committed. */
    enum { NO_TRIAL, TRIAL_OF_NO_DURATION, TRIAL_SOLVED } trial_state;
    msfp_port_step step;
};

/* ---- port.c ---- */

/* A bearing at rest under the axial load [N], both ends at u = 0; the springs of the top in `p` are
 * the interface. q: as in msfp_run_start, without tilts. loaded: end B is free, axial load zero.
 * The status is that of `committed`. Free it also after a failure; NULL: no memory. */
msfp_port *msfp_port_new(const msfp_parameters *p, const msfp_options *options, double axial_load, const double *q,
                         int loaded);
void msfp_port_free(msfp_port *port);
/* Continue in a port at rest from the state of a port of another model. options: start time, origin, foot and memory are
 * those of that state, as q, v, f are; monitor_heat: as in a scene, NULL: none; ends [end][order][6]: their motion. */
int msfp_port_enter(msfp_port *port, const msfp_options *options, const double *q, const double *v, const double *f,
                    const double *monitor_heat, const double *ends);
/* Go from the committed state to the time `t` [s], not before it, at which the ends are at `to` [end][order][6]. At the
 * committed time `to` is the committed motion. Returns MSFP_OK, or a status: see port->run. */
int msfp_port_trial(msfp_port *port, double t, const double *to);
/* Wrenches [end][6] of the last trial, or of the committed state where there is none. */
void msfp_port_wrench(const msfp_port *port, double *wrench);
/* The row of that state. */
const msfp_row *msfp_port_row(const msfp_port *port);
/* Accept the last trial. Returns MSFP_OK, or MSFP_E_ARGUMENT where none has succeeded. */
int msfp_port_commit(msfp_port *port);
/* Return to the committed state. */
void msfp_port_revert(msfp_port *port);
/* A snapshot of the committed state: bytes without pointers, for a port of the same values and build. */
size_t msfp_port_snapshot_size(const msfp_port *port);
void msfp_port_snapshot_write(const msfp_port *port, void *snapshot);
/* Returns MSFP_OK, or MSFP_E_MEMORY or MSFP_E_SNAPSHOT, after which nothing has changed. */
int msfp_port_snapshot_read(msfp_port *port, const void *snapshot, size_t size);
/* Whether all numbers [end][order][6] are finite and no end turns by more than MSFP_LARGEST_TURN;
 * loaded: those of end B are a load. */
int msfp_valid_ends(const double *ends, int loaded);
/* A history of those polynomials. */
void msfp_attach(msfp_history *history, const double *knots, const msfp_polynomials *polynomials);
/* Prepare a trial that ends at `t` with the ends at `to`: the histories of `run`, from the committed state. */
void msfp_port_prepare(msfp_port *port, msfp_run *run, double t, const msfp_ends *to);

/* ---- stage.c: steps by the stages of a method that another program drives ---- */

/* Begin a step of length h [s] from the committed state, in place of one begun before.
 * expected [2]: horizontal displacement of end B expected at its end [m]. */
void msfp_port_step_begin(msfp_port *port, double h, const double *expected);
/* Solve stage i, the last one again or the next, at the motion `ends` [end][order][6]; gives the
 * wrenches [end][6]. Returns MSFP_OK or a status, with its place as in a run. */
int msfp_port_stage(msfp_port *port, int i, const double *ends, double *wrench);
/* Derivatives [6][6] of the wrench of end B in that stage by the rates of end B; its displacements
 * change with them by gamma h. Returns MSFP_OK or a status. */
int msfp_port_stage_derivative(msfp_port *port, double *derivative);
/* After the last stage: error over tolerance [-], and the share of the step at which the first
 * event lies; 1: none. Returns MSFP_OK or a status. */
int msfp_port_step_end(msfp_port *port, double *error, double *share);
/* Whether a monitor stops the step that has just ended and that would be accepted now. Its trip is noted then, and the
 * step must not be committed. */
int msfp_port_tripped(msfp_port *port);
/* Accept the step, which ends at the time t [s]. */
int msfp_port_step_commit(msfp_port *port, double t);
/* The accelerations of the ends jump to those of `ends`. Returns MSFP_OK or a status. */
int msfp_port_jump(msfp_port *port, const double *ends);
/* The cause of a `status` that a shorter step does not cure. */
int msfp_port_cause(msfp_port *port, int status);

/* ---- ends.c: what a motion of the ends is to the equations ---- */

/* Displacement and angles psi, theta, phi (2.1) [order][6] of the motion [order][6] of an end. */
void msfp_end_channels(const double *end, double *channels);
/* The polynomials of a step from the committed motion at the time t to the ends at `to` at the time `end` [s]: motion of
 * the base; load on the top plate; rotation of its support. The load is what the motion of end B adds to springs that are
 * fixed horizontally where it is at `end`, and vertically at rest, and the axial load; or that of a loaded two-port. */
void msfp_port_paths(msfp_port *port, const msfp_parameters *p, double t, double end, const msfp_ends *to);
/* Channel k: a motion from rest at zero whose derivative k at the end of the step is 1, the others 0. */
void msfp_unit_paths(double h, msfp_polynomials *paths);
/* The block `far_end` of end B; anchor: where the horizontal springs are fixed, a displacement of end B [m]. */
void msfp_far_end(const msfp_port *port, const double *u, const double *v, const double *anchor, double *block);
/* Force on the top plate [3] that follows from it [N]. */
void msfp_load_of_interface(const msfp_parameters *p, const double *far_end, double *load);
/* Fix the horizontal springs where end B is at u = `at` [m] instead of `from`; returns the change
 * of their energy [J], the top plate at `plate` [m]. */
double msfp_port_move_anchor(const msfp_port *port, msfp_run *run, const double *plate, const double *from,
                             const double *at);
/* The histories of the committed run over a step of length h [s] to the ends at `to`. */
void msfp_port_histories(msfp_port *port, const msfp_ends *to, double h);
/* Histories and springs that hold the ends as they move in the committed state. */
void msfp_port_hold(msfp_port *port);
/* Wrenches [end][6] of the evaluation in run->work, the ends at `at`. */
void msfp_port_wrench_of(const msfp_port *port, const msfp_run *run, const msfp_ends *at, double *wrench);
/* Powers of a state, and its works by `weight` [s], with the motion of end B, which those of a run take to be at rest: the
 * dampers of the interface lose c (V - v)^2 of the plate's velocity V and that of end B v; c v (v - 2 V) is input too. */
void msfp_port_dampers(const msfp_port *port, const msfp_run *run, const msfp_ends *at, double weight, msfp_state *to);
/* Energy of the springs of the interface beyond that of the springs of the run, which are fixed elsewhere [J]. */
double msfp_port_springs(const msfp_port *port, const msfp_run *run, const msfp_ends *at);

/* ---- derivatives.c ---- */

/* Derivatives of the last trial, its steps held, by the freedoms of the ends at its end. direction: how displacements,
 * rates and accelerations change together; (1, 0, 0) gives the tangent. derivative [12][12]: of the wrenches; rows
 * [MSFP_ROW_SIZE + 6][12], or NULL: of the row, as port_row_derivative of msfp.h says, and of velocity and acceleration of
 * r_nn. Returns MSFP_OK or a status, after which nothing was written. */
int msfp_port_derivative(msfp_port *port, const double direction[MSFP_ORDERS], double *derivative, double *rows);

#endif
#endif
