/* surface.c: gaps (3.20), (3.21) and rims (3.22)-(3.25) of the sliding surfaces. */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

#if MSFP_RIMS
/* Whether the rim of surface j needs no evaluation: comparing cosines of the tilt avoids an arc cosine. With uplift the
 * gap follows from the separation too. */
static int rim_is_clear(const msfp_parameters *p, const msfp_work *w, int j)
{
    return !MSFP_UPLIFT && msfp_body_cp(w->body[j + 1]) * w->body[j + 1][MSFP_BODY_CT] > p->rim_cosine[j];
}
#endif

void msfp_rim_force(const msfp_parameters *p, msfp_work *w, int j, double *drim)
{
    memset(w->rim[j], 0, sizeof w->rim[j]);
    w->rim_active[j] = 0;
    w->rim_rate[j] = 0.0;
    w->rim_gap[j] = p->surface[j][MSFP_SURFACE_PARAMETERS_SC];
#if MSFP_RIMS
    if (rim_is_clear(p, w, j))
        return;
    double x[MSFP_RIM_LOCAL], out[MSFP_RIM_SIZE];
    msfp_rim_coordinates(w->body[j], w->x[j + 1], x);
    if (drim) {
        double seed[MSFP_RIM_LOCAL * MSFP_RIM_LOCAL] = { 0 };
        for (int i = 0; i < MSFP_RIM_LOCAL; ++i)
            seed[i * MSFP_RIM_LOCAL + i] = 1.0;
        msfp_rim_tangent(p->surface[j], x, out, seed, drim);
    } else
        msfp_rim(p->surface[j], x, out);
    w->rim_gap[j] = out[MSFP_RIM_G];
    w->rim_rate[j] = out[MSFP_RIM_DG];
    const int held = MSFP_GRADIENTS && p->rim_cosine[j] > 1.0; /* while a step to its release is differentiated */
    if (MSFP_UPLIFT && out[MSFP_RIM_G] >= 0.0 && !held)
        return;
    if (out[MSFP_RIM_FC] < 0.0 || held) { /* a rim only pushes: docs/model.md, choice 4 */
        memcpy(w->rim[j], out, sizeof out);
        w->rim_active[j] = 1;
    }
#else
    (void)drim;
#endif
}

void msfp_gaps(const msfp_parameters *p, const double q[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE])
{
    double x[MSFP_COORDINATES_SIZE] = { 0.0 };
    for (int j = 0; j < NB; ++j) {
#if !MSFP_PLANAR
        x[MSFP_COORDINATES_PSI] = q[j][0];
#endif
        x[MSFP_COORDINATES_THETA] = q[j][1];
        msfp_gap_at(p->surface[j], x, sliding[j]);
    }
}
