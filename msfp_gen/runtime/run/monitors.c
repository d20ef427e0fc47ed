/* monitors.c: checks of what a model leaves out (docs/effects.md): rims, uplift, inertia of the sliders, heat, and the
 * range of the friction law; and whether the model is valid at a state at all.
 *
 * A monitor checks every step before it is accepted and records the first time at which its limit is exceeded. Where
 * the run is to stop, that step is not accepted, and the present state is the last one for which the model is valid.
 */
#include <math.h>
#include <string.h>
#include "run.h"

enum { NB = MSFP_NB };

int msfp_check_state(msfp_run *run, const msfp_work *w, const msfp_state *s)
{
    const int unlawful = msfp_invalid_friction(w);
#if MSFP_LAW
    if (unlawful)
        run->status_value = w->contact[unlawful - 1][MSFP_CONTACT_MU];
#endif
    if (unlawful) {
        run->status_surface = unlawful;
        return MSFP_E_LAW;
    }
    for (int j = 0; j < NB; ++j) {
        double p[3];
        msfp_local_p_get(w->local[j], p);
        if (!(fabs(s->q[j][0]) + fabs(s->q[j][1]) + fabs(s->q[j][2]) < INFINITY) || !(fabs(p[2]) < INFINITY)) {
            run->status_surface = j + 1;
            return MSFP_E_FINITE;
        }
        if (p[2] <= 0.0 && !MSFP_UPLIFT) {
            run->status_surface = j + 1;
            run->status_value = p[2];
            return MSFP_E_UPLIFT;
        }
#if MSFP_UPLIFT
        const double aside = msfp_hypot(s->q[j][3], s->q[j][4]),
                     face = run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_RS];
        if (face > 0.0 && aside > face) { /* further aside than its face is wide: it cannot land on it */
            run->status_surface = j + 1;
            run->status_value = aside;
            return MSFP_E_PARTED;
        }
#endif
        if (fabs(s->q[j][1]) > 1.5 || fabs(s->q[j][0]) > 1.5) {
            run->status_surface = j + 1;
            run->status_value = fabs(s->q[j][1]) > 1.5 ? s->q[j][1] : s->q[j][0];
            return MSFP_E_ANGLE;
        }
    }
    return MSFP_OK;
}

/* The largest excess of a quantity over its limit: relative to the limit, its value, its surface counted from 1 (0:
 * none). */
typedef struct {
    double share, value;
    int surface;
} finding;

static void consider(finding *worst, double value, double limit, int surface)
{
    if (limit > 0.0 && value / limit > fmax(worst->share, 1.0)) {
        worst->share = value / limit;
        worst->value = value;
        worst->surface = surface;
    }
}

/* Sliding displacement beyond the capacity of a surface [m]. */
static finding beyond_capacity(const double *gaps)
{
    finding worst = { 0.0, 0.0, 0 };
    for (int j = 0; j < NB; ++j)
        consider(&worst, -gaps[j], 1e-12, j + 1);
    return worst;
}

/* Smallest normal force below its limit, else the largest one above its limit [N]. */
static finding unloaded(const msfp_run *run)
{
    finding worst = { 0.0, 0.0, 0 };
    const double least = run->options.monitor_normal, most = run->options.monitor_peak;
    for (int j = 0; j < NB && least > 0.0; ++j) {
        const double normal = run->work.contact[j][MSFP_CONTACT_N];
        if (normal < least && (!worst.surface || normal < worst.value))
            worst = (finding){ 2.0, normal, j + 1 };
    }
    for (int j = 0; j < NB && !worst.surface; ++j)
        consider(&worst, run->work.contact[j][MSFP_CONTACT_N], most, j + 1);
    return worst;
}

/* Inertial force of a body over the normal force below it. Velocities jump where a surface begins to slide; the change
 * is averaged over the response time of a slider. */
static finding inertial(msfp_run *run, double h)
{
    finding worst = { 0.0, 0.0, 0 };
    for (int k = 1; k <= NB; ++k) {
        double velocity[3], square = 0.0;
        msfp_body_V_get(run->work.body[k], velocity);
        for (int i = 0; i < 3; ++i) {
            const double change = velocity[i] - run->monitor.velocity[k - 1][i];
            square += change * change;
        }
        const double most = run->options.monitor_inertia * run->work.contact[k - 1][MSFP_CONTACT_N];
        const double mass = run->parameters.body[k][MSFP_BODY_PARAMETERS_M], time = fmax(h, run->options.monitor_time);
        if (mass * mass * square > most * most * time * time)
            consider(&worst, mass * sqrt(square) / time / run->work.contact[k - 1][MSFP_CONTACT_N],
                     run->options.monitor_inertia, k);
    }
    return worst;
}

