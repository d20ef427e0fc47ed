/* condensed.c: the condensed equations: angular balances (3.27), (3.29), with interface forces (3.26), (3.28) summed
 * from the top down. Functions msfp_..._values are in msfp_schedule.h, which is emitted from generator/schedule.py. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* unrolls the loops over bodies and surfaces */
#endif
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

static const int unknown[ND] = MSFP_FREE;

MSFP_WIDE int msfp_condensed(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                             msfp_work *w, double g[MSFP_NB][2], double *residual, double *tangent)
{
    msfp_blocks s;
    s.g = g;
    s.jacobians = tangent ? &w->jacobians : NULL;
    msfp_set_inputs(p, at, weights, w, &s);
    if (!weights->same_base)
        msfp_base_values(p, w, &s);
    msfp_bodies_values(p, w, &s);
    msfp_top_values(p, w, &s);
    if (!MSFP_RIMS)
        for (int j = 0; j < NB; ++j)
            msfp_rim_force(p, w, j, NULL);
    msfp_forces_values(p, w, &s);
    const int status = msfp_surfaces_values(p, w, &s);
    if (status)
        return status;
    msfp_moments_values(p, w, &s);
    for (int j = 0; j < NB; ++j) {
        memcpy(residual + j * ND, s.angular[j + 1], NA * sizeof *residual);
#if MSFP_UPLIFT
        memcpy(residual + j * ND + NA, s.excess[j], MSFP_SPACE * sizeof *residual);
#endif
        w->lock[j][MSFP_LOCK_MOMENT] = MSFP_PLANAR || !MSFP_SPIN_LOCKED ? 0.0 : s.angular[j + 1][MSFP_ANGULAR_SIZE - 1];
    }
    if (tangent)
        msfp_tangent(p, at, weights, w, tangent);
    return MSFP_OK;
}

/* Natural size of each residual [MSFP_DOF]: (N + rim force) R (mu + 1/100) of the surface below; of a force N + rim
 * force. */
static void residual_scale(const msfp_parameters *p, const msfp_work *w, double *scale)
{
    for (int k = 0; k < NB; ++k) {
        const double *par = p->surface[k];
#if MSFP_RIMS
        const double rim = fabs(w->rim[k][MSFP_RIM_FC]);
#else
        const double rim = 0.0;
#endif
        /* At rates far from the solution N is arbitrarily large and no scale; it is bounded by the loads. */
        const double normal = w->contact[k][MSFP_CONTACT_N], most = 1e3 * w->reference;
        const double pressed = (normal < most ? normal : most) + rim + (MSFP_UPLIFT ? 1e-3 * w->reference : 0.0);
        const double natural = pressed * par[MSFP_SURFACE_PARAMETERS_R] * (par[MSFP_SURFACE_PARAMETERS_MU] + 0.01);
        for (int i = 0; i < ND; ++i)
            scale[k * ND + i] = fmax(i < NA ? natural : pressed, 1e-12);
    }
}

int msfp_surface_in_tension(const msfp_work *w)
{
    for (int j = 0; j < NB && !MSFP_UPLIFT; ++j) {
        double p[3];
        msfp_contact_frame_p_get(w->contact_frame[j], p);
        if (p[2] <= 0.0)
            return j + 1;
    }
    return 0;
}

int msfp_invalid_friction(const msfp_work *w)
{
#if MSFP_LAW
    for (int j = 0; j < NB; ++j)
        if (!(w->contact[j][MSFP_CONTACT_MU] >= 0.0 && w->contact[j][MSFP_CONTACT_MU] < INFINITY))
            return j + 1;
#else
    (void)w;
#endif
    return 0;
}

void msfp_friction_rates(const msfp_work *w, double rates[MSFP_NB][2])
{
    for (int j = 0; j < NB; ++j) {
        rates[j][0] = w->contact[j][MSFP_CONTACT_DY];
        rates[j][1] = msfp_contact_dZ(w->contact[j]);
    }
}

void msfp_friction_state(const msfp_work *w, double f[MSFP_NB][2])
{
    for (int j = 0; j < NB; ++j) {
        f[j][0] = w->contact[j][MSFP_CONTACT_Y];
        f[j][1] = msfp_contact_Z(w->contact[j]);
    }
}

double msfp_residual_size(const msfp_parameters *p, const msfp_work *w, const double *residual, int *worst)
{
    double scale[DOF], size = 0.0;
    residual_scale(p, w, scale);
    for (int i = 0; i < DOF; ++i) {
        const double one = fabs(residual[i]) / scale[i];
        if (one <= size)
            continue;
        size =
            one < INFINITY ? one : INFINITY; /* also where the residual is not a number, which then stays the largest */
        *worst = i;
    }
    return size;
}

/* Whether a step of the unknowns is below the roundoff of the accelerations. While surfaces are open N, the scale of
 * the residual, is so small that its roundoff is no measure. */
static int below_roundoff(const msfp_point *at, const double *step)
{
    double size[2] = { 0.0 }, moved[2] = { 0.0 }; /* of angles, of separations */
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            const int separation = unknown[i] >= 3;
            size[separation] = fmax(size[separation], fabs(at->a[k][unknown[i]]));
            moved[separation] = fmax(moved[separation], fabs(step[k * ND + i]));
        }
    return moved[0] <= 1e-12 * size[0] && moved[1] <= 1e-12 * size[1];
}

/* The equations are nearly linear in the accelerations: the first factors are kept while a step reduces the residual a
 * hundredfold. */
int msfp_accelerations(const msfp_parameters *p, msfp_point *at, msfp_work *w, msfp_solution *out)
{
    double residual[DOF], tangent[DOF * DOF], g[NB][2], last = INFINITY;
    int pivots[DOF], worst, settled = 0;
    msfp_stage_weights weights = { .a_weight = 1.0 };
    memcpy(weights.fp, at->f, sizeof weights.fp);
    memcpy(g, at->f, sizeof g);
    out->determinant = 1;
    for (out->iterations = 0; out->iterations < 50; ++out->iterations) {
        const int first = out->iterations == 0;
        int status = msfp_condensed(p, at, &weights, w, g, residual, first ? tangent : NULL);
        if (status)
            return status;
        weights.same_base = 1;
        out->residual = msfp_residual_size(p, w, residual, &worst);
        if (!(out->residual < INFINITY))
            return MSFP_E_FINITE;
        /* Converged, or at the floor that rounding leaves; a step is taken all the same, for the determinant. */
        if ((out->iterations && out->residual <= 1e-13) ||
            ((settled || out->residual <= 1e-9) && out->residual >= 0.5 * last))
            return MSFP_OK;
        const int good = out->residual < 1e-2 * last;
        last = out->residual;
        if (!first && !good && (status = msfp_condensed(p, at, &weights, w, g, residual, tangent)))
            return status;
        if (first || !good) {
            out->determinant = msfp_lu(tangent, DOF, pivots);
            if (out->determinant == 0)
                return MSFP_E_IRREGULAR;
        }
        msfp_lu_solve(tangent, DOF, pivots, residual);
        for (int k = 0; k < NB; ++k)
            for (int i = 0; i < ND; ++i)
                at->a[k][unknown[i]] -= residual[k * ND + i];
        settled = below_roundoff(at, residual);
    }
    return MSFP_E_NEWTON;
}
