/* derivatives.c: derivatives of wrenches by the motion of the ends: of a trial, whose steps are taken once more, and of a
 * stage that another program drives.
 *
 * The equations of a stage are differentiated where it was solved, by what is known there: the state before, the earlier
 * stages, the motion of the ends (msfp_by_ends.h, from generator/schedule.py). The factored tangent of the stage gives
 * the rates that follow, by the implicit function theorem.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O1", "tree-vectorize") /* compiled in half the time of -O2 */
#endif
#include <math.h>
#include <string.h>
#include "port.h"

#include "msfp_by_ends.h"

enum { W = MSFP_PORT_FREEDOMS, EACH = MSFP_END_FREEDOMS };
typedef double columns[W];                        /* derivatives of a number by the freedoms of both ends */
typedef columns channels[MSFP_ORDERS][EACH]; /* of displacement and angles of an end, or of the load */

static const int unknown[ND] = MSFP_FREE;

/* ---- a trial ---- */

/* Of a state, without works and powers. */
typedef struct {
    MSFP_STATE_FIELDS(columns)
} state_columns;

typedef struct {
    channels to[MSFP_ENDS]; /* at the end of the trial */
    state_columns stage[MSFP_STAGES]; /* 0: the start of the step */
    msfp_by_ends d;
} moved;

/* Derivatives of the channels of an end along a direction, at its motion [order][6]; rates: not of second derivatives. */
static void channels_by_freedoms(const double *motion, const double direction[MSFP_ORDERS], int end, int rates,
                                 columns (*of)[EACH])
{
    double turn[MSFP_TURN_SIZE], dturn[MSFP_TURN_SIZE * W] = { 0.0 }, angles[MSFP_ROTATION_ANGLES_SIZE * W] = { 0.0 };
    memset(of, 0, sizeof(channels));
    for (int order = 0; order < MSFP_ORDERS; ++order) {
        memcpy(turn + 3 * order, motion + order * EACH + 3, 3 * sizeof *turn);
        for (int i = 0; i < 3; ++i) {
            of[order][i][end * EACH + i] = direction[order];
            dturn[(3 * order + i) * W + end * EACH + 3 + i] = direction[order];
        }
    }
    if (rates)
        msfp_support_angles_by_ends(turn, dturn, angles);
    else
        msfp_rotation_angles_by_ends(turn, dturn, angles);
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(of[order][3], angles + 3 * order * W, 3 * sizeof(columns));
}

/* What the motion of the lower end is to the equations. */
static void move_base(const msfp_parameters *p, const msfp_work *w, columns (*of)[EACH], msfp_blocks *s, msfp_by_ends *d)
{
    memcpy(d->frame + MSFP_BODY_CX * W, of[0], 3 * sizeof(columns));
    memcpy(d->frame + MSFP_BODY_VX * W, of[1], 3 * sizeof(columns));
    memcpy(d->frame + MSFP_BODY_AX * W, of[2], 3 * sizeof(columns));
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(d->x[0] + msfp_coordinate_field(order, 0) * W, of[order] + 3, 3 * sizeof(columns));
    msfp_base_by_ends(p, w, s, d);
}

/* What that of the upper end is to the top plate, through the interface; or the load. */
static void move_top(const msfp_port *port, const msfp_work *w, columns (*of)[EACH], msfp_blocks *s, msfp_by_ends *d)
{
    if (port->loaded) {
        memcpy(d->load_force, of[0], sizeof d->load_force);
        memcpy(d->load_moment, of[0] + 3, sizeof d->load_moment);
        return;
    }
    memcpy(d->far_end + MSFP_FAR_END_UX * W, of[0], 3 * sizeof(columns));
    memcpy(d->far_end + MSFP_FAR_END_VX * W, of[1], 3 * sizeof(columns));
    memcpy(d->support + MSFP_SUPPORT_PSI * W, of[0] + 3, PAIR * sizeof(columns));
    memcpy(d->support + MSFP_SUPPORT_PSI1 * W, of[1] + 3, PAIR * sizeof(columns));
    msfp_interface_by_ends(&port->run.parameters, w, s, d);
}

