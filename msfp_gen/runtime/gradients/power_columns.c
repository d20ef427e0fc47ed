/* power_columns.c: directional derivatives of the powers whose integrals are the works of the energy balance
 * (observe.c), from those of their programs. Where a damper or a contact switches they are those of the branch taken.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

MSFP_STATIC_ASSERT(!MSFP_UPLIFT, gradients_of_powers); /* ModelSpec refuses it */

MSFP_COLUMNWISE void msfp_base_motion_columns(const msfp_point_columns *dat, double *dbase)
{
    static const int first[3] = { MSFP_BASE_MOTION_OX, MSFP_BASE_MOTION_UX, MSFP_BASE_MOTION_BX };
    for (int order = 0; order < 3; ++order)
        msfp_put_polar(dbase + first[order] * C, dat->base[order]);
}

MSFP_COLUMNWISE void msfp_rim_energy_columns(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                             const msfp_work *w, const msfp_work_columns *d, int j, double *energy)
{
    memset(energy, 0, MSFP_RIM_ENERGY_SIZE * C * sizeof *energy);
#if MSFP_RIMS
    double rim[MSFP_CLOSED_RIM_SIZE], drim[MSFP_CLOSED_RIM_SIZE * C], own[MSFP_RIM_SIZE * C];
    if (w->rim_gap[j] >= 0.0)
        return;
    const double *all = d->rim[j];
    if (!w->rim_active[j]) {
        msfp_rim_columns(p, dp, w, j, d, own);
        all = own;
    }
    memcpy(drim + MSFP_CLOSED_RIM_G * C, all + MSFP_RIM_G * C, C * sizeof *drim);
    memcpy(drim + MSFP_CLOSED_RIM_DG * C, all + MSFP_RIM_DG * C, C * sizeof *drim);
    msfp_closed_rim(w, j, rim);
    msfp_rim_energy_direction(p->surface[j], rim, dp->surface[j], drim, energy);
#else
    (void)p;
    (void)dp;
    (void)w;
    (void)d;
    (void)j;
#endif
}

MSFP_COLUMNWISE void msfp_columns_of_powers(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                            const msfp_point *at, const msfp_point_columns *dat, const msfp_work *w,
                                            const msfp_work_columns *d, msfp_power_columns *power)
{
    double base[MSFP_BASE_MOTION_SIZE], dbase[MSFP_BASE_MOTION_SIZE * C], force[FORCE], moment[MOMENT];
    double dforce[FORCE * C], dmoment[MOMENT * C], friction[MSFP_FRICTION_POWER_SIZE * C],
        rim[MSFP_RIM_ENERGY_SIZE * C];
    msfp_columns mechanical[MSFP_ENERGY_SIZE], top[MSFP_TOP_POWER_SIZE], one;
    double *input = power->of[MSFP_WORK_INPUT];
    memset(power, 0, sizeof *power);
    msfp_base_motion(at, base);
    msfp_base_motion_columns(dat, dbase);
    msfp_force_F_put(force, at->load);
    msfp_moment_M_put(moment, at->load + 3);
    msfp_put_polar(dforce, dat->load);
    msfp_put_axial(dmoment, dat->load + 3);
    msfp_mechanical_columns(p, dp, at, dat, w, d, mechanical);
#if MSFP_TOP_ROTATION
    double upright[MSFP_UPRIGHT_SIZE], dupright[MSFP_UPRIGHT_SIZE * C];
    msfp_support_axis(at, upright);
    msfp_support_columns(at, dat, dupright);
#endif
    msfp_top_power_direction(p->top, w->body[NB], w->foot MSFP_IF_TOP_ROTATION(upright), w->x[NB], base, force, moment,
                             dp->top, d->body[NB], d->foot MSFP_IF_TOP_ROTATION(dupright), d->x[NB], dbase, dforce,
                             dmoment, top[0]);
    msfp_base_power_direction(w->body[0], base, w->force[0], w->moment[0], d->body[0], dbase, d->force[0], d->moment[0],
                              one);
    memcpy(power->load, top[MSFP_TOP_POWER_LOAD], sizeof power->load);
    memcpy(power->of[MSFP_WORK_TOP_DISSIPATED], top[MSFP_TOP_POWER_DAMPED], sizeof one);
    for (int c = 0; c < C; ++c) {
        power->prescribed[c] = top[MSFP_TOP_POWER_PRESCRIBED][c] + one[c];
        input[c] = mechanical[MSFP_ENERGY_POWER][c] + power->load[c] + top[MSFP_TOP_POWER_SUPPORT][c] +
                   power->prescribed[c];
    }
    for (int j = 0; j < NB; ++j) {
        msfp_lock_power_direction(w->body[j + 1], &w->lock[j], d->body[j + 1], d->lock[j], one);
        msfp_friction_power_direction(p->surface[j], w->contact[j], dp->surface[j], d->contact[j], friction);
        msfp_rim_energy_columns(p, dp, w, d, j, rim);
        for (int c = 0; c < C; ++c) {
            input[c] += one[c];
            power->of[MSFP_WORK_FRICTION_STORED][c] += friction[MSFP_FRICTION_POWER_STORED * C + c];
            power->of[MSFP_WORK_FRICTION_DISSIPATED][c] += friction[MSFP_FRICTION_POWER_LOST * C + c];
            power->of[MSFP_WORK_CONTACT_DISSIPATED][c] += friction[MSFP_FRICTION_POWER_DAMPED * C + c];
            power->of[MSFP_WORK_RIM_DISSIPATED][c] += rim[MSFP_RIM_ENERGY_LOST * C + c];
        }
    }
}
#endif
