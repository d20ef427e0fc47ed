/* equations.h: what the files of equations/ share, and what steppers/ and run/ take from them. Private to the runtime.
 *
 * Arguments as in msfp_runtime.h; j is a surface, 0..MSFP_NB - 1; k a body, 0..MSFP_NB. "Columns" are derivatives with
 * respect to the MSFP_DOF unknowns of a step, stored [field][column].
 */
#ifndef MSFP_EQUATIONS_H
#define MSFP_EQUATIONS_H
#include <math.h>
#include "msfp_model.h"

#if MSFP_LAW
#define MSFP_IF_LAW(...) , __VA_ARGS__ /* one more argument where the friction coefficient is an unknown */
#else
#define MSFP_IF_LAW(...)
#endif
#if MSFP_RIMS
#define MSFP_IF_RIMS(...) , __VA_ARGS__ /* one more argument where the surfaces have rims */
#else
#define MSFP_IF_RIMS(...)
#endif
#if MSFP_TOP_ROTATION
#define MSFP_IF_TOP_ROTATION(...) , __VA_ARGS__ /* one more argument where the support of the top plate rotates */
#else
#define MSFP_IF_TOP_ROTATION(...)
#endif

#ifndef MSFP_FORWARD_TANGENT
#define MSFP_FORWARD_TANGENT MSFP_UPLIFT /* whether the tangent is that of tangent_forward.c; tests define it */
#endif

/* Field of the block of coordinates: angle i of order 0, 1, 2. */
static inline int msfp_coordinate_field(int order, int i) { return MSFP_PLANAR ? order : 3 * order + i; }

#if MSFP_UPLIFT
/* Field of the block of coordinates: component i of the separation, order 0, 1, 2. */
static inline int msfp_separation_field(int order, int i) { return MSFP_COORDINATES_DX + MSFP_SPACE * order + i; }
#endif

/* Field of the block of coordinates: unknown i of a body, order 0, 1, 2. */
static inline int msfp_unknown_field(int order, int i)
{
#if MSFP_UPLIFT
    if (i >= MSFP_NA)
        return msfp_separation_field(order, i - MSFP_NA);
#endif
    return msfp_coordinate_field(order, i);
}

/* The blocks of an evaluation that are not in msfp_work (msfp_schedule.h). */
typedef struct msfp_blocks msfp_blocks;
typedef struct msfp_block_tangents msfp_block_tangents;

/* ---- kinematics.c ---- */

/* The body that slides in surface j: its face is the footprint, its edge meets the rim. */
static inline int msfp_slider(int j)
{
    static const int signs[MSFP_NB] = MSFP_SIGNS;
    return signs[j] > 0 ? j + 1 : j;
}

/* Inputs of an evaluation: coordinates, motion of the base unless it is the same as in `w`, loads, friction and
 * memories. weights: NULL outside of a step. */
void msfp_set_inputs(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights, msfp_work *w,
                     msfp_blocks *s);
/* The inertial frame at r_01 (3.1) as the block of a body, the parent of body 0. */
void msfp_inertial_frame(const msfp_point *at, double *body);
/* Inputs at the top plate alone: load, the block `foot_stage`, axis of a rotating support. */
void msfp_set_loads(const msfp_parameters *p, const msfp_point *at, msfp_blocks *s);
/* Motion of all bodies alone, into `w`. */
void msfp_motion(const msfp_parameters *p, const msfp_point *at, msfp_work *w);
/* Motion of the foot of the supported mass; without a spring it is fixed to the top plate. */
void msfp_move_foot(const msfp_parameters *p, const double *stage, msfp_work *w);
/* Whether a vertical spring or damper acts on the top plate. */
int msfp_top_is_sprung(const msfp_parameters *p);
/* The mass that rests on it [kg]; 0 for that of a rig. */
double msfp_sprung_mass(const msfp_parameters *p);
/* The block `foot_stage`: zero without a spring. A spring on which no mass rests has a fixed end. */
void msfp_foot_stage(const msfp_parameters *p, const msfp_point *at, double *stage);
#if MSFP_TOP_ROTATION
/* Tilt of the support of the top plate and its rate, as the block `support`. */
void msfp_support(const msfp_point *at, double *support);
/* Its axis and angular velocity, as the block `upright`. */
void msfp_support_axis(const msfp_point *at, double *upright);
#endif

