/* events.c: rim contact and release, lift-off and landing, the stop displacement. */
#include <float.h>
#include <math.h>
#include "run.h"

enum { STOP = NB, FIRST_CONTACT = NB + 1 }; /* event functions: gaps, stop displacement, compressions */

/* Size below which event function i counts as zero [m]. */
static double event_tolerance(const msfp_run *run, int i)
{
    if (i >= FIRST_CONTACT)
        return 0.1 * msfp_absolute_tolerance(run, i - FIRST_CONTACT, 3);
    return 1e-6 * (i < NB ? run->parameters.surface[i][MSFP_SURFACE_PARAMETERS_SC] : run->options.stop_displacement);
}

void msfp_event_values(msfp_run *run, const msfp_state *s, double *g)
{
    double u[3], sliding[NB][MSFP_GAP_SIZE];
    msfp_row row;
    int near = 0;
    for (int j = 0; j < NB; ++j) { /* cos x > 1 - x^2/2: a lower bound of a wide gap without an arc tangent */
        const double tilt = s->q[j][0] * s->q[j][0] + s->q[j][1] * s->q[j][1];
        g[j] = (1.0 - 0.5 * tilt - run->parameters.rim_cosine[j]) * run->parameters.rim_slope[j];
        near |= g[j] <= event_tolerance(run, j);
    }
    if (near)
        msfp_gaps(&run->parameters, s->q, sliding);
    for (int j = 0; j < NB && near; ++j)
        g[j] = g[j] <= event_tolerance(run, j) ? sliding[j][MSFP_GAP_G] : g[j];
    g[STOP] = 1.0;
    if (run->options.stop_displacement > 0.0) {
        msfp_observe_state(run, s, &row);
        msfp_displacement_across(run, &row, u);
        g[STOP] = run->options.stop_displacement - sqrt(u[0] * u[0] + u[1] * u[1]);
    }
#if MSFP_UPLIFT
    msfp_observe_state(run, s, &row);
    for (int j = 0; j < NB; ++j) {
        g[j] = row.gap[j];
        g[FIRST_CONTACT + j] = row.compression[j];
    }
#endif
}

double msfp_first_event(msfp_run *run, const double *before, const double *after)
{
    double first = 1.0, g[MSFP_EVENTS];
    for (int i = 0; i < MSFP_EVENTS; ++i) {
        const double tolerance = event_tolerance(run, i);
        /* A stiff rim holds the gap within the tolerance, at the end of a long quasi-static step too; the step to the
         * contact must end before it, where rates are still those of the approach. */
        const double passed = i < NB && msfp_is_quasistatic(run) ? 0.0 : tolerance;
        const int falls = before[i] > tolerance && after[i] < -passed;
        const int rises = i != STOP && before[i] < -tolerance && after[i] > tolerance;
        if (!(falls || rises) || (i < NB && !MSFP_RIMS))
            continue;
        double low = 0.0, high = 1.0;
        for (int n = 0; n < 40; ++n) {
            msfp_state s;
            const double middle = 0.5 * (low + high);
            msfp_interpolate(run, middle, &s);
            msfp_event_values(run, &s, g);
            *((g[i] > 0.0) == falls ? &low : &high) = middle;
        }
        first = fmin(first, high);
    }
    return first;
}

static int all_rims_in_contact(const double *g)
{
    for (int j = 0; j < NB; ++j)
        if (g[j] > 0.0)
            return 0;
    return 1;
}

/* Whether rim j is in contact at the end of the step. located: whether the step was shortened to an event; it may then
 * end shortly before the gap changes its sign. Such a gap is stored as +-DBL_MIN with the sign of the new state, which
 * then lasts until the gap leaves the tolerance on the other side: the event is recorded once. */
static int in_contact(const msfp_run *run, int j, double before, double after, int located)
{
    const double tolerance = event_tolerance(run, j);
    if (before <= 0.0) {
        const int released = after > 0.0 && before < -DBL_MIN;
        return !(after > tolerance || released || (located && before < -tolerance && after >= -tolerance));
    }
    const int met = after <= 0.0 && before > DBL_MIN;
    return after < -tolerance || met || (located && before > tolerance && after <= tolerance);
}

int msfp_record_events(msfp_run *run, const double *before, double *after, int located)
{
    int stop = 0, rims = 0;
    for (int j = 0; j < NB && MSFP_RIMS; ++j) {
        const int contact = in_contact(run, j, before[j], after[j], located);
        if (contact != (before[j] <= 0.0)) {
            msfp_write_event(run, &run->next, j + 1, contact ? MSFP_EVENT_RIM_CONTACT : MSFP_EVENT_RIM_RELEASE);
            rims = 1;
        }
        after[j] = contact ? fmin(after[j], -DBL_MIN) : fmax(after[j], DBL_MIN);
    }
    if (rims)
        msfp_quasistatic_restart(run);
    for (int j = 0, i = FIRST_CONTACT; i < MSFP_EVENTS; ++i, ++j)
        if ((before[i] > 0.0) != (after[i] > 0.0))
            msfp_write_event(run, &run->next, j + 1, after[i] > 0.0 ? MSFP_EVENT_LANDING : MSFP_EVENT_LIFT_OFF);
    if (after[STOP] <= event_tolerance(run, STOP) || (run->options.stop_all_rims && all_rims_in_contact(after))) {
        msfp_write_event(run, &run->next, 0, MSFP_EVENT_STOP);
        stop = 1;
    }
    return stop;
}
