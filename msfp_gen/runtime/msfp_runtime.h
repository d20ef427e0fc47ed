/* msfp_runtime.h: types and functions of the runtime that is compiled with each model.
 *
 * Included at the end of the generated msfp_model.h, which knows the dimensions. SI units throughout: m, kg, s, N, rad,
 * degC. Bodies are numbered from 0 (the base) to MSFP_NB (the top plate); arrays over surfaces, or over moving bodies,
 * have MSFP_NB entries, the lowest first.
 */
#ifndef MSFP_RUNTIME_H
#define MSFP_RUNTIME_H
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Functions that run on columns or on all surfaces are compiled for wider vectors: for those of the processor whose
 * level MSFP_X86_64_LEVEL is, or, where it is not defined, once for each level, and the processor selects a version when
 * the model is loaded. No version fuses a multiplication with an addition, so all give the same numbers.
 * Never for vectors of eight numbers: gcc 12.2 then compiled contact.c wrongly for 9 to 12 surfaces, whose lanes are a
 * vector of eight and one of four. */
#if !(defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) && defined(__linux__))
#define MSFP_WIDE
#elif defined(__AVX512F__) /* by the flags of the user, such as -march=native */
#define MSFP_WIDE __attribute__((target("prefer-vector-width=256")))
#elif !defined(MSFP_X86_64_LEVEL)
#define MSFP_WIDE __attribute__((target_clones("arch=x86-64-v3", "default")))
#elif MSFP_X86_64_LEVEL >= 4
#define MSFP_WIDE __attribute__((target("arch=x86-64-v4,prefer-vector-width=256")))
#elif MSFP_X86_64_LEVEL == 3
#define MSFP_WIDE __attribute__((target("arch=x86-64-v3")))
#else
#define MSFP_WIDE
#endif
/* Before a short loop of constant length, so that the tables it reads are constants when it is compiled. */
#if defined(__GNUC__) && !defined(__clang__)
#define MSFP_UNROLL _Pragma("GCC unroll 32")
#else
#define MSFP_UNROLL
#endif

/* As many numbers as the vector registers of most processors hold. */
#ifdef __GNUC__
typedef double msfp_pack __attribute__((vector_size(32), aligned(8), may_alias));
#else
typedef double msfp_pack;
#endif
enum { MSFP_PACK_SIZE = sizeof(msfp_pack) / sizeof(double) };

/* The dimensions by their short names. */
enum {
    NB = MSFP_NB,
    NQ = MSFP_NQ,
    NA = MSFP_NA,
    ND = MSFP_ND,
    DOF = MSFP_DOF,
    PAIR = MSFP_PLANAR ? 1 : 2, /* tilt angles of a body */
    FORCE = MSFP_FORCE_SIZE,
    MOMENT = MSFP_MOMENT_SIZE
};

/* ---- a bearing and its top ---------------------------------------------------------------- */

/* Blocks of parameters: msfp_model.h names their entries and units. */
typedef struct {
    double gravity; /* [m/s^2] */
    double body[MSFP_NB + 1][MSFP_BODY_PARAMETERS_SIZE];
    double surface[MSFP_NB][MSFP_SURFACE_PARAMETERS_SIZE];
    double lanes[MSFP_SURFACE_PARAMETERS_SIZE][MSFP_LANES]; /* the parameters of the surfaces, [parameter][surface] */
    double top[MSFP_TOP_PARAMETERS_SIZE];
    double rim_cosine[MSFP_NB]; /* cos(s_c/R), the cosine of the tilt at which the rim is met; 2: it holds the slider */
    double rim_slope[MSFP_NB];  /* d gap/d cosine at that tilt [m] */
    double weight;              /* of the moving bodies and the supported mass [N] */
    /* The values from which these are computed, some of which a run does not use; they come last. */
    double body_values[MSFP_NB + 1][MSFP_BODY_VALUES_SIZE], surface_values[MSFP_NB][MSFP_SURFACE_VALUES_SIZE];
    double top_values[MSFP_TOP_VALUES_SIZE], sides[MSFP_NB + 1][MSFP_SIDES_SIZE], around[MSFP_AROUND_SIZE];
} msfp_parameters;

