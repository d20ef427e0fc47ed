/* surface.c: the sliding surfaces: rims, gaps, interface forces and moments. */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

enum { NB = MSFP_NB, DOF = MSFP_DOF, FORCE = MSFP_FORCE_SIZE, MOMENT = MSFP_MOMENT_SIZE, PAIR = MSFP_PAIR };

#if MSFP_RIMS
static void rim_coordinates(const msfp_work *w, int j, double *x)
{
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            x[order * PAIR + i] = w->x[j + 1][msfp_coordinate_field(order, i)];
}
#endif

void msfp_rim_force(const msfp_parameters *p, msfp_work *w, int j, double *drim)
{
    memset(w->rim[j], 0, sizeof w->rim[j]);
    w->rim_active[j] = 0;
    w->rim_sum[j] = 0.0;
#if MSFP_RIMS
    /* Comparing cosines of the tilt avoids an arc cosine while the rim is not in contact. */
    if (msfp_body_cp(w->body[j + 1]) * w->body[j + 1][MSFP_BODY_CT] > p->rim_cosine[j])
        return;
    double x[MSFP_RIM_LOCAL], out[MSFP_RIM_SIZE];
    rim_coordinates(w, j, x);
    if (drim) {
        double seed[MSFP_RIM_LOCAL * MSFP_RIM_LOCAL] = { 0 };
        for (int i = 0; i < MSFP_RIM_LOCAL; ++i)
            seed[i * MSFP_RIM_LOCAL + i] = 1.0;
        msfp_rim_tangent(p->surface[j], x, out, seed, drim);
    } else
        msfp_rim(p->surface[j], x, out);
    w->rim_sum[j] = out[MSFP_RIM_FC];
    if (out[MSFP_RIM_FC] < 0.0) { /* a rim only pushes: docs/model.md, choice 4 */
        memcpy(w->rim[j], out, sizeof out);
        w->rim_active[j] = 1;
    }
#else
    (void)p;
    (void)drim;
#endif
}

void msfp_gaps(const msfp_parameters *p, const double q[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE])
{
    double body[MSFP_BODY_SIZE];
    for (int j = 0; j < NB; ++j) {
#if !MSFP_PLANAR
        body[MSFP_BODY_SP] = sin(q[j][0]);
        body[MSFP_BODY_CP] = cos(q[j][0]);
#endif
        body[MSFP_BODY_ST] = sin(q[j][1]);
        body[MSFP_BODY_CT] = cos(q[j][1]);
        msfp_gap(p->surface[j], body, sliding[j]);
    }
}

void msfp_rim_force_tangent(const msfp_work *w, int j, const double *drim, double *dforce, double *dmoment)
{
    memset(dforce, 0, FORCE * DOF * sizeof *dforce);
    memset(dmoment, 0, MOMENT * DOF * sizeof *dmoment);
    if (!w->rim_active[j])
        return;
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i) {
            const double *dx = w->dx[j + 1] + msfp_coordinate_field(order, i) * DOF;
            const int from = order * PAIR + i;
            for (int r = 0; r < FORCE + MOMENT; ++r) {
                double *to = r < FORCE ? dforce + r * DOF : dmoment + (r - FORCE) * DOF;
                const double factor = drim[r * MSFP_RIM_LOCAL + from];
                for (int c = 0; c < DOF; ++c)
                    to[c] += factor * dx[c];
            }
        }
}

double msfp_rim_share(const msfp_work *w, int j)
{
    double interface = 0.0, rim = 0.0;
    if (!MSFP_UPLIFT || !w->rim_active[j])
        return 1.0;
    for (int i = 0; i < FORCE; ++i) {
        interface += w->force[j][i] * w->force[j][i];
        rim += w->rim[j][i] * w->rim[j][i];
    }
    return interface < rim ? sqrt(interface / rim) : 1.0;
}

/* Rim force of surface j, and the inputs of its contact: force and slip in the basis of the body below. */
MSFP_INLINE void contact_inputs(const msfp_parameters *p, msfp_work *w, int j, double *drim)
{
    double rim[FORCE];
    msfp_rim_force(p, w, j, drim);
    const double share = msfp_rim_share(w, j);
    for (int i = 0; i < FORCE; ++i)
        rim[i] = share * w->rim[j][i];
    msfp_surface_local(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], rim, w->local[j]);
}

void msfp_surface_moment(const msfp_work *w, int j, double *moment)
{
    for (int r = 0; r < MOMENT; ++r)
        moment[r] = w->contact[j][r] + w->rim[j][FORCE + r];
}

MSFP_WIDE int msfp_surfaces(const msfp_parameters *p, msfp_work *w, const msfp_seed *seed, double g[NB][2],
                            msfp_surface_jacobians *jacobians)
{
    double moment[MOMENT];
    for (int j = 0; j < NB; ++j)
        contact_inputs(p, w, j, jacobians ? jacobians->rim[j] : NULL);
    const int status = msfp_contacts(p, w, seed, g, jacobians ? jacobians->contact : NULL);
    if (status)
        return status;
    for (int j = 0; j < NB; ++j) {
        msfp_surface_moment(w, j, moment);
        msfp_moment_to_world(w->body[j], moment, w->moment[j]);
#if MSFP_UPLIFT
        msfp_split_moment(w, j);
#endif
    }
    return MSFP_OK;
}
