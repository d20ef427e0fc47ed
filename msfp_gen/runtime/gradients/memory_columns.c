/* memory_columns.c: directional derivatives of the memories of the surfaces: the formulas of memory.c, differentiated. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS && MSFP_MEMORY
static const double lambda[MSFP_MEMORY] = MSFP_MEMORY_RATES, weight[MSFP_MEMORY] = MSFP_MEMORY_WEIGHTS;

/* Those of the parts are linear in them (memory.c); beta adds its own where the length of the step has columns. */
void msfp_memory_point_columns(const msfp_state *from, const msfp_state_columns *dfrom, double beta,
                               msfp_point_columns *dat)
{
    memset(dat->gain, 0, sizeof dat->gain);
    for (int j = 0; j < NB; ++j)
        msfp_memory_past(dfrom->memory[j][0], beta, C, dat->past[j]);
    for (int n = 0; n < MSFP_MEMORY; ++n) {
        const double share = 1.0 / (1.0 + beta * lambda[n]);
        for (int c = 0; c < C; ++c) {
            dat->gain[c] += weight[n] * share * share * dat->beta[c];
            for (int j = 0; j < NB; ++j)
                dat->past[j][c] -= share * share * lambda[n] * from->memory[j][n] * dat->beta[c];
        }
    }
}

void msfp_memory_state_columns(const msfp_state *s, const msfp_state_columns *dfrom, const msfp_columns source[NB],
                               double beta, const double *dbeta, msfp_state_columns *ds)
{
    for (int j = 0; j < NB; ++j) {
        msfp_memory_stage(dfrom->memory[j][0], source[j], beta, C, ds->memory[j][0], ds->dmemory[j][0]);
        for (int n = 0; n < MSFP_MEMORY; ++n)
            for (int c = 0; c < C; ++c) {
                const double moved = s->dmemory[j][n] / (1.0 + beta * lambda[n]) * dbeta[c];
                ds->memory[j][n][c] += moved;
                ds->dmemory[j][n][c] -= lambda[n] * moved;
            }
    }
}
#endif
