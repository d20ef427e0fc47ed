/* contact_columns.c: directional derivatives of one contact.
 *
 * Friction and its coefficient solve two or three local equations (contact.c). Their derivatives follow from the same
 * equations, and the derivatives of the contact contain them.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

enum {
    C = MSFP_COLUMNS,
    U = MSFP_UNKNOWN_COLUMNS,
    FRICTION = MSFP_SHEAR_SIZE,
    UNKNOWNS = FRICTION + MSFP_LAW /* local unknowns of a contact: g, and mu where it follows a law */
};
MSFP_STATIC_ASSERT(UNKNOWNS <= U, unknown_columns);

#if MSFP_CLOSED_FORM
/* Derivatives of Y after a slip (msfp_friction_after_slip): with respect to Y before, and to the slip. */
MSFP_INLINE void slip_slopes(double Y, double slip, double slopes[2])
{
    const double end = msfp_friction_after_slip(Y, slip);
    slopes[1] = msfp_friction_slope(end, slip);
    if (MSFP_PLASTIC || Y * slip < 0.0)
        slopes[0] = slopes[1]; /* a function of Y + slip, from the start or from where friction is zero */
    else
        slopes[0] = fabs(Y) < 1.0 ? (1.0 - end * end) / (1.0 - Y * Y) : 1.0;
}

/* The block `stage` where Y is a function of the slip of the step, and the rate of that slip. */
MSFP_INLINE double closed_form_stage(const msfp_parameters *p, const msfp_seed *seed, const msfp_work *w, int j,
                                     double *stage)
{
    const double *par = p->surface[j], per_turn = msfp_slip_per_turn(par), rate = per_turn * w->local[j][MSFP_LOCAL_DWY];
    stage[MSFP_STAGE_Y] = msfp_friction_after_slip(seed->fp[j][0], seed->beta * rate + per_turn * seed->turn[j]);
    stage[MSFP_STAGE_TAU] = par[MSFP_SURFACE_PARAMETERS_TD];
    stage[MSFP_STAGE_REST] = 1.0;
    return rate;
}

/* Columns of that block and of g. */
MSFP_INLINE void closed_form(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_seed *seed,
                             const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d, int j,
                             double *dstage, double *dg)
{
    const double *par = p->surface[j], *dpar = dp->surface[j], T = par[MSFP_SURFACE_PARAMETERS_TD];
    const double per_turn = msfp_slip_per_turn(par), turning = w->local[j][MSFP_LOCAL_DWY];
    const double rate = per_turn * turning, slip = seed->beta * rate + per_turn * seed->turn[j], Y0 = seed->fp[j][0];
    const double Y = msfp_friction_after_slip(Y0, slip), left = msfp_friction_slope(Y, rate);
    double slopes[2];
    slip_slopes(Y0, slip, slopes);
    for (int c = 0; c < C; ++c) {
        const double dper = per_turn * (dpar[MSFP_SURFACE_PARAMETERS_R * C + c] / par[MSFP_SURFACE_PARAMETERS_R] -
                                        dpar[MSFP_SURFACE_PARAMETERS_DY * C + c] / par[MSFP_SURFACE_PARAMETERS_DY]);
        const double drate = dper * turning + per_turn * d->local[j][MSFP_LOCAL_DWY * C + c];
        const double dslip =
            seed->beta * drate + dat->beta[c] * rate + dper * seed->turn[j] + per_turn * dat->turn[j][c];
        const double dY = slopes[0] * dat->f[j][0][c] + slopes[1] * dslip, dT = dpar[MSFP_SURFACE_PARAMETERS_TD * C + c];
        const int free = !MSFP_PLASTIC || fabs(Y + T * rate) < 1.0;
        const double bend = !MSFP_PLASTIC && Y * rate > 0.0 ? -2.0 * Y * dY : 0.0;
        const double shear = MSFP_PLASTIC ? 1.0 : left;
        dg[c] = free ? dY + shear * (dT * rate + T * drate) + T * rate * bend : 0.0;
        dstage[MSFP_STAGE_Y * C + c] = dY;
        dstage[MSFP_STAGE_TAU * C + c] = dT;
        dstage[MSFP_STAGE_REST * C + c] = 0.0;
    }
}
#endif

/* The block `stage` of surface j, as msfp_contacts forms it. */
MSFP_INLINE void contact_stage(const msfp_parameters *p, const msfp_seed *seed, const msfp_work *w, int j,
                               double *stage)
{
    const double T = p->surface[j][MSFP_SURFACE_PARAMETERS_TD], tau = seed->beta + T;
    stage[MSFP_STAGE_TAU] = tau;
    stage[MSFP_STAGE_REST] = tau > 0.0 ? T / tau : 1.0;
    for (int i = 0; i < FRICTION; ++i)
        stage[MSFP_STAGE_Y + i] = seed->fp[j][i];
#if MSFP_CLOSED_FORM
    if (seed->closed_form)
        closed_form_stage(p, seed, w, j, stage);
#else
    (void)w;
#endif
}

/* Its columns where it is not in closed form. */
MSFP_INLINE void stage_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_seed *seed,
                               const msfp_point_columns *dat, int j, double *dstage)
{
    const double T = p->surface[j][MSFP_SURFACE_PARAMETERS_TD], tau = seed->beta + T;
    for (int i = 0; i < FRICTION; ++i)
        memcpy(dstage + (MSFP_STAGE_Y + i) * C, dat->f[j][i], sizeof dat->f[j][i]);
    for (int c = 0; c < C; ++c) {
        const double dT = dp->surface[j][MSFP_SURFACE_PARAMETERS_TD * C + c], dtau = dat->beta[c] + dT;
        dstage[MSFP_STAGE_TAU * C + c] = dtau;
        dstage[MSFP_STAGE_REST * C + c] = seed->beta > 0.0 ? (dT - T * dtau / tau) / tau : 0.0;
    }
}

