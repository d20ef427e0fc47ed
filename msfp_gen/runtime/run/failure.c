/* failure.c: why a run cannot continue. Steps shrink towards the time of the cause without reaching it. */
#include "run.h"

#if !MSFP_UPLIFT
static const double unloaded_share =
    0.02; /* of weight and load: a surface with less normal force is about to lift off */
static const double unbounded_share =
    20.0; /* of weight and load: no impact causes more where steps shrink to nothing */

/* Record where the failure is; returns the surface. */
static int failed_at(msfp_run *run, int surface, double value)
{
    run->status_surface = surface;
    run->status_value = value;
    return surface;
}

/* Surface with a normal force close to zero, counted from 1; 0: none. */
static int unloaded(msfp_run *run, const msfp_work *w)
{
    int surface = 0;
    double least = unloaded_share * w->reference;
    for (int j = 0; j < NB; ++j)
        if (w->contact[j][MSFP_CONTACT_N] < least) {
            least = w->contact[j][MSFP_CONTACT_N];
            surface = j + 1;
        }
    return surface ? failed_at(run, surface, least) : 0;
}

/* The present state extrapolated by `moment` [s]. */
static void extrapolate(msfp_run *run, double moment, msfp_point *at)
{
    const double *rates = run->now.dfoot;
    msfp_to_point(run, &run->now, at);
    for (int order = 0; order < 2; ++order) { /* relative to the base, which is not extrapolated */
        const double rate = rates[order] - at->base[order + 1][2];
        at->foot[order] += moment * (rate + (order ? 0.0 : 0.5 * moment * (rates[1] - at->base[2][2])));
    }
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < MSFP_NQ; ++d) {
            at->q[k][d] += moment * (at->v[k][d] + 0.5 * moment * at->a[k][d]);
            at->v[k][d] += moment * at->a[k][d];
        }
        for (int d = 0; d < 2; ++d)
            at->f[k][d] += moment * run->now.df[k][d];
    }
}

/* Whether any rim is in contact. */
static int rim_in_contact(const msfp_work *w)
{
    int found = 0;
    for (int j = 0; j < NB; ++j)
        found = found || w->rim_active[j];
    return found;
}

/* Whether a surface is about to lift off: it carries almost nothing, or the next rim contact would put it under
 * tension. */
static int lift_off_imminent(msfp_run *run)
{
    msfp_point at;
    msfp_work w;
    msfp_row row;
    msfp_solution solution;
    msfp_to_point(run, &run->now, &at);
    msfp_observe(&run->parameters, &at, &w, &row);
    if (unloaded(run, &w))
        return 1;
    for (double moment = 1e-8; moment < 1e-4 && !MSFP_MASSLESS;
         moment *= 10.0) { /* the force of a rim in contact acts at once */
        extrapolate(run, moment, &at);
        if (msfp_accelerations(&run->parameters, &at, &w, &solution) == MSFP_OK && rim_in_contact(&w) &&
            msfp_surface_in_tension(&w)) {
            const int surface = msfp_surface_in_tension(&w);
            double p[3];
            msfp_contact_frame_p_get(w.contact_frame[surface - 1], p);
            return failed_at(run, surface, p[2]);
        }
    }
    return 0;
}

/* Whether a surface carries more than `times` weight and load. */
static int loaded(msfp_run *run, const msfp_work *w, double times)
{
    for (int j = 0; j < NB; ++j)
        if (w->contact[j][MSFP_CONTACT_N] > times * w->reference) {
            run->status_surface = j + 1;
            return 1;
        }
    return 0;
}

/* Whether a normal force grows without bound. */
static int normal_force_unbounded(msfp_run *run)
{
    msfp_point at;
    msfp_work w;
    msfp_row row;
    msfp_to_point(run, &run->now, &at);
    msfp_observe(&run->parameters, &at, &w, &row);
    return loaded(run, &w, unbounded_share);
}

/* Whether the equations lose regularity within a moment (Painleve's paradox): through slope and friction the normal
 * force increases the motion that causes it and grows without bound in finite time. At its end the determinant vanishes
 * and no acceleration exists. */
static int regularity_lost(msfp_run *run)
{
    msfp_point at;
    msfp_work w;
    msfp_row row;
    msfp_solution now, soon;
    msfp_to_point(run, &run->now, &at);
    msfp_observe(&run->parameters, &at, &w, &row);
    if (MSFP_MASSLESS || !loaded(run, &w, 2.0) || msfp_accelerations(&run->parameters, &at, &w, &now))
        return 0;
    for (double moment = 1e-9; moment < 2e-7; moment *= 2.0) {
        extrapolate(run, moment, &at);
        if (msfp_accelerations(&run->parameters, &at, &w, &soon) || soon.determinant != now.determinant)
            return 1;
    }
    return 0;
}

int msfp_classify_failure(msfp_run *run, int status)
{
    if (status == MSFP_E_ANGLE || status == MSFP_E_LAW) /* these name their own cause */
        return status;
    if (status == MSFP_E_FINITE) /* the present state is finite: the next one has no solution */
        status = MSFP_E_NEWTON;
    return normal_force_unbounded(run) ? MSFP_E_IRREGULAR
           : lift_off_imminent(run)    ? MSFP_E_UPLIFT
           : regularity_lost(run)      ? MSFP_E_IRREGULAR
                                       : status;
}
#else
int msfp_classify_failure(msfp_run *run, int status)
{
    (void)run;
    return status == MSFP_E_FINITE ? MSFP_E_NEWTON : status; /* as above */
}
#endif
