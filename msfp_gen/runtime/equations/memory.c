/* memory.c: what a sliding surface remembers, such as its temperature, by exponential states (docs/friction.md).
 *
 * It is a sum of parts above its start. The programs memory_past, memory_gain and memory_stage of generator/laws.py are
 * the stage formula of one part: the sum of all parts is past + gain * source.
 */
#include <math.h>
#include "equations.h"

#if MSFP_MEMORY
#include "msfp_kernels.h"

static const double part[MSFP_MEMORY][MSFP_MEMORY_PART_SIZE] = MSFP_MEMORY_PARTS;

void msfp_memory_point(const msfp_parameters *p, const msfp_state *from, double beta, msfp_point *at)
{
    double one;
    for (int j = 0; j < MSFP_GAINS; ++j) {
        at->gain[j] = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            msfp_memory_gain(part[i], p->surface[j], &beta, &one);
            at->gain[j] += one;
        }
    }
    for (int j = 0; j < NB; ++j) {
        at->past[j] = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            msfp_memory_past(part[i], p->surface[j], &beta, &from->memory[j][i], &one);
            at->past[j] += one;
        }
    }
}

void msfp_memory_state(const msfp_parameters *p, const msfp_work *w, const msfp_state *from, double beta, msfp_state *s)
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            double end[MSFP_MEMORY_END_SIZE];
            msfp_memory_stage(part[i], p->surface[j], &beta, &from->memory[j][i], w->contact[j], end);
            s->memory[j][i] = end[MSFP_MEMORY_END_M];
            s->dmemory[j][i] = end[MSFP_MEMORY_END_D];
        }
}

/* At rtol = 1e-3 the tolerance is a hundredth of the scale (of a temperature a tenth of a degree) and a hundredth of the
 * memory. The error of a fast part is filtered as in implicit.c, by what a stage leaves of it. */
double msfp_memory_error(const msfp_run *run, const msfp_state *error, const msfp_state *s, double beta)
{
    double worst = 0.0;
    for (int j = 0; j < NB; ++j) {
        double sum = 0.0, whole = 0.0;
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            const double size = fabs(error->memory[j][i]);
            double left;
            msfp_memory_past(part[i], run->parameters.surface[j], &beta, &size, &left);
            sum += left;
            whole += s->memory[j][i];
        }
        worst = fmax(worst, sum / (run->options.rtol * (10.0 * MSFP_MEMORY_SCALE + 10.0 * fabs(whole))));
    }
    return worst;
}
#endif
