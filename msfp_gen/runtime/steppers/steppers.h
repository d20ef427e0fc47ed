/* steppers.h: one step of each method, and what the methods share. Private to the runtime.
 *
 * A step goes from run->now to run->next; h is its length [s]. Functions that return an int return MSFP_OK or a status.
 */
#ifndef MSFP_STEPPERS_H
#define MSFP_STEPPERS_H
#include <string.h>
#include "equations.h"

/* ---- tableaux.c: stiffly accurate ESDIRK methods as data ---- */

typedef struct {
    int stages;
    double gamma;                       /* diagonal entry of every stage but the explicit first one */
    double a[MSFP_STAGES][MSFP_STAGES]; /* strictly lower part */
    double c[MSFP_STAGES];
    double e[MSFP_STAGES]; /* weights less embedded weights */
    double order;          /* order of the error estimate + 1, the exponent of the step control */
    int nodes[MSFP_NODES]; /* stages that are interpolation nodes of the dense output; 0: no more */
} msfp_tableau;

const msfp_tableau *msfp_tableau_of(int method);
/* Order of the error estimate of a method + 1, the exponent of its step control. */
double msfp_control_order(int method);

/* ---- state.c: states, points and errors ---- */

/* Base motion, load and rotation of the support at time t [s], into `at`. */
void msfp_point_at(msfp_run *run, double t, msfp_point *at);
/* The integrated quantities of a state, into `at`. */
void msfp_place(const msfp_parameters *p, const msfp_state *s, msfp_point *at);
/* All inputs of an evaluation at a state. */
void msfp_to_point(msfp_run *run, const msfp_state *s, msfp_point *at);
/* Weights of the start of the last step, its interpolation nodes and its end in the polynomial through all of them. */
typedef struct {
    double of[MSFP_NODES + 2];
    int count;
} msfp_weights;
msfp_weights msfp_weights_at(const msfp_run *run, double share);
/* The state at a share of the last step, 0 to 1. */
void msfp_interpolate(const msfp_run *run, double share, msfp_state *out);
/* Absolute tolerance of coordinate d of body j + 1: of an angle [rad], or of a separation (d >= 3) [m]. */
double msfp_absolute_tolerance(const msfp_run *run, int j, int d);
/* sum += h times the weighted rates of the integrated quantities of the first `count` states. */
void msfp_add_rates(msfp_state *sum, const msfp_state *states, const double *weights, int count, double h);
/* The state of the evaluation in run->work at the point `at`, with Y, Z in `f` and all rates, but for powers and what a
 * stage formula gives: temperatures and works. */
void msfp_state_of(const msfp_run *run, const msfp_point *at, double f[MSFP_NB][2], msfp_state *s);
/* Powers and energies of the masses of that evaluation, into `s`. */
void msfp_powers_of(const msfp_run *run, const msfp_point *at, msfp_state *s);
/* Sum of weights times `count` numbers of each of at least three items. */
MSFP_INLINE void msfp_weigh(const double *weights, int items, const double *const *numbers, int count,
                            double *restrict sum)
{
    /* Callers set as many numbers as there are items. NOLINTBEGIN(clang-analyzer-core.*) */
    const double *a = numbers[0], *b = numbers[1], *c = numbers[2];
    for (int i = 0; i < count; ++i)
        sum[i] = weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i];
    for (int k = 3; k < items; ++k)
        for (int i = 0; i < count; ++i)
            sum[i] += weights[k] * numbers[k][i];
    /* NOLINTEND(clang-analyzer-core.*) */
}
/* What follows is written once for the numbers of states and for their columns, of which each number has `width`. */
#define MSFP_FROM(numbers, field, width) ((numbers) + (width) * (offsetof(msfp_state, field) / sizeof(double)))
/* As msfp_add_rates; size: numbers from one state to the next. */
MSFP_INLINE void msfp_sum_rates(double *sum, const double *states, size_t size, const double *weights, int count,
                                double h, int width)
{
    msfp_sum_stages(MSFP_FROM(sum, q, width), MSFP_FROM(states, v, width), size, weights, count, h,
                    MSFP_COORDINATES * width);
    msfp_sum_stages(MSFP_FROM(sum, v, width), MSFP_FROM(states, a, width), size, weights, count, h,
                    MSFP_INTEGRATED * width);
}
/* What the formulas of a stage know of the earlier ones: Y, Z; for the foot of the supported mass y and y' as in msfp_point.
 * from: sum of the start of the step and those rates. */
