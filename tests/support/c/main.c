/* A program that uses an emitted model with no Python: accelerations at a state, then a short harmonic run.
 * The bearing is fenz-tfp of the report (tables A.1-A.4) on the rig of the report's tests.
 * Prints lines of "name value ..."; the test holds them against Python's.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "msfp_model.h"

#define PIECES 64
#define LOAD 112e3

static const double bodies[MSFP_NB + 1][MSFP_BODY_VALUES_SIZE] = {
    /* l, z, m, J transverse, J axial, r, p */
    { 0.013, 0.0065, 0.0, 0.0, 0.0, 0.0, 0.0 },
    { 0.015, 0.0075, 0.45, 3.01e-4, 5.85e-4, 0.051, 0.0028 },
    { 0.046, 0.023, 0.34, 1.15e-4, 1.11e-4, 0.0255, 0.0044 },
    { 0.015, 0.0075, 0.45, 3.01e-4, 5.85e-4, 0.051, 0.0028 },
    { 0.013, 0.0065, 8.0, 3.14e-2, 6.25e-2, 0.0, 0.0 },
};
static const double surfaces[MSFP_NB][MSFP_SURFACE_VALUES_SIZE] = {
    /* R, s_c, mu, d_y, k_c, c_c, T */
    { 0.473, 0.065, 0.03, 5e-5 / 0.473, 1e7, 5.0, 0.0 },
    { 0.076, 0.0215, 0.017, 5e-5 / 0.076, 1e7, 5.0, 0.0 },
    { 0.076, 0.0215, 0.017, 5e-5 / 0.076, 1e7, 5.0, 0.0 },
    { 0.473, 0.065, 0.107, 5e-5 / 0.473, 1e7, 5.0, 0.0 },
};
/* k, c, k_rot, c_rot; no mass, no anchor */
static const double top[MSFP_TOP_VALUES_SIZE] = { 1e8, 5.0, 1e6, 5.0 };

static void print(const char *name, const double *values, int count)
{
    printf("%s", name);
    for (int i = 0; i < count; ++i)
        printf(" %.17g", values[i]);
    printf("\n");
}

static int evaluate(const msfp_parameters *p)
{
    msfp_point at;
    msfp_work work;
    msfp_solution solution;
    double rates[MSFP_NB][2], normal[MSFP_NB];
    memset(&at, 0, sizeof at);
    at.base[2][0] = 0.5;
    at.load[2] = -LOAD;
    for (int k = 0; k < MSFP_NB; ++k) {
        at.q[k][0] = 0.01 * (k + 1);
        at.q[k][1] = -0.02 * (k + 1);
        at.v[k][1] = 0.1;
        at.f[k][0] = 0.3;
        at.f[k][1] = -0.2;
    }
    const int status = msfp_accelerations(p, &at, &work, &solution);
    if (status)
        return status;
    msfp_friction_rates(&work, rates);
    for (int j = 0; j < MSFP_NB; ++j)
        normal[j] = work.contact[j][MSFP_CONTACT_N];
    print("acceleration", &at.a[0][0], 3 * MSFP_NB);
    print("normal_force", normal, MSFP_NB);
    print("friction_rate", &rates[0][0], 2 * MSFP_NB);
    return MSFP_OK;
}

/* A (1 - cos(2 pi t / T)) over one period as quintics that take value, rate and second derivative at each knot. */
static void wave(double amplitude, double period, double *knots, double coefficients[PIECES][6][MSFP_DEGREE + 1])
{
    const double w = 2.0 * acos(-1.0) / period, h = period / PIECES;
    memset(coefficients, 0, PIECES * sizeof *coefficients);
    for (int i = 0; i <= PIECES; ++i)
        knots[i] = i * h;
    for (int i = 0; i < PIECES; ++i) {
        double u[2], r[2], s[2], *c = coefficients[i][0];
        for (int e = 0; e < 2; ++e) {
            u[e] = amplitude * (1.0 - cos(w * knots[i + e]));
            r[e] = amplitude * w * sin(w * knots[i + e]);
            s[e] = amplitude * w * w * cos(w * knots[i + e]);
        }
        const double d0 = u[1] - u[0] - h * (r[0] + h * s[0] / 2.0), d1 = (r[1] - r[0] - h * s[0]) * h, d2 = (s[1] - s[0]) * h * h;
        c[0] = u[0];
        c[1] = r[0];
        c[2] = s[0] / 2.0;
        c[3] = (10.0 * d0 - 4.0 * d1 + d2 / 2.0) / (h * h * h);
        c[4] = (-15.0 * d0 + 7.0 * d1 - d2) / (h * h * h * h);
        c[5] = (6.0 * d0 - 3.0 * d1 + d2 / 2.0) / (h * h * h * h * h);
    }
}

static int integrate(const msfp_parameters *p)
{
    static double knots[PIECES + 1], coefficients[PIECES][6][MSFP_DEGREE + 1];
    static msfp_run run;
    const double load_knots[2] = { 0.0, 1.0 }, zero[3 * MSFP_NB] = { 0 };
    double load_coefficients[6][MSFP_DEGREE + 1] = { { 0 } };
    wave(0.01, 2.0, knots, coefficients);
    load_coefficients[2][0] = -LOAD;
    const msfp_history motion = { .pieces = PIECES, .knots = knots, .coefficients = &coefficients[0][0][0] };
    const msfp_history load = { .pieces = 1, .knots = load_knots, .coefficients = &load_coefficients[0][0] };
    msfp_options options;
    memset(&options, 0, sizeof options);
    options.method = MSFP_METHOD_IMPLICIT;
    options.rtol = 1e-5;
    options.atol_angle = 1e-7;
    options.max_steps = 1e6;
    options.duration = 2.0;
    options.output_step = 0.02;
    msfp_run_start(&run, p, &motion, &load, NULL, NULL, 0, &options, zero, zero, zero);
    while (msfp_run_advance(&run, 50))
        ;
    for (size_t i = 0; i < run.row_count; ++i) {
        print("time", &run.rows[i].time, 1);
        print("top_force", run.rows[i].top_force, 3);
    }
    const double steps = (double)run.counts[MSFP_COUNT_STEPS];
    print("steps", &steps, 1);
    const int status = run.status;
    msfp_run_free(&run);
    return status;
}

int main(void)
{
    static msfp_parameters parameters;
    msfp_set_parameters(&parameters, 9.8, &bodies[0][0], &surfaces[0][0], top);
    int status = evaluate(&parameters);
    if (!status)
        status = integrate(&parameters);
    printf("status %s\n", msfp_status_name(status));
    return status != MSFP_OK;
}
