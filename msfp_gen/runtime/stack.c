/* stack.c: the loops over bodies and surfaces around the generated kernels. */
#include <math.h>
#include <string.h>
#include "msfp_kernels.h"

#define DOF MSFP_DOF
#define NB MSFP_NB
#define ND MSFP_ND
#define VECTOR MSFP_FORCE_SIZE  /* components of a force */
#define MOMENT MSFP_MOMENT_SIZE /* components of a moment */
#define PAIR (MSFP_PLANAR ? 1 : 2)

static const int signs[NB] = MSFP_SIGNS;

/* Field of block coordinates: angle i of order 0, 1, 2. */
static int coordinate(int order, int i) { return MSFP_PLANAR ? order : 3 * order + i; }
static int angle_of(int i)
{
    static const int angles[ND] = MSFP_ANGLES;
    return angles[i];
}

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
        p->rim_cosine[j] = cos(s[1] / s[0]);
    }
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
}

/* ---- kinematics up the stack ------------------------------------------------------------------ */

static void load_coordinates(double *x, const double *q, const double *v, const double *a)
{
    const double *orders[3] = { q, v, a };
    for (int order = 0; order < 3; ++order)
        for (int i = 0; i < (MSFP_PLANAR ? 1 : 3); ++i)
            x[coordinate(order, i)] = orders[order][MSFP_PLANAR ? 1 : i];
}

/* What carries the base: the inertial frame at r_01. */
static void ground(const msfp_point *at, double *body)
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

static void kinematics(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    double below[MSFP_BODY_SIZE];
    ground(at, below);
    load_coordinates(w->x[0], at->base[0] + 3, at->base[1] + 3, at->base[2] + 3);
    msfp_forward(p->body[0], below, w->x[0], w->body[0]);
    for (int k = 1; k <= NB; ++k) {
        load_coordinates(w->x[k], at->q[k - 1], at->v[k - 1], at->a[k - 1]);
        msfp_forward(p->body[k], w->body[k - 1], w->x[k], w->body[k]);
    }
}

static void kinematics_tangent(const msfp_parameters *p, msfp_work *w)
{
    for (int k = 1; k <= NB; ++k)
        msfp_forward_tangent(p->body[k], w->body[k - 1], w->x[k], w->body[k], w->dbody[k - 1], w->dx[k], w->dbody[k]);
}

static void load_top(const msfp_point *at, double *force, double *moment)
{
    msfp_force_F_put(force, at->load);
    msfp_moment_M_put(moment, at->load + 3);
}

static void split_wrench(const double *wrench, double *force, double *moment)
{
    memcpy(force, wrench, VECTOR * sizeof *force);
    memcpy(moment, wrench + VECTOR, MOMENT * sizeof *moment);
}

static void top(const msfp_parameters *p, const msfp_point *at, msfp_work *w)
{
    double force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE];
    load_top(at, force, moment);
    msfp_top_wrench(p->top, w->body[NB], w->x[NB], force, moment, wrench);
    split_wrench(wrench, w->force[NB], w->moment[NB]);
}

static void top_tangent(const msfp_parameters *p, const msfp_point *at, msfp_work *w, const double *dload /* [6][DOF] or NULL */)
{
    static const double zero[6 * DOF];
    double force[VECTOR], moment[MOMENT], wrench[MSFP_TOP_WRENCH_SIZE], dwrench[MSFP_TOP_WRENCH_SIZE * DOF];
    load_top(at, force, moment);
    const double *df = dload ? dload : zero, *dm = dload ? dload + VECTOR * DOF : zero;
    msfp_top_wrench_tangent(p->top, w->body[NB], w->x[NB], force, moment, wrench, w->dbody[NB], w->dx[NB], df, dm, dwrench);
    split_wrench(wrench, w->force[NB], w->moment[NB]);
    memcpy(w->dforce[NB], dwrench, sizeof w->dforce[NB]);
    memcpy(w->dmoment[NB], dwrench + VECTOR * DOF, sizeof w->dmoment[NB]);
}

/* ---- rims ----------------------------------------------------------------------------------------- */

