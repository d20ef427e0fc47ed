/* msfp_runtime.h: types and functions of the runtime that is compiled with each model.
 * Included by the generated msfp_model.h, which knows the dimensions. SI units throughout.
 */
#ifndef MSFP_RUNTIME_H
#define MSFP_RUNTIME_H
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Functions that run on columns and surfaces are compiled for wider vectors as well, and the processor picks one of the
 * versions when the model is loaded. No version contracts a product and a sum: all give the same numbers. */
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) && defined(__linux__)
#define MSFP_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define MSFP_WIDE
#endif
#if defined(__GNUC__) /* a kernel is compiled for the vectors of the function that calls it */
#define MSFP_INLINED __attribute__((always_inline))
#else
#define MSFP_INLINED
#endif
#define MSFP_INLINE MSFP_INLINED static inline

/* Numbers side by side, as many as the vectors of most processors hold. */
#ifdef __GNUC__
typedef double msfp_whole __attribute__((vector_size(32), aligned(8), may_alias));
#else
typedef double msfp_whole;
#endif
enum { MSFP_WHOLE = sizeof(msfp_whole) / sizeof(double) };

#if MSFP_BATCH
/* The library's fmax, without a call: a batch is compiled for the processor at hand. */
#include <math.h>
MSFP_INLINE double msfp_larger(double a, double b) { return a > b || b != b ? a : b; }
#define fmax msfp_larger
#endif

/* ---- values: a bearing and its top ------------------------------------------------------- */

#ifndef MSFP_LAW /* the friction coefficient is constant */
#define MSFP_LAW 0
#define MSFP_LAW_VALUES 0
#define MSFP_HEAT 0
#endif

/* R, s_c, mu, d_y, k_c, c_c; where bodies part, seat stiffness and damping; numbers of a law of friction */
#define MSFP_SURFACE_VALUES (6 + 2 * MSFP_UPLIFT + MSFP_LAW_VALUES)
#define MSFP_BODY_VALUES 7    /* l, z, m, J transverse, J axial, r, p; the base first (m, J, z unused) */
#define MSFP_TOP_VALUES 10    /* k, c, k_rot, c_rot, m, J transverse, J axial, h, anchor x, anchor y */

typedef struct {
    double gravity;
    double dimensions[MSFP_NB + 1][MSFP_DIMENSIONS_SIZE];
    double body[MSFP_NB + 1][MSFP_BODY_PARAMETERS_SIZE];
    double surface[MSFP_NB][MSFP_SURFACE_PARAMETERS_SIZE];
    double lanes[MSFP_SURFACE_PARAMETERS_SIZE][MSFP_LANES]; /* the same, surfaces side by side */
    double top[MSFP_TOP_PARAMETERS_SIZE];
    double rim_cosine[MSFP_NB]; /* cos(s_c/R) */
    double rim_slope[MSFP_NB];  /* d gap/d cosine there [m] */
    double weight;              /* of the moving bodies and the supported mass */
} msfp_parameters;

void msfp_set_parameters(msfp_parameters *p, double gravity, const double *bodies /* [N][7] */,
                         const double *surfaces /* [NB][MSFP_SURFACE_VALUES] */, const double *top /* [10] */);

/* ---- one evaluation ---------------------------------------------------------------------- */

/* Where the equations are evaluated. Coordinates of the moving bodies: psi, theta, phi, and where bodies may part the
 * separation of the sphere centres below; Y, Z of the surfaces. */
typedef struct {
    double base[3][6]; /* u_g1..3, psi_1, theta_1, phi_1; first and second derivatives */
    double load[6];    /* force and moment that the outside applies to the top plate at r_nn */
#if MSFP_TURNED
    double support[2][6]; /* psi, theta of what holds the top plate, then their rates; the rest is unused */
#endif
    double q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], a[MSFP_NB][MSFP_NQ];
    double f[MSFP_NB][2];
#if MSFP_HEAT
    double rise[MSFP_NB], warming; /* temperature above the start is rise + warming * flux */
#endif
} msfp_point;

