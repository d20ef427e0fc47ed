/* failure.c: what a run that cannot go on died of, where steps shrink towards that moment without reaching it. */
#include "run.h"

#define PARTING 0.02 /* of weight and load: an interface that carries less is about to part */
#define RUNAWAY 20.0 /* of weight and load: where no step helps no blow does that, only a normal force without a bound */

#if !MSFP_UPLIFT
static int named(msfp_run *run, int surface, double value)
{
    run->status_surface = surface;
    run->status_value = value;
    return surface;
}

/* The surface that carries hardly anything any more; 0: none. */
static int unloaded(msfp_run *run, const msfp_work *w)
{
    int surface = 0;
    double least = PARTING * w->reference;
    for (int j = 0; j < NB; ++j)
        if (w->contact[j][MSFP_CONTACT_N] < least) {
            least = w->contact[j][MSFP_CONTACT_N];
            surface = j + 1;
        }
    return surface ? named(run, surface, least) : 0;
}

/* The state a moment later, on its present course. */
static void moved(msfp_run *run, double moment, msfp_point *at)
{
    msfp_to_point(run, &run->now, at);
    for (int k = 0; k < NB; ++k) {
        for (int d = 0; d < MSFP_NQ; ++d) {
            at->q[k][d] += moment * (at->v[k][d] + 0.5 * moment * at->a[k][d]);
            at->v[k][d] += moment * at->a[k][d];
        }
        for (int d = 0; d < 2; ++d)
            at->f[k][d] += moment * run->now.df[k][d];
    }
}

static int rim_met(const msfp_work *w)
{
    int met = 0;
    for (int j = 0; j < NB; ++j)
        met = met || w->rim_active[j];
    return met;
}

static int parting(msfp_run *run)
{
    msfp_point at;
    msfp_work w;
    msfp_row row;
    msfp_solution solution;
    msfp_to_point(run, &run->now, &at);
    msfp_observe(&run->parameters, &at, &w, &row);
    if (unloaded(run, &w))
        return 1;
    for (double moment = 1e-8; moment < 1e-4 && !MSFP_MASSLESS; moment *= 10.0) { /* a rim that is met acts at once */
        moved(run, moment, &at);
        if (msfp_accelerations(&run->parameters, &at, &w, &solution) == MSFP_OK && rim_met(&w) && msfp_pulling(&w)) {
            const int surface = msfp_pulling(&w);
            double p[3];
            msfp_local_p_get(w.local[surface - 1], p);
            return named(run, surface, p[2]);
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

static int runaway(msfp_run *run)
{
    msfp_point at;
    msfp_work w;
    msfp_row row;
    msfp_to_point(run, &run->now, &at);
    msfp_observe(&run->parameters, &at, &w, &row);
    return loaded(run, &w, RUNAWAY);
}

/* A mass thrown upwards through slopes and friction: what presses feeds what drives, the normal force grows without a
 * bound in a time that every method finds (Painleve's paradox), and at its end, where the determinant vanishes, there is
 * no acceleration. */
static int jammed(msfp_run *run)
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
        moved(run, moment, &at);
        if (msfp_accelerations(&run->parameters, &at, &w, &soon) || soon.determinant != now.determinant)
            return 1;
    }
    return 0;
}

int msfp_last_word(msfp_run *run, int status)
{
    if (status == MSFP_E_ANGLE) /* whatever else is true there */
        return status;
    if (status == MSFP_E_FINITE) /* the state is: it is the next one that has no solution */
        status = MSFP_E_NEWTON;
    return runaway(run) ? MSFP_E_IRREGULAR : parting(run) ? MSFP_E_UPLIFT : jammed(run) ? MSFP_E_IRREGULAR : status;
}
#else
int msfp_last_word(msfp_run *run, int status)
{
    (void)run;
    return status;
}
#endif