/* Derivatives of an evaluation from those of its point and its base; balances: of the balances too. */
static void differentiate(const msfp_parameters *p, const msfp_work *w, int balances, msfp_blocks *s, msfp_by_ends *d)
{
    msfp_bodies_by_ends(p, w, s, d);
    msfp_top_by_ends(p, w, s, d);
    msfp_forces_by_ends(p, w, s, d);
    msfp_surfaces_by_ends(p, w, s, d);
    msfp_results_by_ends(p, w, s, d);
    if (balances)
        msfp_moments_by_ends(p, w, s, d);
}

/* Derivatives of coordinates and accelerations of a stage from those of the rates and of what is known before it. */
static void point(const state_columns *known, double beta, state_columns *stage, msfp_by_ends *d)
{
    msfp_stage_formula(known->q[0][0], known->v[0][0], beta, 1.0 / beta, stage->v[0][0], MSFP_COORDINATES * W,
                       stage->q[0][0], stage->a[0][0]);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            columns *orders[MSFP_ORDERS] = { &stage->q[k][unknown[i]], &stage->v[k][unknown[i]],
                                             &stage->a[k][unknown[i]] };
            for (int order = 0; order < MSFP_ORDERS; ++order)
                memcpy(d->x[k + 1] + msfp_unknown_field(order, i) * W, *orders[order], sizeof(columns));
        }
}

#if MSFP_MEMORY
static const double part[MSFP_MEMORY][MSFP_MEMORY_PART_SIZE] = MSFP_MEMORY_PARTS;
#endif

/* What the stage formulas of friction, memory and foot know of the earlier stages. */
static void known_of_stage(const msfp_parameters *p, const msfp_stage *at, const state_columns *known, msfp_by_ends *d)
{
    const double beta = at->beta;
    columns f[NB][2];
    msfp_known_of_stage((const double *)known, beta, W, f[0][0], d->foot_stage + MSFP_FOOT_STAGE_Y * W);
    for (int j = 0; j < NB; ++j) {
        memcpy(d->friction_previous[j] + MSFP_FRICTION_PREVIOUS_Y * W, f[j], MSFP_FRICTION_FORCE_SIZE * sizeof(columns));
#if MSFP_MEMORY
        double *past = d->friction_previous[j] + MSFP_FRICTION_PREVIOUS_PAST * W;
        memset(past, 0, sizeof(columns));
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            columns one;
            msfp_memory_past_by_ends(part[i], p->surface[j], &beta, &at->from.memory[j][i], known->memory[j][i], one);
            msfp_add(past, one, 1.0, W);
        }
#endif
    }
    (void)p;
}
MSFP_STATIC_ASSERT(MSFP_FOOT_STAGE_Y1 == MSFP_FOOT_STAGE_Y + 1, rate_follows_height);

/* Y and Z, foot and memories of the solved stage, with their rates. */
static void rest_of_stage(const msfp_parameters *p, const msfp_work *w, const msfp_stage *at, const state_columns *known,
                          const msfp_by_ends *d, state_columns *stage)
{
    memcpy(stage->f, known->f, sizeof stage->f);
    memcpy(stage->foot, known->foot, sizeof stage->foot);
    for (int j = 0; j < NB; ++j) {
        memcpy(stage->df[j], d->surface_results[j] + MSFP_SURFACE_RESULTS_DY * W, MSFP_FRICTION_FORCE_SIZE * sizeof(columns));
#if MSFP_MEMORY
        for (int i = 0; i < MSFP_MEMORY; ++i) {
            double end[MSFP_MEMORY_END_SIZE * W];
            msfp_memory_stage_by_ends(part[i], p->surface[j], &at->beta, &at->from.memory[j][i], w->contact[j],
                                      known->memory[j][i], d->contact[j], end);
            memcpy(stage->memory[j][i], end + MSFP_MEMORY_END_M * W, sizeof(columns));
            memcpy(stage->dmemory[j][i], end + MSFP_MEMORY_END_D * W, sizeof(columns));
        }
#endif
    }
    (void)p;
    (void)w;
    memcpy(stage->dfoot, d->foot + MSFP_FOOT_Y1 * W, sizeof stage->dfoot);
    msfp_add(stage->f[0][0], stage->df[0][0], at->beta, 2 * NB * W);
    msfp_add(stage->foot[0], stage->dfoot[0], at->beta, 2 * W);
}

