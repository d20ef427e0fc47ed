/* building.h: what the files of the run of a building share. */
#ifndef BUILDING_H
#define BUILDING_H
/* POSIX reserves the name for this. NOLINTNEXTLINE(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include "msfp_building.h"
#include "msfp_hash.h"
#include "msfp_math.h"
#include "msfp_time.h"

enum { LENGTHS = 64 }; /* most lengths of steps whose factors are kept */
enum { ENDED = -1 };
enum { ENERGIES = 3, DAMPED = 0, RECEIVED, GROUND }; /* integrals over the run */

/* The linear equations at one length of step, with the oscillators eliminated: S x + forces = those without rates x. */
typedef struct {
    double length; /* [s]; 0: none */
    double used;   /* when it was last used */
    long tangent;  /* number of the tangent in `matrix`; 0: none */
    int factored;
    double *system, *factors;  /* [attachments][attachments] S, and its factors */
    double *matrix;            /* factors of S + tangent */
    int *pivots;
    double *follow, *inverse;  /* [oscillators] (d + beta k)/D and 1/D, with D = 1/beta + d + beta k */
} linear;

/* The columns of each of several sets of rows in which any of its rows is not zero. */
typedef struct {
    int *begin;   /* [sets + 1] of each set in `columns` */
    int *columns; /* rising in each set */
} pattern;

/* Rows of one length that are added one by one. */
typedef struct {
    double *data;
    size_t count, capacity;
} table;

/* A bearing in the stage that is being solved. */
typedef struct {
    int status;
    double wrench[2 * MSFP_WRENCH], derivative[MSFP_WRENCH * MSFP_WRENCH], rest[MSFP_WRENCH];
    double ends[2 * 3 * MSFP_WRENCH];
    double previous[MSFP_WRENCH]; /* of its upper end, before the last iteration */
    double error, share; /* of the step */
    double *row;         /* of its model, at the end of the last step */
} member;

/* What a task of the threads does for one bearing. */
typedef void task(msfp_building *b, int bearing);

typedef struct {
    pthread_t *threads; /* beside the one that asks */
    int count;          /* with that one */
    pthread_mutex_t lock;
    pthread_cond_t begun, done;
    task *what;
    int *taken; /* [count] bearings of each that have been begun; from here on shared without the lock */
    long generation; /* of the task, from 1; ENDED */
    int unfinished, sleeping, waiting; /* bearings; threads without work; whether the one that asks sleeps */
    int together, trial; /* whether the threads work; whether this is the way that was slower, timed again */
    long calls;          /* of the present way */
    double since, period, each[2]; /* when it began, and for how long it is kept [s]; time of a call alone, together [s] */
} pool;

struct msfp_building {
    msfp_building_scene scene;
    msfp_method_stages method;
    member *members;
    int *piece;     /* [grounds] where the last search ended */
    double *ground; /* [grounds][MSFP_GROUND] in the present stage */
    pool pool;
    /* State between two steps; pass_state (state.c) lists what a snapshot holds. */
    double t, h, previous_error, energy, energies[ENERGIES];
    double tangent_beta; /* of `tangent` [s]; 0: none */
    int stop, jump, span, next_row;
    long counts[MSFP_BUILDING_COUNTS];
    double *u, *v, *a;  /* [n] */
    double *slope;      /* [n] rate of change of `a` over the last step */
    double *tangent;    /* [attachments]^2 sum of the derivatives of the bearings; other entries than `coupled` are 0 */
    double *force;      /* [attachments] forces of the bearings less those at rest */
    /* The step in progress. */
    pattern moved;   /* attachments that each bearing moves with */
    pattern coupled; /* attachments that share a bearing with each attachment */
    pattern watched; /* coordinates that each vector of the scene depends on */
    pattern of_node; /* coordinates that each node depends on */
    linear linear[LENGTHS], *now;
    int lengths; /* that are kept */
    int damped;  /* whether the damping of the attachments is not zero, as that of modes alone is */
    double clock;
    int solving;   /* stage */
    double trying; /* length of the step [s] */
    double *stage_v, *stage_a;                       /* [stages][n] */
    double power[MSFP_STAGES][ENERGIES];
    double *Q, *V;               /* [n] of the stage: u = Q + beta v, v = V + beta a */
    double *driving;             /* [n] forces of these: on the attachments with those of the oscillators, on those */
    double *x, *residual;        /* [attachments] rates; forces that are out of balance */
    double *change;              /* [attachments] of the rates */
    double *scale;               /* [attachments] of these forces [N], [N m] */
    double *strain;              /* [oscillators], or its rate */
    double *scaled;              /* [oscillators][attachments] shares */
    double *next_u, *product;    /* [n] */
    double next_energies[2];     /* kinetic and strain energy at the end of the step [J] */
    double *scratch;             /* [3][attachments] */
    int status, bearing, surface;
    double value;
    uint64_t identity; /* of all that the run computes from but its two-ports */
    int *entries, *faces; /* as in the scene, of the present models */
    double *peaks; /* and then as many times; see peaks.c */
    table rows, steps; /* see state.c */
};

