/* ends.c: the motion of the ends as base motion, load on the top plate and rotation of its support; their wrenches.
 *
 * Between two times every channel is the polynomial of degree five through values, first and second derivatives at
 * both: base accelerations are continuous, and a history of such pieces is repeated exactly.
 */
#include <math.h>
#include <string.h>
#include "port.h"
#include "msfp_schedule.h"

/* ---- polynomials of a step ---- */

/* The polynomial of degree five over the length h, from values and derivatives at its ends, and what begins there. */
static void through(const double from[MSFP_ORDERS], const double to[MSFP_ORDERS], double h, int channel,
                    msfp_polynomials *path)
{
    /* cppcheck-suppress ctuuninitvar ; the polynomials are what is written here */
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

void msfp_unit_paths(double h, msfp_polynomials *paths)
{
    static const double rest[MSFP_ORDERS];
    memset(paths, 0, sizeof *paths);
    for (int order = 0; order < MSFP_ORDERS; ++order) {
        double to[MSFP_ORDERS] = { 0.0 };
        to[order] = 1.0;
        through(rest, to, h, order, paths);
    }
}

/* The polynomials of all channels [order][channel] of an end. */
static void paths(const double *from, const double *to, double h, msfp_polynomials *path)
{
    for (int i = 0; i < MSFP_END_FREEDOMS; ++i) {
        double start[MSFP_ORDERS], end[MSFP_ORDERS];
        for (int order = 0; order < MSFP_ORDERS; ++order) {
            start[order] = from[order * MSFP_END_FREEDOMS + i];
            end[order] = to[order * MSFP_END_FREEDOMS + i];
        }
        through(start, end, h, i, path);
    }
}

void msfp_end_channels(const double *end, double *channels)
{
    double turn[MSFP_ORDERS][3], angles[MSFP_ORDERS][3];
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(turn[order], end + order * MSFP_END_FREEDOMS + 3, sizeof turn[order]);
    msfp_end_angles((const double(*)[3])turn, angles);
    memcpy(channels, end, MSFP_ORDERS * MSFP_END_FREEDOMS * sizeof *channels);
    for (int order = 0; order < MSFP_ORDERS; ++order)
        memcpy(channels + order * MSFP_END_FREEDOMS + 3, angles[order], sizeof angles[order]);
}

/* The polynomials of displacement and angles of an end. */
static void motion_paths(const double *from, const double *to, double h, msfp_polynomials *path)
{
    double start[MSFP_ORDERS][MSFP_END_FREEDOMS], end[MSFP_ORDERS][MSFP_END_FREEDOMS];
    msfp_end_channels(from, start[0]);
    msfp_end_channels(to, end[0]);
    paths(start[0], end[0], h, path);
}

/* The load of the interface is linear in displacement and rate, and so in the coefficients of their polynomials. */
static void interface_path(const msfp_port *port, const msfp_parameters *p, const msfp_ends *to, double h,
                           msfp_polynomials *load)
{
    msfp_polynomials motion;
    paths(port->from.of[1][0], to->of[1][0], h, &motion);
    memset(load, 0, sizeof *load);
    for (int piece = 0; piece < MSFP_PORT_PIECES; ++piece)
        for (int k = 0; k <= (piece ? MSFP_ORDERS - 1 : MSFP_DEGREE); ++k) {
            static const double none[3];
            double u[3], v[3] = { 0.0 }, force[3], block[MSFP_FAR_END_SIZE];
            for (int i = 0; i < 3; ++i) {
                u[i] = motion.coefficients[piece][i][k];
                if (k < MSFP_DEGREE)
                    v[i] = (k + 1) * motion.coefficients[piece][i][k + 1];
            }
            msfp_far_end(port, u, v, k ? none : to->of[1][0], block);
            block[MSFP_FAR_END_AXIAL] *= k == 0;
            msfp_load_of_interface(p, block, force);
            for (int i = 0; i < 3; ++i)
                load->coefficients[piece][i][k] = force[i];
        }
}

void msfp_port_paths(msfp_port *port, const msfp_parameters *p, double t, double end, const msfp_ends *to)
{
    const double h = end - t;
    port->knots[0] = t;
    port->knots[1] = end;
    port->knots[2] = end + h;
    motion_paths(port->from.of[0][0], to->of[0][0], h, &port->motion);
    if (port->loaded) {
        paths(port->from.of[1][0], to->of[1][0], h, &port->load);
        return;
    }
    interface_path(port, p, to, h, &port->load);
    motion_paths(port->from.of[1][0], to->of[1][0], h, &port->support);
    for (int piece = 0; piece < MSFP_PORT_PIECES; ++piece) { /* psi, theta; the interface does not transmit torsion */
        double(*channels)[MSFP_DEGREE + 1] = port->support.coefficients[piece];
        memcpy(channels[0], channels[3], 2 * sizeof *channels);
        memset(channels[2], 0, 4 * sizeof *channels);
    }
}

/* ---- the interface and the wrenches ---- */

void msfp_far_end(const msfp_port *port, const double *u, const double *v, const double *anchor, double *block)
{
    const double fixed[3] = { anchor[0], anchor[1], 0.0 };
    msfp_far_end_u_put(block, u);
    msfp_far_end_v_put(block, v);
    msfp_far_end_a_put(block, fixed);
    msfp_far_end_rest_put(block, port->plate);
    block[MSFP_FAR_END_AXIAL] = port->axial_load;
}

void msfp_load_of_interface(const msfp_parameters *p, const double *far_end, double *load)
{
    double force[MSFP_FORCE_SIZE];
    msfp_interface_load(p->top, far_end, force);
    msfp_force_F_get(force, load);
}

double msfp_port_move_anchor(const msfp_port *port, msfp_run *run, const double *plate, const double *from,
                             const double *at)
{
    double anchor[3] = { 0.0 }, before[3], stored = 0.0;
    for (int i = 0; i < 2; ++i) {
        before[i] = port->plate[i] + from[i];
        anchor[i] = port->plate[i] + at[i];
        stored += (plate[i] - anchor[i]) * (plate[i] - anchor[i]) - (plate[i] - before[i]) * (plate[i] - before[i]);
    }
    msfp_top_parameters_x0_put(run->parameters.top, anchor);
    return 0.5 * run->parameters.top[MSFP_TOP_PARAMETERS_K] * stored;
}

void msfp_port_histories(msfp_port *port, const msfp_ends *to, double h)
{
    msfp_run *run = &port->committed;
    msfp_port_paths(port, &run->parameters, run->now.t, run->now.t + h, to);
    run->motion.held = run->load.held = 0;
    run->support.held = 0;
}

void msfp_port_hold(msfp_port *port)
{
    msfp_run *run = &port->committed;
    msfp_port_histories(port, &port->from, 1.0);
    msfp_port_move_anchor(port, run, run->rows[0].top, port->from.of[1][0], port->from.of[1][0]);
}

void msfp_port_wrench_of(const msfp_port *port, const msfp_run *run, const msfp_ends *at, double *wrench)
{
    msfp_blocks s;
    msfp_body_C_put(s.frame, at->of[0][0]);
    msfp_far_end(port, at->of[1][0], at->of[1][1], at->of[1][0], s.far_end);
    msfp_wrenches_values(&run->parameters, &run->work, &s);
    msfp_end_wrench_F_get(s.lower, wrench);
    msfp_end_wrench_M_get(s.lower, wrench + 3);
    if (port->loaded) {
        memcpy(wrench + MSFP_END_FREEDOMS, at->of[1][0], sizeof at->of[1][0]);
        return;
    }
    msfp_end_wrench_F_get(s.upper, wrench + MSFP_END_FREEDOMS);
    msfp_end_wrench_M_get(s.upper, wrench + MSFP_END_FREEDOMS + 3);
}

void msfp_port_dampers(const msfp_port *port, const msfp_run *run, const msfp_ends *at, double weight, msfp_state *to)
{
    const double *top = run->parameters.top;
    const double damping[3] = { top[MSFP_TOP_PARAMETERS_C], top[MSFP_TOP_PARAMETERS_C], top[MSFP_TOP_PARAMETERS_CV] };
    double plate[3], more = 0.0;
    msfp_body_V_get(run->work.body[NB], plate);
    for (int i = 0; i < 3 && !port->loaded; ++i)
        more += damping[i] * at->of[1][1][i] * (at->of[1][1][i] - 2.0 * plate[i]);
    to->power[MSFP_WORK_TOP_DISSIPATED] += more;
    to->power[MSFP_WORK_INPUT] += more;
    to->work[MSFP_WORK_TOP_DISSIPATED] += weight * more;
    to->work[MSFP_WORK_INPUT] += weight * more;
}

double msfp_port_springs(const msfp_port *port, const msfp_run *run, const msfp_ends *at)
{
    const double *top = run->parameters.top, *end = at->of[1][0];
    const double k = top[MSFP_TOP_PARAMETERS_K], kv = top[MSFP_TOP_PARAMETERS_KV];
    double plate[3], across[3], fixed[3] = { 0.0 };
    if (port->loaded)
        return 0.0;
    msfp_body_C_get(run->work.body[NB], plate);
    msfp_top_parameters_x0_get(top, fixed);
    for (int i = 0; i < 3; ++i)
        across[i] = plate[i] - port->plate[i] - end[i];
    const double x = plate[0] - fixed[0], y = plate[1] - fixed[1], sunk = plate[2] - run->work.foot[MSFP_FOOT_Y];
    const double compression = across[2] + (kv > 0.0 ? port->axial_load / kv : 0.0);
    return 0.5 * k * (across[0] * across[0] + across[1] * across[1] - x * x - y * y) +
           0.5 * kv * (compression * compression - sunk * sunk);
}
