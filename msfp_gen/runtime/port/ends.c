/* ends.c: the motion of the ends as base motion, load on the top plate and rotation of its support.
 *
 * Between two times every channel is the polynomial of degree five through values, first and second derivatives at
 * both: base accelerations are continuous, and a history of such pieces is repeated exactly.
 */
#include <math.h>
#include <string.h>
#include "port.h"

/* ---- polynomials of a step ---- */

/* The polynomial of degree five over the length h, from values and derivatives at its ends, and what begins there. */
static void through(const double from[MSFP_ORDERS], const double to[MSFP_ORDERS], double h, int channel,
                    msfp_polynomials *path)
{
    double *c = path->coefficients[0][channel], *then = path->coefficients[1][channel];
    const double moved = to[0] - from[0], v0 = h * from[1], v1 = h * to[1], a0 = h * h * from[2], a1 = h * h * to[2];
    const double h3 = 2.0 * h * h * h;
    c[0] = from[0];
    c[1] = from[1];
    c[2] = 0.5 * from[2];
    c[3] = (20.0 * moved - 8.0 * v1 - 12.0 * v0 - 3.0 * a0 + a1) / h3;
    c[4] = (-30.0 * moved + 14.0 * v1 + 16.0 * v0 + 3.0 * a0 - 2.0 * a1) / (h3 * h);
    c[5] = (12.0 * moved - 6.0 * (v1 + v0) - a0 + a1) / (h3 * h * h);
    memset(then, 0, sizeof path->coefficients[1][channel]);
    then[0] = to[0];
    then[1] = to[1];
    then[2] = 0.5 * to[2];
}

/* Those polynomials of one freedom of an end. */
static void freedom_path(const double from[MSFP_ORDERS][MSFP_END_FREEDOMS], const double to[MSFP_ORDERS][MSFP_END_FREEDOMS],
                         int freedom, double h, msfp_polynomials *path)
{
    double start[MSFP_ORDERS], end[MSFP_ORDERS];
    for (int order = 0; order < MSFP_ORDERS; ++order) {
        start[order] = from[order][freedom];
        end[order] = to[order][freedom];
    }
    through(start, end, h, freedom, path);
}

/* Polynomials of psi, theta, phi of an end, from a channel on. */
static void angle_paths(const double from[MSFP_ORDERS][MSFP_END_FREEDOMS], const double to[MSFP_ORDERS][MSFP_END_FREEDOMS],
                        double h, int channel, msfp_polynomials *path)
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
        through(one, other, h, channel + i, path);
    }
}

void msfp_base_path(const msfp_ends *from, const msfp_ends *to, double h, msfp_polynomials *motion)
{
    for (int i = 0; i < 3; ++i)
        freedom_path(from->of[0], to->of[0], i, h, motion);
    angle_paths(from->of[0], to->of[0], h, 3, motion);
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
        freedom_path(from->of[1], to->of[1], i, h, load);
        for (int piece = 0; piece < MSFP_PORT_PIECES; ++piece) {
            double *out = load->coefficients[piece][i];
            out[0] -= i < 2 ? to->of[1][0][i] : 0.0;
            for (int k = 0; k <= MSFP_DEGREE; ++k)
                out[k] = stiffness[i] * out[k] + (k < MSFP_DEGREE ? damping[i] * (k + 1) * out[k + 1] : 0.0);
        }
    }
    for (int piece = 0; piece < MSFP_PORT_PIECES; ++piece)
        load->coefficients[piece][2][0] -= axial_load;
}

void msfp_load_path(const msfp_ends *from, const msfp_ends *to, double h, msfp_polynomials *load)
{
    for (int i = 0; i < MSFP_END_FREEDOMS; ++i)
        freedom_path(from->of[1], to->of[1], i, h, load);
}

#if MSFP_TOP_ROTATION
void msfp_support_path(const msfp_ends *from, const msfp_ends *to, double h, msfp_polynomials *support)
{
    memset(support, 0, sizeof *support);
    angle_paths(from->of[1], to->of[1], h, 0, support);
    for (int piece = 0; piece < MSFP_PORT_PIECES; ++piece) /* the interface does not transmit torsion */
        memset(support->coefficients[piece][2], 0, sizeof support->coefficients[piece][2]);
}
#endif
