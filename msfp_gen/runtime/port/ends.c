/* ends.c: the motion of the ends as base motion, load on the top plate and rotation of its support.
 *
 * Between two times every channel is the polynomial of degree five through values, first and second derivatives at
 * both: base accelerations are continuous, and a history of such pieces is repeated exactly.
 */
#include <math.h>
#include <string.h>
#include "port.h"

/* ---- rotation vectors ---- */

/* A value with two derivatives with respect to time. */
typedef struct {
    double of[MSFP_ORDERS];
} jet;

static jet constant(double value) { return (jet){ { value, 0.0, 0.0 } }; }

static jet sum(jet a, double factor, jet b)
{
    for (int i = 0; i < MSFP_ORDERS; ++i)
        a.of[i] += factor * b.of[i];
    return a;
}

static jet product(jet a, jet b)
{
    return (jet){ { a.of[0] * b.of[0], a.of[1] * b.of[0] + a.of[0] * b.of[1],
                    a.of[2] * b.of[0] + 2.0 * a.of[1] * b.of[1] + a.of[0] * b.of[2] } };
}

/* Sum over k of (-s)^k/(2k + first)!: sin(x)/x with first = 1, (1 - cos x)/x^2 with first = 2, where s = x^2 < 10. */
static jet series(jet s, int first)
{
    enum { TERMS = 20, SMALL = 8 };
    static const double smallest = 0.1; /* below it the terms from SMALL on vanish */
    double value = 0.0, rate = 0.0, second = 0.0;
    for (int k = s.of[0] < smallest ? SMALL : TERMS; k > 0; --k) { /* a_(k-1) = 1 + factor s a_k, in nested form */
        const double factor = -1.0 / ((2 * k + first) * (2 * k + first - 1));
        second = factor * (second * s.of[0] + 2.0 * rate);
        rate = factor * (rate * s.of[0] + (value + 1.0));
        value = factor * s.of[0] * (value + 1.0);
    }
    const double scale = 1.0 / first;
    value = (value + 1.0) * scale;
    rate *= scale;
    second *= scale;
    return (jet){ { value, rate * s.of[1], second * s.of[1] * s.of[1] + rate * s.of[2] } };
}

/* Angle of the point (x, y). */
static jet angle_of(jet y, jet x)
{
    const double turn = x.of[0] * y.of[1] - y.of[0] * x.of[1], square = x.of[0] * x.of[0] + y.of[0] * y.of[0];
    const double dturn = x.of[0] * y.of[2] - y.of[0] * x.of[2], dsquare = 2.0 * (x.of[0] * x.of[1] + y.of[0] * y.of[1]);
    return (jet){ { atan2(y.of[0], x.of[0]), turn / square, (dturn - turn * dsquare / square) / square } };
}

/* Angle between -pi/2 and pi/2 with that sine. */
static jet angle_of_sine(jet sine)
{
    const double angle = asin(sine.of[0]), cosine = cos(angle), rate = sine.of[1] / cosine;
    return (jet){ { angle, rate, (sine.of[2] + sine.of[0] * rate * rate) / cosine } };
}