/* How q, v, a follow the unknown of a step (columns of the tangent) and Y, Z their stage formula
 * f = fp + beta df/dt. beta = 0 holds Y, Z at fp. */
typedef struct {
    double cq, cv, ca, beta;
    double accuracy; /* of Y, Z; 0: all there is */
    double fp[MSFP_NB][2];
    int same_base; /* the base is where the last evaluation in this work area had it */
#if MSFP_FLOW
    int flow;             /* Y follows the slip of the whole step from fp, exactly: beta v + turn is what a body turns in it */
    double turn[MSFP_NB];
#endif
} msfp_seed;

/* Everything one evaluation leaves behind, with tangents [field][column]. */
typedef struct {
    double x[MSFP_NB + 1][MSFP_COORDINATES_SIZE];
    double body[MSFP_NB + 1][MSFP_BODY_SIZE];
    double force[MSFP_NB + 1][MSFP_FORCE_SIZE], moment[MSFP_NB + 1][MSFP_MOMENT_SIZE];
    double local[MSFP_NB][MSFP_LOCAL_SIZE];
    double contact[MSFP_NB][MSFP_CONTACT_SIZE];
    double rim[MSFP_NB][MSFP_RIM_SIZE];
    int rim_active[MSFP_NB];
    double rim_sum[MSFP_NB]; /* k gap + c dgap/dt where a gap has closed, pull or push */
#if MSFP_LAW
    double coefficient[MSFP_NB][MSFP_COEFFICIENT_SIZE]; /* mu: what Newton starts from; 0 does */
#endif
    double lock[MSFP_NB]; /* axial moments that hold phi'' = 0 where spin is locked */
    double reference;     /* weight and load: what forces are measured by where nothing else is at hand */
#if MSFP_UPLIFT
    double seat[MSFP_NB][MSFP_SEAT_SIZE], below[MSFP_NB][MSFP_MOMENT_SIZE]; /* moment on the body below, about its own centre */
    double dseat[MSFP_NB][MSFP_SEAT_SIZE * MSFP_DOF], dbelow[MSFP_NB][MSFP_MOMENT_SIZE * MSFP_DOF];
#endif
    double dx[MSFP_NB + 1][MSFP_COORDINATES_SIZE * MSFP_DOF];
    double dbody[MSFP_NB + 1][MSFP_BODY_SIZE * MSFP_DOF];
    double dforce[MSFP_NB + 1][MSFP_FORCE_SIZE * MSFP_DOF], dmoment[MSFP_NB + 1][MSFP_MOMENT_SIZE * MSFP_DOF];
    double dnormal[MSFP_NB][MSFP_DOF];
} msfp_work;

enum {
    MSFP_OK = 0,
    MSFP_STOPPED,         /* a stop condition was met */
    MSFP_E_NEWTON,        /* Newton's method did not converge at the smallest step */
    MSFP_E_STEP,          /* the error control asks for a step below the smallest */
    MSFP_E_IRREGULAR,     /* the determinant of the equations changed sign: no unique acceleration */
    MSFP_E_UPLIFT,        /* an interface would have to pull */
    MSFP_E_ANGLE,         /* theta near +-pi/2: the Euler angles are singular */
    MSFP_E_STEPS,         /* the allowed number of steps is used up */
    MSFP_E_FINITE,        /* a value is not finite */
    MSFP_E_MEMORY,
    MSFP_E_GUARD,         /* what the model leaves out would matter from here on: see run->guard */
    MSFP_E_PARTED,        /* a body is beside its place by more than its slider is wide: it has left the stack */
    MSFP_E_STIFF          /* step after step at the limit of stability of the explicit method: its error means nothing */
};

/* The condensed equations: angular balances with interface forces summed from the top and contact in
 * closed form. On return f holds Y, Z. residual [DOF], tangent [DOF][DOF] or NULL. Nonzero on failure. */
int msfp_condensed(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w,
                   double f[MSFP_NB][2], double *residual, double *tangent);

/* Natural size of each residual: (N + rim force) R (mu + 1/100) of the surface below; of a force where bodies may part. */
void msfp_residual_scale(const msfp_parameters *p, const msfp_work *w, double *scale);

