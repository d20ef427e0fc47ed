/* heat_columns.c: directional derivatives of the temperatures of the surfaces: the formulas of heat.c, differentiated. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS && MSFP_HEAT
static const double lambda[MSFP_HEAT] = MSFP_HEAT_RATES, weight[MSFP_HEAT] = MSFP_HEAT_WEIGHTS;

void msfp_heat_point_columns(const msfp_state *from, const msfp_state_columns *dfrom, double beta,
                             msfp_point_columns *dat)
{
    memset(dat->rise, 0, sizeof dat->rise);
    memset(dat->warming, 0, sizeof dat->warming);
    for (int n = 0; n < MSFP_HEAT; ++n) {
        const double share = 1.0 / (1.0 + beta * lambda[n]);
        for (int c = 0; c < C; ++c)
            dat->warming[c] += weight[n] * share * share * dat->beta[c];
        for (int j = 0; j < NB; ++j)
            for (int c = 0; c < C; ++c)
                dat->rise[j][c] +=
                    share * (dfrom->heat[j][n][c] - share * lambda[n] * from->heat[j][n] * dat->beta[c]);
    }
}

void msfp_heat_state_columns(const msfp_state *s, const msfp_state_columns *dfrom, const msfp_columns flux[NB],
                             double beta, const double *dbeta, msfp_state_columns *ds)
{
    for (int j = 0; j < NB; ++j)
        for (int n = 0; n < MSFP_HEAT; ++n) {
            const double share = 1.0 / (1.0 + beta * lambda[n]);
            for (int c = 0; c < C; ++c) {
                ds->heat[j][n][c] = share * (dfrom->heat[j][n][c] + beta * weight[n] * flux[j][c] +
                                             s->dheat[j][n] * dbeta[c]);
                ds->dheat[j][n][c] = weight[n] * flux[j][c] - lambda[n] * ds->heat[j][n][c];
            }
        }
}
#endif
