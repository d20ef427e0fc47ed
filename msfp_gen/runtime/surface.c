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


#if MSFP_UPLIFT
static const int signs[NB] = MSFP_SIGNS;

/* The body that carries the footprint of surface j. */
static int slider_of(int j) { return signs[j] > 0 ? j + 1 : j; }

/* Compression along the slider's axis and across it. */
static void compression(const msfp_work *w, int j, double *along, double *across)
{
    double d[3], axis[3], square = 0.0;
    msfp_coordinates_d_get(w->x[j + 1], d);
    msfp_body_t3_get(w->body[slider_of(j)], axis);
    *along = -(d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2]);
    for (int i = 0; i < 3; ++i)
        square += (d[i] + *along * axis[i]) * (d[i] + *along * axis[i]);
    *across = sqrt(square);
}

double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    double along, across;
    const double *par = p->surface[j];
    compression(w, j, &along, &across);
    if (across * par[MSFP_SURFACE_PARAMETERS_CA] <= along * par[MSFP_SURFACE_PARAMETERS_SA])
        return sqrt(along * along + across * across);
    return par[MSFP_SURFACE_PARAMETERS_CA] * along + par[MSFP_SURFACE_PARAMETERS_SA] * across;
}

/* Force of the seat of surface j, into force[j]; zero where it is open or its damping would pull. */
void msfp_seat(const msfp_parameters *p, msfp_work *w, int j, int tangent)
{
    double along, across;
    const double *par = p->surface[j];
    const int k = slider_of(j);
    double *seat = w->seat[j], *dseat = w->dseat[j];
    compression(w, j, &along, &across);
    if (msfp_compression(p, w, j) > 0.0) {
        if (across * par[MSFP_SURFACE_PARAMETERS_CA] <= along * par[MSFP_SURFACE_PARAMETERS_SA]) {
            if (tangent)
                msfp_seat_inside_tangent(par, w->body[k], w->x[j + 1], seat, w->dbody[k], w->dx[j + 1], dseat);
            else
                msfp_seat_inside(par, w->body[k], w->x[j + 1], seat);
        } else if (tangent)
            msfp_seat_edge_tangent(par, w->body[k], w->x[j + 1], seat, w->dbody[k], w->dx[j + 1], dseat);
        else
            msfp_seat_edge(par, w->body[k], w->x[j + 1], seat);
    } else
        seat[MSFP_SEAT_GRIP] = seat[MSFP_SEAT_STORED] = seat[MSFP_SEAT_POWER] = 0.0;
    if (seat[MSFP_SEAT_GRIP] <= 0.0) {
        memset(seat, 0, (VECTOR + MOMENT) * sizeof *seat);
        if (tangent)
            memset(dseat, 0, sizeof w->dseat[j]);
    }
    memcpy(w->force[j], seat, sizeof w->force[j]);
    if (tangent)
        memcpy(w->dforce[j], dseat, sizeof w->dforce[j]);
}

/* The wrench of a surface is (F, M) about the centre of its concave side; on its slider's side the seat adds its moment. */
static void split_moment(msfp_work *w, int j, int tangent)
{
    const double *turning = w->seat[j] + VECTOR, *dturning = w->dseat[j] + VECTOR * DOF;
    const int above = signs[j] > 0;
    memcpy(w->below[j], w->moment[j], sizeof w->below[j]);
    double *on = above ? w->moment[j] : w->below[j], *don = above ? w->dmoment[j] : w->dbelow[j];
    if (tangent)
        memcpy(w->dbelow[j], w->dmoment[j], sizeof w->dbelow[j]);
    for (int i = 0; i < MOMENT; ++i) /* moment_below is what the body below receives, reversed */
        on[i] += above ? turning[i] : -turning[i];
    for (int i = 0; i < MOMENT * DOF && tangent; ++i)
        don[i] += above ? dturning[i] : -dturning[i];
}
#else
double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    (void)p;
    (void)w;
    (void)j;
    return 1.0;
}
#endif

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
#if MSFP_UPLIFT
    split_moment(w, j, tangent);
#endif
    return MSFP_OK;
}