#if MSFP_MOVING_ENDS
/* Angles psi, theta, phi (2.1) of a rotation vector, with two derivatives in time: both [order][3]. */
void msfp_end_angles(const double rotation[3][3], double angles[3][3]);
#endif

/* ---- contact_unilateral.c ---- */

#if MSFP_UPLIFT
/* Compression of the unilateral contact of surface j [m]; negative where it is open. */
double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j);
enum { MSFP_OPEN, MSFP_ON_FACE, MSFP_ON_EDGE }; /* how a slider stands on its footprint */
/* Unilateral contact of surface j, zero where it is open or its damping would pull. */
void msfp_unilateral_force(const msfp_parameters *p, msfp_work *w, int j);
#endif

/* ---- surface.c ---- */

/* Rim force (3.22)-(3.25) of surface j; drim: its Jacobian [force, moment][inputs of the rim], or NULL. */
void msfp_rim_force(const msfp_parameters *p, msfp_work *w, int j, double *drim);
/* Sliding displacements and gaps (3.20), (3.21) [m] at given coordinates. */
void msfp_gaps(const msfp_parameters *p, const double q[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE]);

/* ---- contact.c ---- */

/* Local unknowns of a contact: the friction force over -mu N, and mu where it follows a law. */
enum { MSFP_LOCAL_UNKNOWNS = MSFP_FRICTION_FORCE_SIZE + MSFP_LAW };
/* Eliminate them from derivatives [MSFP_LOCAL_UNKNOWNS][inputs][lane] of their equations by inputs, the unknowns first: by
 * the others they are their row over its diagonal entry. Their matrix is near the identity and needs no pivots. */
MSFP_INLINE void msfp_eliminate_friction(int inputs, double (*a)[MSFP_LANES])
{
    for (int k = 0; k < MSFP_LOCAL_UNKNOWNS; ++k)
        for (int r = 0; r < MSFP_LOCAL_UNKNOWNS; ++r) {
            double factor[MSFP_LANES];
            for (int s = 0; s < MSFP_LANES; ++s)
                factor[s] = a[r * inputs + k][s] / a[k * inputs + k][s];
            for (int c = k + 1; c < inputs && r != k; ++c)
                for (int s = 0; s < MSFP_LANES; ++s)
                    a[r * inputs + c][s] -= factor[s] * a[k * inputs + c][s];
        }
}
/* Y, Z and the contact of all surfaces; g as of msfp_condensed. condensed: Jacobian [MSFP_CONTACT_ROWS] with respect to the
 * inputs of a surface, with g (and mu) eliminated, lane by lane; or NULL. Returns a status. */
int msfp_contacts(const msfp_parameters *p, msfp_work *w, const msfp_stage_weights *weights, double g[MSFP_NB][2],
                  double *condensed);
/* Columns of the moments and of N from those of the inputs of the contacts, by that Jacobian, which is in `w`; in models
 * with gradients also `drates` of `w`. */
void msfp_contact_tangents(msfp_work *w, double dlocal[MSFP_NB][MSFP_CONTACT_FRAME_SIZE * MSFP_DOF],
                           double dcontact[MSFP_NB][MSFP_CONTACT_SIZE * MSFP_DOF]);
#if MSFP_CLOSED_FORM
/* Y after the body above has turned by `turn` [rad]. par: of the surface. */
double msfp_friction_after_turn(const double *par, double Y, double turn);
/* Work that friction stores and dissipates over a slip: blocks `slip`, `slip_end` and `slip_work`. */
void msfp_work_of_slip(const double *par, const double *slip, const double *end, double *work);
#endif

/* ---- condensed.c, and its tangent in tangent.c or in tangent_forward.c ---- */