#if MSFP_RIMS
static void rim_coordinates(const msfp_work *w, int j, double *x)
{
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            x[order * PAIR + i] = w->x[j + 1][coordinate(order, i)];
}
#endif

/* Rim force of surface j; drim (or NULL): its local Jacobian [f, M][psi, theta and rates]. */
static void rim(const msfp_parameters *p, msfp_work *w, int j, double *drim)
{
    memset(w->rim[j], 0, sizeof w->rim[j]);
    w->rim_active[j] = 0;
#if MSFP_RIMS
    /* t_3 . t_3' against the cosine at capacity: no arc cosine while the rim is away */
    if (msfp_body_cp(w->body[j + 1]) * w->body[j + 1][MSFP_BODY_CT] > p->rim_cosine[j])
        return;
    double x[MSFP_RIM_LOCAL], out[MSFP_RIM_SIZE];
    rim_coordinates(w, j, x);
    if (drim) {
        double seed[MSFP_RIM_LOCAL * MSFP_RIM_LOCAL] = { 0 };
        for (int i = 0; i < MSFP_RIM_LOCAL; ++i)
            seed[i * MSFP_RIM_LOCAL + i] = 1.0;
        msfp_rim_tangent(p->surface[j], x, out, seed, drim);
    } else
        msfp_rim(p->surface[j], x, out);
    if (out[MSFP_RIM_FC] < 0.0) { /* compression only: docs/model.md, choice 4 */
        memcpy(w->rim[j], out, sizeof out);
        w->rim_active[j] = 1;
    }
#else
    (void)p;
    (void)drim;
#endif
}

void msfp_gaps(const msfp_parameters *p, const double q[MSFP_NB][3], double sliding[MSFP_NB][MSFP_GAP_SIZE])
{
    for (int j = 0; j < NB; ++j) {
        double x[MSFP_RIM_LOCAL] = { 0 };
        for (int i = 0; i < PAIR; ++i)
            x[i] = q[j][MSFP_PLANAR ? 1 : i];
        msfp_gap(p->surface[j], x, sliding[j]);
    }
}

/* Columns of the rim force and moment from the local Jacobian. */
static void rim_columns(const msfp_work *w, int j, const double *drim, double *dforce, double *dmoment)
{
    memset(dforce, 0, VECTOR * DOF * sizeof *dforce);
    memset(dmoment, 0, MOMENT * DOF * sizeof *dmoment);
    if (!w->rim_active[j])
        return;
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i) {
            const double *dx = w->dx[j + 1] + coordinate(order, i) * DOF;
            const int from = order * PAIR + i;
            for (int r = 0; r < VECTOR + MOMENT; ++r) {
                double *to = r < VECTOR ? dforce + r * DOF : dmoment + (r - VECTOR) * DOF;
                const double factor = drim[r * MSFP_RIM_LOCAL + from];
                for (int c = 0; c < DOF; ++c)
                    to[c] += factor * dx[c];
            }
        }
}

/* ---- contact of one surface -------------------------------------------------------------------- */

#define FRICTION MSFP_FRICTION_SIZE
#define ROWS (MOMENT + FRICTION + 1) /* rows of the contact's tangent: M, dY, dZ, N */
#define ACTIONS (MOMENT + 1)         /* what is condensed: M and N */

static void contact_tangent(const double *par, const double *local, const double *f, double *out, double *jacobian)
{
    double seed[(MSFP_LOCAL_SIZE + FRICTION) * MSFP_LOCAL] = { 0 }, full[MSFP_CONTACT_SIZE * MSFP_LOCAL];
    for (int i = 0; i < MSFP_LOCAL; ++i)
        seed[i * MSFP_LOCAL + i] = 1.0;
    msfp_contact_tangent(par, local, f, out, seed, seed + MSFP_LOCAL_SIZE * MSFP_LOCAL, full);
    memcpy(jacobian, full, ROWS * MSFP_LOCAL * sizeof *jacobian);
}

