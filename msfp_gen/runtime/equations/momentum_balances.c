/* momentum_balances.c: the 6(n-1) balances of PEER 2017/07 as they stand, their Jacobians, and Newton's method on
 * them. */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

enum {
    FRICTION = MSFP_FRICTION_SIZE
};
enum { ROWS = FORCE + MOMENT }; /* of a body */

/* Copy the unknowns (2.119) to the point and to the blocks of the contacts. */
static void distribute(const double *unknowns, msfp_point *at, double contact[NB][MSFP_UNKNOWNS_SIZE])
{
    for (int k = 0; k < NB; ++k) {
        for (int i = 0; i < MSFP_ANGLES_A; ++i)
            at->a[k][MSFP_PLANAR ? 1 : i] = unknowns[k * MSFP_ANGLES_A + i];
        for (int i = 0; i < MSFP_ANGLES_C; ++i)
            contact[k][i] = unknowns[NB * MSFP_ANGLES_A + k * MSFP_ANGLES_C + i];
        contact[k][MSFP_ANGLES_C] = unknowns[NB * (MSFP_ANGLES_A + MSFP_ANGLES_C) + k];
    }
}

/* The contacts, and columns of what the variables of a Jacobian enter. */
typedef struct {
    double contact[NB][MSFP_UNKNOWNS_SIZE], dcontact[NB][MSFP_UNKNOWNS_SIZE * DOF];
    double dfriction[NB][FRICTION * DOF], drates[NB][FRICTION * DOF], dload[(FORCE + MOMENT) * DOF],
        dground[MSFP_BODY_SIZE * DOF];
} columns;

/* Set column c to the derivative with respect to variable `v`. */
static void seed_variable(msfp_work *w, columns *s, const msfp_variable *v, int c)
{
    static const int map_coordinate[9] = { -1, 0, -1, -1, 1, -1, -1, 2, -1 }, map_polar[3] = { 0, -1, 1 },
                     map_pair[3] = { -1, 0, 1 };
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
            field = MSFP_PLANAR ? (field == 4 ? FORCE : -1) : field;
        if (field >= 0)
            s->dload[field * DOF + c] = 1.0;
    }
}

/* Force and moment of surface j at given unknowns, or (tangent) their columns. */
static void balance_surface(const msfp_parameters *p, const msfp_point *at, msfp_work *w, columns *s, int j,
                            int tangent)
{
    double out[MSFP_REPORT_CONTACT_SIZE], f[2] = { at->f[j][0], at->f[j][1] }, moment[MOMENT], force[FORCE];
    double drim[MSFP_RIM_SIZE * MSFP_RIM_LOCAL] = { 0 }, drf[FORCE * DOF], drm[MOMENT * DOF];
    msfp_rim_force(p, w, j, tangent ? drim : NULL);
    if (!tangent) {
        msfp_surface_local(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[NB], w->rim[j], w->local[j]);
        msfp_report_contact(p->surface[j], s->contact[j], f, w->local[j] MSFP_IF_LAW(w->coefficient[j]), out);
        memcpy(w->contact[j] + MSFP_CONTACT_DY, out + MSFP_REPORT_CONTACT_DY, FRICTION * sizeof *out);
#if MSFP_HEAT
        w->contact[j][MSFP_CONTACT_FLUX] = out[MSFP_REPORT_CONTACT_FLUX];
#endif
    }
    double dlocal[MSFP_LOCAL_SIZE * DOF], dout[MSFP_REPORT_CONTACT_SIZE * DOF];
    if (tangent) {
        msfp_rim_force_tangent(w, j, drim, drf, drm);
        /* Only the slip of the local block is used: here the contact force follows from the unknowns. */
        msfp_surface_local_tangent(w->body[j], w->body[j + 1], w->x[j + 1], w->x[j], w->force[NB], w->rim[j],
                                   w->local[j], w->dbody[j], w->dbody[j + 1], w->dx[j + 1], w->dx[j], w->dforce[NB],
                                   drf, dlocal);
        msfp_report_contact_tangent(p->surface[j], s->contact[j], f, w->local[j] MSFP_IF_LAW(w->coefficient[j]), out,
                                    s->dcontact[j], s->dfriction[j], dlocal, dout);
    }
    for (int r = 0; r < FORCE; ++r)
        force[r] = out[r] + w->rim[j][r];
    for (int r = 0; r < MOMENT; ++r)
        moment[r] = out[FORCE + r] + w->rim[j][FORCE + r];
    if (!tangent) {
        msfp_force_to_world(w->body[j], force, w->force[j]);
        msfp_moment_to_world(w->body[j], moment, w->moment[j]);
        return;
    }
    memcpy(s->drates[j], dout + MSFP_REPORT_CONTACT_DY * DOF, sizeof s->drates[j]);
    for (int i = 0; i < FORCE * DOF; ++i)
        dout[i] += drf[i];
    for (int i = 0; i < MOMENT * DOF; ++i)
        dout[FORCE * DOF + i] += drm[i];
    msfp_force_to_world_tangent(w->body[j], force, w->force[j], w->dbody[j], dout, w->dforce[j]);
    msfp_moment_to_world_tangent(w->body[j], moment, w->moment[j], w->dbody[j], dout + FORCE * DOF, w->dmoment[j]);
}

