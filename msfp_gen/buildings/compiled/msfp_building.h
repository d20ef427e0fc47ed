/* msfp_building.h: the run of a linear building on bearings (docs/buildings.md).
 *
 * The building has n coordinates: attachments u, by which bearings hold it, and oscillators y on them, unit masses on
 * springs and dampers, M u'' + C u' + K u - P (d s' + k s) + forces of the bearings = 0 and y'' + d s' + k s = 0 with
 * s = y - P^T u. Each bearing is a two-port (msfp.h) between the ground and the building. All take the steps of one
 * implicit method. In a stage the rates of the attachments are the unknowns: each oscillator follows from its own
 * equation, and each bearing from its stage equations.
 *
 * Matrices are dense; those for LAPACK are stored by columns. Functions that return an int return MSFP_OK or a status.
 */
#ifndef MSFP_BUILDING_H
#define MSFP_BUILDING_H
#include <stddef.h>
#include "msfp.h"

/* A two-port of a model: as in the wrapper of the models. */
typedef struct {
    const msfp_api *api;
    msfp_port *port;
} msfp_part;

/* Functions of BLAS and LAPACK. */
typedef struct {
    void (*syrk)(char *uplo, char *transposed, int *n, int *columns, double *alpha, double *a, int *lda, double *beta,
                 double *c, int *ldc);
    void (*potrf)(char *uplo, int *n, double *a, int *lda, int *info);
    void (*potrs)(char *uplo, int *n, int *columns, double *a, int *lda, double *b, int *ldb, int *info);
    void (*getrf)(int *m, int *n, double *a, int *lda, int *pivots, int *info);
    void (*getrs)(char *transposed, int *n, int *columns, double *a, int *lda, int *pivots, double *b, int *ldb,
                  int *info);
} msfp_lapack;

/* Where the contacts of a bearing are in the row of its model: number of surfaces, and of those concave up; indices of the
 * first normal force, contact angle and tilt, how many coordinates each body has, and indices of the first gap and rim
 * force. Not checked: contacts on edges are modelled. */
enum {
    MSFP_FACES_CHECKED,
    MSFP_FACES_SURFACES,
    MSFP_FACES_UPWARD,
    MSFP_FACES_NORMAL,
    MSFP_FACES_ANGLES,
    MSFP_FACES_TILTS,
    MSFP_FACES_STRIDE,
    MSFP_FACES_GAP,
    MSFP_FACES_RIM,
    MSFP_FACES
};

enum { MSFP_WRENCH = 6, MSFP_GROUND = 9 }; /* displacement, velocity and acceleration along E1, E2, E3 */

/* What a run is given; arrays must outlive it. */
typedef struct {
    int n, attachments, bearings, grounds;
    const double *mass, *damping, *stiffness; /* [attachments][attachments] M, C, K */
    const double *shares, *shares_turned;     /* P [attachments][n - attachments]; its transpose */
    const double *dampers, *springs;          /* [n - attachments] d, k */
    const msfp_part *parts;                   /* [bearings] */
    const double *rows;                       /* [bearings][6][attachments] motion of the upper ends */
    const int *ground_of;                     /* [bearings] motion of the ground below */
    const msfp_piecewise *ground;             /* [grounds] motions, of which channels 0 to 2 are used */
    const int *entry_count;                   /* [bearings] numbers kept of the rows of each bearing, */
    const int *entries;                       /* one bearing after the other: their indices; -1: 0 */
    const int *faces;                         /* [bearings][MSFP_FACES] where contacts are in these rows, see below */
    double weight;                            /* scale of forces [N] */
    int vectors;                              /* of the building, whose peaks are kept: */
    const int *vector_orders;                 /* [vectors] 0: of the coordinates, 1, 2: of their derivatives; */
    const double *vector_rows;                /* [vectors][3][n], less */
    const double *vector_grounds;             /* [vectors][grounds] shares of the displacements of the ground */
    int nodes;                                /* whose accelerations are recorded at the end of each step: */
    const double *node_rows;                  /* [nodes][6][n] their motions from the coordinates */
    const double *arms;                       /* [bearings][2] of the forces of the ground, for their torsion [m] */
    const double *stops, *jumps;              /* rising times at which a step ends; at which accelerations jump [s] */
    int stop_count, jump_count;
    const double *span_ends, *span_steps;     /* intervals of time with a longest step each [s] */
    int span_count;
    int method;                               /* enum msfp_method */
    double rtol, max_step, first_step, max_steps, end, output_step;
    int threads;
    int timed; /* whether the threads work only where that is faster, by the clock */
    msfp_lapack lapack;
} msfp_building_scene;