/* Solve the 1x1 or 2x2 system a x = b in place; 0 if singular. */
static int solve_small(const double *a, double *b)
{
    if (FRICTION == 1) {
        b[0] /= a[0];
        return a[0] != 0.0;
    }
    const double determinant = a[0] * a[FRICTION + 1] - a[1] * a[FRICTION];
    const double x = (b[0] * a[FRICTION + 1] - a[1] * b[FRICTION - 1]) / determinant;
    b[FRICTION - 1] = (a[0] * b[FRICTION - 1] - a[FRICTION] * b[0]) / determinant;
    b[0] = x;
    return determinant != 0.0;
}

/* Y, Z of one surface from their stage formula f = fp + beta df/dt, at a given force and slip rotation. Newton with the
 * derivative at constant slip velocity (the contact point hardly moves with Y, Z), halved while it does not help. */
static int friction_stage(const double *par, const double *local, const double *fp, double beta, double accuracy, double *f, double *out)
{
    double g[FRICTION], a[FRICTION * FRICTION], step[FRICTION] = { 0 }, best = INFINITY;
    for (int i = 0; i < 60; ++i) {
        msfp_contact(par, local, f, out);
        double size = 0.0;
        for (int r = 0; r < FRICTION; ++r) {
            g[r] = f[r] - fp[r] - beta * out[MSFP_CONTACT_DY + r];
            size = fmax(size, fabs(g[r]));
        }
        if (!(size < INFINITY))
            return MSFP_E_FINITE;
        if (size <= accuracy * (1.0 + fabs(beta * out[MSFP_CONTACT_DY])))
            return MSFP_OK;
        const int overshot = size > best;
        for (int r = 0; r < FRICTION; ++r) {
            if (overshot)
                step[r] *= 0.5;
            else
                step[r] = g[r];
            for (int c = 0; c < FRICTION; ++c)
                a[r * FRICTION + c] = (r == c) - beta * out[MSFP_CONTACT_YY + r * FRICTION + c];
        }
        if (!overshot) {
            best = size;
            if (!solve_small(a, step))
                return MSFP_E_NEWTON;
        }
        for (int r = 0; r < FRICTION; ++r) /* past a switch: half the step back */
            f[r] += overshot ? step[r] : -step[r];
    }
    return MSFP_E_NEWTON;
}

/* Jacobian of the moment and of N with Y, Z following their stage formula: [ACTIONS][MSFP_LOCAL_SIZE]. */
static int condense(const double *par, const double *local, const double *f, double beta, double *out, double *condensed)
{
    double jacobian[ROWS * MSFP_LOCAL], a[FRICTION * FRICTION], b[FRICTION];
    contact_tangent(par, local, f, out, jacobian);
    for (int r = 0; r < FRICTION; ++r)
        for (int c = 0; c < FRICTION; ++c)
            a[r * FRICTION + c] = (r == c) - beta * jacobian[(MOMENT + r) * MSFP_LOCAL + MSFP_LOCAL_SIZE + c];
    for (int k = 0; k < MSFP_LOCAL_SIZE; ++k) {
        for (int r = 0; r < FRICTION; ++r)
            b[r] = beta * jacobian[(MOMENT + r) * MSFP_LOCAL + k];
        if (!solve_small(a, b))
            return MSFP_E_NEWTON;
        for (int r = 0; r < ACTIONS; ++r) {
            const double *row = jacobian + (r < MOMENT ? r : MOMENT + FRICTION) * MSFP_LOCAL;
            double sum = row[k];
            for (int c = 0; c < FRICTION; ++c)
                sum += row[MSFP_LOCAL_SIZE + c] * b[c];
            condensed[r * MSFP_LOCAL_SIZE + k] = sum;
        }
    }
    return MSFP_OK;
}

