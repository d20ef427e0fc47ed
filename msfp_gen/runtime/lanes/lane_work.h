/* lane_work.h: what an evaluation of several runs at once works on. Private to lanes.c and what it includes. */
#ifndef MSFP_LANE_WORK_H
#define MSFP_LANE_WORK_H
#include "stack.h"
#include <stddef.h>
#include "batch.h"
#include "lane_copy.h"
#define sin lane_sin
#define cos lane_cos
#define sqrt lane_sqrt
#define pow lane_pow
#define fabs lane_abs
#define msfp_step lane_step
#include "msfp_lane_kernels.h"
#undef fabs
#undef sqrt
#undef pow
#undef cos
#undef sin

#if MSFP_UPLIFT || MSFP_LAW
#error "no lanes for bodies that part and for laws of friction"
#endif

#define W MSFP_WIDTH
#define INPUTS MSFP_LOCAL_SIZE

/* The numbers that a run brings, in the order in which its structures have them. */
typedef struct {
    struct {
        lane base[3][6], load[6];
#if MSFP_TURNED
        lane support[2][6];
#endif
        lane q[NB][MSFP_NQ], v[NB][MSFP_NQ], a[NB][MSFP_NQ];
    } at;
    struct {
        lane cq, cv, ca, beta, accuracy, fp[NB][2];
    } seed;
    lane f[NB][2];
    struct {
        lane body[NB + 1][MSFP_BODY_PARAMETERS_SIZE], surface[NB][MSFP_SURFACE_PARAMETERS_SIZE];
    } parts;
    lane top[MSFP_TOP_PARAMETERS_SIZE], rim_cosine[NB], weight;
} lane_inputs;

/* What an evaluation leaves behind, in the order of msfp_work. */
typedef struct {
    lane x[NB + 1][MSFP_COORDINATES_SIZE], body[NB + 1][MSFP_BODY_SIZE];
    lane force[NB + 1][VECTOR], moment[NB + 1][MOMENT];
    lane local[NB][INPUTS], contact[NB][MSFP_CONTACT_SIZE], rim[NB][MSFP_RIM_SIZE];
} lane_outcome;

/* Copies between the two are those of one array. */
typedef char lane_outcome_fits[offsetof(msfp_work, rim_active) == sizeof(lane_outcome) / W ? 1 : -1];

struct lane_work {
    lane_inputs in;
    lane_outcome out;
    struct {
        lane rim_sum[NB], lock[NB], reference;
    } more; /* of msfp_work, behind rim_active */
    int rim_active[NB][W], status[W];
    lane_mask over;  /* where residual and tangent are wanted over N */
    int wanted;      /* a tangent */
    lane_mask asked; /* runs that are evaluated; the others have been, and what Y, Z they have stays */
    struct {
        lane Q[NB][MSFP_NQ], V[NB][MSFP_NQ], inertia, factors[DOF * DOF], step[DOF];
        int pivots[DOF][W];
    } newton;
    const msfp_parameters *parameters[W];
    long values[W]; /* of the parameters that the lanes hold */
    lane residual[DOF], worst, size;
    lane tangent[DOF * DOF], dnormal[NB][DOF];
    lane rim_slope[NB][(VECTOR + MOMENT) * MSFP_RIM_LOCAL]; /* of rims that some run has met */
    int any_rim[NB];
};

/* Numbers of every run i from where `pointer` says, into lanes; and back to the runs where that is `wanted`. */
#define COUNT(type) ((int)(sizeof(type) / sizeof(lane)))
#define GATHER(to, pointer)                                                                                         \
    do {                                                                                                            \
        const double *from[W];                                                                                      \
        for (int i = 0; i < W; ++i)                                                                                 \
            from[i] = (const double *)(pointer);                                                                    \
        lane_gather((lane *)&(to), from, COUNT(to));                                                                \
    } while (0)
#define SCATTER(from, wanted, pointer)                                                                              \
    do {                                                                                                            \
        double *to[W];                                                                                              \
        for (int i = 0; i < W; ++i)                                                                                 \
            to[i] = (wanted) ? (double *)(pointer) : NULL;                                                          \
        lane_scatter(to, (const lane *)&(from), COUNT(from));                                                       \
    } while (0)

#endif
