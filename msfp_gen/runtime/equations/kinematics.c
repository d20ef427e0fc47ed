/* kinematics.c: parameters, inputs of an evaluation, the foot of the supported mass, named points (3.1)-(3.11). */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

static const int signs[NB] = MSFP_SIGNS;

/* Values of the surfaces below and above body k, on which its parameters depend. */
static void set_sides(msfp_parameters *p, int k)
{
    double *sides = p->sides[k];
    sides[MSFP_SIDES_SIGN_LOWER] = k > 0 ? signs[k - 1] : 1.0;
    sides[MSFP_SIDES_SIGN_UPPER] = k < NB ? signs[k] : 1.0;
    sides[MSFP_SIDES_RADIUS_LOWER] = k > 0 ? p->surface_values[k - 1][MSFP_SURFACE_VALUES_RADIUS] : 0.0;
    sides[MSFP_SIDES_RADIUS_UPPER] = k < NB ? p->surface_values[k][MSFP_SURFACE_VALUES_RADIUS] : 0.0;
    sides[MSFP_SIDES_GRAVITY] = p->gravity;
}

void msfp_set_parameters(msfp_parameters *p, double gravity, const double *bodies, const double *surfaces,
                         const double *top)
{
    memset(p, 0, sizeof *p);
    p->gravity = p->around[MSFP_AROUND_GRAVITY] = gravity;
    memcpy(p->body_values, bodies, sizeof p->body_values);
    memcpy(p->surface_values, surfaces, sizeof p->surface_values);
    memcpy(p->top_values, top, sizeof p->top_values);
    for (int k = 0; k <= NB; ++k) {
        set_sides(p, k);
        msfp_body_block(p->body_values[k], p->sides[k], p->body[k]);
    }
    for (int j = 0; j < NB; ++j) {
        const double sign = signs[j], *values = p->surface_values[j];
        double bound[MSFP_RIM_BOUND_SIZE];
        msfp_surface_block(values, p->body_values[msfp_slider(j)], &sign, p->surface[j]);
        msfp_rim_bound(values, bound);
        p->rim_cosine[j] = bound[MSFP_RIM_BOUND_COSINE];
        p->rim_slope[j] = bound[MSFP_RIM_BOUND_SLOPE];
#if MSFP_UPLIFT
        double compliance;
        msfp_seat_compliance(values, &compliance);
        p->around[MSFP_AROUND_COMPLIANCE] += compliance;
#endif
    }
    for (int i = 0; i < MSFP_SURFACE_PARAMETERS_SIZE; ++i)
        for (int lane = 0; lane < MSFP_LANES; ++lane)
            p->lanes[i][lane] = p->surface[lane < NB ? lane : NB - 1][i];
    msfp_top_block(p->top_values, p->around, p->top);
    p->weight = top[MSFP_TOP_VALUES_MASS] * gravity;
    for (int k = 1; k <= NB; ++k)
        p->weight += p->body_values[k][MSFP_BODY_VALUES_MASS] * gravity;
}

/* The block of coordinates from q, v, a of a body; separated: with the separation, which the base has not. */
MSFP_INLINE void load_coordinates(double *x, const double *q, const double *v, const double *a, int separated)
{
    const double *orders[3] = { q, v, a };
    MSFP_UNROLL
    for (int order = 0; order < 3; ++order)
        MSFP_UNROLL
        for (int i = 0; i < (MSFP_PLANAR ? 1 : 3); ++i)
            x[msfp_coordinate_field(order, i)] = orders[order][MSFP_PLANAR ? 1 : i];
#if MSFP_UPLIFT
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < MSFP_SPACE; ++i)
            x[msfp_separation_field(order, i)] = separated ? orders[order][3 + (MSFP_PLANAR ? 2 * i : i)] : 0.0;
#else
    (void)separated;
#endif
}

