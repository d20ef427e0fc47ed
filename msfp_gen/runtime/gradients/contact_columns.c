/* contact_columns.c: directional derivatives of one contact.
 *
 * Friction and its coefficient solve two or three local equations (contact.c). Their derivatives follow from the same
 * equations, and the derivatives of the contact contain them.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3", "no-tree-loop-distribute-patterns") /* zeros of Jacobians as vectors, not by memset */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

enum {
    LANES = MSFP_LANES,
    FRICTION = MSFP_FRICTION_FORCE_SIZE,
    UNKNOWNS = MSFP_LOCAL_UNKNOWNS,
    RESULTS = MSFP_CONTACT_RESULTS,
    INPUTS = MSFP_CONTACT_INPUTS,  /* the unknowns come last */
    GIVEN = INPUTS - UNKNOWNS,
    FEW = MSFP_MEMORY ? RESULTS : MOMENT + UNKNOWNS /* results on which the motion depends; the source is among the last */
};
enum { PARAMETERS, STAGE, LOCAL }; /* blocks of inputs */
static const struct {
    int block, index;
} input[INPUTS] = MSFP_CONTACT_INPUT_LIST;
/* Indices in the block of a contact. The moment comes first, then what the equations of the unknowns contain. */
static const int result[RESULTS] = MSFP_CONTACT_RESULT_LIST;

/* Eliminate the local unknowns from the Jacobians. They are g = fp + tau df/dt, and mu by its law. rates: df/dt; rates and
 * tau by lanes. */
MSFP_INLINE void eliminate(const double *rates, const double *tau, int rows, double (*restrict jacobian)[INPUTS][LANES],
                           double (*restrict slopes)[INPUTS][LANES])
{
    double a[UNKNOWNS][INPUTS][LANES];
    for (int r = 0; r < UNKNOWNS; ++r)
        MSFP_UNROLL
        for (int i = 0; i < INPUTS; ++i) {
            const int stage = r < FRICTION && input[i].block == STAGE, given = i < GIVEN;
            const double past = stage && input[i].index == MSFP_FRICTION_STAGE_Y + r;
            for (int s = 0; s < LANES; ++s) {
                const double slope = (r < FRICTION ? tau[s] : 1.0) * jacobian[MOMENT + r][i][s] + past +
                                     (stage && input[i].index == MSFP_FRICTION_STAGE_TAU ? rates[r * LANES + s] : 0.0);
                a[r][given ? UNKNOWNS + i : i - GIVEN][s] = given ? slope : (i - GIVEN == r) - slope;
            }
        }
    msfp_eliminate_friction(INPUTS, a[0]);
    for (int u = 0; u < UNKNOWNS; ++u) {
        double inverse[LANES];
        for (int s = 0; s < LANES; ++s)
            inverse[s] = 1.0 / a[u][u][s];
        for (int i = UNKNOWNS; i < INPUTS; ++i)
            for (int s = 0; s < LANES; ++s)
                a[u][i][s] *= inverse[s];
    }
    for (int r = 0; r < rows; ++r)
        for (int i = 0; i < GIVEN; ++i)
            for (int s = 0; s < LANES; ++s) {
                double sum = jacobian[r][i][s];
                for (int u = 0; u < UNKNOWNS; ++u)
                    sum += jacobian[r][GIVEN + u][s] * a[u][UNKNOWNS + i][s];
                slopes[r][i][s] = sum;
            }
}

/* The derivatives of the first `rows` results; inlined for each number of them, so that no others are computed. */
MSFP_INLINE void contact_slopes(const msfp_parameters *p, const msfp_stage_weights *weights, const msfp_work *w,
                                const double g[MSFP_NB][2], int rows, msfp_slopes *slopes)
{
    double stage[MSFP_FRICTION_STAGE_SIZE * LANES], contact_frame[MSFP_CONTACT_FRAME_SIZE * LANES],
        force[FRICTION * LANES];
    double out[MSFP_CONTACT_SIZE * LANES], jacobian[RESULTS][INPUTS][LANES];
#if MSFP_LAW
    double x[MSFP_COEFFICIENT_SIZE * LANES];
#endif
    for (int s = 0; s < LANES; ++s) {
        const int j = s < MSFP_NB ? s : MSFP_NB - 1;
        for (int i = 0; i < MSFP_FRICTION_STAGE_SIZE; ++i)
            stage[i * LANES + s] = w->friction_stage[j][i];
        for (int i = 0; i < MSFP_CONTACT_FRAME_SIZE; ++i)
            contact_frame[i * LANES + s] = w->contact_frame[j][i];
        for (int i = 0; i < FRICTION; ++i)
            force[i * LANES + s] = g[j][i];
#if MSFP_LAW
        for (int i = 0; i < MSFP_COEFFICIENT_SIZE; ++i)
            x[i * LANES + s] = w->coefficient[j][i];
#endif
    }
    msfp_contact_by_inputs_jacobian(&p->lanes[0][0], stage, contact_frame, force MSFP_IF_LAW(x), out,
                                    &jacobian[0][0][0]);
#if MSFP_CLOSED_FORM
    if (weights->closed_form) {
        memcpy(slopes->of, jacobian, (size_t)rows * sizeof *jacobian);
        return;
    }
#else
    (void)weights;
#endif
    eliminate(out + MSFP_CONTACT_DY * LANES, stage + MSFP_FRICTION_STAGE_TAU * LANES, rows, jacobian, slopes->of);
}

