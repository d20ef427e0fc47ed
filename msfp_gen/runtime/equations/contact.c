/* contact.c: friction and contact (3.13)-(3.19) of all surfaces at once, one surface in each lane of a vector.
 *
 * The friction force (3.16) over -mu N is g = f + T df/dt, with f = (Y, Z) and the damping time T of the contact. With
 * the stage formula f = fp + beta df/dt it is g = fp + (beta + T) df/dt. For each surface, Newton's method solves this
 * for g, and mu from its law: two or three local unknowns, from which f follows. They are eliminated from the tangent
 * of the moment and of N by their consistent tangent. Where mu follows the slip velocity strongly and bodies turn about
 * the contact normal, mu is bracketed instead (docs/friction.md, "One coefficient or three").
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* unrolls the loops over surfaces */
#endif
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

enum {
    LANES = MSFP_LANES,
    FRICTION = MSFP_FRICTION_FORCE_SIZE,
    UNKNOWNS = MSFP_LOCAL_UNKNOWNS,
    ROWS = MOMENT + UNKNOWNS + 1,     /* of the Jacobian of a contact: M, dY, dZ, mu, N */
    INPUTS = MSFP_CONTACT_FRAME_SIZE, /* force and slip rotation */
    SOURCE = MSFP_CONTACT_ROWS -
             MSFP_GRADIENTS * (MSFP_MEMORY > 0) /* the row of the source of a memory, where there is one */
};
#if MSFP_MEMORY
#define SLOPE(out, s)                                                                                                  \
    (out)[MSFP_CONTACT_LAW_MU * LANES + (s)] /* d mu/d mu by the law, because friction heats the surface */
#else
#define SLOPE(out, s) 0.0
#endif

/* Fields of all surfaces, [field][lane]; spare lanes repeat the last surface. */
typedef struct {
    double contact_frame[INPUTS * LANES], stage[MSFP_FRICTION_STAGE_SIZE * LANES], g[FRICTION * LANES],
        out[MSFP_CONTACT_SIZE * LANES];
#if MSFP_LAW
    double x[MSFP_COEFFICIENT_SIZE * LANES];
#endif
} lanes;

/* From the blocks of the surfaces to lanes. */
MSFP_INLINE void gather(const msfp_work *w, double g[NB][2], lanes *all)
{
    for (int s = 0; s < LANES; ++s) {
        const int j = s < NB ? s : NB - 1;
        for (int k = 0; k < INPUTS; ++k)
            all->contact_frame[k * LANES + s] = w->contact_frame[j][k];
        for (int k = 0; k < FRICTION; ++k)
            all->g[k * LANES + s] = g[j][k];
        for (int k = 0; k < MSFP_FRICTION_STAGE_SIZE; ++k)
            all->stage[k * LANES + s] = w->friction_stage[j][k];
#if MSFP_LAW
        const double mu = w->coefficient[j][MSFP_COEFFICIENT_MU];
        all->x[s] = fabs(mu) < 1e3 ? mu : 0.0; /* not finite after a failed step */
#endif
    }
}

/* From lanes to the blocks of the surfaces. */
MSFP_INLINE void scatter(const lanes *all, msfp_work *w, double g[NB][2])
{
    for (int j = 0; j < NB; ++j) {
        for (int k = 0; k < MSFP_CONTACT_SIZE; ++k)
            w->contact[j][k] = all->out[k * LANES + j];
        for (int k = 0; k < FRICTION; ++k)
            g[j][k] = all->g[k * LANES + j];
#if MSFP_LAW
        w->coefficient[j][MSFP_COEFFICIENT_MU] = all->x[j];
#endif
    }
}

/* Solve the 1x1 or 2x2 system a x = b of every lane, in place of b. */
MSFP_INLINE void solve_small(const double *a, double *b)
{
    for (int s = 0; s < LANES; ++s) {
#if MSFP_PLANAR
        b[s] /= a[s];
#else
        const double inverse = 1.0 / (a[s] * a[3 * LANES + s] - a[LANES + s] * a[2 * LANES + s]);
        const double x = (b[s] * a[3 * LANES + s] - a[LANES + s] * b[LANES + s]) * inverse;
        b[LANES + s] = (a[s] * b[LANES + s] - a[2 * LANES + s] * b[s]) * inverse;
        b[s] = x;
#endif
    }
}

/* One Newton step on g (and mu) of every surface that has not converged, with derivatives at constant slip velocity
 * and N, on which they depend weakly. Where the residual has grown, past a switch of the hysteresis law, half of the
 * last step is taken back. held: mu stays as it is, whatever its law gives. Returns how many surfaces have not
 * converged, -1 if a value is not finite. */