void msfp_inertial_frame(const msfp_point *at, double *body)
{
    static const double e[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
    memset(body, 0, MSFP_BODY_SIZE * sizeof *body);
    msfp_body_t1_put(body, e[0]);
    msfp_body_t2_put(body, e[1]);
    msfp_body_t3_put(body, e[2]);
    msfp_body_C_put(body, at->base[0]);
    msfp_body_V_put(body, at->base[1]);
    msfp_body_A_put(body, at->base[2]);
}

void msfp_set_loads(const msfp_parameters *p, const msfp_point *at, msfp_blocks *s)
{
    msfp_force_F_put(s->load_force, at->load);
    msfp_moment_M_put(s->load_moment, at->load + 3);
    msfp_foot_stage(p, at, s->foot_stage);
#if MSFP_TOP_ROTATION
    msfp_support_axis(at, s->upright);
#endif
}

MSFP_WIDE void msfp_set_inputs(const msfp_parameters *p, const msfp_point *at, const msfp_stage_weights *weights,
                               msfp_work *w, msfp_blocks *s)
{
    s->at = at;
    s->weights = weights;
    if (!(weights && weights->same_base)) {
        msfp_inertial_frame(at, s->frame);
        load_coordinates(w->x[0], at->base[0] + 3, at->base[1] + 3, at->base[2] + 3, 0);
    }
    for (int k = 1; k <= NB; ++k)
        load_coordinates(w->x[k], at->q[k - 1], at->v[k - 1], at->a[k - 1], 1);
    msfp_set_loads(p, at, s);
    for (int j = 0; j < NB; ++j) {
        double *before = s->friction_previous[j];
        MSFP_UNROLL
        for (int i = 0; i < MSFP_FRICTION_FORCE_SIZE; ++i)
            before[MSFP_FRICTION_PREVIOUS_Y + i] = weights ? weights->fp[j][i] : at->f[j][i];
        before[MSFP_FRICTION_PREVIOUS_BETA] = weights ? weights->beta : 0.0;
#if MSFP_MEMORY
        before[MSFP_FRICTION_PREVIOUS_PAST] = at->past[j];
        before[MSFP_FRICTION_PREVIOUS_GAIN] = at->gain[MSFP_GAIN(j)];
#endif
    }
    w->reference = p->weight + fabs(at->load[0]) + fabs(at->load[1]) + fabs(at->load[2]);
}

#if MSFP_TOP_ROTATION
void msfp_support(const msfp_point *at, double *support)
{
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            support[order * PAIR + i] = at->support[order][MSFP_PLANAR ? 1 : i];
}

void msfp_support_axis(const msfp_point *at, double *upright)
{
    double support[MSFP_SUPPORT_SIZE];
    msfp_support(at, support);
    msfp_upright(support, upright);
}
#endif

#if MSFP_MOVING_ENDS
void msfp_end_angles(const double rotation[3][3], double angles[3][3])
{
    int turned = 0;
    for (int i = 0; i < MSFP_TURN_SIZE; ++i)
        turned |= (&rotation[0][0])[i] != 0.0;
    if (turned)
        msfp_rotation_angles(&rotation[0][0], &angles[0][0]);
    else
        memset(&angles[0][0], 0, MSFP_ROTATION_ANGLES_SIZE * sizeof **angles);
}
#endif

int msfp_top_is_sprung(const msfp_parameters *p)
{
    return p->top[MSFP_TOP_PARAMETERS_KV] > 0.0 || p->top[MSFP_TOP_PARAMETERS_CV] > 0.0;
}

double msfp_sprung_mass(const msfp_parameters *p)
{
    return p->top[MSFP_TOP_PARAMETERS_M] - p->top[MSFP_TOP_PARAMETERS_MZ];
}

void msfp_foot_stage(const msfp_parameters *p, const msfp_point *at, double *stage)
{
    const double before[MSFP_FOOT_PREVIOUS_SIZE] = { at->foot[0], at->foot[1], at->foot_beta };
    if (msfp_top_is_sprung(p))
        msfp_spring_stage(p->top, before, stage);
    else
        memset(stage, 0, MSFP_FOOT_STAGE_SIZE * sizeof *stage);
}

void msfp_move_foot(const msfp_parameters *p, const double *stage, msfp_work *w)
{
    const double *plate = w->body[NB];
    if (msfp_top_is_sprung(p)) {
        msfp_foot(p->top, plate, stage, w->foot);
        return;
    }
    w->foot[MSFP_FOOT_Y] = plate[MSFP_BODY_CZ];
    w->foot[MSFP_FOOT_Y1] = plate[MSFP_BODY_VZ];
    w->foot[MSFP_FOOT_Y2] = plate[MSFP_BODY_AZ];
}

/* Kinematics of all bodies, without friction. */
static void kinematics(const msfp_parameters *p, const msfp_point *at, msfp_work *w, msfp_blocks *s)
{
    memset(w, 0, sizeof *w);
    msfp_set_inputs(p, at, NULL, w, s);
    msfp_base_values(p, w, s);
    msfp_bodies_values(p, w, s);
}

void msfp_motion(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    msfp_blocks s;
    kinematics(p, at, w, &s);
}

void msfp_foot_at_rest(const msfp_parameters *p, const msfp_point *at, double foot[2])
{
    msfp_work w;
    msfp_motion(p, at, &w);
    msfp_resting_foot(p->top, w.body[NB], foot);
}

static void points_of(const double *block, double *out /* [4][3][3] */)
{
    msfp_points_r_lo_get(block, out);
    msfp_points_v_lo_get(block, out + 3);
    msfp_points_a_lo_get(block, out + 6);
    msfp_points_r_cm_get(block, out + 9);
    msfp_points_v_cm_get(block, out + 12);
    msfp_points_a_cm_get(block, out + 15);
    msfp_points_r_up_get(block, out + 18);
    msfp_points_v_up_get(block, out + 21);
    msfp_points_a_up_get(block, out + 24);
    msfp_points_r_sc_get(block, out + 27);
    msfp_points_v_sc_get(block, out + 30);
    msfp_points_a_sc_get(block, out + 33);
}

void msfp_named_vectors(const msfp_parameters *p, const msfp_point *at, double *points, double *rotations,
                        double *bases)
{
    msfp_work w;
    msfp_blocks s;
    double block[MSFP_POINTS_SIZE];
    kinematics(p, at, &w, &s);
    for (int k = 0; k <= NB; ++k) {
        msfp_named_points(p->body_values[k], p->sides[k], k ? w.body[k - 1] : s.frame, w.x[k], block);
        points_of(block, points + k * 36);
        msfp_body_w_get(w.body[k], rotations + k * 12);
        msfp_body_wp_get(w.body[k], rotations + k * 12 + 3);
        msfp_body_al_get(w.body[k], rotations + k * 12 + 6);
        msfp_body_alp_get(w.body[k], rotations + k * 12 + 9);
        msfp_body_t1_get(w.body[k], bases + k * 9);
        msfp_body_t2_get(w.body[k], bases + k * 9 + 3);
        msfp_body_t3_get(w.body[k], bases + k * 9 + 6);
    }
}
