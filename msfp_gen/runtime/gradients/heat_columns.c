/* heat_columns.c: directional derivatives of the temperatures of the surfaces: the formulas of heat.c, differentiated. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS && MSFP_HEAT
static const double lambda[MSFP_HEAT] = MSFP_HEAT_RATES, weight[MSFP_HEAT] = MSFP_HEAT_WEIGHTS;

/* Columns of the rates of the parts of one surface. */
MSFP_INLINE void rates(const msfp_columns *heat, const msfp_columns flux, msfp_columns *out)
{
    for (int n = 0; n < MSFP_HEAT; ++n)
        for (int c = 0; c < C; ++c)
            out[n][c] = weight[n] * flux[c] - lambda[n] * heat[n][c];
}

void msfp_heat_columns_begin(const msfp_run *run, const msfp_group *group, msfp_heat_columns *s)
{
    msfp_heat_rates(&run->now.heat[0][0], run->now.flux, &s->rates[0][0][0]);
    for (int j = 0; j < NB; ++j)
        rates((const msfp_columns *)group->now.heat[j], group->now.flux[j], s->drates[0][j]);
}

void msfp_heat_columns_prepare(const msfp_run *run, const msfp_group *group, const double *weights, int i,
                               double h, msfp_heat_columns *s, msfp_point_columns *dat)
{
    const double beta = run->gradients->trail.stage[i].beta;
    memcpy(s->before, run->now.heat, sizeof s->before);
    memcpy(s->dbefore, group->now.heat, sizeof s->dbefore);
    memset(dat->rise, 0, sizeof dat->rise);
    memset(dat->warming, 0, sizeof dat->warming);
    for (int k = 0; k < i; ++k)
        for (int j = 0; j < NB; ++j)
            for (int n = 0; n < MSFP_HEAT; ++n) {
                s->before[j][n] += h * weights[k] * s->rates[k][j][n];
                for (int c = 0; c < C; ++c)
                    s->dbefore[j][n][c] +=
                        weights[k] * (h * s->drates[k][j][n][c] + group->h[c] * s->rates[k][j][n]);
            }
    for (int n = 0; n < MSFP_HEAT; ++n) {
        const double share = 1.0 / (1.0 + beta * lambda[n]);
        for (int c = 0; c < C; ++c)
            dat->warming[c] += weight[n] * share * share * dat->beta[c];
        for (int j = 0; j < NB; ++j)
            for (int c = 0; c < C; ++c)
                dat->rise[j][c] +=
                    share * (s->dbefore[j][n][c] - share * lambda[n] * s->before[j][n] * dat->beta[c]);
    }
}

void msfp_heat_columns_stage(const msfp_run *run, const msfp_group *group, int i, msfp_heat_columns *s)
{
    const msfp_trail *trail = &run->gradients->trail;
    const double beta = trail->stage[i].beta, *dbeta = group->point.beta;
    double heat[NB][MSFP_HEAT], flux[NB];
    for (int j = 0; j < NB; ++j) {
        flux[j] = trail->work[i].contact[j][MSFP_CONTACT_FLUX];
        for (int n = 0; n < MSFP_HEAT; ++n) {
            const double share = 1.0 / (1.0 + beta * lambda[n]), warmed = weight[n] * flux[j];
            heat[j][n] = share * (s->before[j][n] + beta * warmed);
            for (int c = 0; c < C; ++c)
                s->heat[j][n][c] = share * (s->dbefore[j][n][c] + beta * weight[n] * s->flux[j][c] +
                                            (warmed - lambda[n] * heat[j][n]) * dbeta[c]);
        }
        rates((const msfp_columns *)s->heat[j], s->flux[j], s->drates[i][j]);
    }
    msfp_heat_rates(&heat[0][0], flux, &s->rates[i][0][0]);
}

void msfp_heat_columns_point(const msfp_state_columns *ds, msfp_point_columns *dat)
{
    memset(dat->rise, 0, sizeof dat->rise);
    memset(dat->warming, 0, sizeof dat->warming);
    for (int j = 0; j < NB; ++j)
        for (int n = 0; n < MSFP_HEAT; ++n)
            for (int c = 0; c < C; ++c)
                dat->rise[j][c] += ds->heat[j][n][c];
}
#endif