/* Force, slip, friction and moment of surface j. */
static int surface(const msfp_parameters *p, msfp_work *w, const msfp_seed *seed, double *f, int j, int tangent)
{
    double drim[(VECTOR + MOMENT + 3) * MSFP_RIM_LOCAL] = { 0 }, condensed[ACTIONS * MSFP_LOCAL_SIZE], moment[MOMENT];
    double drf[VECTOR * DOF], dmoment[MOMENT * DOF], dlocal[MSFP_LOCAL_SIZE * DOF];
    const double *par = p->surface[j];
    const double fp[2] = { seed->fp[j][0], seed->fp[j][1] };
    rim(p, w, j, tangent ? drim : NULL);
    if (tangent) {
        rim_columns(w, j, drim, drf, dmoment);
        msfp_surface_local_tangent(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], w->rim[j], w->local[j],
                                   w->dbody[j], w->dbody[j + 1], w->dx[j + 1], w->dx[j], w->dforce[j], drf, dlocal);
    } else
        msfp_surface_local(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], w->rim[j], w->local[j]);
    int status = friction_stage(par, w->local[j], fp, seed->beta, fmax(seed->accuracy, 1e-12), f, w->contact[j]);
    if (status == MSFP_OK && tangent)
        status = condense(par, w->local[j], f, seed->beta, w->contact[j], condensed);
    if (status)
        return status;
    for (int r = 0; r < MOMENT; ++r)
        moment[r] = w->contact[j][r] + w->rim[j][VECTOR + r];
    if (tangent) {
        for (int r = 0; r < MOMENT; ++r)
            for (int k = 0; k < MSFP_LOCAL_SIZE; ++k)
                for (int c = 0; c < DOF; ++c)
                    dmoment[r * DOF + c] += condensed[r * MSFP_LOCAL_SIZE + k] * dlocal[k * DOF + c];
        memset(w->dnormal[j], 0, sizeof w->dnormal[j]);
        for (int k = 0; k < MSFP_LOCAL_SIZE; ++k)
            for (int c = 0; c < DOF; ++c)
                w->dnormal[j][c] += condensed[MOMENT * MSFP_LOCAL_SIZE + k] * dlocal[k * DOF + c];
        msfp_moment_to_world_tangent(w->body[j], moment, w->moment[j], w->dbody[j], dmoment, w->dmoment[j]);
    } else
        msfp_moment_to_world(w->body[j], moment, w->moment[j]);
    return MSFP_OK;
}

/* ---- the condensed equations -------------------------------------------------------------------- */

static void seed_columns(msfp_work *w, const msfp_seed *seed)
{
    memset(w->dx, 0, sizeof w->dx);
    memset(w->dbody[0], 0, sizeof w->dbody[0]);
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < ND; ++i) {
            const int column = k * ND + i;
            w->dx[k + 1][coordinate(0, i) * DOF + column] = seed->cq;
            w->dx[k + 1][coordinate(1, i) * DOF + column] = seed->cv;
            w->dx[k + 1][coordinate(2, i) * DOF + column] = seed->ca;
        }
}

int msfp_condensed(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w,
                   double f[MSFP_NB][2], double *residual, double *tangent)
{
    double out[MSFP_ANGULAR_SIZE], dout[MSFP_ANGULAR_SIZE * DOF];
    kinematics(p, at, w);
    if (tangent) {
        seed_columns(w, seed);
        kinematics_tangent(p, w);
        top_tangent(p, at, w, NULL);
    } else
        top(p, at, w);
    for (int j = NB - 1; j >= 0; --j) {
        if (tangent)
            msfp_interface_force_tangent(p->body[j + 1], w->body[j + 1], w->force[j + 1], w->force[j],
                                         w->dbody[j + 1], w->dforce[j + 1], w->dforce[j]);
        else
            msfp_interface_force(p->body[j + 1], w->body[j + 1], w->force[j + 1], w->force[j]);
    }
    for (int j = 0; j < NB; ++j) {
        const int status = surface(p, w, seed, f[j], j, tangent != NULL);
        if (status)
            return status;
    }
    for (int k = 1; k <= NB; ++k) {
        if (tangent) {
            msfp_angular_balance_tangent(p->body[k], w->body[k], w->force[k - 1], w->moment[k - 1], w->force[k], w->moment[k], out,
                                         w->dbody[k], w->dforce[k - 1], w->dmoment[k - 1], w->dforce[k], w->dmoment[k], dout);
            memcpy(tangent + (k - 1) * ND * DOF, dout, ND * DOF * sizeof *tangent);
        } else
            msfp_angular_balance(p->body[k], w->body[k], w->force[k - 1], w->moment[k - 1], w->force[k], w->moment[k], out);
        memcpy(residual + (k - 1) * ND, out, ND * sizeof *residual);
    }
    return MSFP_OK;
}