/* Largest residual relative to its natural size, infinite where one is not finite. worst: its row, unchanged if all are
 * zero. */
double msfp_residual_size(const msfp_parameters *p, const msfp_work *w, const double *residual, int *worst);
/* Of tangent.c in all models: columns of force and moment at the top at a given load, from those of the top plate: all in `w`. */
void msfp_top_tangent(const msfp_parameters *p, const msfp_point *at, msfp_work *w);
/* Tangent [MSFP_DOF][MSFP_DOF] of the condensed equations at the evaluation in `w`. */
void msfp_tangent(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights, msfp_work *w,
                  double *tangent);
/* After it: derivatives [MSFP_DOF][MSFP_DOF] of the same equations with respect to force and moment at the top, for
 * given columns of these: dforce [MSFP_FORCE_SIZE][MSFP_DOF], dmoment [MSFP_MOMENT_SIZE][MSFP_DOF]. The columns in `w`
 * are lost. */
void msfp_load_tangent(const msfp_parameters *p, msfp_work *w, const double *dforce, const double *dmoment,
                       double *derivatives);

/* ---- observe.c ---- */

/* Inputs of energies and powers that are not in `w`: motion of the base, load, axis of a rotating support. */
void msfp_set_observed(const msfp_point *at, msfp_blocks *s);
/* Gap of the rim of surface j and its rate, as the block `rim_motion`. */
void msfp_gap_of_rim(const msfp_work *w, int j, double *rim);
/* Power that plastic slip and the drilling moment dissipate at surface j [W]. */
double msfp_heating(const msfp_parameters *p, const msfp_work *w, int j);
#if MSFP_CLOSED_FORM
/* Load on the top plate with its displacement at the evaluation in `w`, as the block `load_end`; its work between two
 * such ends [J]. */
void msfp_end_of_load(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, double *end);
double msfp_work_of_load(const double *from, const double *to);
#endif
/* Kinetic and potential energy and that of all springs but friction [J]. */
double msfp_stored_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                          const msfp_mechanical *mechanical);
/* Length of two numbers of a row. */
double msfp_length_of(const double pair[2]);
/* Y, Z scaled to the size of others. */
void msfp_bound_friction(double f[2], const double most[2]);
/* Evaluate the equations at a state outside of a step; fills weights and g, the friction force over -mu N. */
void msfp_evaluate_state(const msfp_parameters *p, const msfp_point *at, msfp_stage_weights *weights, msfp_work *w,
                         double g[MSFP_NB][2]);
/* Fill a row from the evaluation in `w`. */
void msfp_record(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_mechanical *mechanical,
                 msfp_row *row);

/* ---- history.c ---- */

/* Value and derivatives of a prescribed history at time t [s]: out [orders][6]. */
void msfp_history_at(msfp_history *h, double t, int orders, double out[][6]);

/* ---- memory.c: nothing of it is compiled into models whose friction remembers nothing ---- */
#if MSFP_MEMORY
/* Memories of a stage with diagonal entry beta [s], for its evaluation, from what the earlier stages give; at beta = 0
 * those of a state. */
void msfp_memory_point(const msfp_parameters *p, const msfp_state *from, double beta, msfp_point *at);
/* Parts of the memories after the evaluation in `w`, and their rates, into `s`. */
void msfp_memory_state(const msfp_parameters *p, const msfp_work *w, const msfp_state *from, double beta, msfp_state *s);
/* Largest error of a memory over its tolerance [-]; error: its estimate, s: the end of the step. */
double msfp_memory_error(const msfp_run *run, const msfp_state *error, const msfp_state *s, double beta);
#else
/* In place of their prefixed names, see msfp_symbols.h. */
#undef msfp_memory_point
#undef msfp_memory_state
#undef msfp_memory_error
#define msfp_memory_point(...) ((void)0)
#define msfp_memory_state(...) ((void)0)
#define msfp_memory_error(run, error, s, beta) 0.0
#endif

#endif