MSFP_INLINE int newton_step(lanes *all, double beta, double accuracy, int held, double *step, double *best)
{
    double a[FRICTION * FRICTION * LANES], newton[FRICTION * LANES], size[LANES], sum[LANES];
    const double *out = all->out, *tau = all->stage + MSFP_FRICTION_STAGE_TAU * LANES;
    int unconverged = 0, not_finite = 0;
    (void)held; /* of a law alone */
    for (int s = 0; s < LANES; ++s)
        size[s] = sum[s] = 0.0;
    for (int r = 0; r < FRICTION; ++r)
        for (int s = 0; s < LANES; ++s) {
            const double rest = all->g[r * LANES + s] - all->stage[r * LANES + s] -
                                tau[s] * out[(MSFP_CONTACT_DY + r) * LANES + s];
            newton[r * LANES + s] = rest;
            size[s] = fabs(rest) > size[s] ? fabs(rest) : size[s];
            sum[s] += fabs(rest);
        }
#if MSFP_LAW
    double excess[LANES];
    for (int s = 0; s < LANES; ++s) {
        excess[s] = held ? 0.0 : all->x[s] - out[MSFP_CONTACT_MU * LANES + s];
        size[s] = fabs(excess[s]) > size[s] ? fabs(excess[s]) : size[s];
        sum[s] += fabs(excess[s]);
    }
#endif
    for (int s = 0; s < LANES; ++s) {
        not_finite += !(sum[s] < INFINITY);
        unconverged += size[s] > accuracy * (1.0 + fabs(tau[s] * out[MSFP_CONTACT_DY * LANES + s]));
    }
    if (not_finite || !unconverged)
        return not_finite ? -1 : 0;
    for (int i = 0; i < FRICTION * FRICTION; ++i)
        for (int s = 0; s < LANES; ++s)
            a[i * LANES + s] = (i % (FRICTION + 1) == 0) - beta * out[(MSFP_CONTACT_YY + i) * LANES + s];
    solve_small(a, newton);
    for (int s = 0; s < LANES; ++s) {
        const int converged = size[s] <= accuracy * (1.0 + fabs(tau[s] * out[MSFP_CONTACT_DY * LANES + s]));
        const int overshot = size[s] > best[s];
        const double sign = converged ? 0.0 : overshot ? 1.0 : -1.0;
#if MSFP_LAW
        double change = excess[s];
        for (int c = 0; c < FRICTION; ++c)
            change += out[(MSFP_CONTACT_LAW_Y + c) * LANES + s] * newton[c * LANES + s];
        change = overshot ? 0.5 * step[FRICTION * LANES + s] : change / (1.0 - SLOPE(out, s));
        step[FRICTION * LANES + s] = change;
        all->x[s] += held ? 0.0 : sign * change;
#endif
        for (int r = 0; r < FRICTION; ++r) {
            step[r * LANES + s] = overshot ? 0.5 * step[r * LANES + s] : newton[r * LANES + s];
            all->g[r * LANES + s] += sign * step[r * LANES + s];
        }
        best[s] = overshot ? best[s] : size[s];
    }
    return unconverged;
}

/* g (and mu, unless it is held) of all surfaces by Newton's method on their stage formula. */
MSFP_INLINE int friction_by_newton(const double *par, lanes *all, double beta, double accuracy, int held)
{
    double step[UNKNOWNS * LANES] = { 0 }, best[LANES];
    for (int s = 0; s < LANES; ++s)
        best[s] = INFINITY;
    for (int i = 0; i < 60; ++i) {
        msfp_contact_lanes(par, all->stage, all->contact_frame, all->g MSFP_IF_LAW(all->x), all->out);
        const int unconverged = newton_step(all, beta, accuracy, held, step, best);
        if (unconverged <= 0)
            return unconverged == 0 ? MSFP_OK : i == 0 ? MSFP_E_FINITE : MSFP_E_NEWTON;
    }
    return MSFP_E_NEWTON;
}

#if MSFP_LAW
/* mu of every surface as the root of its excess over the law, each with the g that belongs to it. From the present mu
 * the steps double towards the law until the sign of the excess changes, so that a root is found that is stable and on
 * the present branch as long as this exists; regula falsi (Illinois) follows. */
