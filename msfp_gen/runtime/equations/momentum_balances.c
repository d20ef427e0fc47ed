/* momentum_balances.c: the 6(n-1) balances (3.26)-(3.29) as PEER 2017/07 states them, their Jacobians, and Newton's
 * method on them. msfp_balances_values and _tangents are in msfp_schedule.h, emitted from generator/schedule.py. */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

#define LEAST_FORCE 1e-6 /* [N], of generator/body.py */

enum {
    FRICTION = MSFP_FRICTION_SIZE,
    ROWS = MSFP_BALANCES_SIZE, /* of a body */
    NORMAL_FORCES = NB * (MSFP_ACCELERATIONS + MSFP_ANGLES_C) /* place of the first among the unknowns */
};

/* Hand the rates of friction on to the steppers, which read them in the blocks of the condensed equations. */
static void give_friction_rates(const msfp_blocks *s, msfp_work *w)
{
    for (int j = 0; j < NB; ++j) {
        memcpy(w->contact[j] + MSFP_CONTACT_DY, s->report_rates[j], sizeof s->report_rates[j]);
#if MSFP_MEMORY
        w->contact[j][MSFP_CONTACT_SOURCE] = s->report_contact[j][MSFP_REPORT_CONTACT_SOURCE];
#endif
    }
}

/* Copy `rows` rows of columns to columns `first` and following of a matrix with `count` columns. */
static void put_columns(const double *columns, int rows, int first, int count, double *matrix)
{
    const int width = count - first < DOF ? count - first : DOF;
    for (int r = 0; r < rows; ++r)
        memcpy(matrix + (size_t)r * count + first, columns + r * DOF, width * sizeof *matrix);
}

void msfp_momentum_balances(const msfp_parameters *p, const msfp_point *at, const double *unknowns, msfp_work *w,
                            double *residual, const msfp_variable *variables, int count, double *jacobian,
                            double *rates)
{
    msfp_blocks s;
    msfp_block_tangents ds;
    s.jacobians = NULL;
    msfp_set_inputs(p, at, NULL, w, &s);
    for (int j = 0; j < NB; ++j)
        memcpy(s.friction[j], at->f[j], sizeof s.friction[j]);
    for (int i = 0; i < MSFP_UNKNOWNS; ++i)
        *msfp_variable_values(w, &s, msfp_unknowns + i) = unknowns[i];
    msfp_balances_values(p, w, &s);
    give_friction_rates(&s, w);
    memcpy(residual, s.balances[1], NB * ROWS * sizeof *residual);
#if MSFP_UPLIFT
    memcpy(residual + NB * ROWS, s.excess[0], NB * FORCE * sizeof *residual);
#endif
    for (int first = 0; first < count; first += DOF) {
        msfp_clear_variables(w, &ds);
        for (int i = first; i < count && i < first + DOF; ++i) {
            double *columns = msfp_variable_tangents(w, &ds, variables + i);
            if (columns)
                columns[i - first] = 1.0;
        }
        msfp_balances_tangents(p, w, &s, &ds);
        put_columns(ds.balances[1], NB * ROWS, first, count, jacobian);
#if MSFP_UPLIFT
        put_columns(ds.excess[0], NB * FORCE, first, count, jacobian + (size_t)NB * ROWS * count);
#endif
        for (int j = 0; j < NB && rates; ++j)
            put_columns(ds.report_rates[j], FRICTION, first, count, rates + (size_t)2 * j * count);
    }
}

/* Largest residual relative to N and N R. */
static double balance_size(const msfp_parameters *p, const double *unknowns, const double *residual)
{
    double load = 1e-9, size = 0.0;
    for (int k = 0; k < NB; ++k)
        load = fmax(load, fabs(unknowns[NORMAL_FORCES + k]));
    for (int k = 0; k < NB; ++k)
        for (int r = 0; r < ROWS; ++r) {
            const double scale = r < FORCE ? load : load * p->surface[k][MSFP_SURFACE_PARAMETERS_R];
            size = fmax(size, fabs(residual[k * ROWS + r]) / scale);
        }
    for (int r = NB * ROWS; r < MSFP_UNKNOWNS; ++r) /* contact forces, with uplift */
        size = fmax(size, fabs(residual[r]) / load);
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
            unknowns[NB * MSFP_ACCELERATIONS + k * MSFP_ANGLES_C + i] = at->q[k][MSFP_PLANAR ? 1 : i];
        unknowns[NORMAL_FORCES + k] = load;
    }
}