/* Fill `p`. gravity [m/s^2]; bodies [MSFP_NB + 1][MSFP_BODY_VALUES_SIZE]; surfaces [MSFP_NB][MSFP_SURFACE_VALUES_SIZE];
 * top [MSFP_TOP_VALUES_SIZE]. */
void msfp_set_parameters(msfp_parameters *p, double gravity, const double *bodies, const double *surfaces,
                         const double *top);

/* ---- one evaluation ------------------------------------------------------------------------ */

/* Memories whose rates a value of the surface multiplies, its pace, differ between surfaces. */
#if MSFP_PACED
enum { MSFP_GAINS = MSFP_NB };
#define MSFP_GAIN(j) (j)
#else
enum { MSFP_GAINS = 1 };
#define MSFP_GAIN(j) 0
#endif

/* The state and the inputs at which the equations are evaluated. */
typedef struct {
    double base[3][6]; /* [order][u_g1..3 [m], psi_1, theta_1, phi_1 [rad]]: values, first and second derivatives */
    double load[6];    /* force [N] and moment [N m] on the top plate at r_nn */
#if MSFP_TOP_ROTATION
    double support[2][6]; /* [order][psi, theta [rad]] of the support of the top plate; the other entries are unused */
#endif
    /* Coordinates of the moving bodies psi, theta, phi [rad], with uplift the separation [m], and two derivatives. */
    double q[MSFP_NB][MSFP_NQ], v[MSFP_NB][MSFP_NQ], a[MSFP_NB][MSFP_NQ];
    double f[MSFP_NB][2]; /* friction state Y, Z [-] */
    /* Height of the foot of the supported mass and its rate, [m], [m/s]; in a stage with diagonal entry foot_beta [s]
     * what the earlier stages give: y = foot[0] + foot_beta^2 y'', y' = foot[1] + foot_beta y''. */
    double foot[2], foot_beta;
#if MSFP_MEMORY
    double past[MSFP_NB], gain[MSFP_GAINS]; /* the memory of a surface is its start + past + gain * source */
#endif
} msfp_point;

/* Derivatives of q, v, a with respect to the unknowns of a step (the columns of the tangent), and the stage formula
 * of the friction state f = (Y, Z), f = fp + beta df/dt; beta = 0 keeps f = fp. */
typedef struct {
    double q_weight, v_weight, a_weight;
    double beta;           /* [s] */
    double accuracy;       /* of Y, Z [-]; 0: to rounding */
    double fp[MSFP_NB][2]; /* [-] */
    int same_base;         /* the base has not moved since the last evaluation in this work area */
#if MSFP_CLOSED_FORM
    int closed_form; /* Y is a function of the slip of the whole step, and fp is not used */
    double slip[MSFP_NB][MSFP_SLIP_SIZE];
#endif
} msfp_stage_weights;

/* Rates of the states of a surface: dY/dt, dZ/dt, and the source of a memory. */
#define MSFP_SURFACE_RATES (MSFP_FRICTION_FORCE_SIZE + (MSFP_MEMORY > 0))
/* Rows of the Jacobian of a contact: its moment, N, and in models with gradients these rates. */
#define MSFP_CONTACT_ROWS (MSFP_MOMENT_SIZE + 1 + MSFP_GRADIENTS * MSFP_SURFACE_RATES)
/* Jacobians of all surfaces with respect to their inputs: of the contacts, lane by lane; of the rims. */
typedef struct {
    double contact[MSFP_CONTACT_ROWS * MSFP_CONTACT_FRAME_SIZE * MSFP_LANES],
        rim[MSFP_NB][MSFP_RIM_SIZE * MSFP_RIM_LOCAL];
} msfp_surface_jacobians;

