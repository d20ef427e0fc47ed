/* bearing.c: a bearing with its top, and one evaluation of its equations, for the table of functions. */
#include <stdlib.h>
#include <string.h>
#include "api.h"

enum { STATE = MSFP_NB * MSFP_NQ };

static void copied(double *to, const double *from, size_t count)
{
    if (from)
        memcpy(to, from, count * sizeof *to);
}

static int valid_inputs(const msfp_inputs *at)
{
    return msfp_all_finite(at->q, STATE) && msfp_all_finite(at->v, STATE) && msfp_all_finite(at->a, STATE)
           && msfp_all_finite(at->f, 2 * NB) && msfp_all_finite(at->base, 18) && msfp_all_finite(at->load, 6)
           && msfp_all_finite(at->support, 12) && msfp_all_finite(at->foot, 2) && msfp_all_finite(at->memory, NB);
}

/* The point of an evaluation. Returns MSFP_OK, MSFP_E_ARGUMENT or MSFP_E_FINITE. */
static int point_of(const msfp_bearing *bearing, const msfp_inputs *at, msfp_point *point)
{
    if (!bearing || !at)
        return MSFP_E_ARGUMENT;
    if (!valid_inputs(at))
        return MSFP_E_FINITE;
    memset(point, 0, sizeof *point);
    copied(&point->q[0][0], at->q, STATE);
    copied(&point->v[0][0], at->v, STATE);
    copied(&point->a[0][0], at->a, STATE);
    copied(&point->f[0][0], at->f, 2 * NB);
    copied(&point->base[0][0], at->base, 18);
    copied(point->load, at->load, 6);
#if MSFP_TOP_ROTATION
    copied(&point->support[0][0], at->support, 12);
#endif
    if (at->foot)
        copied(point->foot, at->foot, 2);
    else
        msfp_foot_at_rest(&bearing->parameters, point, point->foot);
#if MSFP_MEMORY
    copied(point->past, at->memory, NB);
#endif
    return MSFP_OK;
}

/* Hand over numbers that were found. Returns MSFP_OK, or MSFP_E_FINITE where not all are finite. */
static int give(double *to, const void *from, size_t size)
{
    if (to)
        memcpy(to, from, size);
    return msfp_all_finite(from, size / sizeof *to) ? MSFP_OK : MSFP_E_FINITE;
}

/* The row of the evaluation in `w`, its time and integrals zero. Status as of give. */
static int row_of(const msfp_bearing *bearing, const msfp_point *point, msfp_work *w, double *row)
{
    msfp_row found;
    memset(&found, 0, sizeof found);
    msfp_observe(&bearing->parameters, point, w, &found);
    return give(row, &found, sizeof found);
}

static int rates_of(const msfp_work *w, double *rates)
{
    double found[NB][2];
    msfp_friction_rates(w, found);
    return give(rates, found, sizeof found);
}

static int first(int status, int other) { return status ? status : other; }

int msfp_api_bearing_new(double gravity, const double *bodies, const double *surfaces, const double *top,
                         msfp_bearing **bearing, const char **message)
{
    static const double none[MSFP_TOP_VALUES_SIZE] = { 0.0 };
    if (!bearing)
        return msfp_refuse(message, "bearing: give the address of a handle");
    *bearing = NULL;
    const int status = msfp_check_bearing(gravity, bodies, surfaces, top ? top : none, message);
    if (status)
        return status;
    msfp_bearing *new_bearing = malloc(sizeof *new_bearing);
    if (!new_bearing)
        return MSFP_E_MEMORY;
    msfp_set_parameters(&new_bearing->parameters, gravity, bodies, surfaces, top ? top : none);
    *bearing = new_bearing;
    return MSFP_OK;
}

void msfp_api_bearing_free(msfp_bearing *bearing) { free(bearing); }

int msfp_api_accelerations(const msfp_bearing *bearing, const msfp_inputs *at, int balances, double *a, double *row,
                           double *rates, double *unknowns, msfp_convergence *how)
{
    msfp_point point;
    msfp_work w;
    msfp_solution solution = { 0, 0, 0.0 };
    double found[MSFP_UNKNOWNS];
    int status = point_of(bearing, at, &point);
    if (status)
        return status;
#if MSFP_LAW
    memset(&w, 0, sizeof w); /* the first guess of the friction coefficients */
#endif
    memset(point.a, 0, sizeof point.a);
    status = balances ? msfp_solve_momentum_balances(&bearing->parameters, &point, &w, found, 0, &solution)
                      : msfp_accelerations(&bearing->parameters, &point, &w, &solution);
    const int finite = first(row_of(bearing, &point, &w, row), rates_of(&w, rates));
    status = first(status, msfp_surface_in_tension(&w) ? MSFP_E_UPLIFT : MSFP_OK);
    status = first(status, msfp_invalid_friction(&w) ? MSFP_E_LAW : MSFP_OK);
    status = first(first(status, finite), give(a, point.a, sizeof point.a));
    if (unknowns && balances)
        memcpy(unknowns, found, sizeof found);
    if (how)
        *how = (msfp_convergence){ solution.iterations, solution.determinant, solution.residual };
    return status;
}