void msfp_residual_scale(const msfp_parameters *p, const msfp_work *w, double *scale)
{
    for (int k = 0; k < NB; ++k) {
        const double *par = p->surface[k];
        const double natural = w->contact[k][MSFP_CONTACT_N] * par[MSFP_SURFACE_PARAMETERS_R] * (par[MSFP_SURFACE_PARAMETERS_MU] + 0.01);
        for (int i = 0; i < ND; ++i)
            scale[k * ND + i] = natural > 1e-12 ? natural : 1e-12;
    }
}

void msfp_friction_rates(const msfp_work *w, double rates[MSFP_NB][2])
{
    for (int j = 0; j < NB; ++j) {
        rates[j][0] = w->contact[j][MSFP_CONTACT_DY];
        rates[j][1] = msfp_contact_dZ(w->contact[j]);
    }
}

int msfp_accelerations(const msfp_parameters *p, msfp_point *at, msfp_work *w, msfp_solution *out)
{
    double residual[DOF], tangent[DOF * DOF], scale[DOF], f[NB][2];
    int pivots[DOF];
    msfp_seed seed = { 0.0, 0.0, 1.0, 0.0, 0.0, { { 0 } } };
    memcpy(seed.fp, at->f, sizeof seed.fp);
    double last = INFINITY;
    out->determinant = 1;
    for (out->iterations = 0; out->iterations < 50; ++out->iterations) {
        memcpy(f, at->f, sizeof f);
        const int status = msfp_condensed(p, at, &seed, w, f, residual, tangent);
        if (status)
            return status;
        msfp_residual_scale(p, w, scale);
        out->residual = 0.0;
        for (int i = 0; i < DOF; ++i)
            out->residual = fmax(out->residual, fabs(residual[i]) / scale[i]);
        if (!(out->residual < INFINITY))
            return MSFP_E_FINITE;
        /* Converged, or at the floor that rounding leaves. */
        if (out->residual <= 1e-13 || (out->residual <= 1e-9 && out->residual >= 0.5 * last))
            return MSFP_OK;
        last = out->residual;
        out->determinant = msfp_lu(tangent, DOF, pivots);
        if (out->determinant == 0)
            return MSFP_E_IRREGULAR;
        msfp_lu_solve(tangent, DOF, pivots, residual);
        for (int k = 0; k < NB; ++k)
            for (int i = 0; i < ND; ++i)
                at->a[k][angle_of(i)] -= residual[k * ND + i];
    }
    return MSFP_E_NEWTON;
}

/* ---- the report's balances ------------------------------------------------------------------------ */

#define ROWS_BODY (VECTOR + MOMENT)

/* Unknowns (2.119) into the point and the contact blocks. */
static void spread(const double *unknowns, msfp_point *at, double contact[NB][MSFP_UNKNOWNS_SIZE])
{
    for (int k = 0; k < NB; ++k) {
        for (int i = 0; i < MSFP_ANGLES_A; ++i)
            at->a[k][MSFP_PLANAR ? 1 : i] = unknowns[k * MSFP_ANGLES_A + i];
        for (int i = 0; i < MSFP_ANGLES_C; ++i)
            contact[k][i] = unknowns[NB * MSFP_ANGLES_A + k * MSFP_ANGLES_C + i];
        contact[k][MSFP_ANGLES_C] = unknowns[NB * (MSFP_ANGLES_A + MSFP_ANGLES_C) + k];
    }
}

typedef struct {
    double contact[NB][MSFP_UNKNOWNS_SIZE], dcontact[NB][MSFP_UNKNOWNS_SIZE * DOF];
    double dfriction[NB][FRICTION * DOF], drates[NB][FRICTION * DOF], dload[(VECTOR + MOMENT) * DOF], dground[MSFP_BODY_SIZE * DOF];
} columns;