/* The rotation matrix is cos(x) I + A [r]x + B r r^T with x = |r|. */
void msfp_end_angles(const double rotation[MSFP_ORDERS][3], double angles[MSFP_ORDERS][3])
{
    static const int next[3] = { 1, 2, 0 };
    jet r[3], matrix[3][3], square = constant(0.0);
    int turned = 0;
    for (int i = 0; i < MSFP_ORDERS * 3; ++i)
        turned |= (&rotation[0][0])[i] != 0.0;
    if (!turned) {
        memset(&angles[0][0], 0, MSFP_ORDERS * sizeof *angles);
        return;
    }
    for (int i = 0; i < 3; ++i)
        r[i] = (jet){ { rotation[0][i], rotation[1][i], rotation[2][i] } };
    for (int i = 0; i < 3; ++i)
        square = sum(square, 1.0, product(r[i], r[i]));
    const jet A = series(square, 1), B = series(square, 2), cosine = sum(constant(1.0), -1.0, product(B, square));
    for (int i = 0; i < 3; ++i) {
        const int j = next[i], k = next[j];
        const jet along = product(B, product(r[i], r[j])), across = product(A, r[k]);
        matrix[i][i] = sum(cosine, 1.0, product(B, product(r[i], r[i])));
        matrix[i][j] = sum(along, -1.0, across);
        matrix[j][i] = sum(along, 1.0, across);
    }
    const jet found[3] = { angle_of(sum(constant(0.0), -1.0, matrix[1][2]), matrix[2][2]),
                           angle_of_sine(matrix[0][2]),
                           angle_of(sum(constant(0.0), -1.0, matrix[0][1]), matrix[0][0]) };
    for (int order = 0; order < MSFP_ORDERS; ++order)
        for (int i = 0; i < 3; ++i)
            angles[order][i] = found[i].of[order];
}

#if MSFP_TOP_ROTATION
/* Angular velocity of the axis at angles psi, theta, phi, from their rates, (3.12) without spin. */
static void axis_turns(const double *angles, const double *rates, double turn[3])
{
    turn[0] = rates[0];
    turn[1] = rates[1] * cos(angles[0]);
    turn[2] = rates[1] * sin(angles[0]);
}

/* Rates of angles at the rates of the rotation vector, are linear in these; their derivatives with respect to the
 * rotation vector are the second derivatives of the angles on a straight path, in two directions at once. */
void msfp_end_turns(const double rotation[2][3], double turns[3][3], double derivatives[3][3])
{
    double path[MSFP_ORDERS][3] = { { 0.0 } }, along[MSFP_ORDERS][3], sum[MSFP_ORDERS][3], difference[MSFP_ORDERS][3];
    memcpy(path[0], rotation[0], sizeof path[0]);
    memcpy(path[1], rotation[1], sizeof path[1]);
    double angles[MSFP_ORDERS][3];
    msfp_end_angles((const double(*)[3])path, angles);
    const double sine = sin(angles[0][0]), cosine = cos(angles[0][0]);
    for (int i = 0; i < 3; ++i) {
        memset(path[1], 0, sizeof path[1]);
        path[1][i] = 1.0;
        msfp_end_angles((const double(*)[3])path, along);
        axis_turns(along[0], along[1], turns[i]);
        for (int k = 0; k < 3; ++k)
            path[1][k] = rotation[1][k] + (k == i);
        msfp_end_angles((const double(*)[3])path, sum);
        for (int k = 0; k < 3; ++k)
            path[1][k] = rotation[1][k] - (k == i);
        msfp_end_angles((const double(*)[3])path, difference);
        const double psi1 = 0.25 * (sum[2][0] - difference[2][0]), theta1 = 0.25 * (sum[2][1] - difference[2][1]);
        const double turned = angles[1][1] * along[1][0];
        derivatives[i][0] = psi1;
        derivatives[i][1] = theta1 * cosine - turned * sine;
        derivatives[i][2] = theta1 * sine + turned * cosine;
    }
}
#endif

/* ---- polynomials of a step ---- */

/* The polynomial c of degree five over the length h, from values and derivatives at its ends. */
static void through(const double from[MSFP_ORDERS], const double to[MSFP_ORDERS], double h, double c[MSFP_DEGREE + 1])
{
    const double moved = to[0] - from[0], v0 = h * from[1], v1 = h * to[1], a0 = h * h * from[2], a1 = h * h * to[2];
    const double h3 = 2.0 * h * h * h;
    c[0] = from[0];
    c[1] = from[1];
    c[2] = 0.5 * from[2];
    c[3] = (20.0 * moved - 8.0 * v1 - 12.0 * v0 - 3.0 * a0 + a1) / h3;
    c[4] = (-30.0 * moved + 14.0 * v1 + 16.0 * v0 + 3.0 * a0 - 2.0 * a1) / (h3 * h);
    c[5] = (12.0 * moved - 6.0 * (v1 + v0) - a0 + a1) / (h3 * h * h);
}

