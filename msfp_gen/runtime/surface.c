/* surface.c: one sliding surface: rim, contact with Y and Z condensed, and the gaps. */
#include <math.h>
#include <string.h>
#include "stack.h"

#if MSFP_RIMS
static void rim_coordinates(const msfp_work *w, int j, double *x)
{
    for (int order = 0; order < 2; ++order)
        for (int i = 0; i < PAIR; ++i)
            x[order * PAIR + i] = w->x[j + 1][coordinate(order, i)];
}
#endif

/* Rim force of surface j; drim (or NULL): its local Jacobian [f, M][psi, theta and rates]. */
void msfp_rim_force(const msfp_parameters *p, msfp_work *w, int j, double *drim)
{
    memset(w->rim[j], 0, sizeof w->rim[j]);
    w->rim_active[j] = 0;
    w->rim_sum[j] = 0.0;
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
    w->rim_sum[j] = out[MSFP_RIM_FC];
    if (out[MSFP_RIM_FC] < 0.0) { /* compression only: docs/model.md, choice 4 */
        memcpy(w->rim[j], out, sizeof out);
        w->rim_active[j] = 1;
    }
#else
    (void)p;
    (void)drim;
#endif
}

void msfp_gaps(const msfp_parameters *p, const double q[MSFP_NB][MSFP_NQ], double sliding[MSFP_NB][MSFP_GAP_SIZE])
{
    for (int j = 0; j < NB; ++j) {
        double x[MSFP_RIM_LOCAL] = { 0 };
        for (int i = 0; i < PAIR; ++i)
            x[i] = q[j][MSFP_PLANAR ? 1 : i];
        msfp_gap(p->surface[j], x, sliding[j]);
    }
}

/* Columns of the rim force and moment from the local Jacobian. */
void msfp_rim_columns(const msfp_work *w, int j, const double *drim, double *dforce, double *dmoment)
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

#define OWN (FRICTION + MSFP_LAW) /* local unknowns: Y, Z, and mu where it follows a law */
#define ROWS (MOMENT + OWN + 1)  /* rows of the contact's tangent: M, dY, dZ, mu, N */
#define ACTIONS (MOMENT + 1)     /* what is condensed: M and N */
#if MSFP_HEAT
#define SLOPE(out) (out)[MSFP_CONTACT_LAW_MU] /* d mu/d mu by its law: friction heats */
#else
#define SLOPE(out) 0.0
#endif

#if MSFP_LAW
void msfp_surroundings(const msfp_point *at, msfp_work *w)
{
    for (int j = 0; j < NB; ++j) {
        double *x = w->coefficient[j];
#if MSFP_HEAT
        x[MSFP_COEFFICIENT_RISE] = at->rise[j];
        x[MSFP_COEFFICIENT_WARMING] = at->warming;
#else
        (void)at;
#endif
        if (!(fabs(x[MSFP_COEFFICIENT_MU]) < 1e3)) /* left by a failed step */
            x[MSFP_COEFFICIENT_MU] = 0.0;
    }
}
#endif