/* Largest residual relative to its natural size, and its row (left alone where all are zero); infinite where one is none. */
double msfp_residual_size(const msfp_parameters *p, const msfp_work *w, const double *residual, int *worst);

/* Accelerations at a given state from the condensed equations; fills at->a. */
typedef struct {
    int iterations, determinant;
    double residual;
} msfp_solution;
int msfp_accelerations(const msfp_parameters *p, msfp_point *at, msfp_work *w, msfp_solution *out);

/* The report's 6(n-1) balances (planar: 3(n-1)). Unknowns in the order of (2.119): accelerations body by
 * body, position angles of the normals surface by surface, normal forces. Rows: per body linear, angular. */
#define MSFP_SPACE (MSFP_PLANAR ? 2 : 3)
#define MSFP_ANGLES_A (MSFP_PLANAR ? 1 : 3)  /* accelerations of a body */
#define MSFP_ANGLES_C (MSFP_PLANAR ? 1 : 2)  /* position angles of a normal */
#define MSFP_UNKNOWNS (MSFP_NB * (MSFP_PLANAR ? 3 : 6))
enum { MSFP_SEED_COORDINATE, MSFP_SEED_CONTACT, MSFP_SEED_FRICTION, MSFP_SEED_BASE, MSFP_SEED_LOAD };
/* What one column of the report's Jacobian is taken with respect to. coordinate: body 0..NB, field 3*order + angle;
 * contact: surface, psi~, theta~, N; friction: surface, Y, Z; base: 3*order + axis; load: 0..5. */
typedef struct {
    int kind, index, field;
} msfp_variable;
void msfp_report(const msfp_parameters *p, const msfp_point *at, const double *unknowns, msfp_work *w,
                 double *residual, const msfp_variable *variables, int count, double *jacobian /* [UNKNOWNS][count] */,
                 double *rates /* derivatives of dY/dt, dZ/dt [2 NB][count], zeroed by the caller, or NULL */);
int msfp_report_solve(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm, msfp_solution *out);

/* Sliding displacements and gaps (3.20), (3.21): of an evaluation, at given coordinates. */
void msfp_gaps(const msfp_parameters *p, const msfp_work *w, double sliding[MSFP_NB][MSFP_GAP_SIZE]);
void msfp_gaps_at(const msfp_parameters *p, const double q[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE]);

/* Surface (1-based) whose interface would have to pull: P . t_3 <= 0 (docs/model.md, choice 11). 0: none. */
int msfp_pulling(const msfp_work *w);

/* How far the seat of surface j is compressed; negative: how far it is open. 1 where bodies cannot part. */
double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j);

#if MSFP_TURNED
/* The direction that the top plate is held to, and its angular velocity: block upright. */
void msfp_held(const msfp_point *at, double *upright);
#endif

void msfp_friction_rates(const msfp_work *w, double rates[MSFP_NB][2]);

/* Named points (3.1)-(3.11) of bodies 0..NB: [body][bottom, centre of mass, top, sphere centre][r, v, a][3];
 * [body][omega, omega', their rates][3]; [body][t_1, t_2, t_3][3]. */
void msfp_named_vectors(const msfp_parameters *p, const msfp_point *at, double *points, double *rotations, double *bases);

/* Dense LU with partial pivoting, in place, the diagonal inverted. Returns the sign of the determinant, 0 if singular. */
int msfp_lu(double *matrix, int n, int *pivots);
void msfp_lu_solve(const double *matrix, int n, const int *pivots, double *rhs);

/* ---- histories: piecewise polynomials in time --------------------------------------------- */

#define MSFP_DEGREE 5
#define MSFP_CHANNELS 8 /* six, and as many as whole vectors have */
typedef struct {
    int pieces;
    const double *knots;        /* [pieces + 1] */
    const double *coefficients; /* [pieces][6][MSFP_DEGREE + 1], ascending powers of t - knot */
    int last;                   /* piece found last: the search starts there */
    int held, degree;           /* the piece, counted from 1, whose coefficients are at hand with channels side by side */
    double powers[MSFP_DEGREE + 1][MSFP_CHANNELS];
} msfp_history;
void msfp_history_at(msfp_history *h, double t, int orders, double out[][6]);

