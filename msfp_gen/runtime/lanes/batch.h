/* batch.h: many runs of one model on one core. Each goes its own way, as if alone, up to the next evaluation of the
 * condensed equations; there it waits until as many runs wait as a vector has lanes, and all are evaluated at once.
 */
#ifndef MSFP_BATCH_H
#define MSFP_BATCH_H
#include "newton.h"

#define MSFP_MOST_RUNS 64            /* of one batch at a time */
#define MSFP_FEW (MSFP_WIDTH / 4 + 1) /* so many runs go faster alone: most lanes would be empty */

/* An evaluation that a run waits for: the arguments of msfp_condensed, and what becomes of it. */
typedef struct {
    const msfp_parameters *parameters;
    long values;                /* runs with the same number have the same parameters; set by msfp_batch_asked */
    const msfp_point *at;
    const msfp_seed *seed;
    msfp_work *work;
    double (*f)[2];
    double *residual, *tangent; /* tangent: NULL where none is wanted */
    int over_normal;            /* divide both by N, and measure the residual */
    double keep;                /* up to which size of the residual the work area is wanted as well */
    int status, worst;          /* worst: row of the largest residual */
    double size;                /* of the residual, relative to its natural size */
    msfp_stage *stage;          /* Newton may go on in it; NULL: one evaluation */
    const double *factors;      /* with these */
    const int *pivots;
    int most, more;             /* steps it may take; evaluations beyond the first */
} msfp_request;

typedef struct msfp_batch msfp_batch;

int msfp_batch_width(void); /* runs in a vector */
msfp_batch *msfp_batch_new(void); /* NULL: no memory */
void msfp_batch_free(msfp_batch *b);
/* Let a started run go on in slot 0 .. MSFP_MOST_RUNS - 1, which is free. 0 or MSFP_E_MEMORY. */
int msfp_batch_put(msfp_batch *b, int slot, msfp_run *run);
/* Take the memory for rows of a run whose rows nobody wants any more: the next run writes there, and the system need not
 * find new pages. */
void msfp_batch_reuse(msfp_batch *b, msfp_run *run);
/* Go on for a while or until a run has ended; the slots that have become free. */
int msfp_batch_advance(msfp_batch *b, long evaluations, int *ended);
/* Whether the caller is a run of a batch; then a request is answered when this returns. The last MSFP_FEW runs of a batch
 * go alone. */
int msfp_batch_asked(msfp_request *request);

/* lanes.c: up to MSFP_WIDTH requests at once, all with a tangent or none. */
typedef struct lane_work lane_work;
lane_work *msfp_lanes_new(void);
void msfp_lanes(lane_work *w, msfp_request *const *requests, int count);

#endif