/* With locked spin, phi'' = 0 replaces the axial balance. */
static void lock_spin(const msfp_work *w, int k, double *row, double *drow)
{
    if (MSFP_PLANAR || !MSFP_SPIN_LOCKED)
        return;
    *row = w->x[k][msfp_coordinate_field(2, 2)];
    if (drow)
        memcpy(drow, w->dx[k] + msfp_coordinate_field(2, 2) * DOF, DOF * sizeof *drow);
}

/* Rows of body k; drows: their columns, or NULL. */
static void balance_rows(const msfp_parameters *p, msfp_work *w, int k, double *rows, double *drows)
{
    const double *below = w->force[k - 1], *above = w->force[k];
    if (drows) {
        msfp_linear_balance_tangent(p->body[k], w->body[k], below, above, rows,
                                    w->dbody[k], w->dforce[k - 1], w->dforce[k], drows);
        msfp_angular_balance_tangent(p->body[k], w->body[k], below, w->moment[k - 1], above, w->moment[k], rows + FORCE,
                                     w->dbody[k], w->dforce[k - 1], w->dmoment[k - 1], w->dforce[k], w->dmoment[k],
                                     drows + FORCE * DOF);
    } else {
        msfp_linear_balance(p->body[k], w->body[k], below, above, rows);
        msfp_angular_balance(p->body[k], w->body[k], below, w->moment[k - 1], above, w->moment[k], rows + FORCE);
    }
    lock_spin(w, k, rows + ROWS - 1, drows ? drows + (ROWS - 1) * DOF : NULL);
}

void msfp_momentum_balances(const msfp_parameters *p, const msfp_point *given, const double *unknowns, msfp_work *w,
                 double *residual, const msfp_variable *variables, int count, double *jacobian, double *rates)
{
    msfp_point at = *given;
    columns s;
    double rows[ROWS], drows[ROWS * DOF], below[MSFP_BODY_SIZE];
    distribute(unknowns, &at, s.contact);
    msfp_base(p, &at, w);
    msfp_kinematics(p, &at, w);
    msfp_top(p, &at, w);
#if MSFP_LAW
    msfp_friction_conditions(&at, w);
#endif
    for (int j = 0; j < NB; ++j)
        balance_surface(p, &at, w, &s, j, 0);
    for (int k = 1; k <= NB; ++k) {
        balance_rows(p, w, k, rows, NULL);
        memcpy(residual + (k - 1) * ROWS, rows, sizeof rows);
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
        msfp_inertial_frame(&at, below);
        msfp_forward_tangent(p->body[0], below, w->x[0], w->body[0], s.dground, w->dx[0], w->dbody[0]);
        msfp_kinematics_tangent(p, &at, w);
        msfp_top_tangent(p, &at, w, s.dload);
        for (int j = 0; j < NB; ++j)
            balance_surface(p, &at, w, &s, j, 1);
        for (int k = 1; k <= NB; ++k) {
            balance_rows(p, w, k, rows, drows);
            for (int r = 0; r < ROWS; ++r)
                memcpy(jacobian + ((size_t)(k - 1) * ROWS + r) * count + first, drows + r * DOF,
                       width * sizeof *jacobian);
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
static double balance_size(const msfp_parameters *p, const double *unknowns, const double *residual)
{
    double load = 1e-9, size = 0.0;
    for (int k = 0; k < NB; ++k)
        load = fmax(load, fabs(unknowns[NB * (MSFP_ANGLES_A + MSFP_ANGLES_C) + k]));
    for (int k = 0; k < NB; ++k)
        for (int r = 0; r < ROWS; ++r) {
            const double scale = r < FORCE ? load : load * p->surface[k][MSFP_SURFACE_PARAMETERS_R];
            size = fmax(size, fabs(residual[k * ROWS + r]) / scale);
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

int msfp_solve_momentum_balances(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm,
                                 msfp_solution *out)
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
        msfp_momentum_balances(p, at, unknowns, w, residual, NULL, 0, NULL, NULL);
        out->residual = balance_size(p, unknowns, residual);
        if (!(out->residual < INFINITY))
            return MSFP_E_FINITE;
        if (((warm || out->iterations) && out->residual <= 1e-13) ||
            (out->residual <= 1e-10 && out->residual >= 0.5 * last)) {
            double contact[NB][MSFP_UNKNOWNS_SIZE];
            distribute(unknowns, at, contact);
            return MSFP_OK;
        }
        last = out->residual;
        msfp_momentum_balances(p, at, unknowns, w, residual, variables, MSFP_UNKNOWNS, jacobian, NULL);
        out->determinant = msfp_lu(jacobian, MSFP_UNKNOWNS, pivots);
        if (out->determinant == 0)
            return MSFP_E_IRREGULAR;
        msfp_lu_solve(jacobian, MSFP_UNKNOWNS, pivots, residual);
        for (int i = 0; i < MSFP_UNKNOWNS; ++i)
            unknowns[i] -= residual[i];
    }
    return MSFP_E_NEWTON;
}