/* Results of one evaluation, with tangents [field][column]. Blocks as in msfp_model.h. */
typedef struct {
    double x[MSFP_NB + 1][MSFP_COORDINATES_SIZE];
    double body[MSFP_NB + 1][MSFP_BODY_SIZE];
    double force[MSFP_NB + 1][MSFP_FORCE_SIZE], moment[MSFP_NB + 1][MSFP_MOMENT_SIZE];
    double contact_frame[MSFP_NB][MSFP_CONTACT_FRAME_SIZE];
    double friction_stage[MSFP_NB][MSFP_FRICTION_STAGE_SIZE], contact[MSFP_NB][MSFP_CONTACT_SIZE];
    double rim[MSFP_NB][MSFP_RIM_SIZE];
    int rim_active[MSFP_NB]; /* whether the rim pushes */
    double rim_gap[MSFP_NB], rim_rate[MSFP_NB]; /* gap of a closed rim, with uplift of every rim, and its rate [m], [m/s] */
#if MSFP_LAW
    double coefficient[MSFP_NB]
                      [MSFP_COEFFICIENT_SIZE]; /* mu on entry is the first guess of Newton's method; 0 will do */
#endif
    double lock[MSFP_NB][MSFP_LOCK_SIZE]; /* axial moment that holds phi'' = 0 where spin is locked [N m] */
    double foot[MSFP_FOOT_SIZE]; /* motion of the foot of the supported mass */
    double reference;     /* weight and load, the scale of forces where no normal force is known [N] */
#if MSFP_UPLIFT
    double unilateral[MSFP_NB][MSFP_UNILATERAL_SIZE], rim_wrench[MSFP_NB][MSFP_RIM_WRENCH_SIZE];
    /* Moment of a surface on the body below, about the sphere centre of that body; the last is that of the top. */
    double below[MSFP_NB + 1][MSFP_MOMENT_SIZE];
    int standing[MSFP_NB]; /* MSFP_OPEN, MSFP_ON_FACE or MSFP_ON_EDGE */
#endif
    double dx[MSFP_NB + 1][MSFP_COORDINATES_SIZE * MSFP_DOF];
    double dbody[MSFP_NB + 1][MSFP_BODY_SIZE * MSFP_DOF];
    double dforce[MSFP_NB + 1][MSFP_FORCE_SIZE * MSFP_DOF], dmoment[MSFP_NB + 1][MSFP_MOMENT_SIZE * MSFP_DOF];
    double dnormal[MSFP_NB][MSFP_DOF];
    msfp_surface_jacobians jacobians;
#if MSFP_GRADIENTS
    double drates[MSFP_NB][MSFP_SURFACE_RATES][MSFP_DOF];
#endif
} msfp_work;

/* Residual [MSFP_DOF] of the condensed equations: the angular balances [N m], with interface forces summed from the top
 * down and the contact in closed form; with uplift also the linear balances [N]. tangent: [MSFP_DOF][MSFP_DOF], or
 * NULL. g: first guess of the friction force over -mu N, f + T df/dt, on return its value. Returns MSFP_OK or a
 * status. */
int msfp_condensed(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights, msfp_work *w,
                   double g[MSFP_NB][2], double *residual, double *tangent);

typedef struct {
    int iterations;
    int determinant; /* sign of the determinant of the equations solved: 1, -1 or 0 */
    double residual; /* largest residual relative to its natural size [-] */
} msfp_solution;

/* Height of the foot at which the vertical spring of the top carries the supported mass, and the vertical velocity of
 * the top plate, into foot [m], [m/s]. */
void msfp_foot_at_rest(const msfp_parameters *p, const msfp_point *at, double foot[2]);

/* Accelerations at a given state from the condensed equations, into at->a. Returns MSFP_OK or a status. */
int msfp_accelerations(const msfp_parameters *p, msfp_point *at, msfp_work *w, msfp_solution *out);

/* The momentum balances of PEER 2017/07, 6(n-1) in space and 3(n-1) in the plane; with uplift also the forces of the
 * unilateral contacts, 3(n-1) and 2(n-1). Unknowns in the order of (2.119): accelerations body by body, position angles
 * of the normals surface by surface, normal forces. */
#define MSFP_SPACE (MSFP_PLANAR ? 2 : 3)    /* components of a translation */
#define MSFP_ANGLES_A (MSFP_PLANAR ? 1 : 3) /* accelerations of the angles of a body */
#define MSFP_ANGLES_C (MSFP_PLANAR ? 1 : 2) /* position angles of a normal */
#define MSFP_ACCELERATIONS (MSFP_ANGLES_A + (MSFP_UPLIFT ? MSFP_SPACE : 0)) /* of a body */
#define MSFP_UNKNOWNS (MSFP_NB * (MSFP_ACCELERATIONS + MSFP_ANGLES_C + 1))