MSFP_INLINE void msfp_known_of_stage(const double *from, double beta, int width, double *f, double *foot)
{
    const double *y = MSFP_FROM(from, foot, width), *y1 = y + width;
    memcpy(f, MSFP_FROM(from, f, width), 2 * NB * width * sizeof *f);
    for (int c = 0; c < width; ++c) {
        foot[c] = y[c] + beta * y1[c];
        foot[width + c] = y1[c];
    }
}
/* The cubics through `count` values y and rates d at the ends of a step of length h, at its share s. */
MSFP_INLINE void msfp_hermite(const double *y0, const double *d0, const double *y1, const double *d1, double h,
                              double s, int count, double *out)
{
    const double r = 1.0 - s, w0 = r * r * (1.0 + 2.0 * s), w1 = s * s * (3.0 - 2.0 * s), w = s * r * h;
    for (int i = 0; i < count; ++i)
        out[i] = w0 * y0[i] + w1 * y1[i] + w * (r * d0[i] - s * d1[i]);
}
/* The integrated quantities, on these cubics. */
MSFP_INLINE void msfp_cubics(const double *now, const double *next, double h, double share, int width, double *out)
{
    msfp_hermite(MSFP_FROM(now, q, width), MSFP_FROM(now, v, width), MSFP_FROM(next, q, width),
                 MSFP_FROM(next, v, width), h, share, MSFP_COORDINATES * width, MSFP_FROM(out, q, width));
    msfp_hermite(MSFP_FROM(now, v, width), MSFP_FROM(now, a, width), MSFP_FROM(next, v, width),
                 MSFP_FROM(next, a, width), h, share, MSFP_INTEGRATED * width, MSFP_FROM(out, v, width));
}
/* Their rates, linear in time. */
MSFP_INLINE void msfp_linear_rates(const double *now, const double *next, double share, int width, double *out)
{
    for (int k = 0; k < MSFP_INTEGRATED * width; ++k)
        MSFP_FROM(out, a, width)[k] =
            (1.0 - share) * MSFP_FROM(now, a, width)[k] + share * MSFP_FROM(next, a, width)[k];
}
/* Largest error of a step over its tolerance [-]: of q, of Y, Z, of the foot, and if `rates` of their rates. */
double msfp_error_norm(const msfp_run *run, const msfp_state *error, int rates);
/* Error of a step in which Y, Z change by more than 1/2, 0 otherwise. Such a step may span a reversal, its estimate is
 * not reliable and its interpolation meaningless. Cubed, because the step control takes the cube root. */
double msfp_friction_jump_error(const msfp_state *now, const msfp_state *next);

/* ---- newton.c: the equations of one stage ---- */

/* Unknowns are the rates at.v; q = from.q + beta v and a = inertia (v - from.v)/beta follow, g, Y, Z from the weights.
 */
typedef struct {
    msfp_state from; /* what the earlier stages give: q = from.q + beta v, v = from.v + beta a, and so on */
    double beta;    /* [s] */
    double inertia; /* 1; 0 leaves out all inertia */
    msfp_stage_weights weights;
    msfp_point at;
    double g[MSFP_NB][2]; /* friction force over -mu N; its first guess before the stage is solved */
    double f[MSFP_NB][2]; /* Y, Z */
} msfp_stage;

/* First guesses of Newton's method, in the order in which they are tried. */
enum msfp_start { MSFP_START_PREDICTED, MSFP_START_PLAIN, MSFP_START_QUASISTATIC, MSFP_STARTS };

/* Residual [MSFP_DOF] over N at the present rates. Returns its largest entry relative to its natural size, infinite
 * where it cannot be formed. The evaluation is left in `w`. */
double msfp_stage_residual(msfp_run *run, msfp_stage *s, msfp_work *w, double *residual);
/* Subtract factor * step [MSFP_DOF] from the rates. */
void msfp_stage_move(msfp_stage *s, const double *step, double factor);
/* The same of rates [MSFP_NB][MSFP_NQ], of `width` numbers each. As Newton's method moves rates by its residual, so
 * they follow what changes the residual, by the same factors: the implicit function theorem. */
MSFP_INLINE void msfp_move_rates(double *rates, const double *step, double factor, int width)
{
    static const int unknown[MSFP_ND] = MSFP_FREE;
    for (int k = 0; k < MSFP_NB; ++k)
        for (int i = 0; i < MSFP_ND; ++i)
            msfp_add(rates + (k * MSFP_NQ + unknown[i]) * width, step + (k * MSFP_ND + i) * width, -factor, width);
}
/* Columns [MSFP_ND][width] of the moments of a body, over N as Newton's method divides them. residual: what is left of
 * them over N. */
