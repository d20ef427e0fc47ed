/* tangent_forward.c: the tangent of the condensed equations, part by part as generator/schedule.py states them.
 *
 * With uplift, separations are along fixed axes, so that the bodies above an unknown do not move as one rigid body
 * (tangent.c). Elsewhere the tests compare it with the faster tangent.c.
 */
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

#if MSFP_FORWARD_TANGENT

/* The tangent from the derivatives of kinematics and of force and moment at the top. */
MSFP_INLINE void descend(const msfp_parameters *p, msfp_work *w, msfp_blocks *s, double *tangent)
{
    msfp_block_tangents ds;
    msfp_forces_tangents(p, w, s, &ds);
    msfp_surfaces_tangents(p, w, s, &ds);
    msfp_moments_tangents(p, w, s, &ds);
    for (int j = 0; j < NB; ++j) {
        memcpy(tangent + j * ND * DOF, ds.angular[j + 1], NA * DOF * sizeof *tangent);
#if MSFP_UPLIFT
        memcpy(tangent + (j * ND + NA) * DOF, ds.excess[j], MSFP_SPACE * DOF * sizeof *tangent);
#endif
        memcpy(w->dnormal[j], ds.contact[j] + MSFP_CONTACT_N * DOF, sizeof w->dnormal[j]);
    }
}

void msfp_load_tangent(const msfp_parameters *p, msfp_work *w, const double *dforce, const double *dmoment,
                       double *derivatives)
{
    msfp_blocks s;
    memset(w->dx, 0, sizeof w->dx);
    memset(w->dbody, 0, sizeof w->dbody);
    memcpy(w->dforce[NB], dforce, sizeof w->dforce[NB]);
    memcpy(w->dmoment[NB], dmoment, sizeof w->dmoment[NB]);
    descend(p, w, &s, derivatives);
}

MSFP_WIDE void msfp_tangent(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                            msfp_work *w, double *tangent)
{
    const double factors[3] = { weights->q_weight, weights->v_weight, weights->a_weight };
    msfp_blocks s;
    memset(w->dx, 0, sizeof w->dx);
    memset(w->dbody[0], 0, sizeof w->dbody[0]);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i)
            for (int order = 0; order < 3; ++order)
                w->dx[k + 1][msfp_unknown_field(order, i) * DOF + k * ND + i] = factors[order];
    msfp_bodies_tangents(p, w, &s, NULL);
    msfp_top_tangent(p, at, w);
    descend(p, w, &s, tangent);
}
#endif