/* Put a 1 where variable `v` lives, in column c. */
static void seed_variable(msfp_work *w, columns *s, const msfp_variable *v, int c)
{
    static const int map_coordinate[9] = { -1, 0, -1, -1, 1, -1, -1, 2, -1 }, map_polar[3] = { 0, -1, 1 }, map_pair[3] = { -1, 0, 1 };
    double zero[3] = { 0 }, one[MSFP_BODY_SIZE] = { 0 };
    int field = v->field;
    switch (v->kind) {
    case MSFP_SEED_COORDINATE:
        field = MSFP_PLANAR ? map_coordinate[field] : field;
        if (field >= 0)
            w->dx[v->index][field * DOF + c] = 1.0;
        break;
    case MSFP_SEED_CONTACT:
        field = MSFP_PLANAR ? map_pair[field] : field;
        if (field >= 0)
            s->dcontact[v->index][field * DOF + c] = 1.0;
        break;
    case MSFP_SEED_FRICTION:
        if (field < FRICTION)
            s->dfriction[v->index][field * DOF + c] = 1.0;
        break;
    case MSFP_SEED_BASE:
        zero[field % 3] = 1.0;
        if (field / 3 == 0)
            msfp_body_C_put(one, zero);
        else if (field / 3 == 1)
            msfp_body_V_put(one, zero);
        else
            msfp_body_A_put(one, zero);
        for (int i = 0; i < MSFP_BODY_SIZE; ++i)
            s->dground[i * DOF + c] = one[i];
        break;
    default:
        if (field < 3)
            field = MSFP_PLANAR ? map_polar[field] : field;
        else
            field = MSFP_PLANAR ? (field == 4 ? VECTOR : -1) : field;
        if (field >= 0)
            s->dload[field * DOF + c] = 1.0;
    }
}

static void report_surface(const msfp_parameters *p, const msfp_point *at, msfp_work *w, columns *s, int j, int tangent)
{
    double out[MSFP_REPORT_CONTACT_SIZE], f[2] = { at->f[j][0], at->f[j][1] }, moment[MOMENT], force[VECTOR];
    double drim[(VECTOR + MOMENT + 3) * MSFP_RIM_LOCAL] = { 0 }, drf[VECTOR * DOF], drm[MOMENT * DOF];
    rim(p, w, j, tangent ? drim : NULL);
    if (!tangent) {
        msfp_surface_local(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[NB], w->rim[j], w->local[j]);
        msfp_report_contact(p->surface[j], s->contact[j], f, w->local[j], out);
        memcpy(w->contact[j] + MSFP_CONTACT_DY, out + MSFP_REPORT_CONTACT_DY, FRICTION * sizeof *out);
    }
    double dlocal[MSFP_LOCAL_SIZE * DOF], dout[MSFP_REPORT_CONTACT_SIZE * DOF];
    if (tangent) {
        rim_columns(w, j, drim, drf, drm);
        /* Only the slip rotation of the local block is used here: the force is made from the unknowns. */
        msfp_surface_local_tangent(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[NB], w->rim[j], w->local[j],
                                   w->dbody[j], w->dbody[j + 1], w->dx[j + 1], w->dx[j], w->dforce[NB], drf, dlocal);
        msfp_report_contact_tangent(p->surface[j], s->contact[j], f, w->local[j], out, s->dcontact[j], s->dfriction[j], dlocal, dout);
    }
    for (int r = 0; r < VECTOR; ++r)
        force[r] = out[r] + w->rim[j][r];
    for (int r = 0; r < MOMENT; ++r)
        moment[r] = out[VECTOR + r] + w->rim[j][VECTOR + r];
    if (!tangent) {
        msfp_force_to_world(w->body[j], force, w->force[j]);
        msfp_moment_to_world(w->body[j], moment, w->moment[j]);
        return;
    }
    memcpy(s->drates[j], dout + MSFP_REPORT_CONTACT_DY * DOF, sizeof s->drates[j]);
    for (int i = 0; i < VECTOR * DOF; ++i)
        dout[i] += drf[i];
    for (int i = 0; i < MOMENT * DOF; ++i)
        dout[VECTOR * DOF + i] += drm[i];
    msfp_force_to_world_tangent(w->body[j], force, w->force[j], w->dbody[j], dout, w->dforce[j]);
    msfp_moment_to_world_tangent(w->body[j], moment, w->moment[j], w->dbody[j], dout + VECTOR * DOF, w->dmoment[j]);
}