/* Solve for the derivatives of the local unknowns, g = fp + tau df/dt and mu by its law: [unknown][C]. Their matrix is
 * near the identity, so that elimination needs no pivots. slopes: of the contact by the unknowns; d: its columns at
 * constant unknowns. */
MSFP_INLINE void solve_unknowns(const double *contact, const msfp_point_columns *dat, int j, const double *stage,
                                const double *dstage, const double *slopes, const double *d, double *solution)
{
    static const int rows[] = { MSFP_CONTACT_DY,
#if !MSFP_PLANAR
                                MSFP_CONTACT_DZ,
#endif
#if MSFP_LAW
                                MSFP_CONTACT_MU
#endif
    };
    double a[UNKNOWNS][UNKNOWNS];
    for (int r = 0; r < UNKNOWNS; ++r) {
        const double factor = r < FRICTION ? stage[MSFP_STAGE_TAU] : 1.0;
        for (int u = 0; u < UNKNOWNS; ++u)
            a[r][u] = (r == u) - factor * slopes[rows[r] * U + u];
        for (int c = 0; c < C; ++c)
            solution[r * C + c] =
                factor * d[rows[r] * C + c] +
                (r < FRICTION ? dat->f[j][r][c] + dstage[MSFP_STAGE_TAU * C + c] * contact[rows[r]] : 0.0);
    }
    for (int u = 0; u < UNKNOWNS; ++u) {
        const double inverse = 1.0 / a[u][u];
        for (int i = u; i < UNKNOWNS; ++i)
            a[u][i] *= inverse;
        for (int c = 0; c < C; ++c)
            solution[u * C + c] *= inverse;
        for (int r = 0; r < UNKNOWNS; ++r) {
            const double factor = a[r][u];
            if (r == u)
                continue;
            for (int i = u; i < UNKNOWNS; ++i)
                a[r][i] -= factor * a[u][i];
            for (int c = 0; c < C; ++c)
                solution[r * C + c] -= factor * solution[u * C + c];
        }
    }
}

MSFP_WIDE void msfp_contact_slopes(const msfp_parameters *p, const msfp_seed *seed, const msfp_work *w,
                                   const double g[MSFP_NB][2], msfp_slopes *slopes)
{
    double stage[MSFP_STAGE_SIZE], out[MSFP_CONTACT_SIZE], dg[FRICTION * U] = { 0 };
#if MSFP_LAW
    double x[MSFP_COEFFICIENT_SIZE * U] = { 0 };
    x[MSFP_COEFFICIENT_MU * U + FRICTION] = 1.0;
#endif
    for (int u = 0; u < FRICTION; ++u)
        dg[u * U + u] = 1.0;
    for (int j = 0; j < MSFP_NB; ++j) {
        contact_stage(p, seed, w, j, stage);
        msfp_contact_by_unknowns(p->surface[j], stage, w->local[j], g[j] MSFP_IF_LAW(w->coefficient[j]), out,
                                 dg MSFP_IF_LAW(x), slopes->of[j]);
    }
}

/* Results of a contact whose derivatives are used, beside its moment, which comes first. */
static const int used[] = { MSFP_CONTACT_DY, MSFP_CONTACT_Y, MSFP_CONTACT_N, MSFP_CONTACT_ST, MSFP_CONTACT_CT,
                            MSFP_CONTACT_U,
#if !MSFP_PLANAR
                            MSFP_CONTACT_DZ, MSFP_CONTACT_Z, MSFP_CONTACT_SP, MSFP_CONTACT_CP, MSFP_CONTACT_V,
#endif
#if MSFP_LAW
                            MSFP_CONTACT_MU,
#endif
};

MSFP_INLINE void add_unknowns(const double *slopes, const double *solution, int field, double *d)
{
    for (int u = 0; u < UNKNOWNS; ++u)
        for (int c = 0; c < C; ++c)
            d[field * C + c] += slopes[field * U + u] * solution[u * C + c];
}

MSFP_WIDE void msfp_contact_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_seed *seed,
                                    const msfp_point_columns *dat, const msfp_work *w, const msfp_slopes *slopes,
                                    const double g[MSFP_NB][2], int j, msfp_work_columns *d)
{
    double stage[MSFP_STAGE_SIZE], dstage[MSFP_STAGE_SIZE * C] = { 0 }, out[MSFP_CONTACT_SIZE], solution[UNKNOWNS * C];
    double *dcontact = d->contact[j];
    contact_stage(p, seed, w, j, stage);
#if MSFP_CLOSED_FORM
    if (seed->closed_form)
        closed_form(p, dp, seed, dat, w, d, j, dstage, solution);
    else
#endif
        stage_columns(p, dp, seed, dat, j, dstage);
    msfp_contact_direction(p->surface[j], stage, w->local[j], g[j] MSFP_IF_LAW(w->coefficient[j]), out,
                           dp->surface[j], dstage, d->local[j], dcontact);
#if MSFP_CLOSED_FORM
    if (!seed->closed_form)
#endif
        solve_unknowns(out, dat, j, stage, dstage, slopes->of[j], dcontact, solution);
    for (int r = 0; r < MSFP_MOMENT_SIZE; ++r)
        add_unknowns(slopes->of[j], solution, r, dcontact);
    for (size_t r = 0; r < sizeof used / sizeof *used; ++r)
        add_unknowns(slopes->of[j], solution, used[r], dcontact);
}
#endif
