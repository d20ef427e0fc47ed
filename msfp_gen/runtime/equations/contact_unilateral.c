/* contact_unilateral.c: a contact that transmits compression only, in models with uplift (docs/uplift.md). */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

#if MSFP_UPLIFT

static const int signs[NB] = MSFP_SIGNS;

/* The body whose face is the footprint of surface j. */
static int slider_of(int j) { return signs[j] > 0 ? j + 1 : j; }

/* Penetration of surface j, and whether it stands on the edge of its footprint. */
static void depth(const msfp_parameters *p, const msfp_work *w, int j, double *found)
{
    msfp_unilateral_depth(p->surface[j], w->body[slider_of(j)], w->x[j + 1], found);
}

double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    double found[MSFP_UNILATERAL_DEPTH_SIZE];
    depth(p, w, j, found);
    return found[MSFP_UNILATERAL_DEPTH_DEPTH];
}

void msfp_unilateral_force(const msfp_parameters *p, msfp_work *w, int j)
{
    double found[MSFP_UNILATERAL_DEPTH_SIZE], *contact = w->unilateral[j];
    depth(p, w, j, found);
    contact[MSFP_UNILATERAL_GRIP] = contact[MSFP_UNILATERAL_STORED] = contact[MSFP_UNILATERAL_LOST] = 0.0;
    if (found[MSFP_UNILATERAL_DEPTH_DEPTH] > 0.0) { /* at zero the normal is not defined */
        if (found[MSFP_UNILATERAL_DEPTH_BEYOND] > 0.0)
            msfp_unilateral_edge(p->surface[j], w->body[slider_of(j)], w->x[j + 1], contact);
        else
            msfp_unilateral_inside(p->surface[j], w->body[slider_of(j)], w->x[j + 1], contact);
    }
    if (contact[MSFP_UNILATERAL_GRIP] <= 0.0)
        memset(contact, 0, (FORCE + MOMENT) * sizeof *contact);
    msfp_rim_to_world(w->body[j], w->x[j + 1], w->rim[j], w->rim_wrench[j]);
    for (int i = 0; i < FORCE; ++i)
        w->force[j][i] = contact[i] + w->rim_wrench[j][i];
}

void msfp_unilateral_tangent(const msfp_parameters *p, msfp_work *w, int j, const double *drim)
{
    const int k = slider_of(j);
    double found[MSFP_UNILATERAL_DEPTH_SIZE], contact[MSFP_UNILATERAL_SIZE], wrench[FORCE + MOMENT], *dunilateral = w->dunilateral[j];
    depth(p, w, j, found);
    if (w->unilateral[j][MSFP_UNILATERAL_GRIP] <= 0.0)
        memset(dunilateral, 0, sizeof w->dunilateral[j]);
    else if (found[MSFP_UNILATERAL_DEPTH_BEYOND] > 0.0)
        msfp_unilateral_edge_tangent(p->surface[j], w->body[k], w->x[j + 1], contact, w->dbody[k], w->dx[j + 1],
                                     dunilateral);
    else
        msfp_unilateral_inside_tangent(p->surface[j], w->body[k], w->x[j + 1], contact, w->dbody[k], w->dx[j + 1],
                                       dunilateral);
    msfp_rim_to_world_tangent(w->body[j], w->x[j + 1], w->rim[j], wrench, w->dbody[j], w->dx[j + 1], drim,
                              w->drim_wrench[j]);
    for (int i = 0; i < FORCE * DOF; ++i)
        w->dforce[j][i] = dunilateral[i] + w->drim_wrench[j][i];
}

/* Moments of `count` components on the body above (in place) and the reverse of those on the body below, equal so far
 * and about the sphere centre of each body: on the slider, the moments of contact and rim by the separation are added. */
static void split(int j, const double *contact, const double *rim, double *on_above, double *below, int count)
{
    const int above = signs[j] > 0;
    double *slider = above ? on_above : below;
    memcpy(below, on_above, count * sizeof *below);
    for (int i = 0; i < count; ++i)
        slider[i] += above ? contact[i] + rim[i] : -contact[i] - rim[i];
}

void msfp_split_moment(msfp_work *w, int j)
{
    split(j, w->unilateral[j] + FORCE, w->rim_wrench[j] + FORCE, w->moment[j], w->below[j], MOMENT);
}

void msfp_split_moment_tangent(msfp_work *w, int j)
{
    split(j, w->dunilateral[j] + FORCE * DOF, w->drim_wrench[j] + FORCE * DOF, w->dmoment[j], w->dbelow[j],
          MOMENT * DOF);
}
#else
double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    (void)p;
    (void)w;
    (void)j;
    return 1.0;
}
#endif
