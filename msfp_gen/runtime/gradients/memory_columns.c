/* memory_columns.c: directional derivatives of the memories of the surfaces, part by part as in memory.c. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS && MSFP_MEMORY
#include "msfp_gradient_kernels.h"

static const double part[MSFP_MEMORY][MSFP_MEMORY_PART_SIZE] = MSFP_MEMORY_PARTS, fixed[MSFP_MEMORY_PART_SIZE * C];

void msfp_memory_point_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_state *from,
                               const msfp_state_columns *dfrom, double beta, msfp_point_columns *dat)
{
    msfp_columns one[1];
    memset(dat->gain, 0, sizeof dat->gain);
    memset(dat->past, 0, sizeof dat->past);
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            msfp_memory_past_direction(part[i], p->surface[j], &beta, &from->memory[j][i], fixed, dp->surface[j], dat->beta,
                                       dfrom->memory[j][i], one[0]);
            msfp_add_columns(&dat->past[j], (const msfp_columns *)one, 1.0, 1);
        }
    for (int j = 0; j < MSFP_GAINS; ++j)
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            msfp_memory_gain_direction(part[i], p->surface[j], &beta, fixed, dp->surface[j], dat->beta, one[0]);
            msfp_add_columns(&dat->gain[j], (const msfp_columns *)one, 1.0, 1);
        }
}

void msfp_memory_state_columns(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                               const msfp_work_columns *d, const msfp_state *from, const msfp_state_columns *dfrom,
                               double beta, const double *dbeta, msfp_state_columns *ds)
{
    for (int j = 0; j < NB; ++j)
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            double end[MSFP_MEMORY_END_SIZE * C];
            msfp_memory_stage_direction(part[i], p->surface[j], &beta, &from->memory[j][i], w->contact[j], fixed,
                                        dp->surface[j], dbeta, dfrom->memory[j][i], d->contact[j], end);
            memcpy(ds->memory[j][i], end + MSFP_MEMORY_END_M * C, sizeof ds->memory[j][i]);
            memcpy(ds->dmemory[j][i], end + MSFP_MEMORY_END_D * C, sizeof ds->dmemory[j][i]);
        }
}
#endif
