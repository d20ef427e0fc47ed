/* heat.c: temperature of the sliding surfaces by exponential states (docs/friction.md).
 *
 * The rise in temperature is a sum of parts, each with dheat/dt = -lambda heat + weight flux. The stage formula of the
 * method is linear in them and is solved for them: heat = (from + beta weight flux)/(1 + beta lambda). The sum of the
 * parts is rise + warming * flux.
 */
#include <math.h>
#include "equations.h"

#if MSFP_HEAT

static const double lambda[MSFP_HEAT] = MSFP_HEAT_RATES, weight[MSFP_HEAT] = MSFP_HEAT_WEIGHTS;

void msfp_heat_point(const msfp_state *from, double beta, msfp_point *at)
{
    at->warming = 0.0;
    for (int i = 0; i < MSFP_HEAT; ++i)
        at->warming += beta * weight[i] / (1.0 + beta * lambda[i]);
    for (int j = 0; j < NB; ++j) {
        at->rise[j] = 0.0;
        for (int i = 0; i < MSFP_HEAT; ++i)
            at->rise[j] += from->heat[j][i] / (1.0 + beta * lambda[i]);
    }
}

void msfp_heat_state(const msfp_work *w, const msfp_state *from, double beta, msfp_state *s)
{
    for (int j = 0; j < NB; ++j) {
        const double flux = w->contact[j][MSFP_CONTACT_FLUX];
        for (int i = 0; i < MSFP_HEAT; ++i) {
            s->heat[j][i] = (from->heat[j][i] + beta * weight[i] * flux) / (1.0 + beta * lambda[i]);
            s->dheat[j][i] = weight[i] * flux - lambda[i] * s->heat[j][i];
        }
    }
}

/* At rtol = 1e-3 the tolerance is a tenth of a degree and a hundredth of the rise. The error of a fast part is filtered
 * by (1 + beta lambda)^-1, as in implicit.c. */
double msfp_heat_error(const msfp_run *run, const msfp_state *error, const msfp_state *s, double beta)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        double sum = 0.0, rise = 0.0;
        for (int i = 0; i < MSFP_HEAT; ++i) {
            sum += fabs(error->heat[j][i]) / (1.0 + beta * lambda[i]);
            rise += s->heat[j][i];
        }
        worst = fmax(worst, sum / (run->options.rtol * (100.0 + 10.0 * fabs(rise))));
    }
    return worst;
}
#endif
