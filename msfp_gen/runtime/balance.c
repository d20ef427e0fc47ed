/* balance.c: no step makes energy out of nothing, nor loses most of it.
 *
 * A step may pass over a moment at which the normal force has no bound and land where the equations hold again, with an
 * error estimate that knows nothing of it. Its energy does.
 */
#include <math.h>
#include "run.h"

#define SHARE 0.1  /* of the largest energy so far: more is not the error of a method */
#define LOST 0.5   /* likewise: ringing that the method damps may be a large part of it */
#define FLOOR 1e-6 /* of all that presses, lifted by a radius: below that little is at stake */

/* What has been put in and not lost. */
static double left(const msfp_state *s)
{
    double sum = s->work[MSFP_WORK_INPUT];
    for (int i = MSFP_WORK_FRICTION; i < MSFP_WORKS; ++i)
        sum -= s->work[i];
    return sum;
}

/* What friction stores, a state by itself: the integral of its power would hide what a runaway normal force makes. */
static double stored(const msfp_run *run, const msfp_state *s)
{
    double sum = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double *par = run->parameters.surface[j], *f = s->f[j];
        const double pressed = fmin(run->work.contact[j][MSFP_CONTACT_N], 2.0 * run->work.reference);
        sum += 0.5 * par[MSFP_SURFACE_PARAMETERS_MU] * pressed * par[MSFP_SURFACE_PARAMETERS_DY] * (f[0] * f[0] + f[1] * f[1]);
    }
    return sum;
}

void msfp_balance_begin(msfp_run *run, const msfp_point *at)
{
    run->now.energy = msfp_energy(&run->parameters, at, &run->work, &run->now.masses) + stored(run, &run->now);
    run->exchanged = fmax(run->exchanged, FLOOR * run->work.reference * run->parameters.surface[0][MSFP_SURFACE_PARAMETERS_R]);
}

int msfp_balanced(msfp_run *run)
{
    msfp_state *next = &run->next;
    const msfp_state *now = &run->now;
    next->energy = msfp_energy(&run->parameters, &run->reached, &run->work, &next->masses) + stored(run, next);
    const double made = next->energy - now->energy - (left(next) - left(now));
    double most = fmax(run->exchanged, now->masses.kinetic);
    for (int i = 0; i < MSFP_WORKS; ++i)
        most = i == MSFP_WORK_FRICTION_STORED ? most : fmax(most, fabs(now->work[i]));
    run->exchanged = most;
    return made <= SHARE * most && made >= -LOST * most;
}