static void contact_tangent(const double *par, const double *local, const double *f LAW(const double *x), double *out, double *jacobian)
{
    double seed[(MSFP_LOCAL_SIZE + OWN) * MSFP_LOCAL] = { 0 }, full[MSFP_CONTACT_SIZE * MSFP_LOCAL];
    for (int i = 0; i < MSFP_LOCAL; ++i)
        seed[i * MSFP_LOCAL + i] = 1.0;
    msfp_contact_tangent(par, local, f LAW(x), out, seed, seed + MSFP_LOCAL_SIZE * MSFP_LOCAL
                         LAW(seed + (MSFP_LOCAL_SIZE + FRICTION) * MSFP_LOCAL), full);
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

/* Y, Z of one surface from their stage formula f = fp + beta df/dt, at a given force and slip rotation, and mu from its
 * law. Newton with the derivative at constant slip velocity and N (the contact point hardly moves with Y, Z, mu), halved
 * while it does not help. */
static int friction_stage(const double *par, const double *local, const double *fp, double beta, double accuracy, double *f LAW(double *x), double *out)
{
    double g[FRICTION], a[FRICTION * FRICTION], step[OWN] = { 0 }, best = INFINITY;
    for (int i = 0; i < 60; ++i) {
        msfp_contact(par, local, f LAW(x), out);
        double size = 0.0;
        for (int r = 0; r < FRICTION; ++r) {
            g[r] = f[r] - fp[r] - beta * out[MSFP_CONTACT_DY + r];
            size = fmax(size, fabs(g[r]));
        }
#if MSFP_LAW
        const double excess = x[MSFP_COEFFICIENT_MU] - out[MSFP_CONTACT_MU];
        size = fmax(size, fabs(excess));
#endif
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
#if MSFP_LAW
        step[FRICTION] = overshot ? 0.5 * step[FRICTION] : excess;
        for (int c = 0; c < FRICTION && !overshot; ++c)
            step[FRICTION] += out[MSFP_CONTACT_LAW_Y + c] * step[c];
        step[FRICTION] /= overshot ? 1.0 : 1.0 - SLOPE(out);
        x[MSFP_COEFFICIENT_MU] += overshot ? step[FRICTION] : -step[FRICTION];
#endif
        for (int r = 0; r < FRICTION; ++r) /* past a switch: half the step back */
            f[r] += overshot ? step[r] : -step[r];
    }
    return MSFP_E_NEWTON;
}

/* Jacobian of the moment and of N with Y, Z following their stage formula and mu its law: [ACTIONS][MSFP_LOCAL_SIZE]. */
static int condense(const double *par, const double *local, const double *f LAW(const double *x), double beta, double *out, double *condensed)
{
    double jacobian[ROWS * MSFP_LOCAL], a[OWN * OWN], b[OWN];
    contact_tangent(par, local, f LAW(x), out, jacobian);
    for (int r = 0; r < OWN; ++r)
        for (int c = 0; c < OWN; ++c)
            a[r * OWN + c] = (r == c) - (r < FRICTION ? beta : 1.0) * jacobian[(MOMENT + r) * MSFP_LOCAL + MSFP_LOCAL_SIZE + c];
#if MSFP_LAW
    int pivots[OWN];
    if (!msfp_lu(a, OWN, pivots))
        return MSFP_E_NEWTON;
#endif
    for (int k = 0; k < MSFP_LOCAL_SIZE; ++k) {
        for (int r = 0; r < OWN; ++r)
            b[r] = (r < FRICTION ? beta : 1.0) * jacobian[(MOMENT + r) * MSFP_LOCAL + k];
#if MSFP_LAW
        msfp_lu_solve(a, OWN, pivots, b);
#else
        if (!solve_small(a, b))
            return MSFP_E_NEWTON;
#endif
        for (int r = 0; r < ACTIONS; ++r) {
            const double *row = jacobian + (r < MOMENT ? r : MOMENT + OWN) * MSFP_LOCAL;
            double sum = row[k];
            for (int c = 0; c < OWN; ++c)
                sum += row[MSFP_LOCAL_SIZE + c] * b[c];
            condensed[r * MSFP_LOCAL_SIZE + k] = sum;
        }
    }
    return MSFP_OK;
}

/* How much of its rim's force a surface presses against: all of it, but no more than it carries itself where bodies may
 * part; a rim met in flight turns the bodies and presses nothing. */
static double rim_share(const msfp_work *w, int j)
{
    double carried = 0.0, met = 0.0;
    if (!MSFP_UPLIFT || !w->rim_active[j])
        return 1.0;
    for (int i = 0; i < VECTOR; ++i) {
        carried += w->force[j][i] * w->force[j][i];
        met += w->rim[j][i] * w->rim[j][i];
    }
    return carried < met ? sqrt(carried / met) : 1.0;
}

/* Force, slip, friction and moment of surface j. */
int msfp_surface(const msfp_parameters *p, msfp_work *w, const msfp_seed *seed, double *f, int j, int tangent)
{
    double drim[MSFP_RIM_SIZE * MSFP_RIM_LOCAL] = { 0 }, condensed[ACTIONS * MSFP_LOCAL_SIZE], moment[MOMENT];
    double drf[VECTOR * DOF], dmoment[MOMENT * DOF], dlocal[MSFP_LOCAL_SIZE * DOF];
    const double *par = p->surface[j];
    const double fp[2] = { seed->fp[j][0], seed->fp[j][1] };
    double rim[VECTOR];
    msfp_rim_force(p, w, j, tangent ? drim : NULL);
    const double share = rim_share(w, j);
    for (int i = 0; i < VECTOR; ++i)
        rim[i] = share * w->rim[j][i];
    if (tangent) {
        msfp_rim_columns(w, j, drim, drf, dmoment);
        for (int i = 0; i < VECTOR * DOF; ++i)
            drf[i] *= share;
        msfp_surface_local_tangent(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], rim, w->local[j],
                                   w->dbody[j], w->dbody[j + 1], w->dx[j + 1], w->dx[j], w->dforce[j], drf, dlocal);
    } else
        msfp_surface_local(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[j], rim, w->local[j]);
    int status = friction_stage(par, w->local[j], fp, seed->beta, fmax(seed->accuracy, 1e-12), f LAW(w->coefficient[j]), w->contact[j]);
    if (status == MSFP_OK && tangent)
        status = condense(par, w->local[j], f LAW(w->coefficient[j]), seed->beta, w->contact[j], condensed);
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
#if MSFP_UPLIFT
    msfp_split_moment(w, j, tangent);
#endif
    return MSFP_OK;
}
