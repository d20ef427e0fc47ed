/* work_columns.c: derivatives of the works of the energy balance, integrated as the methods integrate them
 * (implicit.c, quasistatic.c).
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { WORKS = MSFP_WORKS };

/* The columns of msfp_refine_works. */
static void refine(const msfp_run *run, const msfp_parameter_batch *batch, const msfp_tableau *method, double h,
                   const msfp_state_columns *stages, msfp_columns work[WORKS])
{
    const msfp_stage_history *s = &run->gradients->stage_history;
    double rates[WORKS] = { 0.0 };
    msfp_refine_works(method, (const double *)stages, sizeof *stages / sizeof(double), h, run->ringing, C, work[0]);
    msfp_refine_works(method, (const double *)s->state, sizeof *s->state / sizeof(double), 1.0, run->ringing, 1, rates);
    msfp_add_scaled(work, rates, batch->h, 1.0, WORKS);
}

MSFP_WIDE void msfp_stage_works(msfp_run *run, msfp_parameter_batch *batch, int i, const msfp_state_columns *from,
                                msfp_state_columns *stages)
{
    const msfp_tableau *method = msfp_tableau_of(run->options.method);
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const msfp_stage *stage = &stage_history->stage[i];
    const double h = stage->beta / method->gamma;
    msfp_state_columns *to = &stages[i];
    msfp_condensed_columns(&run->parameters, &batch->parameters, &stage->at, &batch->point, &stage->weights,
                           &stage_history->work[i], &stage_history->slopes[i], MSFP_OF_RESIDUAL | MSFP_OF_ROW,
                           &batch->work);
    msfp_columns_of_powers(&run->parameters, &batch->parameters, &stage->at, &batch->point, &stage_history->work[i],
                           &batch->work, to);
    memcpy(to->work, from->work, sizeof to->work);
    msfp_add_columns(to->work, (const msfp_columns *)to->power, h * method->gamma, WORKS);
    msfp_add_scaled(to->work, stage_history->state[i].power, batch->h, method->gamma, WORKS);
    if (i < method->stages - 1)
        return;
    refine(run, batch, method, h, stages, to->work);
    batch->complete = 1;
}

#if MSFP_CLOSED_FORM
#include "msfp_gradient_kernels.h"

enum { ANGLE = 1 };

/* What the work of the next step uses of the end of this one, at the point and evaluation of the batch. */
static void ends(const msfp_run *run, const msfp_parameter_batch *batch, const msfp_point *at, const msfp_work *w,
                 msfp_history_columns *to)
{
    memcpy(to->power, batch->now.power, sizeof to->power);
    msfp_load_end_columns(&run->parameters, &batch->parameters, at, &batch->point, w, &batch->work, to->load_end);
    for (int k = 0; k < NB; ++k)
        memcpy(to->normal[k], batch->work.contact[k] + MSFP_CONTACT_N * C, sizeof to->normal[k]);
}

/* As friction_work of quasistatic.c. */
static void friction_work(const msfp_run *run, const msfp_parameter_batch *batch, const msfp_history_columns *to,
                          msfp_columns work[WORKS])
{
    for (int k = 0; k < NB; ++k) {
        const double slip[MSFP_SLIP_SIZE] = { [MSFP_SLIP_Y] = run->now.f[k][0],
                                              [MSFP_SLIP_TURN] = run->next.q[k][ANGLE] - run->now.q[k][ANGLE] };
        const double end[MSFP_SLIP_END_SIZE] = {
            run->next.f[k][0], 0.5 * (run->step_history.normal[k] + run->next_step_history.normal[k])
        };
        double dslip[MSFP_SLIP_SIZE * C] = { 0 }, dend[MSFP_SLIP_END_SIZE * C], done[MSFP_SLIP_WORK_SIZE * C];
        for (int c = 0; c < C; ++c) {
            dslip[MSFP_SLIP_Y * C + c] = batch->now.f[k][0][c];
            dslip[MSFP_SLIP_TURN * C + c] = batch->next.q[k][ANGLE][c] - batch->now.q[k][ANGLE][c];
            dend[MSFP_SLIP_END_Y * C + c] = batch->next.f[k][0][c];
            dend[MSFP_SLIP_END_N * C + c] = 0.5 * (batch->history.normal[k][c] + to->normal[k][c]);
        }
        msfp_slip_work_direction(run->parameters.surface[k], slip, end, batch->parameters.surface[k], dslip, dend,
                                 done);
        msfp_add_columns(&work[MSFP_WORK_FRICTION_STORED], (const msfp_columns *)done + MSFP_SLIP_WORK_STORED, 1.0, 1);
        msfp_add_columns(&work[MSFP_WORK_FRICTION_DISSIPATED], (const msfp_columns *)done + MSFP_SLIP_WORK_LOST, 1.0, 1);
    }
}

/* As count_work of quasistatic.c: lengths of these steps do not depend on the parameters. */
void msfp_quasistatic_works(msfp_run *run, msfp_parameter_batch *batch)
{
    const msfp_stage_history *stage_history = &run->gradients->stage_history;
    const double h = run->next.t - run->now.t;
    const msfp_state_columns *now = &batch->now;
    msfp_state_columns *next = &batch->next;
    msfp_columns *work = next->work;
    msfp_history_columns reached;
    msfp_columns load;
    msfp_columns_of_powers(&run->parameters, &batch->parameters, &stage_history->stage[1].at, &batch->point,
                           &stage_history->work[1], &batch->work, next);
    msfp_add_columns(&next->power[MSFP_WORK_INPUT], (const msfp_columns *)&next->load_power, -1.0, 1);
    msfp_parabola_works(batch->history.power[0], now->power[0], next->power[0], run->step_history.h, h, C, work[0]);
    ends(run, batch, &stage_history->stage[1].at, &stage_history->work[1], &reached);
    friction_work(run, batch, &reached, work);
    msfp_load_work_direction(run->step_history.load_end, run->next_step_history.load_end, batch->history.load_end,
                             reached.load_end, load);
    msfp_add_columns(&work[MSFP_WORK_INPUT], (const msfp_columns *)&load, 1.0, 1);
    batch->history = reached;
}
#endif

void msfp_initial_works(msfp_run *run, msfp_parameter_batch *batch, const msfp_point *at,
                        const msfp_stage_weights *weights, const double g[NB][2])
{
    msfp_stage_history *stage_history = &run->gradients->stage_history;
    const msfp_work *w = &stage_history->work[0];
    msfp_state_columns *now = &batch->now;
    msfp_contact_slopes(&run->parameters, weights, w, g, 1, &stage_history->slopes[0]);
    msfp_condensed_columns(&run->parameters, &batch->parameters, at, &batch->point, weights, w,
                           &stage_history->slopes[0], MSFP_OF_RESIDUAL | MSFP_OF_ROW, &batch->work);
    msfp_columns_of_powers(&run->parameters, &batch->parameters, at, &batch->point, w, &batch->work, now);
#if MSFP_CLOSED_FORM
    if (!msfp_is_quasistatic(run))
        return;
    msfp_add_columns(&now->power[MSFP_WORK_INPUT], (const msfp_columns *)&now->load_power, -1.0, 1);
    ends(run, batch, at, w, &batch->history);
#endif
}
#endif