/* Residual [MSFP_UNKNOWNS] of the balances [N], [N m], body by body: linear, angular; then of the contact forces [N].
 * jacobian: [MSFP_UNKNOWNS][count] with respect to `variables`; rates: derivatives of dY/dt, dZ/dt [2 MSFP_NB][count], zeroed by the caller, or NULL. */
void msfp_momentum_balances(const msfp_parameters *p, const msfp_point *at, const double *unknowns, msfp_work *w,
                            double *residual, const msfp_variable *variables, int count, double *jacobian,
                            double *rates);

/* Newton's method on those balances; accelerations into at->a. warm: `unknowns` holds a first guess. */
int msfp_solve_momentum_balances(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm,
                                 msfp_solution *out);

/* Surface, counted from 1, that would have to transmit tension: P . t_3 <= 0 (docs/model.md, choice 11). 0: none. */
int msfp_surface_in_tension(const msfp_work *w);

/* Surface, counted from 1, whose friction law gives a coefficient that is negative or not finite. 0: none. */
int msfp_invalid_friction(const msfp_work *w);

/* Y, Z [-] of the evaluation in `w`. */
void msfp_friction_state(const msfp_work *w, double f[MSFP_NB][2]);

/* dY/dt, dZ/dt [1/s] of the evaluation in `w`. */
void msfp_friction_rates(const msfp_work *w, double rates[MSFP_NB][2]);

/* Named points (3.1)-(3.11) of bodies 0..MSFP_NB: points [body][bottom, centre of mass, top, sphere centre][r, v,
 * a][3]; rotations [body][omega, omega', their rates][3]; bases [body][t_1, t_2, t_3][3]. */
void msfp_named_vectors(const msfp_parameters *p, const msfp_point *at, double *points, double *rotations,
                        double *bases);

/* LU factors of matrix [n][n] with partial pivoting, in place, the diagonal inverted; pivots [n]. Returns the sign of
 * the determinant, 0 if the matrix is singular. */
int msfp_lu(double *matrix, int n, int *pivots);
/* Solve with those factors, in place of rhs [n]. */
void msfp_lu_solve(const double *matrix, int n, const int *pivots, double *rhs);
/* The same of the factors of a step, for columns [MSFP_DOF][width] at once. */
void msfp_lu_solve_columns(const double *matrix, const int *pivots, int width, double *columns);

/* ---- energies and rows of output ------------------------------------------------------------ */

/* Energies of all masses of the model. */
typedef struct {
    double kinetic, potential; /* [J] */
    double power;              /* of the inertial forces of the frame that moves with the base [W] */
} msfp_mechanical;

/* Energies of the masses at the evaluation in `w`. */
msfp_mechanical msfp_mechanical_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w);
/* Parts of the power of the input [W]: of the load on the top plate, relative to the moving base; of everything that moves
 * as prescribed, the base of the rig and a rotating base. */
typedef struct {
    double load, prescribed;
} msfp_input_parts;
/* Integrands [W] of the integrals `enum msfp_integral`. */
msfp_input_parts msfp_powers(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                             const msfp_mechanical *mechanical, double power[MSFP_WORKS]);
/* Evaluate the equations at a state with given accelerations, and fill a row but for its time and integrals. */
void msfp_observe(const msfp_parameters *p, const msfp_point *at, msfp_work *w, msfp_row *row);

/* ---- histories: piecewise polynomials in time ---------------------------------------------- */

#define MSFP_CHANNELS 8 /* six, rounded up to full vectors */
typedef struct {
    int pieces;
    const double *knots;        /* [pieces + 1], rising [s] */
    const double *coefficients; /* [pieces][6][MSFP_DEGREE + 1], ascending powers of t - knot */
    /* Where the last search ended. A run sets these itself. */
    int last;   /* index of the piece */
    int held;   /* that piece, counted from 1, whose coefficients are in `powers`; 0: none */
    int degree; /* highest power of that piece that is not zero */
    double powers[MSFP_DEGREE + 1][MSFP_CHANNELS];
} msfp_history;