#if MSFP_UPLIFT
static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* First guess of the contacts: the state gives their forces, from which friction inclines the normals a little. */
static void guess_contacts(const msfp_work *w, double *unknowns)
{
    double force[3], t1[3], t2[3], t3[3];
    for (int k = 0; k < NB; ++k) {
        msfp_unilateral_F_get(w->unilateral[k], force);
        msfp_body_t1_get(w->body[k], t1);
        msfp_body_t2_get(w->body[k], t2);
        msfp_body_t3_get(w->body[k], t3);
        const double x = dot(force, t1), y = dot(force, t2), z = dot(force, t3) + LEAST_FORCE;
        const double size = sqrt(x * x + y * y + z * z), angles[2] = { msfp_atan2(-y, z), msfp_asin(x / size) };
        for (int i = 0; i < MSFP_ANGLES_C; ++i)
            unknowns[NB * MSFP_ACCELERATIONS + k * MSFP_ANGLES_C + i] = angles[MSFP_PLANAR ? 1 : i];
        unknowns[NORMAL_FORCES + k] = size;
    }
}
#endif

static void give_accelerations(const double *unknowns, msfp_point *at)
{
    for (int k = 0; k < NB; ++k) {
        const double *found = unknowns + k * MSFP_ACCELERATIONS;
        for (int i = 0; i < MSFP_ANGLES_A; ++i)
            at->a[k][MSFP_PLANAR ? 1 : i] = found[i];
        for (int i = MSFP_ANGLES_A; i < MSFP_ACCELERATIONS; ++i)
            at->a[k][3 + (MSFP_PLANAR ? 2 * (i - MSFP_ANGLES_A) : i - MSFP_ANGLES_A)] = found[i];
    }
}

int msfp_solve_momentum_balances(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm,
                                 msfp_solution *out)
{
    double residual[MSFP_UNKNOWNS], jacobian[MSFP_UNKNOWNS * MSFP_UNKNOWNS];
    int pivots[MSFP_UNKNOWNS];
    if (!warm) {
        first_guess(p, at, unknowns);
#if MSFP_UPLIFT
        msfp_momentum_balances(p, at, unknowns, w, residual, NULL, 0, NULL, NULL);
        guess_contacts(w, unknowns);
#endif
    }
    double last = INFINITY;
    out->determinant = 1;
    for (out->iterations = 0; out->iterations < 30; ++out->iterations) {
        msfp_momentum_balances(p, at, unknowns, w, residual, NULL, 0, NULL, NULL);
        out->residual = balance_size(p, unknowns, residual);
        if (!(out->residual < INFINITY))
            return MSFP_E_FINITE;
        if (((warm || out->iterations) && out->residual <= 1e-13) ||
            (out->residual <= 1e-10 && out->residual >= 0.5 * last)) {
            give_accelerations(unknowns, at);
            return MSFP_OK;
        }
        last = out->residual;
        msfp_momentum_balances(p, at, unknowns, w, residual, msfp_unknowns, MSFP_UNKNOWNS, jacobian, NULL);
        out->determinant = msfp_lu(jacobian, MSFP_UNKNOWNS, pivots);
        if (out->determinant == 0)
            return MSFP_E_IRREGULAR;
        msfp_lu_solve(jacobian, MSFP_UNKNOWNS, pivots, residual);
        for (int i = 0; i < MSFP_UNKNOWNS; ++i)
            unknowns[i] -= residual[i];
    }
    return MSFP_E_NEWTON;
}