MSFP_WIDE void msfp_contact_slopes(const msfp_parameters *p, const msfp_stage_weights *weights, const msfp_work *w,
                                   const double g[MSFP_NB][2], int all, msfp_slopes *slopes)
{
    if (all)
        contact_slopes(p, weights, w, g, RESULTS, slopes);
    else
        contact_slopes(p, weights, w, g, FEW, slopes);
}

int msfp_tangent_with_slopes(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                             msfp_work *w, double g[MSFP_NB][2], int all, msfp_slopes *slopes, double *tangent)
{
    enum { SIZE = MSFP_CONTACT_FRAME_SIZE * LANES };
    int closed_form = 0;
#if MSFP_CLOSED_FORM
    closed_form = weights->closed_form;
#endif
    for (int j = 0; j < NB; ++j)
        msfp_rim_force(p, w, j, w->jacobians.rim[j]);
    const int status = closed_form ? msfp_contacts(p, w, weights, g, w->jacobians.contact) : MSFP_OK;
    if (status)
        return status;
    msfp_contact_slopes(p, weights, w, (const double (*)[2])g, all, slopes);
    int from[MSFP_CONTACT_ROWS] = { 0 }; /* row MOMENT, that of N, does not enter the tangent */
    for (int r = 0; r < RESULTS; ++r) {
        if (r < MOMENT + FRICTION)
            from[r < MOMENT ? r : r + 1] = r;
#if MSFP_MEMORY
        if (result[r] == MSFP_CONTACT_SOURCE)
            from[MSFP_CONTACT_ROWS - 1] = r;
#endif
    }
    for (int r = 0; r < MSFP_CONTACT_ROWS && !closed_form; ++r)
        memcpy(w->jacobians.contact + r * SIZE, slopes->of[from[r]][GIVEN - MSFP_CONTACT_FRAME_SIZE],
               SIZE * sizeof(double));
    msfp_tangent(p, at, weights, w, tangent);
    return MSFP_OK;
}

/* Columns of the first `rows` results of the contact of surface j from those of `count` inputs. */
MSFP_INLINE void results_columns(const msfp_slopes *slopes, const double *const *inputs, int count, int rows, int j,
                                 double *contact)
{
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < C; c += MSFP_PACK_SIZE) {
            msfp_pack sum = slopes->of[r][0][j] * *(const msfp_pack *)(inputs[0] + c);
            MSFP_UNROLL
            for (int i = 1; i < count; ++i)
                sum += slopes->of[r][i][j] * *(const msfp_pack *)(inputs[i] + c);
            *(msfp_pack *)(contact + result[r] * C + c) = sum;
        }
}

/* The columns of surface j; inlined for each number of results. */
MSFP_INLINE void contact_columns(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                 const msfp_stage_weights *weights, const msfp_point_columns *dat, const msfp_work *w,
                                 const msfp_slopes *slopes, int j, int rows, msfp_work_columns *d)
{
    double *dstage = d->friction_stage[j], unknowns[UNKNOWNS * C];
    const double *const blocks[] = { dp->surface[j], dstage, d->contact_frame[j], unknowns, unknowns + FRICTION * C },
                        *inputs[INPUTS];
    MSFP_UNROLL
    for (int i = 0; i < INPUTS; ++i)
        inputs[i] = blocks[input[i].block] + input[i].index * C;
#if MSFP_CLOSED_FORM
    if (weights->closed_form) {
        double dslid[MSFP_FRICTION_END_SIZE * C];
        msfp_friction_after_slip_direction(p->surface[j], weights->slip[j], w->contact_frame[j], dp->surface[j],
                                           dat->slip[j], d->contact_frame[j], dslid);
        memset(dstage, 0, sizeof d->friction_stage[j]);
        memcpy(dstage + MSFP_FRICTION_STAGE_Y * C, dslid + MSFP_FRICTION_END_Y * C, sizeof(msfp_columns));
        memcpy(dstage + MSFP_FRICTION_STAGE_TAU * C, dp->surface[j] + MSFP_SURFACE_PARAMETERS_TD * C,
               sizeof(msfp_columns));
        memcpy(unknowns, dslid + MSFP_FRICTION_END_G * C, sizeof(msfp_columns));
        results_columns(slopes, inputs, INPUTS, rows, j, d->contact[j]);
        return;
    }
#endif
    (void)p;
    (void)weights;
    (void)dat;
    (void)w;
    results_columns(slopes, inputs, GIVEN, rows, j, d->contact[j]);
}

MSFP_WIDE void msfp_contact_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                                    const msfp_point_columns *dat, const msfp_slopes *slopes,
                                    const msfp_stage_weights *weights, int all, msfp_work_columns *d)
{
    for (int j = 0; j < NB; ++j) {
        if (all)
            contact_columns(p, dp, weights, dat, w, slopes, j, RESULTS, d);
        else
            contact_columns(p, dp, weights, dat, w, slopes, j, FEW, d);
    }
}
#endif
