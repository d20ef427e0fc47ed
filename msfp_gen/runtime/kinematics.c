/* kinematics.c: parameters, kinematics up the stack, the boundary row above the top plate, named points. */
#include <math.h>
#include <string.h>
#include "stack.h"

static const int signs[NB] = MSFP_SIGNS;

void msfp_set_parameters(msfp_parameters *p, double gravity, const double *bodies, const double *surfaces, const double *top)
{
    memset(p, 0, sizeof *p);
    p->gravity = gravity;
    for (int k = 0; k <= NB; ++k) {
        const double *b = bodies + k * MSFP_BODY_VALUES;
        double *d = p->dimensions[k], *out = p->body[k], arms[MSFP_ARMS_SIZE];
        d[MSFP_DIMENSIONS_HEIGHT] = b[0];
        d[MSFP_DIMENSIONS_CENTROID] = b[1];
        d[MSFP_DIMENSIONS_SIGN_LOWER] = k > 0 ? signs[k - 1] : 1.0;
        d[MSFP_DIMENSIONS_SIGN_UPPER] = k < NB ? signs[k] : 1.0;
        d[MSFP_DIMENSIONS_RADIUS_LOWER] = k > 0 ? surfaces[(k - 1) * MSFP_SURFACE_VALUES] : 0.0;
        d[MSFP_DIMENSIONS_RADIUS_UPPER] = k < NB ? surfaces[k * MSFP_SURFACE_VALUES] : 0.0;
        msfp_arms(d, arms);
        out[MSFP_BODY_PARAMETERS_C] = arms[MSFP_ARMS_C];
        out[MSFP_BODY_PARAMETERS_E] = arms[MSFP_ARMS_E];
        out[MSFP_BODY_PARAMETERS_M] = b[2];
        out[MSFP_BODY_PARAMETERS_JT] = b[3];
        out[MSFP_BODY_PARAMETERS_JA] = b[4];
        out[MSFP_BODY_PARAMETERS_G] = gravity;
    }
    for (int j = 0; j < NB; ++j) {
        const double *s = surfaces + j * MSFP_SURFACE_VALUES;
        const double *slider = bodies + (signs[j] > 0 ? j + 1 : j) * MSFP_BODY_VALUES;
        double *out = p->surface[j];
        out[MSFP_SURFACE_PARAMETERS_SIGN] = signs[j];
        out[MSFP_SURFACE_PARAMETERS_R] = s[0];
        out[MSFP_SURFACE_PARAMETERS_SC] = s[1];
        out[MSFP_SURFACE_PARAMETERS_MU] = s[2];
        out[MSFP_SURFACE_PARAMETERS_DY] = s[3];
        out[MSFP_SURFACE_PARAMETERS_KC] = s[4];
        out[MSFP_SURFACE_PARAMETERS_CC] = s[5];
        out[MSFP_SURFACE_PARAMETERS_RS] = slider[5];
        out[MSFP_SURFACE_PARAMETERS_PR] = slider[6];
        if (MSFP_UPLIFT) {
            out[MSFP_SURFACE_PARAMETERS_KS] = s[6];
            out[MSFP_SURFACE_PARAMETERS_CS] = s[7];
        }
        /* The resultant leans by friction from the normal, whose place the footprint bounds. */
        const double footprint = fmin(asin(fmin(slider[5] / s[0], 1.0)) + atan(s[2]), 1.5);
        out[MSFP_SURFACE_PARAMETERS_CA] = cos(footprint);
        out[MSFP_SURFACE_PARAMETERS_SA] = sin(footprint);
        for (int i = 0; i < MSFP_LAW_VALUES; ++i) /* a law's numbers come last in both */
            out[MSFP_SURFACE_PARAMETERS_SIZE - MSFP_LAW_VALUES + i] = s[MSFP_SURFACE_VALUES - MSFP_LAW_VALUES + i];
        p->rim_cosine[j] = cos(s[1] / s[0]);
        p->rim_slope[j] = s[0] / sin(s[1] / s[0]);
    }
    for (int i = 0; i < MSFP_SURFACE_PARAMETERS_SIZE; ++i)
        for (int lane = 0; lane < MSFP_LANES; ++lane)
            p->lanes[i][lane] = p->surface[lane < NB ? lane : NB - 1][i];
    double *t = p->top;
    t[MSFP_TOP_PARAMETERS_K] = top[0];
    t[MSFP_TOP_PARAMETERS_C] = top[1];
    t[MSFP_TOP_PARAMETERS_KR] = top[2];
    t[MSFP_TOP_PARAMETERS_CR] = top[3];
    t[MSFP_TOP_PARAMETERS_M] = top[4];
    t[MSFP_TOP_PARAMETERS_JT] = top[5];
    t[MSFP_TOP_PARAMETERS_JA] = top[6];
    t[MSFP_TOP_PARAMETERS_H] = top[7];
    t[MSFP_TOP_PARAMETERS_G] = gravity;
    const double anchor[3] = { top[8], top[9], 0.0 };
    msfp_top_parameters_x0_put(t, anchor);
    p->weight = top[4] * gravity;
    for (int k = 1; k <= NB; ++k)
        p->weight += bodies[k * MSFP_BODY_VALUES + 2] * gravity;
}