/* ---- runs ------------------------------------------------------------------------------------ */

#define MSFP_NODES 3 /* interpolation nodes inside a step, at most */

typedef struct {
    int method; /* enum msfp_method */
    double rtol, atol_angle; /* [-], [rad] */
    double max_step, first_step; /* [s]; 0: chosen */
    double max_steps;
    double duration, output_step; /* [s]; output_step 0: a row at every step of the integrator */
    size_t row_limit;             /* msfp_run_advance returns once so many rows are held; 0: no limit */
    double stop_displacement;     /* [m]; 0: none */
    int stop_all_rims;            /* stop once every rim is in contact */
    int sampled; /* the base acceleration is linear between samples: decides the first guess of Newton's method */
    int stop_count;               /* times at which a step must end: jumps and kinks of a prescribed history */
    const double *stops;          /* [stop_count], rising [s]; must outlive the run, as the next two */
    int span_count;               /* intervals of time with a longest step each; 0: only max_step counts */
    const double *span_ends;      /* [span_count], rising [s] */
    const double *span_steps;     /* [span_count]: longest step inside the interval [s] */
    int quasistatic; /* no force depends on rates beyond the tolerance: take quasi-static steps where the model can */
    double start_time;            /* [s] */
    const double *origin;         /* [3] r_01 - r_nn at the start of the whole run [m]; NULL: that of this start */
    const double *foot;           /* [2] height of the foot of the supported mass and its rate; NULL: at rest */
    const double *memory;         /* [MSFP_NB][MSFP_MEMORY] parts of the memories of the surfaces; NULL: zero */
    int monitors, monitor_stop; /* monitors that are active, and those that stop the run: bits 1 << MSFP_MONITOR_... */
    double monitor_normal;        /* least normal force [N] */
    double monitor_peak;          /* largest normal force [N]; 0: no limit */
    double monitor_inertia;       /* largest inertial force over normal force [-] */
    double monitor_time;          /* time over which a change of velocity is averaged [s] */
    double monitor_rise;          /* largest rise in temperature [K] */
    double monitor_heating[MSFP_NB]; /* sqrt(D/pi)/k over the area of contact [K s^1/2/J] */
    double monitor_reach[MSFP_NB]; /* sliding displacement up to which the contact covers the centre [m]; 0: any */
    /* Range in which the friction law was checked: velocity [m/s], normal forces [N], temperatures [degC]. */
    double law_speed, law_load[MSFP_NB][2], law_temperature[2];
} msfp_options;

/* Event functions of a run [m]: the gap of every rim (a lower bound of it while the gap is wide), what is left to the
 * stop displacement, and with uplift the compression of every unilateral contact. */
#define MSFP_EVENTS (MSFP_NB + 1 + MSFP_UPLIFT * MSFP_NB)

/* Fields of a state. type: double, or for gradients an array of derivatives ("columns"). The methods integrate q, the
 * coordinates as in msfp_point, and the fields from v to work. The rates of q are v; the rates of the others are the
 * fields from a to power, in the same order. f: Y, Z [-]; foot: height of the foot of the supported mass and its
 * velocity; memory: parts of the memories of the surfaces, see memory.c; work: integrals [J], power: integrands [W];
 * prescribed_power, load_power: parts of the power of the input, see msfp_input_parts. */
#if MSFP_MEMORY
#define MSFP_MEMORY_FIELD(type, name) type name[MSFP_NB][MSFP_MEMORY];
#else
#define MSFP_MEMORY_FIELD(type, name)
#endif
#define MSFP_STATE_FIELDS(type) \
    type t, q[MSFP_NB][MSFP_NQ]; \
    type v[MSFP_NB][MSFP_NQ], f[MSFP_NB][2], foot[2]; \
    MSFP_MEMORY_FIELD(type, memory) \
    type work[MSFP_WORKS]; \
    type a[MSFP_NB][MSFP_NQ], df[MSFP_NB][2], dfoot[2]; \
    MSFP_MEMORY_FIELD(type, dmemory) \
    type power[MSFP_WORKS], prescribed_power, load_power;