/* Derivatives of the rates of the stage, by the tangent of the balances as Newton's method divides them. */
static void solve(const msfp_run *run, const double *residual, const msfp_by_ends *d, state_columns *stage)
{
    double x[DOF * W];
    for (int k = 0; k < NB; ++k) {
        double *own = x + k * ND * W;
        memcpy(own, d->angular[k + 1], NA * sizeof(columns));
#if MSFP_UPLIFT
        memcpy(own + NA * W, d->excess[k], (ND - NA) * sizeof(columns));
        (void)residual;
#else
        msfp_divide_columns(run->work.contact[k][MSFP_CONTACT_N], residual + k * ND, d->surface_results[k] + MSFP_SURFACE_RESULTS_N * W, W,
                            own);
#endif
    }
    msfp_lu_solve_columns(run->factors, run->pivots, W, x);
    msfp_move_rates(stage->v[0][0], x, 1.0, W);
}

/* Stage i, which is solved and whose tangent is factored. residual: what is left of it over N; basis: the channels of
 * msfp_unit_paths at its time; balances: whether those of the balances are wanted at the solution. */
static void differentiate_stage(const msfp_port *port, const msfp_run *run, const msfp_stages *stages, int i,
                                const double *residual, double basis[MSFP_ORDERS][6], int balances, msfp_blocks *s, moved *m)
{
    enum { COUNT = sizeof(m->to[0][0]) / sizeof(double) };
    const double beta = stages->now.beta;
    state_columns known = m->stage[0], *stage = &m->stage[i];
    channels here[MSFP_ENDS];
    msfp_sum_rates((double *)&known, (const double *)m->stage, sizeof known / sizeof(double), stages->method->a[i], i,
                   stages->h, W);
    for (int e = 0; e < MSFP_ENDS; ++e)
        for (int order = 0; order < MSFP_ORDERS; ++order)
            for (int c = 0; c < COUNT; ++c) {
                const double *to = &m->to[e][0][0][0] + c, *at = basis[order];
                (&here[e][order][0][0])[c] = at[0] * to[0] + at[1] * to[COUNT] + at[2] * to[2 * COUNT];
            }
    move_base(&run->parameters, &run->work, here[0], s, &m->d);
    move_top(port, &run->work, here[1], s, &m->d);
    known_of_stage(&run->parameters, &stages->now, &known, &m->d);
    memset(stage, 0, sizeof *stage);
    point(&known, beta, stage, &m->d);
    differentiate(&run->parameters, &run->work, 1, s, &m->d);
    solve(run, residual, &m->d, stage);
    point(&known, beta, stage, &m->d);
    differentiate(&run->parameters, &run->work, balances, s, &m->d);
    rest_of_stage(&run->parameters, &run->work, &stages->now, &known, &m->d, stage);
    if (i == stages->method->stages - 1) /* at the end of the step */
        m->stage[0] = *stage;
}

/* The blocks of the evaluation of a stage that msfp_work has not. */
static void blocks_of(const msfp_port *port, msfp_stage *stage, msfp_work *w, msfp_blocks *s)
{
    const msfp_ends *at = &port->to;
    msfp_stage_weights weights = stage->weights;
    weights.same_base = 0;
    msfp_set_inputs(&port->run.parameters, &stage->at, &weights, w, s);
    msfp_far_end(port, at->of[1][0], at->of[1][1], at->of[1][0], s->far_end);
    s->g = stage->g;
    msfp_support(&stage->at, s->support);
}