/* ---- runs ----------------------------------------------------------------------------------- */

enum { MSFP_IMPLICIT = 0, MSFP_DOPRI5 = 1, MSFP_ESDIRK4 = 2 };
#define MSFP_STAGES 7 /* at most */

typedef struct {
    int method;
    double rtol, atol_angle;
    double max_step, first_step; /* 0: chosen */
    double max_steps;
    double duration, output_step; /* output_step 0: the solver's own steps */
    double stop_displacement;     /* 0: none */
    int stop_all_rims;
    int stop_at_knots;            /* the acceleration of the base has a kink at every knot: land on each */
    int stop_at_loads;            /* the load has a kink at every knot: likewise */
    int quasistatic;              /* no force depends on rates, to the tolerance: quasistatic.c where the model allows */
    double start_time;            /* a run that goes on from another, with its origin and its heat */
    const double *origin;         /* [3] r_01 - r_nn at the start of the whole; NULL: where this one starts */
    const double *heat;           /* [NB][MSFP_HEAT]; NULL: none */
    int guards, guard_stop;       /* which watches look, and at which a run stops: bits of MSFP_GUARD_.. */
    double guard_normal;          /* least normal force [N] */
    double guard_inertia, guard_time; /* most inertial over normal force; time over which a velocity may change [s] */
    double guard_rise;            /* most rise in temperature [K] */
    double guard_heating[MSFP_NB]; /* sqrt(D/pi)/k over the area of contact [K s^1/2/J] */
} msfp_options;

enum { MSFP_COUNT_STEPS, MSFP_COUNT_REJECTED, MSFP_COUNT_NEWTON, MSFP_COUNT_EVALUATIONS, MSFP_COUNT_FACTORISATIONS,
       MSFP_COUNT_NEWTON_FAILURES, MSFP_COUNT_EVENTS, MSFP_COUNT_HALVED_STEPS, MSFP_COUNT_FRESH_TANGENTS,
       MSFP_COUNT_OTHER_STARTS, MSFP_COUNT_QUASISTATIC_STARTS, MSFP_COUNTS };

/* Watches over what a model leaves out: guard.c. */
enum { MSFP_GUARD_RIMS, MSFP_GUARD_UPLIFT, MSFP_GUARD_INERTIA, MSFP_GUARD_HEAT, MSFP_GUARDS };
typedef struct {
    double time, value; /* [s]; beyond the capacity [m], N [N], m a/N, rise [K] */
    int surface;        /* 1-based; 0: not tripped */
} msfp_trip;

/* Integrals over the run, in order: work put in, recoverable friction, dissipated friction, rims, top dampers, seats. */
enum { MSFP_WORK_INPUT, MSFP_WORK_FRICTION_STORED, MSFP_WORK_FRICTION, MSFP_WORK_RIM, MSFP_WORK_TOP, MSFP_WORK_SEAT, MSFP_WORKS };

/* One row of output. */
typedef struct {
    double time;
    double q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], a[MSFP_NB][MSFP_NQ], f[MSFP_NB][2];
    double normal[MSFP_NB], angles[MSFP_NB][2], sliding[MSFP_NB], gap[MSFP_NB], rim[MSFP_NB], force[MSFP_NB][3], slip[MSFP_NB][2];
#if MSFP_UPLIFT
    double compression[MSFP_NB]; /* of the seats; negative: how far they are open */
#endif
    double base[3], top[3], top_force[3], top_moment[3];
    double kinetic, potential, restraint, rim_stored, seat_stored;
    double work[MSFP_WORKS];
#if MSFP_LAW
    double mu[MSFP_NB];
#endif
#if MSFP_HEAT
    double temperature[MSFP_NB];
#endif
} msfp_row;
#define MSFP_ROW_SIZE (sizeof(msfp_row) / sizeof(double))

