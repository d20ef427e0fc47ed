/* monitors.c: checks of what a model leaves out (docs/effects.md): rims, uplift, the face of a slider, inertia of the
 * sliders, heat, and the range of the friction law; and whether the model is valid at a state at all.
 *
 * A monitor checks every step before it is accepted. It records the first time at which its limit is exceeded, and the
 * value furthest beyond it with its time. Where the run is to stop, that step is not accepted, and the present state is
 * the last one for which the model is valid.
 */
#include <math.h>
#include <string.h>
#include "run.h"

static const double lambda[MSFP_HEAT_STATES] = MSFP_HEAT_RATES, weight[MSFP_HEAT_STATES] = MSFP_HEAT_WEIGHTS;

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
        msfp_contact_frame_p_get(w->contact_frame[j], p);
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
            return MSFP_E_SEPARATED;
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

/* The largest excess of a quantity over its limit: its share of the limit, or the distance from a range; its value; its
 * surface counted from 1 (0: none). */
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
            worst = (finding){ 2.0 - normal / least, normal, j + 1 };
    }
    for (int j = 0; j < NB && !worst.surface; ++j)
        consider(&worst, run->work.contact[j][MSFP_CONTACT_N], most, j + 1);
    return worst;
}

/* Distance of a contact point (3.14) from the axis of its slider, beyond the radius of the face [m]: there the slider
 * tips. Surfaces below the least normal force do not count; without a radius no face is known. */
static finding outside_face(const msfp_run *run)
{
    finding worst = { 0.0, 0.0, 0 };
    for (int j = 0; j < NB; ++j) {
        const double *par = run->parameters.surface[j], *contact = run->work.contact[j], *q = run->next.q[j];
        const double sp = msfp_contact_sp(contact), cp = msfp_contact_cp(contact), st = contact[MSFP_CONTACT_ST],
                     ct = contact[MSFP_CONTACT_CT];
        const double normal[3] = { st, -ct * sp, ct * cp }; /* t~_3 (3.13), in the basis of the body below */
        double axis[3] = { 0.0, 0.0, 1.0 }, across[3];
        if (par[MSFP_SURFACE_PARAMETERS_SIGN] > 0.0) { /* the slider is the body above */
            axis[0] = msfp_sin(q[1]);
            axis[1] = -msfp_cos(q[1]) * msfp_sin(q[0]);
            axis[2] = msfp_cos(q[1]) * msfp_cos(q[0]);
        }
        for (int i = 0; i < 3; ++i)
            across[i] = normal[(i + 1) % 3] * axis[(i + 2) % 3] - normal[(i + 2) % 3] * axis[(i + 1) % 3];
        const double aside =
            par[MSFP_SURFACE_PARAMETERS_R] * msfp_hypot(across[0], msfp_hypot(across[1], across[2]));
        if (contact[MSFP_CONTACT_N] > run->options.monitor_normal)
            consider(&worst, aside, par[MSFP_SURFACE_PARAMETERS_RS], j + 1);
    }
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

/* Heat flux of every surface times sqrt(D/pi)/k [K/s^1/2], where the contact covers the centre of the surface. */
static void heat_flux(const msfp_run *run, const msfp_state *s, double flux[NB])
{
    for (int j = 0; j < NB; ++j) {
        const double *par = run->parameters.surface[j], reach = run->options.monitor_reach[j],
                     slid = par[MSFP_SURFACE_PARAMETERS_R] * msfp_hypot(s->q[j][0], s->q[j][1]);
        const double heating = reach > 0.0 && slid > reach ? 0.0 : run->options.monitor_heating[j];
        flux[j] = heating > 0.0 ? heating * msfp_heating(&run->parameters, &run->work, j) : 0.0;
    }
}

/* Rise in temperature [K] by the states of memory.c, over a step of the mean flux; exp(-z) is taken as
 * 1/(1 + z + z^2/2). */
static finding hot(const msfp_run *run, double h, double heat[NB][MSFP_HEAT_STATES], double flux[NB])
{
    double decay[MSFP_HEAT_STATES], gain[MSFP_HEAT_STATES];
    finding worst = { 0.0, 0.0, 0 };
    for (int i = 0; i < MSFP_HEAT_STATES; ++i) {
        const double z = h * lambda[i];
        decay[i] = 1.0 / (1.0 + z + 0.5 * z * z);
        gain[i] = h * (1.0 + 0.5 * z) * decay[i] * weight[i];
    }
    heat_flux(run, &run->next, flux);
    for (int j = 0; j < NB; ++j) {
        const double mean = 0.5 * (run->monitor.flux[j] + flux[j]);
        double rise = 0.0;
        for (int i = 0; i < MSFP_HEAT_STATES; ++i)
            rise += heat[j][i] = decay[i] * run->monitor.heat[j][i] + gain[i] * mean;
        consider(&worst, rise, run->options.monitor_rise, j + 1);
    }
    return worst;
}

#if MSFP_LAW
/* A value outside the range in which the friction law was checked. */
static void outside(finding *worst, double value, const double range[2], int surface)
{
    const double beyond = fmax(range[0] - value, value - range[1]);
    if (beyond > fmax(worst->share, 0.0))
        *worst = (finding){ beyond, value, surface };
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
            outside(&found[MSFP_MONITOR_LAW_TEMPERATURE], contact[MSFP_CONTACT_MEMORY], o->law_temperature, j + 1);
#endif
    }
}
#endif