static int friction_by_bracket(const double *par, lanes *all, double beta, double accuracy)
{
    double last[LANES] = { 0 }, last_excess[LANES] = { 0 }, reach[LANES] = { 0 }; /* 0: no step yet */
    double other[LANES] = { 0 }, other_excess[LANES] = { 0 };
    int bracketed[LANES] = { 0 };
    for (int i = 0; i < 100; ++i) {
        const int status = friction_by_newton(par, all, beta, accuracy, 1);
        int unconverged = 0;
        if (status)
            return status;
        for (int s = 0; s < LANES; ++s) {
            const double x = all->x[s], excess = x - all->out[MSFP_CONTACT_MU * LANES + s];
            if (fabs(excess) <= accuracy)
                continue;
            ++unconverged;
            if (excess * last_excess[s] < 0.0) {
                other[s] = last[s];
                other_excess[s] = last_excess[s];
                bracketed[s] = 1;
            } else if (bracketed[s])
                other_excess[s] *= 0.5;
            reach[s] = reach[s] != 0.0 ? 2.0 * reach[s] : excess;
            last[s] = x;
            last_excess[s] = excess;
            all->x[s] -= bracketed[s] ? excess * (x - other[s]) / (excess - other_excess[s]) : reach[s];
        }
        if (!unconverged)
            return MSFP_OK;
    }
    return MSFP_E_NEWTON;
}
#endif

/* g (and mu) of all surfaces. */
MSFP_INLINE int friction_stage(const double *par, lanes *all, double beta, double accuracy)
{
#if MSFP_LAW
    double g[FRICTION * LANES], x[MSFP_COEFFICIENT_SIZE * LANES];
    memcpy(g, all->g, sizeof g);
    memcpy(x, all->x, sizeof x);
#endif
    const int status = friction_by_newton(par, all, beta, accuracy, 0);
#if MSFP_LAW
    if (status == MSFP_E_NEWTON) {
        memcpy(all->g, g, sizeof g);
        memcpy(all->x, x, sizeof x);
        return friction_by_bracket(par, all, beta, accuracy);
    }
#endif
    return status;
}

/* Row of the kernel's Jacobian (M, dY, dZ, mu, N) that is row r of MSFP_CONTACT_ROWS. */
MSFP_INLINE int jacobian_row(int r) { return r < MOMENT ? r : r == MOMENT ? MOMENT + UNKNOWNS : r - 1; }

#if MSFP_CLOSED_FORM
/* Y of all surfaces after the slip of the step, with their blocks `stage`, and their contacts; slope: dg/d(angular velocity of the body)
 * [s/rad], or NULL. */
MSFP_INLINE int closed_form_stage(const msfp_parameters *p, msfp_work *w, const msfp_stage_weights *weights, lanes *all,
                                  double *slope)
{
    static const double unit[INPUTS] = { [MSFP_CONTACT_FRAME_DWY] = 1.0 };
    double finite = 0.0;
    for (int s = 0; s < LANES; ++s) {
        const int j = s < NB ? s : NB - 1;
        double slid[MSFP_FRICTION_END_SIZE], slopes[MSFP_FRICTION_END_SIZE];
        if (slope) {
            msfp_friction_after_slip_tangent(p->surface[j], weights->slip[j], w->contact_frame[j], slid, unit, slopes);
            slope[s] = slopes[MSFP_FRICTION_END_G];
        } else
            msfp_friction_after_slip(p->surface[j], weights->slip[j], w->contact_frame[j], slid);
        all->g[s] = slid[MSFP_FRICTION_END_G];
        /* the kernel leaves Y as it is, and gives its rate */
        w->friction_stage[j][MSFP_FRICTION_STAGE_Y] = slid[MSFP_FRICTION_END_Y];
        w->friction_stage[j][MSFP_FRICTION_STAGE_TAU] = p->surface[j][MSFP_SURFACE_PARAMETERS_TD];
        w->friction_stage[j][MSFP_FRICTION_STAGE_REST] = 1.0;
        for (int k = 0; k < MSFP_FRICTION_STAGE_SIZE; ++k)
            all->stage[k * LANES + s] = w->friction_stage[j][k];
        finite += slid[MSFP_FRICTION_END_Y];
    }
    msfp_contact_lanes(&p->lanes[0][0], all->stage, all->contact_frame, all->g, all->out);
    return finite < INFINITY && finite > -INFINITY ? MSFP_OK : MSFP_E_FINITE;
}

double msfp_friction_after_turn(const double *par, double Y, double turn)
{
    static const double rates[INPUTS];
    const double slip[MSFP_SLIP_SIZE] = { [MSFP_SLIP_Y] = Y, [MSFP_SLIP_TURN] = turn };
    double slid[MSFP_FRICTION_END_SIZE];
    msfp_friction_after_slip(par, slip, rates, slid);
    return slid[MSFP_FRICTION_END_Y];
}

void msfp_work_of_slip(const double *par, const double *slip, const double *end, double *work)
{
    msfp_slip_work(par, slip, end, work);
}

