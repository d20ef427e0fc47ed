/* heat.c: temperature of the sliding surfaces by exponential states (docs/friction.md).
 *
 * The rise in temperature is a sum of parts, dheat/dt = -lambda heat + w flux each. They follow the formula of the
 * method's stage, which is linear in them and so eliminated: heat = (before + beta w flux)/(1 + beta lambda). What a
 * contact sees of that is rise + warming * flux.
 */
#include <math.h>
#include <string.h>
#include "heat.h"

#if MSFP_HEAT
#define NB MSFP_NB

static const double lambda[MSFP_HEAT] = MSFP_HEAT_RATES, weight[MSFP_HEAT] = MSFP_HEAT_WEIGHTS;

static void flux_of(const msfp_work *w, double flux[NB])
{
    for (int j = 0; j < NB; ++j)
        flux[j] = w->contact[j][MSFP_CONTACT_FLUX];
}

void msfp_heat_rates(const double heat[NB][MSFP_HEAT], const double flux[NB], double rates[NB][MSFP_HEAT])
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_HEAT; ++i)
            rates[j][i] = weight[i] * flux[j] - lambda[i] * heat[j][i];
}

/* What is seen of heat = before less its own flux, beta on the diagonal. */
static void seen(const double before[NB][MSFP_HEAT], double beta, msfp_point *at)
{
    at->warming = 0.0;
    for (int i = 0; i < MSFP_HEAT; ++i)
        at->warming += beta * weight[i] / (1.0 + beta * lambda[i]);
    for (int j = 0; j < NB; ++j) {
        at->rise[j] = 0.0;
        for (int i = 0; i < MSFP_HEAT; ++i)
            at->rise[j] += before[j][i] / (1.0 + beta * lambda[i]);
    }
}

void msfp_heat_point(const msfp_state *s, msfp_point *at) { seen(s->heat, 0.0, at); }

void msfp_heat_settle(msfp_run *run) { flux_of(&run->work, run->now.flux); }

void msfp_heat_begin(msfp_run *run) { msfp_heat_rates(run->now.heat, run->now.flux, run->step.rates[0]); }

void msfp_heat_prepare(msfp_run *run, const double *weights, int i, double h, double beta, msfp_point *at)
{
    memcpy(run->step.before, run->now.heat, sizeof run->step.before);
    for (int k = 0; k < i; ++k)
        for (int j = 0; j < NB; ++j)
            for (int n = 0; n < MSFP_HEAT; ++n)
                run->step.before[j][n] += h * weights[k] * run->step.rates[k][j][n];
    seen(run->step.before, beta, at);
}

void msfp_heat_stage(msfp_run *run, int i, double beta)
{
    double flux[NB];
    flux_of(&run->work, flux);
    for (int j = 0; j < NB; ++j)
        for (int n = 0; n < MSFP_HEAT; ++n)
            run->step.heat[j][n] = (run->step.before[j][n] + beta * weight[n] * flux[j]) / (1.0 + beta * lambda[n]);
    msfp_heat_rates(run->step.heat, flux, run->step.rates[i]);
}

void msfp_heat_middle(msfp_run *run, msfp_middle *m) { memcpy(m->heat, run->step.heat, sizeof m->heat); }

void msfp_heat_finish(msfp_run *run)
{
    memcpy(run->next.heat, run->step.heat, sizeof run->next.heat);
    flux_of(&run->work, run->next.flux);
}

/* A tenth of a degree and of the rise at rtol = 1e-3. An error of a fast part is filtered by (1 + beta lambda)^-1, as in
 * implicit.c. */
double msfp_heat_error(const msfp_run *run, const double *weights, int stages, double h, double beta)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        double error = 0.0, rise = 0.0;
        for (int n = 0; n < MSFP_HEAT; ++n) {
            double part = 0.0;
            for (int k = 0; k < stages; ++k)
                part += h * weights[k] * run->step.rates[k][j][n];
            error += fabs(part) / (1.0 + beta * lambda[n]);
            rise += run->step.heat[j][n];
        }
        worst = fmax(worst, error / (run->options.rtol * (100.0 + 10.0 * fabs(rise))));
    }
    return worst;
}
#endif