static void load_coordinates(double *x, const double *q, const double *v, const double *a, int parting)
{
    const double *orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < (MSFP_PLANAR ? 1 : 3); ++i)
            x[coordinate(order, i)] = orders[order][MSFP_PLANAR ? 1 : i];
#if MSFP_UPLIFT
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < SPACE; ++i)
            x[separation(order, i)] = parting ? orders[order][3 + (MSFP_PLANAR ? 2 * i : i)] : 0.0;
#else
    (void)parting;
#endif
}

/* What carries the base: the inertial frame at r_01. */
void msfp_ground(const msfp_point *at, double *body)
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

void msfp_base(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    double below[MSFP_BODY_SIZE];
    msfp_ground(at, below);
    load_coordinates(w->x[0], at->base[0] + 3, at->base[1] + 3, at->base[2] + 3, 0);
    msfp_forward(p->body[0], below, w->x[0], w->body[0]);
}

MSFP_WIDE void msfp_kinematics(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    for (int k = 1; k <= NB; ++k) {
        load_coordinates(w->x[k], at->q[k - 1], at->v[k - 1], at->a[k - 1], 1);
        msfp_forward(p->body[k], w->body[k - 1], w->x[k], w->body[k]);
    }
}

/* The same with the columns of its tangent. */
MSFP_WIDE void msfp_kinematics_tangent(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    for (int k = 1; k <= NB; ++k) {
        load_coordinates(w->x[k], at->q[k - 1], at->v[k - 1], at->a[k - 1], 1);
        msfp_forward_tangent(p->body[k], w->body[k - 1], w->x[k], w->body[k], w->dbody[k - 1], w->dx[k], w->dbody[k]);
    }
}

static void load_top(const msfp_point *at, double *force, double *moment)
{
    msfp_force_F_put(force, at->load);
    msfp_moment_M_put(moment, at->load + 3);
}

#if MSFP_TURNED
void msfp_held(const msfp_point *at, double *upright)
{
    double support[MSFP_SUPPORT_SIZE];
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            support[order * PAIR + i] = at->support[order][MSFP_PLANAR ? 1 : i];
    msfp_upright(support, upright);
}
#endif

static void split_wrench(const double *wrench, double *force, double *moment)
{
    memcpy(force, wrench, VECTOR * sizeof *force);
    memcpy(moment, wrench + VECTOR, MOMENT * sizeof *moment);
}

MSFP_WIDE void msfp_top(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    double force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE];
    load_top(at, force, moment);
#if MSFP_TURNED
    double upright[MSFP_UPRIGHT_SIZE];
    msfp_held(at, upright);
#endif
    msfp_top_wrench(p->top, w->body[NB], w->x[NB], force, moment TURNED(upright), wrench);
    split_wrench(wrench, w->force[NB], w->moment[NB]);
    w->reference = p->weight + fabs(at->load[0]) + fabs(at->load[1]) + fabs(at->load[2]);
}

MSFP_WIDE void msfp_top_columns(const msfp_parameters *p, const msfp_point *at, msfp_work *w, const double *dload /* [6][DOF] or NULL */)
{
    static const double zero[6 * DOF];
    double force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    load_top(at, force, moment);
#if MSFP_TURNED
    double upright[MSFP_UPRIGHT_SIZE];
    msfp_held(at, upright);
#endif
    const double *df = dload ? dload : zero, *dm = dload ? dload + VECTOR * DOF : zero;
    msfp_top_wrench_tangent(p->top, w->body[NB], w->x[NB], force, moment TURNED(upright), wrench, w->dbody[NB], w->dx[NB], df, dm, dwrench);
    split_wrench(wrench, w->force[NB], w->moment[NB]);
    w->reference = p->weight + fabs(at->load[0]) + fabs(at->load[1]) + fabs(at->load[2]);
    memcpy(w->dforce[NB], dwrench, sizeof w->dforce[NB]);
    memcpy(w->dmoment[NB], dwrench + VECTOR * DOF, sizeof w->dmoment[NB]);
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

void msfp_named_vectors(const msfp_parameters *p, const msfp_point *at, double *points, double *rotations, double *bases)
{
    msfp_work w;
    double below[MSFP_BODY_SIZE], block[MSFP_POINTS_SIZE];
    msfp_base(p, at, &w);
    msfp_kinematics(p, at, &w);
    msfp_ground(at, below);
    for (int k = 0; k <= NB; ++k) {
        msfp_named_points(p->dimensions[k], k ? w.body[k - 1] : below, w.x[k], block);
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