/* Upper bound of the rise in temperature [K]. Of all histories of flux with energy E and peak q, the one that is at its
 * peak at the end and zero before gives the highest temperature: 2 sqrt(D/pi)/k q sqrt(E/q). */
static finding hot(const msfp_run *run, double h, double energy[NB], double peak[NB])
{
    finding worst = { 0.0, 0.0, 0 };
    for (int j = 0; j < NB; ++j) {
        const double lost = msfp_heating(&run->parameters, &run->work, j);
        const double flux = run->options.monitor_heating[j] * lost;
        energy[j] = run->monitor.energy[j] + h * flux;
        peak[j] = fmax(run->monitor.peak[j], flux);
        consider(&worst, 2.0 * sqrt(peak[j] * energy[j]), run->options.monitor_rise, j + 1);
    }
    return worst;
}

#if MSFP_LAW
/* A value outside the range in which the friction law was checked. */
static void outside(finding *worst, double value, const double range[2], int surface)
{
    if (!worst->surface && (value < range[0] || value > range[1]))
        *worst = (finding){ 2.0, value, surface };
}

/* Conditions outside the range in which the friction law was checked. */
static void outside_law(const msfp_run *run, finding *found)
{
    const msfp_options *o = &run->options;
    const double speeds[2] = { 0.0, o->law_speed };
    for (int j = 0; j < NB; ++j) {
        const double *contact = run->work.contact[j];
        if (o->monitors & 1 << MSFP_MONITOR_LAW_SPEED)
            outside(&found[MSFP_MONITOR_LAW_SPEED], msfp_hypot(contact[MSFP_CONTACT_U], msfp_contact_v(contact)), speeds,
                    j + 1);
        if (o->monitors & 1 << MSFP_MONITOR_LAW_LOAD)
            outside(&found[MSFP_MONITOR_LAW_LOAD], contact[MSFP_CONTACT_N], o->law_load[j], j + 1);
#if MSFP_HEAT
        if (o->monitors & 1 << MSFP_MONITOR_LAW_TEMPERATURE)
            outside(&found[MSFP_MONITOR_LAW_TEMPERATURE], contact[MSFP_CONTACT_T], o->law_temperature, j + 1);
#endif
    }
}
#endif

/* State of the monitors at the end of an accepted step. */
static void store(msfp_run *run, const double energy[NB], const double peak[NB])
{
    memcpy(run->monitor.energy, energy, sizeof run->monitor.energy);
    memcpy(run->monitor.peak, peak, sizeof run->monitor.peak);
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->monitor.velocity[k - 1]);
}

void msfp_monitor_begin(msfp_run *run)
{
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->monitor.velocity[k - 1]);
}

int msfp_monitor_step(msfp_run *run, const double *gaps)
{
    const msfp_options *o = &run->options;
    const double h = run->next.t - run->now.t;
    double energy[NB] = { 0 }, peak[NB] = { 0 };
    finding found[MSFP_MONITORS] = { { 0.0, 0.0, 0 } };
    if (!o->monitors)
        return 0;
    if (o->monitors & 1 << MSFP_MONITOR_RIMS)
        found[MSFP_MONITOR_RIMS] = beyond_capacity(gaps);
    if (o->monitors & 1 << MSFP_MONITOR_UPLIFT)
        found[MSFP_MONITOR_UPLIFT] = unloaded(run);
    if (o->monitors & 1 << MSFP_MONITOR_INERTIA)
        found[MSFP_MONITOR_INERTIA] = inertial(run, h);
    if (o->monitors & 1 << MSFP_MONITOR_HEAT)
        found[MSFP_MONITOR_HEAT] = hot(run, h, energy, peak);
#if MSFP_LAW
    outside_law(run, found);
#endif
    int tripped = 0;
    for (int g = 0; g < MSFP_MONITORS; ++g) {
        if (!found[g].surface || run->monitor.trips[g].surface)
            continue;
        run->monitor.trips[g] =
            (msfp_trip){ o->monitor_stop & 1 << g ? run->now.t : run->next.t, found[g].value, found[g].surface };
        tripped |= o->monitor_stop & 1 << g;
    }
    if (tripped)
        return 1;
    store(run, energy, peak);
    return 0;
}