typedef struct {
    double time;
    int surface; /* 1-based; 0: none */
    int kind;    /* 0 rim contact, 1 rim release, 2 stop, 3 lift-off, 4 landing */
    double displacement[3], top_force[3];
} msfp_event;

/* Event functions of a run: the gap of every rim (less than it is while it is wide), what is left to the stop displacement,
 * and how far every seat is compressed where bodies may part. */
#define MSFP_EVENTS (MSFP_NB + 1 + MSFP_UPLIFT * MSFP_NB)

/* Of all masses that the model keeps: energies [J], and what the forces of the moving frame do [W]. */
typedef struct {
    double kinetic, potential, power;
} msfp_masses;

/* Values at the end of a step from which the next goes on. */
typedef struct {
    double t;
    double q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], a[MSFP_NB][MSFP_NQ], f[MSFP_NB][2], df[MSFP_NB][2];
    double work[MSFP_WORKS], power[MSFP_WORKS], moved; /* moved: the power of what moves as prescribed */
    double energy;
    msfp_masses masses;
#if MSFP_HEAT
    double heat[MSFP_NB][MSFP_HEAT], flux[MSFP_NB]; /* parts of the rise in temperature [K]; see heat.c */
#endif
} msfp_state;

/* Values at a share of the last step, for dense output. */
typedef struct {
    double share;
    double q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], f[MSFP_NB][2], work[MSFP_WORKS];
#if MSFP_HEAT
    double heat[MSFP_NB][MSFP_HEAT];
#endif
} msfp_middle;
#define MSFP_MIDDLES 3 /* at most */

#if MSFP_FLOW
/* What a step without integration wants to know of the state it starts from (now) and ends at (next), and of the step
 * that led there: coordinates before it, its length (0: none since the start or a jump), powers before it. */
typedef struct {
    double q[MSFP_NB], h, power[MSFP_WORKS], jerk[MSFP_NB], span;
    double load[6], top[3], tilt, normal[MSFP_NB]; /* r_nn seen from the base, rotation about E2 */
} msfp_passage;
#endif

typedef struct {
    msfp_parameters parameters;
    msfp_history motion, load;
#if MSFP_TURNED
    msfp_history support;
#endif
    const double *jumps;
    int jump_count;
    msfp_options options;
    msfp_point reached; /* where the evaluation that ended the last step was made, base and load included */
    /* What a checkpoint keeps begins here: no pointers until `rows`. What is above follows from the scene. */
    int next_jump;
    msfp_state now, next;
    msfp_middle middle[MSFP_MIDDLES]; /* between the ends of the last step */
    int middles;                      /* 0: none, the ends and their rates must do */
    msfp_work work;
#if MSFP_HEAT
    struct { /* of the step in progress: what the stages before leave, the stage itself, and all their rates */
        double before[MSFP_NB][MSFP_HEAT], heat[MSFP_NB][MSFP_HEAT], rates[MSFP_STAGES][MSFP_NB][MSFP_HEAT];
    } step;
#endif
    double h, previous_error, output_time;
    double start[3]; /* r_01 - r_nn at the start */
    double events_now[MSFP_EVENTS]; /* event functions at the present state */
#if MSFP_FLOW
    msfp_passage passage, passing; /* as of now, as of next */
#endif
    double factors[MSFP_DOF * MSFP_DOF], factored_beta; /* LU of the last tangent of a step, and its beta; 0: none */
    int pivots[MSFP_DOF];
    double slope[MSFP_NB][MSFP_NQ]; /* of the accelerations over the last step, where it goes on */
    struct {
        double velocity[MSFP_NB][3], energy[MSFP_NB], peak[MSFP_NB]; /* [m/s]; of the flux: [K s^1/2], [K/s^1/2] */
        msfp_trip trips[MSFP_GUARDS];
    } guard;
    double unknowns[MSFP_UNKNOWNS];
    int have_unknowns, determinant, work_sign, restart;
    double exchanged; /* largest energy so far: balance.c */
    int at_limit;  /* steps in a row that an explicit method took at its limit of stability */
    int shortened; /* the step at hand is a shorter one after Newton failed */
    long counts[MSFP_COUNTS];
    int status, status_surface, worst_surface;
    double status_value;
    msfp_row *rows;
    size_t row_count, row_capacity;
    msfp_event *events;
    size_t event_count, event_capacity;
} msfp_run;
#define MSFP_CHECKPOINT_BEGIN offsetof(msfp_run, next_jump)
#define MSFP_CHECKPOINT_END offsetof(msfp_run, rows)

