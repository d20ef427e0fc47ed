/* guard.c: cheap watches over what a model leaves out (docs/effects.md): rims, uplift, inertia of the sliders, heat.
 *
 * A watch looks at every step before it counts. It notes the first time its limit is passed; where the run is to stop
 * there, the step is not taken, and the present state is the last for which the model holds.
 */
#include <math.h>
#include <string.h>
#include "run.h"

int msfp_check_state(msfp_run *run, const msfp_work *w, const msfp_state *s)
{
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
        const double apart = hypot(s->q[j][3], s->q[j][4]), face = run->parameters.surface[j][MSFP_SURFACE_PARAMETERS_RS];
        if (face > 0.0 && apart > face) { /* beside its place by more than its face: it will not land on it */
            run->status_surface = j + 1;
            run->status_value = apart;
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

const char *msfp_guard_name(int guard)
{
    static const char *const names[MSFP_GUARDS] = { "rims", "uplift", "inertia", "heat" };
    return names[guard];
}

/* The surface (1-based) where a quantity exceeds its limit most, as a share of it; 0: none. */
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

/* How far a slider is beyond the capacity of its surface [m]. */
static finding beyond(const double *gaps)
{
    finding worst = { 0.0, 0.0, 0 };
    for (int j = 0; j < NB; ++j)
        consider(&worst, -gaps[j], 1e-12, j + 1);
    return worst;
}

/* A normal force below its least [N]. */
static finding unloaded(const msfp_run *run)
{
    finding worst = { 0.0, 0.0, 0 };
    const double least = run->options.guard_normal;
    for (int j = 0; j < NB && least > 0.0; ++j) {
        const double normal = run->work.contact[j][MSFP_CONTACT_N];
        if (normal < least && (!worst.surface || normal < worst.value))
            worst = (finding){ 2.0, normal, j + 1 };
    }
    return worst;
}

/* Inertial force of a body over the normal force below it. Velocities jump where a surface begins to slide: what counts
 * there is the mean over the time in which a slider answers. */
static finding inertial(msfp_run *run, double h)
{
    finding worst = { 0.0, 0.0, 0 };
    for (int k = 1; k <= NB; ++k) {
        double velocity[3], square = 0.0;
        msfp_body_V_get(run->work.body[k], velocity);
        for (int i = 0; i < 3; ++i) {
            const double change = velocity[i] - run->guard.velocity[k - 1][i];
            square += change * change;
        }
        const double most = run->options.guard_inertia * run->work.contact[k - 1][MSFP_CONTACT_N];
        const double mass = run->parameters.body[k][MSFP_BODY_PARAMETERS_M], time = fmax(h, run->options.guard_time);
        if (mass * mass * square > most * most * time * time)
            consider(&worst, mass * sqrt(square) / time / run->work.contact[k - 1][MSFP_CONTACT_N], run->options.guard_inertia, k);
    }
    return worst;
}

/* A bound of the rise in temperature [K]: of all histories of flux with the same energy E and peak q, the hottest has
 * all of it at the end, at its peak: 2 sqrt(D/pi)/k q sqrt(E/q). */
static finding hot(const msfp_run *run, double h, double energy[NB], double peak[NB])
{
    finding worst = { 0.0, 0.0, 0 };
    for (int j = 0; j < NB; ++j) {
        double stored = 0.0, lost = 0.0;
        msfp_friction_power(run->parameters.surface[j], run->next.f[j], run->work.contact[j], &stored, &lost);
        const double flux = run->options.guard_heating[j] * lost;
        energy[j] = run->guard.energy[j] + h * flux;
        peak[j] = fmax(run->guard.peak[j], flux);
        consider(&worst, 2.0 * sqrt(peak[j] * energy[j]), run->options.guard_rise, j + 1);
    }
    return worst;
}

static void remember(msfp_run *run, const double energy[NB], const double peak[NB])
{
    memcpy(run->guard.energy, energy, sizeof run->guard.energy);
    memcpy(run->guard.peak, peak, sizeof run->guard.peak);
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->guard.velocity[k - 1]);
}

void msfp_guard_begin(msfp_run *run)
{
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->guard.velocity[k - 1]);
}

int msfp_guarded(msfp_run *run, const double *gaps)
{
    const msfp_options *o = &run->options;
    const double h = run->next.t - run->now.t;
    double energy[NB] = { 0 }, peak[NB] = { 0 };
    finding found[MSFP_GUARDS] = { { 0.0, 0.0, 0 } };
    if (!o->guards)
        return 0;
    if (o->guards & 1 << MSFP_GUARD_RIMS)
        found[MSFP_GUARD_RIMS] = beyond(gaps);
    if (o->guards & 1 << MSFP_GUARD_UPLIFT)
        found[MSFP_GUARD_UPLIFT] = unloaded(run);
    if (o->guards & 1 << MSFP_GUARD_INERTIA)
        found[MSFP_GUARD_INERTIA] = inertial(run, h);
    if (o->guards & 1 << MSFP_GUARD_HEAT)
        found[MSFP_GUARD_HEAT] = hot(run, h, energy, peak);
    int tripped = 0;
    for (int g = 0; g < MSFP_GUARDS; ++g) {
        if (!found[g].surface || run->guard.trips[g].surface)
            continue;
        run->guard.trips[g] = (msfp_trip){ o->guard_stop & 1 << g ? run->now.t : run->next.t, found[g].value, found[g].surface };
        tripped |= o->guard_stop & 1 << g;
    }
    if (tripped)
        return 1;
    remember(run, energy, peak);
    return 0;
}
