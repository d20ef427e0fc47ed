/* initial_columns.c: derivatives of base motion, load and initial state. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
#include "msfp_gradient_kernels.h"

/* Third derivative of a history at its last search. */
MSFP_INLINE void third_derivative(const msfp_history *h, double t, double out[6])
{
    const double s = t - h->knots[h->last];
    memset(out, 0, 6 * sizeof *out);
    for (int k = h->degree; k >= 3; --k) {
        const double factor = (double)(k * (k - 1) * (k - 2));
        for (int i = 0; i < 6; ++i)
            out[i] = out[i] * s + factor * h->powers[k][i];
    }
}

MSFP_WIDE void msfp_inputs_columns(msfp_run *run, msfp_parameter_batch *batch, double t, const double *dt,
                                   msfp_point_columns *dat)
{
    double found[3][6], third[6];
    if (run->next_jump < run->jump_count && t >= run->jumps[run->next_jump]) /* as msfp_point_at */
        t = nextafter(run->jumps[run->next_jump], -INFINITY);
    memset(dat->base, 0, sizeof dat->base);
    memset(dat->load, 0, sizeof dat->load);
#if MSFP_TOP_ROTATION
    memset(dat->support, 0, sizeof dat->support);
#endif
    dat->base_moves = msfp_any_column(dt);
    for (int c = 0; c < C; ++c) {
        if (batch->motion[c].pieces) {
            dat->base_moves = 1;
            msfp_history_at(&batch->motion[c], t, 3, found);
            for (int order = 0; order < 3; ++order)
                for (int i = 0; i < 6; ++i)
                    dat->base[order][i][c] = found[order][i];
        }
        if (batch->load[c].pieces) {
            msfp_history_at(&batch->load[c], t, 1, found);
            for (int i = 0; i < 6; ++i)
                dat->load[i][c] = found[0][i];
        }
    }
    if (!msfp_any_column(dt))
        return;
    msfp_history_at(&run->motion, t, 3, found);
    third_derivative(&run->motion, t, third);
    msfp_add_scaled(dat->base[0], found[1], dt, 1.0, 6);
    msfp_add_scaled(dat->base[1], found[2], dt, 1.0, 6);
    msfp_add_scaled(dat->base[2], third, dt, 1.0, 6);
    msfp_history_at(&run->load, t, 2, found);
    msfp_add_scaled(dat->load, found[1], dt, 1.0, 6);
#if MSFP_TOP_ROTATION
    msfp_history_at(&run->support, t, 3, found);
    for (int order = 0; order < 2; ++order)
        msfp_add_scaled(dat->support[order], found[order + 1], dt, 1.0, 6);
#endif
}

int msfp_initial_columns(msfp_run *run, msfp_parameter_batch *batch, int first)
{
    const msfp_parameters *p = &run->parameters;
    const msfp_parameter_columns *dp = &batch->parameters;
    msfp_stage_history *stage_history = &run->gradients->stage_history;
    msfp_work *w = &stage_history->work[0];
    msfp_slopes *slopes = &stage_history->slopes[0];
    msfp_state_columns *now = &batch->now;
    msfp_point_columns *dat = &batch->point;
    msfp_stage_weights weights = { .a_weight = 1.0 };
    msfp_point at;
    double g[NB][2], residual[DOF];
    msfp_to_point(run, &run->now, &at);
    memcpy(weights.fp, at.f, sizeof weights.fp);
    memcpy(g, at.f, sizeof g);
#if MSFP_LAW
    memset(w->coefficient, 0, sizeof w->coefficient);
#endif
    const int status = msfp_condensed(p, &at, &weights, w, g, residual, stage_history->factors[0]);
    if (status)
        return status;
    msfp_contact_slopes(p, &weights, w, (const double (*)[2])g, 0, slopes);
    memset(dat, 0, sizeof *dat);
    memset(now->t, 0, sizeof now->t);
    memset(now->a, 0, sizeof now->a);
    memcpy(dat->q, now->q, sizeof dat->q);
    memcpy(dat->v, now->v, sizeof dat->v);
    memcpy(dat->f, now->f, sizeof dat->f);
    msfp_memory_point_columns(p, dp, &run->now, now, 0.0, dat);
    msfp_inputs_columns(run, batch, run->now.t, now->t, dat);
    if (first) {
        msfp_condensed_columns(p, dp, &at, dat, &weights, w, slopes, MSFP_OF_RESIDUAL, &batch->work);
        msfp_resting_foot_direction(p->top, w->body[NB], dp->top, batch->work.body[NB], now->foot[0]);
    }
    memcpy(dat->foot, now->foot, sizeof dat->foot);
    msfp_condensed_columns(p, dp, &at, dat, &weights, w, slopes, MSFP_OF_RESIDUAL, &batch->work);
    if (!MSFP_MASSLESS) {
        if (msfp_lu(stage_history->factors[0], DOF, stage_history->pivots[0]) == 0)
            return MSFP_E_IRREGULAR;
        msfp_lu_solve_columns(stage_history->factors[0], stage_history->pivots[0], C, batch->work.residual[0]);
        msfp_move_rates(now->a[0][0], batch->work.residual[0], 1.0, C);
        memcpy(dat->a, now->a, sizeof dat->a);
        msfp_condensed_columns(p, dp, &at, dat, &weights, w, slopes, MSFP_OF_RESIDUAL, &batch->work);
    }
    msfp_friction_columns(&batch->work, now->df, NULL);
#if MSFP_MEMORY
    static const msfp_columns fixed;
    msfp_memory_state_columns(p, dp, w, &batch->work, &run->now, now, 0.0, fixed, now);
#endif
    memcpy(now->foot, batch->work.foot + MSFP_FOOT_Y * C, sizeof now->foot);
    memcpy(now->dfoot, batch->work.foot + MSFP_FOOT_Y1 * C, sizeof now->dfoot);
    if (run->gradients->energies)
        msfp_initial_works(run, batch, &at, &weights, (const double (*)[2])g);
    return MSFP_OK;
}
#endif