/* ---- pool.c ---- */

int pool_begin(msfp_building *b);
void pool_end(msfp_building *b);
/* Do something for each bearing, in threads. */
void for_each_bearing(msfp_building *b, task *what);

/* ---- linear.c ---- */

/* y += A x, of a matrix of n rows by its columns. Each row is summed in the order of the columns. */
void add_columns(int n, int columns, const double *matrix, const double *x, double *y);
/* y = A x, of a matrix [n][n] by its columns, such as a symmetric one. */
void multiply(int n, const double *matrix, const double *x, double *y);
double dot(int n, const double *x, const double *y);
/* The pattern of `sets` times `height` rows of n numbers; MSFP_OK or MSFP_E_MEMORY. */
int find_pattern(pattern *p, const double *rows, int sets, int height, int n);
/* The columns of a set. */
static inline const int *columns_of(const pattern *p, int set, int *count)
{
    *count = p->begin[set + 1] - p->begin[set];
    return p->columns + p->begin[set];
}
/* The sum of row[c] x[c] over some columns. */
double dot_at(int count, const int *columns, const double *row, const double *x);
/* Patterns of the scene; MSFP_OK or MSFP_E_MEMORY. */
int find_patterns(msfp_building *b);
/* The equations for steps of length h [s], into b->now, with the present tangent if there is one. Steps of one length
 * differ by the rounding of times; the first one's length is that of the equations. */
int factor_linear(msfp_building *b, double h);
/* Factors of S + tangent, unless they are there. */
int factor_tangent(msfp_building *b);
/* x = S^-1 x, (S + tangent)^-1 x [attachments]. */
void solve_linear(msfp_building *b, double *x);
void solve_tangent(msfp_building *b, double *x);
/* What the tangent, which is kept as of `tangent_beta`, is multiplied by at the present length: stiffness prevails over
 * damping. */
double tangent_share(const msfp_building *b);
/* s = y - P^T u [oscillators] of coordinates or rates [n]. */
void strain_of(const msfp_building *b, const double *u, double *s);
void linear_free(msfp_building *b);

/* ---- stage.c ---- */

/* Motions of the ground at time t [s]; up to a jump it is that before. */
void ground_at(msfp_building *b, double t);
/* One step of length h [s], not accepted: its error over the tolerance, the share at which the first event lies, and the
 * bearing, from 1, with the largest error; 0: the building. */
int try_step(msfp_building *b, double h, double *error, double *share, int *worst);
/* The status of the first bearing that has failed, which is noted. */
int first_failure(msfp_building *b);
/* Motion of both ends of each bearing at the present state, into the members. */
void ends_now(msfp_building *b);

/* ---- state.c ---- */

int write_row(msfp_building *b);
/* Record the accelerations of the nodes. */
int write_step(msfp_building *b);
/* Take the row of a bearing from its two-port; MSFP_OK or MSFP_E_MEMORY. */
int read_row(msfp_building *b, int bearing);

/* Numbers that are kept of the rows of all bearings. */
size_t entry_count(const msfp_building *b);
/* A number that is kept of the row of a bearing; 0 where its model has none (entry < 0). */
static inline double kept(const member *m, int entry) { return entry < 0 ? 0.0 : m->row[entry]; }
/* A number that tells what a run computes from, its two-ports aside, which have their own. */
uint64_t identity_of(const msfp_building *b);

/* ---- peaks.c ---- */

size_t peak_count(const msfp_building *b);
/* Values that every state exceeds, before the first one. */
void begin_peaks(msfp_building *b);
/* Peaks with those of the present state: of the building, and of one bearing. */
void note_peaks(msfp_building *b);
void note_bearing(msfp_building *b, int bearing);

#endif
