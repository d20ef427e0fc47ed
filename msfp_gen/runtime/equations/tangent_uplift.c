/* tangent_uplift.c: the tangent of the condensed equations with uplift: columns of all fields, from the base upward.
 *
 * Separations are along fixed axes, so that the bodies above an unknown do not move as one rigid body (tangent.c).
 */
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

#if MSFP_UPLIFT

static void seed_columns(msfp_work *w, const msfp_seed *seed)
{
    memset(w->dx, 0, sizeof w->dx);
    memset(w->dbody[0], 0, sizeof w->dbody[0]);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            const double factors[3] = { seed->cq, seed->cv, seed->ca };
            for (int order = 0; order < 3; ++order)
                w->dx[k + 1][msfp_unknown_field(order, i) * DOF + k * ND + i] = factors[order];
        }
}

/* Columns of the rim forces and of their moments, in the basis of the body below. */
typedef struct {
    double force[NB][FORCE * DOF], moment[NB][MOMENT * DOF];
} rim_columns;

/* Those of surface j, from the Jacobian of its rim. */
static void rim(const msfp_work *w, int j, rim_columns *rims)
{
    memset(rims->force[j], 0, sizeof rims->force[j]);
    memset(rims->moment[j], 0, sizeof rims->moment[j]);
#if MSFP_RIMS
    double x[MSFP_RIM_LOCAL], dx[MSFP_RIM_LOCAL * DOF];
    if (!w->rim_active[j])
        return;
    msfp_rim_coordinates_tangent(w->body[j], w->x[j + 1], x, w->dbody[j], w->dx[j + 1], dx);
    for (int i = 0; i < MSFP_RIM_LOCAL; ++i)
        for (int r = 0; r < FORCE + MOMENT; ++r) {
            double *to = r < FORCE ? rims->force[j] + r * DOF : rims->moment[j] + (r - FORCE) * DOF;
            const double factor = w->jacobians.rim[j][r * MSFP_RIM_LOCAL + i];
            for (int c = 0; c < DOF; ++c)
                to[c] += factor * dx[i * DOF + c];
        }
#else
    (void)w;
#endif
}

/* Columns of the forces of the surfaces, and of the linear balances. The kernels are linear in forces, whose values
 * therefore do not enter. */
static void forces(const msfp_parameters *p, msfp_work *w, const rim_columns *rims, double *tangent)
{
    double dsum[FORCE * DOF], unused[FORCE];
    memcpy(dsum, w->dforce[NB], sizeof dsum);
    for (int j = NB - 1; j >= 0; --j) {
        double *dforce = w->dforce[j];
        msfp_interface_force_tangent(p->body[j + 1], w->body[j + 1], w->force[j + 1], unused, w->dbody[j + 1], dsum,
                                     dforce);
        memcpy(dsum, dforce, sizeof dsum);
        msfp_unilateral_tangent(p, w, j, rims->force[j]);
        for (int i = 0; i < MSFP_SPACE * DOF; ++i)
            tangent[(j * ND + NA) * DOF + i] = dsum[i] - dforce[i];
    }
}

/* Columns of the moments of surface j on its two bodies, and of N. */
static void surface(msfp_work *w, const msfp_surface_jacobians *jacobians, rim_columns *rims, int j)
{
    double dlocal[MSFP_LOCAL_SIZE * DOF], local[MSFP_LOCAL_SIZE], moment[MOMENT], unused[MOMENT];
    double *dmoment = rims->moment[j];
    msfp_surface_local_tangent(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], w->rim[j], local,
                               w->dbody[j], w->dbody[j + 1], w->dx[j + 1], w->dx[j], w->dforce[j], rims->force[j], dlocal);
    memset(w->dnormal[j], 0, sizeof w->dnormal[j]);
    for (int r = 0; r <= MOMENT; ++r) {
        double *row = r < MOMENT ? dmoment + r * DOF : w->dnormal[j];
        for (int k = 0; k < MSFP_LOCAL_SIZE; ++k) {
            const double slope = jacobians->contact[(r * MSFP_LOCAL_SIZE + k) * MSFP_LANES + j];
            for (int c = 0; c < DOF; ++c)
                row[c] += slope * dlocal[k * DOF + c];
        }
    }
    msfp_surface_moment(w, j, moment);
    msfp_moment_to_world_tangent(w->body[j], moment, unused, w->dbody[j], dmoment, w->dmoment[j]);
    msfp_split_moment_tangent(w, j);
}

/* The tangent from the columns of kinematics and of force and moment at the top. */
static void descend(const msfp_parameters *p, msfp_work *w, double *tangent)
{
    double out[MSFP_ANGULAR_SIZE], dout[MSFP_ANGULAR_SIZE * DOF];
    rim_columns rims;
    for (int j = 0; j < NB; ++j)
        rim(w, j, &rims);
    forces(p, w, &rims, tangent);
    for (int j = 0; j < NB; ++j)
        surface(w, &w->jacobians, &rims, j);
    for (int k = 1; k <= NB; ++k) {
        const double *above = k < NB ? w->below[k] : w->moment[k], *dabove = k < NB ? w->dbelow[k] : w->dmoment[k];
        msfp_angular_balance_tangent(p->body[k], w->body[k], w->force[k - 1], w->moment[k - 1], w->force[k], above, out,
                                     w->dbody[k], w->dforce[k - 1], w->dmoment[k - 1], w->dforce[k], dabove, dout);
        memcpy(tangent + (k - 1) * ND * DOF, dout, NA * DOF * sizeof *dout);
    }
}

void msfp_load_tangent(const msfp_parameters *p, msfp_work *w, const double *dforce, const double *dmoment,
                       double *derivatives)
{
    memset(w->dx, 0, sizeof w->dx);
    memset(w->dbody, 0, sizeof w->dbody);
    memcpy(w->dforce[NB], dforce, sizeof w->dforce[NB]);
    memcpy(w->dmoment[NB], dmoment, sizeof w->dmoment[NB]);
    descend(p, w, derivatives);
}

MSFP_WIDE void msfp_tangent(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w,
                            double *tangent)
{
    seed_columns(w, seed);
    for (int k = 1; k <= NB; ++k)
        msfp_forward_tangent(p->body[k], w->body[k - 1], w->x[k], w->body[k], w->dbody[k - 1], w->dx[k], w->dbody[k]);
    msfp_top_tangent(p, at, w);
    descend(p, w, tangent);
}
#endif