/* Locked spin: phi'' = 0 in place of the axial balance. */
static void lock_spin(const msfp_work *w, int k, double *row, double *drow)
{
    if (MSFP_PLANAR || !MSFP_SPIN_LOCKED)
        return;
    *row = w->x[k][coordinate(2, 2)];
    if (drow)
        memcpy(drow, w->dx[k] + coordinate(2, 2) * DOF, DOF * sizeof *drow);
}

static void report_rows(const msfp_parameters *p, msfp_work *w, int k, double *rows, double *drows)
{
    const double *below = w->force[k - 1], *above = w->force[k];
    if (drows) {
        msfp_linear_balance_tangent(p->body[k], w->body[k], below, above, rows,
                                    w->dbody[k], w->dforce[k - 1], w->dforce[k], drows);
        msfp_angular_balance_tangent(p->body[k], w->body[k], below, w->moment[k - 1], above, w->moment[k], rows + VECTOR, w->dbody[k],
                                     w->dforce[k - 1], w->dmoment[k - 1], w->dforce[k], w->dmoment[k], drows + VECTOR * DOF);
    } else {
        msfp_linear_balance(p->body[k], w->body[k], below, above, rows);
        msfp_angular_balance(p->body[k], w->body[k], below, w->moment[k - 1], above, w->moment[k], rows + VECTOR);
    }
    lock_spin(w, k, rows + ROWS_BODY - 1, drows ? drows + (ROWS_BODY - 1) * DOF : NULL);
}

void msfp_report(const msfp_parameters *p, const msfp_point *given, const double *unknowns, msfp_work *w,
                 double *residual, const msfp_variable *variables, int count, double *jacobian, double *rates)
{
    msfp_point at = *given;
    columns s;
    double rows[ROWS_BODY], drows[ROWS_BODY * DOF], below[MSFP_BODY_SIZE];
    spread(unknowns, &at, s.contact);
    kinematics(p, &at, w);
    top(p, &at, w);
    for (int j = 0; j < NB; ++j)
        report_surface(p, &at, w, &s, j, 0);
    for (int k = 1; k <= NB; ++k) {
        report_rows(p, w, k, rows, NULL);
        memcpy(residual + (k - 1) * ROWS_BODY, rows, sizeof rows);
    }
    for (int first = 0; first < count; first += DOF) {
        const int width = count - first < DOF ? count - first : DOF;
        memset(w->dx, 0, sizeof w->dx);
        memset(s.dcontact, 0, sizeof s.dcontact);
        memset(s.dfriction, 0, sizeof s.dfriction);
        memset(s.dload, 0, sizeof s.dload);
        memset(s.dground, 0, sizeof s.dground);
        for (int c = 0; c < width; ++c)
            seed_variable(w, &s, variables + first + c, c);
        ground(&at, below);
        msfp_forward_tangent(p->body[0], below, w->x[0], w->body[0], s.dground, w->dx[0], w->dbody[0]);
        kinematics_tangent(p, w);
        top_tangent(p, &at, w, s.dload);
        for (int j = 0; j < NB; ++j)
            report_surface(p, &at, w, &s, j, 1);
        for (int k = 1; k <= NB; ++k) {
            report_rows(p, w, k, rows, drows);
            for (int r = 0; r < ROWS_BODY; ++r)
                memcpy(jacobian + ((size_t)(k - 1) * ROWS_BODY + r) * count + first, drows + r * DOF, width * sizeof *jacobian);
        }
        for (int j = 0; j < NB && rates; ++j)
            for (int r = 0; r < FRICTION; ++r)
                memcpy(rates + ((size_t)2 * j + r) * count + first, s.drates[j] + r * DOF, width * sizeof *rates);
    }
}