/* The steps of the trial once more, with their derivatives; of balances and wrenches at its end. */
static int repeat(msfp_port *port, msfp_run *run, moved *m)
{
    const double end = port->times[port->time_count - 1];
    msfp_polynomials paths;
    msfp_history units;
    msfp_stages s;
    msfp_blocks blocks;
    msfp_port_prepare(port, run, end, &port->to);
    msfp_unit_paths(end - run->now.t, &paths);
    msfp_attach(&units, port->knots, &paths);
    for (size_t step = 0; step < port->time_count; ++step) {
        double error, size, residual[DOF], basis[MSFP_ORDERS][6];
        msfp_stages_begin(run, &s, port->times[step] - run->now.t);
        s.now.weights.accuracy = 0.0;
        for (int i = 1; i < s.method->stages; ++i) {
            const double t = run->now.t + s.method->c[i] * s.h;
            const int last = step + 1 == port->time_count && i + 1 == s.method->stages;
            int status = msfp_stage_take(run, &s, i);
            if (status == MSFP_OK)
                status = msfp_factorise_stage(run, &s.now, residual, &size);
            if (status)
                return status;
            blocks_of(port, &s.now, &run->work, &blocks);
            msfp_history_at(&units, t, MSFP_ORDERS, basis);
            differentiate_stage(port, run, &s, i, residual, basis, last, &blocks, m);
            msfp_stage_end(run, &s, i);
        }
        msfp_stages_end(run, &s, &error);
        run->next.t = port->times[step];
        run->now = run->next;
        run->restart = run->retry_after_newton = 0;
    }
    for (int k = 0; k < NB; ++k)
        memcpy(m->d.lock[k], m->d.angular[k + 1] + (MSFP_ANGULAR_SIZE - 1) * W, sizeof m->d.lock[k]);
    msfp_wrenches_by_ends(&run->parameters, &run->work, &blocks, &m->d);
    msfp_sliding_by_ends(&run->parameters, &run->work, &blocks, &m->d);
    return MSFP_OK;
}

/* Derivatives of a row [MSFP_ROW_SIZE][12], and of velocity and acceleration of r_nn after it. */
static void give_row(const moved *m, double *rows)
{
    const msfp_by_ends *d = &m->d;
    const state_columns *end = &m->stage[0];
    memset(rows, 0, MSFP_ROW_SIZE * sizeof(columns));
    memcpy(rows + MSFP_ROW_Q * W, end->q, sizeof end->q);
    memcpy(rows + MSFP_ROW_V * W, end->v, sizeof end->v);
    memcpy(rows + MSFP_ROW_A * W, end->a, sizeof end->a);
    memcpy(rows + MSFP_ROW_F * W, end->f, sizeof end->f);
    for (int j = 0; j < NB; ++j) {
        memcpy(rows + (MSFP_ROW_NORMAL + j) * W, d->surface_results[j] + MSFP_SURFACE_RESULTS_N * W, sizeof(columns));
        memcpy(rows + (MSFP_ROW_SLIDING + j) * W, d->gap[j] + MSFP_GAP_S * W, sizeof(columns));
    }
    memcpy(rows + MSFP_ROW_FORCE * W, d->force[0], NB * 3 * sizeof(columns));
    memcpy(rows + MSFP_ROW_BASE * W, d->frame + MSFP_BODY_CX * W, 3 * sizeof(columns));
    memcpy(rows + MSFP_ROW_TOP * W, d->body[NB] + MSFP_BODY_CX * W, 3 * sizeof(columns));
    memcpy(rows + MSFP_ROW_TOP_FORCE * W, d->force[NB], 3 * sizeof(columns));
    memcpy(rows + MSFP_ROW_TOP_MOMENT * W, d->moment[NB], 3 * sizeof(columns));
    memcpy(rows + MSFP_ROW_SIZE * W, d->body[NB] + MSFP_BODY_VX * W, 6 * sizeof(columns));
}
MSFP_STATIC_ASSERT(MSFP_BODY_AX == MSFP_BODY_VX + 3, acceleration_follows_velocity);

int msfp_port_derivative(msfp_port *port, const double direction[MSFP_ORDERS], double *derivative, double *rows)
{
    msfp_run run = port->run; /* with rows and events that no step of this file writes */
    moved m;
    memset(&m, 0, sizeof m);
    for (int e = 0; e < MSFP_ENDS - port->loaded; ++e)
        channels_by_freedoms(port->to.of[e][0], direction, e, 0, m.to[e]);
    for (int i = 0; i < MSFP_ORDERS * EACH && port->loaded; ++i)
        m.to[1][i / EACH][i % EACH][EACH + i % EACH] = direction[i / EACH];
    const int status = repeat(port, &run, &m);
    if (status)
        return status;
    if (port->loaded) /* the load is the wrench of end B */
        memcpy(m.d.upper, m.to[1], sizeof m.d.upper);
    if (!msfp_all_finite(m.d.lower, EACH * W) || !msfp_all_finite(m.d.upper, EACH * W)) /* a direction beyond all measure */
        return MSFP_E_FINITE;
    memcpy(derivative, m.d.lower, sizeof m.d.lower);
    memcpy(derivative + EACH * W, m.d.upper, sizeof m.d.upper);
    if (rows)
        give_row(&m, rows);
    return MSFP_OK;
}