static void record(msfp_run *run, int monitor, const finding *found, double time)
{
    msfp_trip *trip = &run->monitor.trips[monitor];
    if (trip->surface && !(found->share > run->monitor.shares[monitor]))
        return;
    *trip = (msfp_trip){ trip->surface ? trip->time : time, found->value, time, found->surface };
    run->monitor.shares[monitor] = found->share;
}

void msfp_monitor_begin(msfp_run *run)
{
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->monitor.velocity[k - 1]);
    heat_flux(run, &run->now, run->monitor.flux);
}

int msfp_monitor_step(msfp_run *run, const double *gaps)
{
    const msfp_options *o = &run->options;
    const double h = run->next.t - run->now.t;
    double heat[NB][MSFP_HEAT_STATES], flux[NB];
    finding found[MSFP_MONITORS] = { { 0.0, 0.0, 0 } };
    if (!o->monitors)
        return 0;
    if (o->monitors & 1 << MSFP_MONITOR_RIMS)
        found[MSFP_MONITOR_RIMS] = beyond_capacity(gaps);
    if (o->monitors & 1 << MSFP_MONITOR_UPLIFT)
        found[MSFP_MONITOR_UPLIFT] = unloaded(run);
    if (o->monitors & 1 << MSFP_MONITOR_FOOTPRINT)
        found[MSFP_MONITOR_FOOTPRINT] = outside_face(run);
    if (o->monitors & 1 << MSFP_MONITOR_INERTIA)
        found[MSFP_MONITOR_INERTIA] = inertial(run, h);
    if (o->monitors & 1 << MSFP_MONITOR_HEAT)
        found[MSFP_MONITOR_HEAT] = hot(run, h, heat, flux);
#if MSFP_LAW
    outside_law(run, found);
#endif
    int tripped = 0; /* monitors that stop the run now: the step is not accepted, so that others record nothing */
    for (int g = 0; g < MSFP_MONITORS; ++g)
        if (found[g].surface && !run->monitor.trips[g].surface)
            tripped |= o->monitor_stop & 1 << g;
    for (int g = 0; g < MSFP_MONITORS; ++g)
        if (found[g].surface && (!tripped || tripped & 1 << g))
            record(run, g, &found[g], tripped ? run->now.t : run->next.t);
    if (tripped)
        return 1;
    if (o->monitors & 1 << MSFP_MONITOR_HEAT) {
        memcpy(run->monitor.heat, heat, sizeof heat);
        memcpy(run->monitor.flux, flux, sizeof flux);
    }
    for (int k = 1; k <= NB; ++k)
        msfp_body_V_get(run->work.body[k], run->monitor.velocity[k - 1]);
    return 0;
}
