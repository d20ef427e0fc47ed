/* contact_unilateral.c: a contact that transmits compression only, in models with uplift (docs/uplift.md). */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

/* Penetration of surface j, and whether it stands on the edge of its footprint. */
static void depth(const msfp_parameters *p, const msfp_work *w, int j, double *block)
{
    msfp_unilateral_depth(p->surface[j], w->body[msfp_slider(j)], w->x[j + 1], block);
}

double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    double block[MSFP_UNILATERAL_DEPTH_SIZE];
    depth(p, w, j, block);
    return block[MSFP_UNILATERAL_DEPTH_DEPTH];
}

void msfp_unilateral_force(const msfp_parameters *p, msfp_work *w, int j)
{
    double block[MSFP_UNILATERAL_DEPTH_SIZE];
    const double *slider = w->body[msfp_slider(j)];
    depth(p, w, j, block);
    w->standing[j] = block[MSFP_UNILATERAL_DEPTH_BEYOND] > 0.0 ? MSFP_ON_EDGE : MSFP_ON_FACE;
    if (!(block[MSFP_UNILATERAL_DEPTH_DEPTH] > 0.0)) { /* at zero the normal is not defined */
        w->standing[j] = MSFP_OPEN;
        memset(w->unilateral[j], 0, sizeof w->unilateral[j]);
    } else if (w->standing[j] == MSFP_ON_EDGE)
        msfp_unilateral_edge(p->surface[j], slider, w->x[j + 1], w->unilateral[j]);
    else
        msfp_unilateral_inside(p->surface[j], slider, w->x[j + 1], w->unilateral[j]);
}