/* ---- a stage that another program drives ---- */

/* Rates of the stage that follow those of end B, by the wrench at the top: its columns in `d` are those at rest. */
static void solve_moves(msfp_port *port, const msfp_by_ends *d)
{
    msfp_run *run = &port->committed;
    for (int begin = 0; begin < EACH; begin += DOF) { /* DOF at a time */
        double force[3 * DOF] = { 0.0 }, moment[3 * DOF] = { 0.0 }, found[DOF * DOF];
        const int count = EACH - begin < DOF ? EACH - begin : DOF;
        for (int i = 0; i < 3; ++i) {
            memcpy(force + i * DOF, d->force[NB] + i * W + EACH + begin, count * sizeof *force);
            memcpy(moment + i * DOF, d->moment[NB] + i * W + EACH + begin, count * sizeof *moment);
        }
        msfp_load_tangent(&run->parameters, &run->work, force, moment, found);
        for (int i = 0; i < DOF * DOF && !MSFP_UPLIFT; ++i)
            found[i] /= run->work.contact[i / (ND * DOF)][MSFP_CONTACT_N];
        msfp_lu_solve_columns(run->factors, run->pivots, DOF, found);
        for (int i = 0; i < DOF; ++i)
            for (int c = 0; c < count; ++c)
                port->step.moves[i][begin + c] = -found[i * DOF + c];
    }
    port->step.moved = 1;
}

int msfp_port_stage_derivative(msfp_port *port, double *derivative)
{
    msfp_run *run = &port->committed;
    msfp_stage *stage = &port->step.stages.now;
    const msfp_work *w = &run->work;
    const double along[MSFP_ORDERS] = { stage->beta, 1.0, 0.0 }; /* displacements change with the rates by beta */
    double residual[DOF], size, by_rates[9][DOF]; /* force and moment at the top, and its position, by the rates of the stage */
    channels upper;
    msfp_blocks s;
    msfp_by_ends d;
    const int status = msfp_factorise_stage(run, stage, residual, &size);
    if (status)
        return status;
    memcpy(by_rates, w->dforce[NB], 3 * sizeof *by_rates);
    memcpy(by_rates + 3, w->dmoment[NB], 3 * sizeof *by_rates);
    memcpy(by_rates + 6, w->dbody[NB] + MSFP_BODY_CX * DOF, 3 * sizeof *by_rates);
    blocks_of(port, stage, &run->work, &s);
    memset(d.foot_stage, 0, sizeof d.foot_stage);
    memset(d.body[NB], 0, sizeof d.body[NB]);
    memset(d.x[NB], 0, sizeof d.x[NB]);
    memset(d.load_moment, 0, sizeof d.load_moment);
    channels_by_freedoms(port->to.of[1][0], along, 1, 1, upper);
    move_top(port, w, upper, &s, &d);
    msfp_top_by_ends(&run->parameters, w, &s, &d);
    solve_moves(port, &d);
    double *const moving[] = { d.force[NB], d.moment[NB], d.body[NB] + MSFP_BODY_CX * W };
    for (int i = 0; i < 9; ++i)
        for (int l = 0; l < DOF; ++l)
            for (int c = 0; c < EACH; ++c)
                moving[i / 3][i % 3 * W + EACH + c] += by_rates[i][l] * port->step.moves[l][c];
    msfp_upper_wrench_by_ends(s.far_end, w->body[NB], w->force[NB], w->moment[NB], d.far_end, d.body[NB], d.force[NB],
                              d.moment[NB], d.upper);
    for (int i = 0; i < EACH; ++i)
        memcpy(derivative + i * EACH, d.upper + i * W + EACH, EACH * sizeof *derivative);
    return msfp_all_finite(derivative, EACH * EACH) ? MSFP_OK : MSFP_E_FINITE;
}