/* Start a run: histories and jumps must outlive it. */
int msfp_run_start(msfp_run *run, const msfp_parameters *p, const msfp_history *motion, const msfp_history *load,
#if MSFP_TURNED
                   const msfp_history *support,
#endif
                   const double *jumps, int jump_count, const msfp_options *options,
                   const double *q, const double *v, const double *f);
/* Take up to `steps` steps. Returns 1 while there is more to do, 0 at the end (see run->status). */
int msfp_run_advance(msfp_run *run, long steps);
/* Take over what a run of the same scene had reached: its bytes from MSFP_CHECKPOINT_BEGIN to _END, rows and events.
 * Returns 0, MSFP_E_MEMORY, or MSFP_E_FINITE for bytes that no run of this model leaves. */
int msfp_run_restore(msfp_run *run, const char *state, const msfp_row *rows, size_t row_count,
                     const msfp_event *events, size_t event_count);
/* Record the present state, if it is not: 0 or MSFP_E_MEMORY. */
int msfp_write_now(msfp_run *run);
void msfp_run_free(msfp_run *run);
const char *msfp_status_name(int status);

const char *msfp_guard_name(int guard);

/* Between the files of the runtime. */
/* Friction of one surface: mu N f . slip, added to what Y, Z store and what is lost (3.16)-(3.18). */
void msfp_friction_power(const double *par, const double f[2], const double *contact, double *stored, double *lost);
msfp_masses msfp_weigh(const msfp_parameters *p, const msfp_point *at, const msfp_work *w);
/* All but those of friction. */
void msfp_other_powers(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_masses *masses, double power[MSFP_WORKS]);
/* Of the load on the top plate, in the frame of the base. */
double msfp_load_power(const msfp_point *at, const msfp_work *w);
void msfp_point_at(msfp_run *run, double t, msfp_point *at);
void msfp_powers(const msfp_parameters *p, const msfp_point *at, const double f[MSFP_NB][2], const msfp_work *w, const msfp_masses *masses,
                 double power[MSFP_WORKS]);
/* Power of what moves as prescribed, a part of what is put in: the base of the rig, and that of the stack where it turns. */
double msfp_moved_power(const msfp_parameters *p, const msfp_point *at, const msfp_work *w);
/* Kinetic, potential and of all springs but friction. */
double msfp_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_masses *masses);
void msfp_observe(const msfp_parameters *p, const msfp_point *at, msfp_work *w, msfp_row *row);
/* The same from an evaluation at hand. */
void msfp_record(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_masses *masses, msfp_row *row);
/* Whether the model holds at a state: no interface pulls, no angle is singular. 0 or a status. */
int msfp_check_state(msfp_run *run, const msfp_work *w, const msfp_state *s);
/* Largest error of a step relative to the tolerance: angles and Y, Z (and rates where given). */
double msfp_error_norm(const msfp_run *run, const double dq[MSFP_NB][MSFP_NQ], const double dv[MSFP_NB][MSFP_NQ], const double df[MSFP_NB][2]);
/* Order of a method's error estimate, plus one: the exponent of its step control. */
double msfp_order(int method);
/* One step of size h from run->now to run->next: 0 and the error norm, or a status. */
int msfp_step_implicit(msfp_run *run, double h, double *error);
int msfp_step_dopri5(msfp_run *run, double h, double *error);
/* Whether steps need no integration, and one of them (quasistatic.c). */
double msfp_foreseen(const msfp_run *run, double h);
/* A state to go on from without a step before it. */
void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at);
int msfp_is_quasistatic(const msfp_run *run);
int msfp_step_quasistatic(msfp_run *run, double h, double *error);

#ifdef __cplusplus
}
#endif
#endif
