/* momentum_balances.c: the 6(n-1) balances (3.26)-(3.29) as PEER 2017/07 states them, their Jacobians, and Newton's
 * method on them. msfp_balances_values and _tangents are in msfp_schedule.h, emitted from generator/schedule.py. */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

enum {
    FRICTION = MSFP_FRICTION_SIZE,
    ROWS = MSFP_BALANCES_SIZE /* of a body */
};

/* Hand the rates of friction on to the steppers, which read them in the blocks of the condensed equations. */
static void give_friction_rates(const msfp_blocks *s, msfp_work *w)
{
    for (int j = 0; j < NB; ++j) {
        memcpy(w->contact[j] + MSFP_CONTACT_DY, s->report_contact[j] + MSFP_REPORT_CONTACT_DY,
               FRICTION * sizeof(double));
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
    memcpy(residual, s.balances[1], MSFP_UNKNOWNS * sizeof *residual);
    for (int first = 0; first < count; first += DOF) {
        msfp_clear_variables(w, &ds);
        for (int i = first; i < count && i < first + DOF; ++i) {
            double *columns = msfp_variable_tangents(w, &ds, variables + i);
            if (columns)
                columns[i - first] = 1.0;
        }
        msfp_balances_tangents(p, w, &s, &ds);
        put_columns(ds.balances[1], MSFP_UNKNOWNS, first, count, jacobian);
        for (int j = 0; j < NB && rates; ++j)
            put_columns(ds.report_contact[j] + MSFP_REPORT_CONTACT_DY * DOF, FRICTION, first, count,
                        rates + (size_t)2 * j * count);
    }
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

static void give_accelerations(const double *unknowns, msfp_point *at)
{
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < MSFP_ANGLES_A; ++i)
            at->a[k][MSFP_PLANAR ? 1 : i] = unknowns[k * MSFP_ANGLES_A + i];
}

int msfp_solve_momentum_balances(const msfp_parameters *p, msfp_point *at, msfp_work *w, double *unknowns, int warm,
                                 msfp_solution *out)
{
    double residual[MSFP_UNKNOWNS], jacobian[MSFP_UNKNOWNS * MSFP_UNKNOWNS];
    int pivots[MSFP_UNKNOWNS];
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