int msfp_api_observe(const msfp_bearing *bearing, const msfp_inputs *at, double *row, double *powers, double *rates,
                     int *in_tension)
{
    msfp_point point;
    msfp_work w;
    double found[MSFP_WORKS];
    int status = point_of(bearing, at, &point);
    if (status)
        return status;
    status = row_of(bearing, &point, &w, row);
    const msfp_mechanical mechanical = msfp_mechanical_energy(&bearing->parameters, &point, &w);
    msfp_powers(&bearing->parameters, &point, &w, &mechanical, found);
    status = first(first(status, give(powers, found, sizeof found)), rates_of(&w, rates));
    if (in_tension)
        *in_tension = msfp_surface_in_tension(&w);
    return status;
}

int msfp_api_condensed(const msfp_bearing *bearing, const msfp_inputs *at, double q_weight, double v_weight,
                       double a_weight, double beta, double gain, double *residual, double *tangent, double *found)
{
    msfp_point point;
    msfp_work w;
    msfp_stage_weights weights = { 0 };
    double g[NB][2], rest[MSFP_DOF];
    const double factors[] = { q_weight, v_weight, a_weight, beta, gain };
    int status = point_of(bearing, at, &point);
    if (status == MSFP_OK && !msfp_all_finite(factors, sizeof factors / sizeof *factors))
        status = MSFP_E_FINITE;
    if (status)
        return status;
#if MSFP_LAW
    memset(&w, 0, sizeof w);
#endif
#if MSFP_MEMORY
    for (int j = 0; j < MSFP_GAINS; ++j)
        point.gain[j] = gain;
#endif
    point.foot_beta = beta;
    weights.q_weight = q_weight, weights.v_weight = v_weight, weights.a_weight = a_weight, weights.beta = beta;
    memcpy(weights.fp, point.f, sizeof weights.fp);
    memcpy(g, point.f, sizeof g);
    status = msfp_condensed(&bearing->parameters, &point, &weights, &w, g, residual ? residual : rest, tangent);
    msfp_friction_state(&w, g);
    status = first(status, give(found, g, sizeof g));
    return msfp_all_finite(residual, MSFP_DOF) && msfp_all_finite(tangent, MSFP_DOF * MSFP_DOF) ? status
                                                                                                 : first(status, MSFP_E_FINITE);
}

static int valid_variable(const msfp_variable *x)
{
    static const int indices[] = { NB + 1, NB, NB, 1, 1 };
    static const int fields[] = { 3 * MSFP_NQ, 3, 2, 9, 6 };
    return x->kind >= 0 && x->kind <= MSFP_SEED_LOAD && x->index >= 0 && x->index < indices[x->kind] && x->field >= 0
           && x->field < fields[x->kind];
}

int msfp_api_momentum_balances(const msfp_bearing *bearing, const msfp_inputs *at, const double *unknowns,
                               const msfp_variable *variables, int count, double *residual, double *jacobian,
                               double *rates)
{
    msfp_point point;
    msfp_work w;
    if (!unknowns || !residual || count < 0 || (count && (!variables || !jacobian)))
        return MSFP_E_ARGUMENT;
    int status = point_of(bearing, at, &point);
    if (status == MSFP_OK && !msfp_all_finite(unknowns, MSFP_UNKNOWNS))
        status = MSFP_E_FINITE;
    if (status)
        return status;
    for (int i = 0; i < count; ++i)
        if (!valid_variable(variables + i))
            return MSFP_E_ARGUMENT;
#if MSFP_LAW
    memset(&w, 0, sizeof w);
#endif
    if (rates)
        memset(rates, 0, 2 * NB * (size_t)count * sizeof *rates);
    msfp_momentum_balances(&bearing->parameters, &point, unknowns, &w, residual, variables, count, jacobian, rates);
    const int finite = msfp_all_finite(residual, MSFP_UNKNOWNS) &&
                       msfp_all_finite(jacobian, MSFP_UNKNOWNS * (size_t)count) &&
                       msfp_all_finite(rates, 2 * NB * (size_t)count);
    return finite ? MSFP_OK : MSFP_E_FINITE;
}

int msfp_api_named_vectors(const msfp_bearing *bearing, const msfp_inputs *at, double *points, double *rotations,
                           double *bases)
{
    msfp_point point;
    if (!points || !rotations || !bases)
        return MSFP_E_ARGUMENT;
    const int status = point_of(bearing, at, &point);
    if (status)
        return status;
    msfp_named_vectors(&bearing->parameters, &point, points, rotations, bases);
    const int finite = msfp_all_finite(points, (NB + 1) * 36) && msfp_all_finite(rotations, (NB + 1) * 12) &&
                       msfp_all_finite(bases, (NB + 1) * 9);
    return finite ? MSFP_OK : MSFP_E_FINITE;
}
