/* memory.c: what a sliding surface remembers, such as its temperature, by exponential states (docs/friction.md).
 *
 * It is a sum of parts above its start, each with dmemory/dt = -lambda memory + weight source. The stage formula of the
 * method is linear in them and is solved for them: memory = (from + beta weight source)/(1 + beta lambda). The sum of the
 * parts is past + gain * source.
 */
#include <math.h>
#include "equations.h"

#if MSFP_MEMORY

static const double lambda[MSFP_MEMORY] = MSFP_MEMORY_RATES, weight[MSFP_MEMORY] = MSFP_MEMORY_WEIGHTS;

void msfp_memory_point(const msfp_state *from, double beta, msfp_point *at)
{
    at->gain = 0.0;
    for (int i = 0; i < MSFP_MEMORY; ++i)
        at->gain += beta * weight[i] / (1.0 + beta * lambda[i]);
    for (int j = 0; j < NB; ++j) {
        at->past[j] = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i)
            at->past[j] += from->memory[j][i] / (1.0 + beta * lambda[i]);
    }
}

void msfp_memory_state(const msfp_work *w, const msfp_state *from, double beta, msfp_state *s)
{
    for (int j = 0; j < NB; ++j) {
        const double source = w->contact[j][MSFP_CONTACT_SOURCE];
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            s->memory[j][i] = (from->memory[j][i] + beta * weight[i] * source) / (1.0 + beta * lambda[i]);
            s->dmemory[j][i] = weight[i] * source - lambda[i] * s->memory[j][i];
        }
    }
}

/* At rtol = 1e-3 the tolerance is a hundredth of the scale (of a temperature a tenth of a degree) and a hundredth of the
 * memory. The error of a fast part is filtered by (1 + beta lambda)^-1, as in implicit.c. */
double msfp_memory_error(const msfp_run *run, const msfp_state *error, const msfp_state *s, double beta)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        double sum = 0.0, whole = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            sum += fabs(error->memory[j][i]) / (1.0 + beta * lambda[i]);
            whole += s->memory[j][i];
        }
        worst = fmax(worst, sum / (run->options.rtol * (10.0 * MSFP_MEMORY_SCALE + 10.0 * fabs(whole))));
    }
    return worst;
}
#endif
