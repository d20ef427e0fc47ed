/* memory_columns.c: directional derivatives of the memories of the surfaces: the formulas of memory.c, differentiated. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS && MSFP_MEMORY
static const double lambda[MSFP_MEMORY] = MSFP_MEMORY_RATES, weight[MSFP_MEMORY] = MSFP_MEMORY_WEIGHTS;

/* Those of the parts are linear in them (memory.c); beta adds its own where the length of the step has columns, and the
 * pace of a surface where a parameter moves it. */
void msfp_memory_point_columns(const msfp_state *from, const msfp_state_columns *dfrom, double beta,
                               msfp_point_columns *dat MSFP_IF_PACED(const msfp_parameters *p, const msfp_parameter_columns *dp))
{
    memset(dat->gain, 0, sizeof dat->gain);
    for (int j = 0; j < NB; ++j)
        msfp_memory_past(dfrom->memory[j][0], beta, C, dat->past[j] MSFP_IF_PACED(p->surface[j][MSFP_PACE]));
    for (int n = 0; n < MSFP_MEMORY; ++n)
        for (int j = 0; j < NB; ++j) {
            const double share = 1.0 / (1.0 + beta * MSFP_RATE(p->surface[j][MSFP_PACE], lambda[n]));
            for (int c = 0; c < C; ++c) {
                double of_beta = dat->beta[c], moved = dat->beta[c];
#if MSFP_PACED
                const double of_pace = dp->surface[j][MSFP_PACE * C + c];
                of_beta -= beta * beta * lambda[n] * of_pace;
                moved = p->surface[j][MSFP_PACE] * moved + beta * of_pace;
#endif
                if (j < MSFP_GAINS)
                    dat->gain[j][c] += weight[n] * share * share * of_beta;
                dat->past[j][c] -= share * share * lambda[n] * from->memory[j][n] * moved;
            }
        }
}

void msfp_memory_state_columns(const msfp_state *s, const msfp_state_columns *dfrom, const msfp_columns source[NB],
                               double beta, const double *dbeta,
                               msfp_state_columns *ds MSFP_IF_PACED(const msfp_parameters *p, const msfp_parameter_columns *dp))
{
    for (int j = 0; j < NB; ++j) {
        msfp_memory_stage(dfrom->memory[j][0], source[j], beta, C, ds->memory[j][0],
                          ds->dmemory[j][0] MSFP_IF_PACED(p->surface[j][MSFP_PACE]));
        for (int n = 0; n < MSFP_MEMORY; ++n) {
            const double rate = MSFP_RATE(p->surface[j][MSFP_PACE], lambda[n]);
            for (int c = 0; c < C; ++c) {
                double moved = s->dmemory[j][n] / (1.0 + beta * rate) * dbeta[c];
#if MSFP_PACED
                const double of_pace = lambda[n] * s->memory[j][n] * dp->surface[j][MSFP_PACE * C + c];
                moved -= beta / (1.0 + beta * rate) * of_pace;
                ds->dmemory[j][n][c] -= of_pace;
#endif
                ds->memory[j][n][c] += moved;
                ds->dmemory[j][n][c] -= rate * moved;
            }
        }
    }
}
#endif
