/* heat.c: temperature of the sliding surfaces by exponential states (docs/friction.md).
 *
 * The rise in temperature is a sum of parts, each with dheat/dt = -lambda heat + weight flux. The stage formula of the
 * method is linear in them and is solved for them: heat = (before + beta weight flux)/(1 + beta lambda). The sum of the
 * parts is rise + warming * flux.
 */
#include <math.h>
#include <string.h>
#include "equations.h"

#if MSFP_HEAT

static const double lambda[MSFP_HEAT] = MSFP_HEAT_RATES, weight[MSFP_HEAT] = MSFP_HEAT_WEIGHTS;

static void flux_of(const msfp_work *w, double flux[NB])
{
    for (int j = 0; j < NB; ++j)
        flux[j] = w->contact[j][MSFP_CONTACT_FLUX];
}

void msfp_heat_rates(const double *heat, const double flux[NB], double *rates)
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_HEAT; ++i)
            rates[j * MSFP_HEAT + i] = weight[i] * flux[j] - lambda[i] * heat[j * MSFP_HEAT + i];
}

/* Rise and warming of a stage: `before` is the sum over the earlier stages. */
static void stage_temperature(const double *before, double beta, msfp_point *at)
{
    at->warming = 0.0;
    for (int i = 0; i < MSFP_HEAT; ++i)
        at->warming += beta * weight[i] / (1.0 + beta * lambda[i]);
    for (int j = 0; j < NB; ++j) {
        at->rise[j] = 0.0;
        for (int i = 0; i < MSFP_HEAT; ++i)
            at->rise[j] += before[j * MSFP_HEAT + i] / (1.0 + beta * lambda[i]);
    }
}

void msfp_heat_point(const msfp_state *s, msfp_point *at) { stage_temperature(&s->heat[0][0], 0.0, at); }

void msfp_heat_initial_state(msfp_run *run) { flux_of(&run->work, run->now.flux); }

void msfp_heat_begin(msfp_run *run) { msfp_heat_rates(&run->now.heat[0][0], run->now.flux, &run->step.rates[0][0][0]); }

void msfp_heat_prepare(msfp_run *run, const double *weights, int i, double h, double beta, msfp_point *at)
{
    memcpy(run->step.before, run->now.heat, sizeof run->step.before);
    for (int k = 0; k < i; ++k)
        for (int j = 0; j < NB; ++j)
            for (int n = 0; n < MSFP_HEAT; ++n)
                run->step.before[j][n] += h * weights[k] * run->step.rates[k][j][n];
    stage_temperature(&run->step.before[0][0], beta, at);
}

void msfp_heat_stage(msfp_run *run, int i, double beta)
{
    double flux[NB];
    flux_of(&run->work, flux);
    for (int j = 0; j < NB; ++j)
        for (int n = 0; n < MSFP_HEAT; ++n)
            run->step.heat[j][n] = (run->step.before[j][n] + beta * weight[n] * flux[j]) / (1.0 + beta * lambda[n]);
    msfp_heat_rates(&run->step.heat[0][0], flux, &run->step.rates[i][0][0]);
}

void msfp_heat_node(const msfp_run *run, msfp_node *node) { memcpy(node->heat, run->step.heat, sizeof node->heat); }

void msfp_heat_finish(msfp_run *run)
{
    memcpy(run->next.heat, run->step.heat, sizeof run->next.heat);
    flux_of(&run->work, run->next.flux);
}

/* At rtol = 1e-3 the tolerance is a tenth of a degree and a hundredth of the rise. The error of a fast part is filtered
 * by (1 + beta lambda)^-1, as in implicit.c. */
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