MSFP_INLINE void msfp_divide_columns(double normal, const double *residual, const double *dnormal, int width,
                                     double *columns)
{
    const double inverse = 1.0 / normal;
    for (int i = 0; i < MSFP_ND; ++i)
        for (int c = 0; c < width; ++c)
            columns[i * width + c] = inverse * (columns[i * width + c] - residual[i] * dnormal[c]);
}
/* Rates that balance all forces but inertia: a first guess where extrapolated rates fail. */
void msfp_quasistatic_start(msfp_run *run, msfp_stage *s);
/* Newton's method on a stage, from the rates in it. */
int msfp_solve_stage(msfp_run *run, msfp_stage *s);
/* Factors of the tangent at the present rates, in `run`, with the residual there and its size. */
int msfp_factorise_stage(msfp_run *run, msfp_stage *s, double *residual, double *size);

/* ---- implicit.c: a step of an ESDIRK method, stage by stage ---- */

/* What the weights of the error estimate add to the works of a step, or to their columns; size: numbers from one stage to
 * the next; ringing: whether the rates ring. */
void msfp_refine_works(const msfp_tableau *method, const double *stages, size_t size, double h, int ringing, int width,
                       double *work);

/* A step in progress: its stages, and the one that is being solved. */
typedef struct {
    const msfp_tableau *method;
    double h, other; /* its length [s]; its error beside that of the embedded estimate, over its tolerance [-] */
    msfp_state stage[MSFP_STAGES]; /* those that are solved; 0: the start of the step */
    msfp_stage now;
} msfp_stages;

/* Begin a step of length h [s]. */
void msfp_stages_begin(msfp_run *run, msfp_stages *s, double h);
/* For each stage i from 1 on: begin; base, load and support into s->now.at; solve, which may be repeated for others of
 * these; end. The point s->now.at and run->work are then at the solution. msfp_stage_take begins and solves with the
 * histories of the run. */
int msfp_stage_take(msfp_run *run, msfp_stages *s, int i);
void msfp_stage_begin(msfp_run *run, msfp_stages *s, int i);
int msfp_stage_solve(msfp_run *run, msfp_stages *s, int i);
void msfp_stage_end(msfp_run *run, msfp_stages *s, int i);
/* The state at the end of the step, into run->next, and its error as below. */
void msfp_stages_end(msfp_run *run, msfp_stages *s, double *error);

/* ---- the methods; error: of the step over its tolerance [-] ---- */

int msfp_step_implicit(msfp_run *run, double h, double *error);
#if MSFP_DOPRI5
int msfp_step_dopri5(msfp_run *run, double h, double *error);
#endif
int msfp_step_quasistatic(msfp_run *run, double h, double *error);
/* Whether the run takes quasi-static steps. */
int msfp_is_quasistatic(const msfp_run *run);
/* The step h, shortened so that no Y changes by more than 0.4 and no surface reverses, as far as can be
 * extrapolated. */
double msfp_limit_step(const msfp_run *run, double h);
/* The works of the step but those of friction += integrals of the parabolas through powers before the last step of length
 * `last`, now and at the end of a step of length h; last 0: straight lines. Of `width` numbers each. */
void msfp_parabola_works(const double *before, const double *now, const double *next, double last, double h, int width,
                         double *work);
/* After a quasi-static step to a rim contact or release, where rates and powers have a kink: the next step is short and
 * takes nothing from the steps before. */
void msfp_quasistatic_restart(msfp_run *run);
/* Prepare quasi-static steps from a state without a step before it. load_power: that of the load [W], whose work these steps
 * sum from its displacement. */
void msfp_quasistatic_begin(msfp_run *run, const msfp_point *at, double load_power);

/* ---- hooks: what follows a run while it takes its steps; in models with gradients only ---- */

#if MSFP_GRADIENTS
/* Those that return an int return a status. */
struct msfp_hooks {
    /* Stage i of the step in progress is solved, by the evaluation in run->work. */
    void (*stage_solved)(msfp_run *run, int i, const msfp_stage *stage, const msfp_state *state);
    /* The step from run->now to run->next is accepted and recorded; before, after: event functions at its ends. */
    int (*step_accepted)(msfp_run *run, const double *before, const double *after);
    /* The accelerations of the present state have jumped. */
    int (*jumped)(msfp_run *run);
};
/* A call of one of them, where they are set. */
#define MSFP_HOOK(run, call, otherwise) ((run)->hooks ? (run)->hooks->call : (otherwise))
#else
#define MSFP_HOOK(run, call, otherwise) (otherwise)
#endif

#endif