/* As `condense`, with Y a function of the slip of the step. */
MSFP_INLINE void condense_closed_form(const double *par, lanes *all, const double *slope, double *condensed)
{
    double jacobian[ROWS * MSFP_FRAME_INPUTS * LANES];
    msfp_contact_jacobian(par, all->stage, all->contact_frame, all->g, all->out, jacobian);
    for (int r = 0; r < MSFP_CONTACT_ROWS; ++r) {
        const double *row = jacobian + jacobian_row(r) * MSFP_FRAME_INPUTS * LANES;
        for (int k = 0; k < INPUTS; ++k)
            for (int s = 0; s < LANES; ++s)
                condensed[(r * INPUTS + k) * LANES + s] =
                    row[k * LANES + s] + (k == MSFP_CONTACT_FRAME_DWY ? row[INPUTS * LANES + s] * slope[s] : 0.0);
    }
}
#endif

/* Jacobian with g and mu eliminated: [MSFP_CONTACT_ROWS][INPUTS][lane]. */
MSFP_INLINE void condense(const double *par, lanes *all, double *condensed)
{
    double jacobian[ROWS * MSFP_FRAME_INPUTS * LANES], a[UNKNOWNS][UNKNOWNS + INPUTS][LANES];
    msfp_contact_jacobian(par, all->stage, all->contact_frame, all->g MSFP_IF_LAW(all->x), all->out, jacobian);
    for (int r = 0; r < UNKNOWNS; ++r)
        for (int c = 0; c < UNKNOWNS + INPUTS; ++c) {
            const double *from =
                jacobian + ((MOMENT + r) * MSFP_FRAME_INPUTS + (c < UNKNOWNS ? INPUTS + c : c - UNKNOWNS)) * LANES;
            for (int s = 0; s < LANES; ++s) {
                const double scaled = (r < FRICTION ? all->stage[MSFP_FRICTION_STAGE_TAU * LANES + s] : 1.0) * from[s];
                a[r][c][s] = c < UNKNOWNS ? (r == c) - scaled : scaled;
            }
        }
    msfp_eliminate_friction(UNKNOWNS + INPUTS, a[0]);
    /* Of the source of a memory only gradients need derivatives (msfp_tangent_with_slopes). */
    memset(condensed + SOURCE * INPUTS * LANES, 0, (MSFP_CONTACT_ROWS - SOURCE) * INPUTS * LANES * sizeof *condensed);
    for (int r = 0; r < SOURCE; ++r) {
        const double *row = jacobian + jacobian_row(r) * MSFP_FRAME_INPUTS * LANES;
        for (int k = 0; k < INPUTS; ++k) {
            double *sum = condensed + (r * INPUTS + k) * LANES;
            for (int s = 0; s < LANES; ++s)
                sum[s] = row[k * LANES + s];
            for (int c = 0; c < UNKNOWNS; ++c)
                for (int s = 0; s < LANES; ++s)
                    sum[s] += row[(INPUTS + c) * LANES + s] * a[c][UNKNOWNS + k][s] / a[c][c][s];
        }
    }
}

MSFP_WIDE int msfp_contacts(const msfp_parameters *p, msfp_work *w, const msfp_stage_weights *weights, double g[NB][2],
                            double *condensed)
{
    lanes all;
    gather(w, g, &all);
#if MSFP_CLOSED_FORM
    if (weights->closed_form) {
        double slope[LANES];
        const int status = closed_form_stage(p, w, weights, &all, condensed ? slope : NULL);
        if (status == MSFP_OK && condensed)
            condense_closed_form(&p->lanes[0][0], &all, slope, condensed);
        scatter(&all, w, g);
        return status;
    }
#endif
    const int status = friction_stage(&p->lanes[0][0], &all, weights->beta, fmax(weights->accuracy, 1e-12));
    if (status == MSFP_OK && condensed)
        condense(&p->lanes[0][0], &all, condensed);
    scatter(&all, w, g);
    return status;
}

#if MSFP_FORWARD_TANGENT
void msfp_contact_tangents(msfp_work *w, double dlocal[NB][INPUTS * DOF], double dcontact[NB][MSFP_CONTACT_SIZE * DOF])
{
    for (int j = 0; j < NB; ++j)
        for (int r = 0; r < MSFP_CONTACT_ROWS; ++r) {
            double *row = dcontact[j] + (r < MOMENT ? r : MSFP_CONTACT_N) * DOF;
#if MSFP_GRADIENTS
            row = r > MOMENT ? w->drates[j][r - MOMENT - 1] : row;
#endif
            memset(row, 0, DOF * sizeof *row);
            for (int k = 0; k < INPUTS; ++k) {
                const double slope = w->jacobians.contact[(r * INPUTS + k) * LANES + j];
                for (int c = 0; c < DOF; ++c)
                    row[c] += slope * dlocal[j][k * DOF + c];
            }
        }
}
#endif
