/* memory.c: what a sliding surface remembers, such as its temperature, by exponential states (docs/friction.md).
 *
 * It is a sum of parts above its start, each with dmemory/dt = -lambda memory + weight source. The stage formula of the
 * method is linear in them and is solved for them: memory = (from + beta weight source)/(1 + beta lambda). The sum of the
 * parts is past + gain * source. Where surfaces have a pace, it multiplies lambda.
 */
#include <math.h>
#include "equations.h"

#if MSFP_MEMORY

static const double lambda[MSFP_MEMORY] = MSFP_MEMORY_RATES, weight[MSFP_MEMORY] = MSFP_MEMORY_WEIGHTS;

void msfp_memory_past(const double *parts, double beta, int width, double *past MSFP_IF_PACED(double pace))
{
    for (int c = 0; c < width; ++c)
        past[c] = 0.0;
    for (int i = 0; i < MSFP_MEMORY; ++i)
        for (int c = 0; c < width; ++c)
            past[c] += parts[i * width + c] / (1.0 + beta * MSFP_RATE(pace, lambda[i]));
}

void msfp_memory_stage(const double *from, const double *source, double beta, int width, double *parts,
                       double *rates MSFP_IF_PACED(double pace))
{
    for (int i = 0; i < MSFP_MEMORY; ++i)
        for (int c = 0; c < width; ++c) {
            const int at = i * width + c;
            parts[at] = (from[at] + beta * weight[i] * source[c]) / (1.0 + beta * MSFP_RATE(pace, lambda[i]));
            rates[at] = weight[i] * source[c] - MSFP_RATE(pace, lambda[i]) * parts[at];
        }
}

void msfp_memory_point(const msfp_state *from, double beta, msfp_point *at MSFP_IF_PACED(const msfp_parameters *p))
{
    for (int j = 0; j < MSFP_GAINS; ++j) {
        at->gain[j] = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i)
            at->gain[j] += beta * weight[i] / (1.0 + beta * MSFP_RATE(p->surface[j][MSFP_PACE], lambda[i]));
    }
    for (int j = 0; j < NB; ++j)
        msfp_memory_past(from->memory[j], beta, 1, &at->past[j] MSFP_IF_PACED(p->surface[j][MSFP_PACE]));
}

void msfp_memory_state(const msfp_work *w, const msfp_state *from, double beta,
                       msfp_state *s MSFP_IF_PACED(const msfp_parameters *p))
{
    for (int j = 0; j < NB; ++j)
        msfp_memory_stage(from->memory[j], &w->contact[j][MSFP_CONTACT_SOURCE], beta, 1, s->memory[j],
                          s->dmemory[j] MSFP_IF_PACED(p->surface[j][MSFP_PACE]));
}

/* At rtol = 1e-3 the tolerance is a hundredth of the scale (of a temperature a tenth of a degree) and a hundredth of the
 * memory. The error of a fast part is filtered by (1 + beta lambda)^-1, as in implicit.c. */
double msfp_memory_error(const msfp_run *run, const msfp_state *error, const msfp_state *s, double beta)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        double sum = 0.0, whole = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            sum += fabs(error->memory[j][i]) /
                   (1.0 + beta * MSFP_RATE(run->parameters.surface[j][MSFP_PACE], lambda[i]));
            whole += s->memory[j][i];
        }
        worst = fmax(worst, sum / (run->options.rtol * (10.0 * MSFP_MEMORY_SCALE + 10.0 * fabs(whole))));
    }
    return worst;
}
#endif