/* A state: at the end of a step, at a stage, or inside a step; also a change of one. */
typedef struct {
    MSFP_STATE_FIELDS(double)
    double energy; /* stored energy [J], see energy_balance.c */
    msfp_mechanical mechanical;
} msfp_state;

enum {
    MSFP_COORDINATES = MSFP_NB * MSFP_NQ,
    MSFP_INTEGRATED = (offsetof(msfp_state, a) - offsetof(msfp_state, v)) / sizeof(double) /* numbers from v to work */
};

/* An interpolation node inside the last step. */
typedef struct {
    double share;    /* of the step, 0 to 1 */
    msfp_state state;
    double top_force[3]; /* of the stage; see extremes.c [N] */
} msfp_node;

#if MSFP_CLOSED_FORM
/* Values of the step before, which a quasi-static step uses. */
typedef struct {
    double q[MSFP_NB];       /* theta before that step [rad] */
    double h;                /* its length [s]; 0: no step since the start or a jump */
    double power[MSFP_WORKS];/* before it [W] */
    double jerk[MSFP_NB];    /* third divided difference of theta [rad/s^3] */
    double span;             /* length of the last two steps [s]; 0: there were not two */
    double load_end[MSFP_LOAD_END_SIZE], normal[MSFP_NB]; /* at its end: load and displacement of the top; N */
} msfp_step_history;
#endif

/* State of the monitors at the end of an accepted step. */
typedef struct {
    double velocity[MSFP_NB][3];           /* of the bodies [m/s] */
    double heat[MSFP_NB][MSFP_HEAT_STATES], flux[MSFP_NB]; /* of the monitor of heat: as of memory.c, and its source */
    msfp_trip trips[MSFP_MONITORS];
    double shares[MSFP_MONITORS]; /* of the limit, or the distance from a range, of each trip */
} msfp_monitor_state;

struct msfp_run {
    msfp_parameters parameters;
    msfp_history motion, load;
#if MSFP_TOP_ROTATION
    msfp_history support;
#endif
    const double *jumps; /* times at which the base acceleration jumps, rising [s] */
    int jump_count;
    const double *ends; /* of the steps, where they are prescribed [s] */
    int end_count;
    msfp_options options;
    msfp_point reached; /* where the evaluation that ended the last step was made, base and load included */
    uint64_t identity;  /* of all that the run computes from; 0: of any scene */
    int stop, span;     /* indices into options.stops and options.span_ends: where a search by time begins */
    msfp_row node_rows[MSFP_NODES + 2]; /* at the start of the last step, at its interpolation nodes, at its end */
    int nodes_observed; /* whether they are */
    int ringing;        /* whether the works of the last step are integrated as where rates ring (msfp_refine_works) */
    /* A snapshot holds what follows, down to `rows`: no pointers. What is above follows from the scene. */
    int next_jump;
    msfp_state now, next;
    msfp_node node[MSFP_NODES]; /* of the last step */
    int node_count;             /* 0: dense output uses the ends of the step and their rates */
    msfp_work work;
    double h, previous_error, output_time; /* next step [s], error of the last one [-], time of the next row [s] */
    double start[3];                       /* r_01 - r_nn at the start [m] */
    double events_now[MSFP_EVENTS];        /* event functions at the present state */
    msfp_extremes extremes;                /* over all accepted steps, */
    msfp_extremes extreme_times;           /* and when each of its numbers was reached [s] */
    double outward_rate;                   /* of the squared horizontal displacement, over 2, at the last step [m^2/s] */
#if MSFP_CLOSED_FORM
    msfp_step_history step_history, next_step_history; /* of the step that led to `now`, and to `next` */
#endif
    double factors[MSFP_DOF * MSFP_DOF],
        factored_beta; /* LU of the last tangent of a step, and its beta [s]; 0: none */
    int pivots[MSFP_DOF];
    double acceleration_slope[MSFP_NB]
                             [MSFP_NQ]; /* rate of change of the accelerations over the last step; 0 after a jump */
    msfp_monitor_state monitor;
    double unknowns[MSFP_UNKNOWNS]; /* of the momentum balances, the first guess of the next stage of dopri5 */
    int have_unknowns;
    int determinant;           /* sign that the determinant must keep; 0: not known yet */
    int work_sign;             /* sign of the determinant at the last factorisation */
    int restart;               /* no step since the start or a jump: nothing to extrapolate */
    double largest_energy;     /* so far [J], see energy_balance.c */
    int stability_limit_steps; /* consecutive steps of an explicit method at its limit of stability */
    int retry_after_newton;    /* the step at hand is a shorter one after Newton's method failed */
    size_t rows_before; /* rows of the run that came before rows[0] and are no longer held */
    size_t rows_taken;  /* rows of the run that the callback has received */
    long counts[MSFP_COUNTS];
    int status;         /* enum msfp_status */
    int status_surface; /* counted from 1; 0: none */
    int worst_surface;  /* of the last evaluation, counted from 1 */
    double status_value;
    msfp_row *rows;
    size_t row_count, row_capacity;
    msfp_event *events;
    size_t event_count, event_capacity;
    msfp_row_callback callback; /* NULL: rows are kept */
    void *user;                 /* its first argument */
#if MSFP_GRADIENTS
    struct msfp_gradients *gradients; /* NULL: none are computed */
    const struct msfp_hooks *hooks;   /* theirs; NULL likewise */
#endif
};
#define MSFP_SNAPSHOT_BEGIN offsetof(msfp_run, next_jump)
#define MSFP_SNAPSHOT_END offsetof(msfp_run, rows)