static void unknown_variables(msfp_variable *v)
{
    int n = 0;
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < MSFP_ANGLES_A; ++i)
            v[n++] = (msfp_variable){ MSFP_SEED_COORDINATE, k + 1, 6 + (MSFP_PLANAR ? 1 : i) };
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < MSFP_ANGLES_C; ++i)
            v[n++] = (msfp_variable){ MSFP_SEED_CONTACT, k, MSFP_PLANAR ? 1 : i };
    for (int k = 0; k < NB; ++k)
        v[n++] = (msfp_variable){ MSFP_SEED_CONTACT, k, 2 };
}

/* Largest residual relative to N and N R. */
static double report_size(const msfp_parameters *p, const double *unknowns, const double *residual)
{
    double load = 1e-9, size = 0.0;
    for (int k = 0; k < NB; ++k)
        load = fmax(load, fabs(unknowns[NB * (MSFP_ANGLES_A + MSFP_ANGLES_C) + k]));
    for (int k = 0; k < NB; ++k)
        for (int r = 0; r < ROWS_BODY; ++r) {
            const double scale = r < VECTOR ? load : load * p->surface[k][MSFP_SURFACE_PARAMETERS_R];
            size = fmax(size, fabs(residual[k * ROWS_BODY + r]) / scale);
        }
    return size;
}

/* First guess: no acceleration, the normal through the contact centre of the body above, N from the load. */
static void first_guess(const msfp_parameters *p, const msfp_point *at, double *unknowns)
{
    double load = -at->load[2] + p->top[MSFP_TOP_PARAMETERS_M] * p->gravity;
    memset(unknowns, 0, MSFP_UNKNOWNS * sizeof *unknowns);
    for (int k = NB - 1; k >= 0; --k) {
        load += p->body[k + 1][MSFP_BODY_PARAMETERS_M] * p->gravity;
        for (int i = 0; i < MSFP_ANGLES_C; ++i)
            unknowns[NB * MSFP_ANGLES_A + k * MSFP_ANGLES_C + i] = at->q[k][MSFP_PLANAR ? 1 : i];
        unknowns[NB * (MSFP_ANGLES_A + MSFP_ANGLES_C) + k] = load;
    }
}

int msfp_report_solve(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm, msfp_solution *out)
{
    double residual[MSFP_UNKNOWNS], jacobian[MSFP_UNKNOWNS * MSFP_UNKNOWNS];
    msfp_variable variables[MSFP_UNKNOWNS];
    int pivots[MSFP_UNKNOWNS];
    unknown_variables(variables);
    if (!warm)
        first_guess(p, at, unknowns);
    double last = INFINITY;
    out->determinant = 1;
    for (out->iterations = 0; out->iterations < 30; ++out->iterations) {
        msfp_report(p, at, unknowns, w, residual, NULL, 0, NULL, NULL);
        out->residual = report_size(p, unknowns, residual);
        if (!(out->residual < INFINITY))
            return MSFP_E_FINITE;
        if (out->residual <= 1e-13 || (out->residual <= 1e-10 && out->residual >= 0.5 * last)) {
            double contact[NB][MSFP_UNKNOWNS_SIZE];
            spread(unknowns, at, contact);
            return MSFP_OK;
        }
        last = out->residual;
        msfp_report(p, at, unknowns, w, residual, variables, MSFP_UNKNOWNS, jacobian, NULL);
        out->determinant = msfp_lu(jacobian, MSFP_UNKNOWNS, pivots);
        if (out->determinant == 0)
            return MSFP_E_IRREGULAR;
        msfp_lu_solve(jacobian, MSFP_UNKNOWNS, pivots, residual);
        for (int i = 0; i < MSFP_UNKNOWNS; ++i)
            unknowns[i] -= residual[i];
    }
    return MSFP_E_NEWTON;
}

/* ---- named points ---------------------------------------------------------------------------------- */

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
    kinematics(p, at, &w);
    ground(at, below);
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