/* That polynomial of one freedom of an end. */
static void freedom_path(const double from[MSFP_ORDERS][MSFP_END_FREEDOMS], const double to[MSFP_ORDERS][MSFP_END_FREEDOMS],
                         int freedom, double h, double c[MSFP_DEGREE + 1])
{
    double start[MSFP_ORDERS], end[MSFP_ORDERS];
    for (int order = 0; order < MSFP_ORDERS; ++order) {
        start[order] = from[order][freedom];
        end[order] = to[order][freedom];
    }
    through(start, end, h, c);
}

/* Polynomials of psi, theta, phi of an end. */
static void angle_paths(const double from[MSFP_ORDERS][MSFP_END_FREEDOMS], const double to[MSFP_ORDERS][MSFP_END_FREEDOMS],
                        double h, double c[3][MSFP_DEGREE + 1])
{
    double rotation[MSFP_ORDERS][3], start[MSFP_ORDERS][3], end[MSFP_ORDERS][3], one[MSFP_ORDERS], other[MSFP_ORDERS];
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(rotation[order], from[order] + 3, sizeof rotation[order]);
    msfp_end_angles((const double(*)[3])rotation, start);
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(rotation[order], to[order] + 3, sizeof rotation[order]);
    msfp_end_angles((const double(*)[3])rotation, end);
    for (int i = 0; i < 3; ++i) {
        for (int order = 0; order < MSFP_ORDERS; ++order) {
            one[order] = start[order][i];
            other[order] = end[order][i];
        }
        through(one, other, h, c[i]);
    }
}

void msfp_base_path(const msfp_ends *from, const msfp_ends *to, double h, msfp_polynomials *motion)
{
    for (int i = 0; i < 3; ++i)
        freedom_path(from->of[0], to->of[0], i, h, motion->coefficients[i]);
    angle_paths(from->of[0], to->of[0], h, motion->coefficients + 3);
}

/* The force k u + c du/dt by which springs with moving ends differ from those of the top, whose ends are fixed. */
void msfp_interface_path(const msfp_parameters *p, const msfp_ends *from, const msfp_ends *to, double h,
                         double axial_load, msfp_polynomials *load)
{
    const double *top = p->top;
    const double stiffness[3] = { top[MSFP_TOP_PARAMETERS_K], top[MSFP_TOP_PARAMETERS_K], top[MSFP_TOP_PARAMETERS_KV] };
    const double damping[3] = { top[MSFP_TOP_PARAMETERS_C], top[MSFP_TOP_PARAMETERS_C], top[MSFP_TOP_PARAMETERS_CV] };
    memset(load, 0, sizeof *load);
    for (int i = 0; i < 3; ++i) {
        double path[MSFP_DEGREE + 2] = { 0.0 }, *out = load->coefficients[i];
        freedom_path(from->of[1], to->of[1], i, h, path);
        path[0] -= i < 2 ? to->of[1][0][i] : 0.0;
        for (int k = 0; k <= MSFP_DEGREE; ++k)
            out[k] = stiffness[i] * path[k] + damping[i] * (k + 1) * path[k + 1];
    }
    load->coefficients[2][0] -= axial_load;
}

#if MSFP_TOP_ROTATION
void msfp_support_path(const msfp_ends *from, const msfp_ends *to, double h, msfp_polynomials *support)
{
    memset(support, 0, sizeof *support);
    angle_paths(from->of[1], to->of[1], h, support->coefficients);
    memset(support->coefficients[2], 0, sizeof support->coefficients[2]); /* the interface does not transmit torsion */
}
#endif