/* Start a run at q, v [MSFP_NB][MSFP_NQ] and f [MSFP_NB][2]: a consistent initial state and the first row. jumps
 * [jump_count]: rising times [s]; support: NULL where that of the top plate does not rotate. Histories and jumps must
 * outlive the run. Returns run->status. */
int msfp_run_start(msfp_run *run, const msfp_parameters *p, const msfp_history *motion, const msfp_history *load,
                   const msfp_history *support, const double *jumps, int jump_count, const msfp_options *options,
                   const double *q, const double *v, const double *f);
/* Take up to `steps` steps. Returns 1 while there is more to do, 0 at the end (see run->status). Between two calls the
 * coefficients of a history may be changed from run->now.t on; its values, and the rates of the motion, stay
 * continuous there. */
int msfp_run_advance(msfp_run *run, long steps);
/* A snapshot of a run between two steps: bytes without pointers, with version and checksum. rows: how many of the last
 * rows it holds, without events; negative: all rows and events. `snapshot` has the size that msfp_snapshot_size gives. */
size_t msfp_snapshot_size(const msfp_run *run, long rows);
void msfp_snapshot_write(const msfp_run *run, long rows, void *snapshot);
/* Continue from a snapshot of a run of the same identity and build. Returns MSFP_OK, MSFP_E_MEMORY, or MSFP_E_FINITE for
 * other bytes; `run` is then unchanged. */
int msfp_snapshot_read(msfp_run *run, const void *snapshot, size_t size);
/* Forget all rows but the last, which the caller has stored elsewhere. */
void msfp_run_drop_rows(msfp_run *run);
/* Record the present state unless it is the last row. Returns MSFP_OK or MSFP_E_MEMORY. */
int msfp_write_now(msfp_run *run);
/* Release rows and events. */
void msfp_run_free(msfp_run *run);

/* ---- derivatives of a run with respect to parameters; docs/gradients.md ---- */
/* Begin the derivatives of a run after msfp_run_start. Returns run->status. */
int msfp_gradients_start(msfp_run *run, const msfp_gradient_inputs *inputs);
/* Release them. */
void msfp_gradients_free(msfp_run *run);
/* Derivatives of the rows, [row][parameter][MSFP_ROW_SIZE]; count: of the rows. */
const double *msfp_gradient_rows(const msfp_run *run, size_t *count);
/* Derivatives of time, displacement and top force of the events, [event][parameter][7]; count: of the events. */
const double *msfp_gradient_events(const msfp_run *run, size_t *count);
/* Derivatives of the extremes with respect to one parameter, in the order of msfp_extremes. */
void msfp_gradient_extremes(const msfp_run *run, int parameter, double *out);

#ifdef __cplusplus
}
#endif
#endif