/* How a run stands. */
typedef struct {
    int status, bearing, surface; /* bearing: that failed, counted from 1; 0: the building */
    double value, time;
    size_t rows;
} msfp_building_progress;

enum {
    MSFP_BUILDING_STEPS,
    MSFP_BUILDING_REJECTED,
    MSFP_BUILDING_ITERATIONS,
    MSFP_BUILDING_TANGENTS,
    MSFP_BUILDING_LENGTHS,
    MSFP_BUILDING_COUNTS
};

typedef struct msfp_building msfp_building;

/* A run at rest, with its first row; NULL: no memory. */
msfp_building *msfp_building_new(const msfp_building_scene *scene);
void msfp_building_free(msfp_building *b);
/* Take up to `steps` steps. Returns 1 while there is more to do. */
int msfp_building_advance(msfp_building *b, long steps);
void msfp_building_state(const msfp_building *b, msfp_building_progress *progress);
void msfp_building_counts(const msfp_building *b, long *counts);
/* Rows: time, u, v, a, motions of the ground, energies (damped, received from the bearings, work of the ground), and of
 * each bearing the wrenches on both ends and the kept numbers of its row. */
size_t msfp_building_row_size(const msfp_building *b);
const double *msfp_building_rows(const msfp_building *b);
/* A record for each step and the start [msfp_building_step_count]: time, and accelerations of all nodes. */
size_t msfp_building_step_count(const msfp_building *b);
const double *msfp_building_steps(const msfp_building *b);
/* Peaks over all steps [msfp_building_peak_count]. Of a vector these are the largest magnitudes along E1, E2, E3 and in
 * the plane of E1 and E2. Of the building: of each vector; of the sum of the forces of the ground; its largest torsion;
 * kinetic and strain energy. Of each bearing: of the displacement of its lower end less that of the upper one; of the
 * force on the upper end; the least and the largest compression there; the least value of each kept number of its rows;
 * their largest values; of each surface the largest sine of the angle at its sphere centre between the contact and the
 * axis of the slider while it is loaded; how many rims are met at one time. Times: when each was reached first [s]. */
size_t msfp_building_peak_count(const msfp_building *b);
const double *msfp_building_peaks(const msfp_building *b);
const double *msfp_building_peak_times(const msfp_building *b);
/* Motion of the ends [2][3][6] of a bearing, counted from 0, at the present state. */
void msfp_building_ends(msfp_building *b, int bearing, double *ends);
/* The two-port of a bearing, counted from 0, was replaced in the scene by one of another model in the present state;
 * entries, faces: of its rows. The run goes on, also after a failure. Returns MSFP_OK or a status. */
int msfp_building_replaced(msfp_building *b, int bearing, const int *entries, const int *faces);
/* The state between two steps, with all rows and records, as bytes; in a run of the same scene and build the steps that follow are
 * those that followed there, bit by bit. */
size_t msfp_building_snapshot_size(const msfp_building *b);
void msfp_building_snapshot_write(const msfp_building *b, void *snapshot);
/* After MSFP_E_SNAPSHOT or MSFP_E_MEMORY the run must not be continued. */
int msfp_building_snapshot_read(msfp_building *b, const void *snapshot, size_t size);

#endif
