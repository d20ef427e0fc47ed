/* energy_balance.c: a step may neither create energy nor lose most of it.
 *
 * A step may pass over a time at which the normal force is unbounded and end where the equations have a solution again.
 * Its error estimate does not show this; its energy balance does.
 */
#include <math.h>
#include "run.h"

static const double largest_gain = 0.1; /* share of the largest energy so far that a step may create by its error */
static const double largest_loss = 0.5; /* share that it may lose: damped ringing may be a large part of it */
static const double smallest_energy =
    1e-6; /* share of weight and load times a radius: smaller energies do not matter */

/* Input less dissipated energy [J]. */
static double net_input(const msfp_state *s)
{
    double sum = s->work[MSFP_WORK_INPUT];
    for (int i = MSFP_WORK_FRICTION_DISSIPATED; i < MSFP_WORKS; ++i)
        sum -= s->work[i];
    return sum;
}

/* Energy stored in friction [J], from the state: the integral of its power would hide the effect of an unbounded normal
 * force. */
static double friction_energy(const msfp_run *run, const msfp_state *s)
{
    double sum = 0.0;
    for (int j = 0; j < NB; ++j) {
        const double *par = run->parameters.surface[j], *f = s->f[j];
        const double pressed = fmin(run->work.contact[j][MSFP_CONTACT_N], 2.0 * run->work.reference);
        sum += 0.5 * par[MSFP_SURFACE_PARAMETERS_MU] * pressed * par[MSFP_SURFACE_PARAMETERS_DY] *
               (f[0] * f[0] + f[1] * f[1]);
    }
    return sum;
}

void msfp_energy_balance_begin(msfp_run *run, const msfp_point *at)
{
    run->now.energy =
        msfp_stored_energy(&run->parameters, at, &run->work, &run->now.mechanical) + friction_energy(run, &run->now);
    run->largest_energy = fmax(run->largest_energy, smallest_energy * run->work.reference *
                                                        run->parameters.surface[0][MSFP_SURFACE_PARAMETERS_R]);
}

int msfp_energy_consistent(msfp_run *run)
{
    msfp_state *next = &run->next;
    const msfp_state *now = &run->now;
    next->energy =
        msfp_stored_energy(&run->parameters, &run->reached, &run->work, &next->mechanical) + friction_energy(run, next);
    const double created = next->energy - now->energy - (net_input(next) - net_input(now));
    double most = fmax(run->largest_energy, now->mechanical.kinetic);
    for (int i = 0; i < MSFP_WORKS; ++i)
        most = i == MSFP_WORK_FRICTION_STORED ? most : fmax(most, fabs(now->work[i]));
    run->largest_energy = most;
    return created <= largest_gain * most && created >= -largest_loss * most;
}
