/* checks.c: what the interface refuses before anything is computed, each with one line that names it. */
#include <math.h>
#include "api.h"

enum { NB = MSFP_NB };
static const double time_tolerance = 1e-9; /* times closer than this share of max(1, t) are equal, as in run.c */

int msfp_refuse(const char **message, const char *text)
{
    if (message)
        *message = text;
    return MSFP_E_ARGUMENT;
}

#define REQUIRE(condition, text)                                                                                       \
    do {                                                                                                               \
        if (!(condition))                                                                                              \
            return msfp_refuse(message, text);                                                                         \
    } while (0)

/* Column `index` of values [rows][size] has no number below the limit, or, where `open`, none at it. */
static int column(const double *values, int rows, int size, int index, double limit, int open)
{
    for (int i = 0; i < rows; ++i) {
        const double x = values[(size_t)i * size + index];
        if (!(open ? x > limit : x >= limit))
            return 0;
    }
    return 1;
}

#define BODY(field, open) column(bodies + MSFP_BODY_VALUES, NB, MSFP_BODY_VALUES, MSFP_BODY_VALUE_##field, 0.0, open)
#define SURFACE(field, open) column(surfaces, NB, MSFP_SURFACE_VALUES, MSFP_SURFACE_VALUE_##field, 0.0, open)
#define TOP(field) (top[MSFP_TOP_VALUE_##field] >= 0.0)

int msfp_check_bearing(double gravity, const double *bodies, const double *surfaces, const double *top,
                       const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(gravity >= 0.0 && gravity < INFINITY, "gravity: give a finite number of at least 0 [m/s^2]");
    REQUIRE(bodies && msfp_all_finite(bodies, (NB + 1) * MSFP_BODY_VALUES),
            "bodies: give finite numbers [n][body_size], the base first");
    REQUIRE(surfaces && msfp_all_finite(surfaces, NB * MSFP_SURFACE_VALUES),
            "surfaces: give finite numbers [n - 1][surface_size], the lowest first");
    REQUIRE(msfp_all_finite(top, MSFP_TOP_VALUES), "top: give finite numbers [top_size]");
    REQUIRE(BODY(HEIGHT, 1), "bodies: height: give a number above 0 [m]");
    REQUIRE(BODY(CENTROID, 0), "bodies: centroid: give a number of at least 0 [m]");
    REQUIRE(BODY(MASS, !MSFP_MASSLESS), "bodies: mass: give a number above 0 [kg]");
    REQUIRE(BODY(INERTIA_TRANSVERSE, !MSFP_MASSLESS), "bodies: inertia_transverse: give a number above 0 [kg m^2]");
    REQUIRE(BODY(INERTIA_AXIAL, !MSFP_MASSLESS), "bodies: inertia_axial: give a number above 0 [kg m^2]");
    REQUIRE(SURFACE(RADIUS, 1), "surfaces: radius: give a number above 0 [m]");
    REQUIRE(SURFACE(CAPACITY, 1), "surfaces: capacity: give a number above 0 [m]");
    REQUIRE(SURFACE(FRICTION, 0), "surfaces: friction: give a number of at least 0");
    REQUIRE(SURFACE(YIELD_DISPLACEMENT, 1), "surfaces: yield_displacement: give a number above 0 [m]");
    REQUIRE(SURFACE(RIM_STIFFNESS, 0), "surfaces: rim_stiffness: give a number of at least 0 [N/m]");
    REQUIRE(SURFACE(RIM_DAMPING, 0), "surfaces: rim_damping: give a number of at least 0 [N s/m]");
    REQUIRE(SURFACE(CONTACT_DAMPING, 0), "surfaces: contact_damping: give a number of at least 0 [s]");
#if MSFP_UPLIFT
    REQUIRE(SURFACE(SEAT_STIFFNESS, 1), "surfaces: seat_stiffness: give a number above 0 [N/m]");
    REQUIRE(SURFACE(SEAT_DAMPING, 0), "surfaces: seat_damping: give a number of at least 0 [s/m]");
#endif
    REQUIRE(TOP(STIFFNESS) && TOP(DAMPING) && TOP(ROTATIONAL_STIFFNESS) && TOP(ROTATIONAL_DAMPING)
                && TOP(VERTICAL_STIFFNESS) && TOP(VERTICAL_DAMPING) && TOP(MASS) && TOP(INERTIA_TRANSVERSE)
                && TOP(INERTIA_AXIAL),
            "top: give stiffnesses, dampings, mass and inertias of at least 0");
    return MSFP_OK;
}

/* No number is below the one before it, or, where `strict`, equal to it; all are finite. */
static int rising(const double *values, int count, int strict)
{
    for (int i = 0; i < count; ++i)
        if (!(fabs(values[i]) < INFINITY) || (i && !(strict ? values[i] > values[i - 1] : values[i] >= values[i - 1])))
            return 0;
    return 1;
}

static int valid_list(const double *values, int count, int strict)
{
    return count >= 0 && (!count || (values && rising(values, count, strict)));
}

static int valid_history(const msfp_piecewise *h)
{
    if (h->pieces < 0 || h->pieces > INT32_MAX / 64)
        return 0;
    return !h->pieces || (h->knots && h->coefficients && rising(h->knots, h->pieces + 1, 1)
                          && msfp_all_finite(h->coefficients, (size_t)h->pieces * 6 * (MSFP_DEGREE + 1)));
}

/* Whether a history is given over the whole run. */
static int covers(const msfp_piecewise *h, const msfp_scene *s)
{
    const double end = s->end_time, tolerance = time_tolerance * fmax(1.0, fabs(end));
    return !h->pieces || (h->knots[0] <= s->start_time + tolerance && h->knots[h->pieces] >= end - tolerance);
}

/* A number that is not negative; infinite where `unlimited`. */
static int natural(double x, int unlimited) { return x >= 0.0 && (unlimited || x < INFINITY); }

static int check_histories(const msfp_scene *s, const char **message)
{
    REQUIRE(valid_history(&s->motion), "motion: give rising knots [pieces + 1] and finite coefficients [pieces][6][6]");
    REQUIRE(valid_history(&s->load), "load: give rising knots [pieces + 1] and finite coefficients [pieces][6][6]");
    REQUIRE(valid_history(&s->support), "support: give rising knots [pieces + 1] and finite coefficients [pieces][6][6]");
    REQUIRE(MSFP_TOP_ROTATION || !s->support.pieces,
            "support: this model has no rotation of the top; export it with --top-rotation");
    REQUIRE(covers(&s->motion, s), "motion: its knots do not reach from start_time to end_time; give pieces for all of it");
    REQUIRE(covers(&s->load, s), "load: its knots do not reach from start_time to end_time; give pieces for all of it");
    REQUIRE(covers(&s->support, s), "support: its knots do not reach from start_time to end_time; give pieces for all of it");
    REQUIRE(valid_list(s->jumps, s->jump_count, 1), "jumps: give rising times [jump_count] [s]");
    REQUIRE(valid_list(s->stops, s->stop_count, 0), "stops: give rising times [stop_count] [s]");
    REQUIRE(valid_list(s->span_ends, s->span_count, 0), "span_ends: give rising times [span_count] [s]");
    REQUIRE(!s->span_count || s->span_steps, "span_steps: give the longest step of each interval [span_count] [s]");
    for (int i = 0; i < s->span_count; ++i)
        REQUIRE(s->span_steps[i] > 0.0, "span_steps: give numbers above 0 [s]");
    return MSFP_OK;
}

static int check_solver(const msfp_scene *s, const char **message)
{
    REQUIRE(s->method >= 0 && s->method < MSFP_METHODS, "method: give one of enum msfp_method");
    REQUIRE(s->method != MSFP_METHOD_DOPRI5 || !(MSFP_MASSLESS || MSFP_UPLIFT),
            "method: MSFP_METHOD_DOPRI5 is for models with masses and without uplift; use MSFP_METHOD_IMPLICIT");
    REQUIRE(s->rtol > 0.0 && s->rtol < INFINITY, "rtol: give a finite number above 0");
    REQUIRE(s->atol_angle > 0.0 && s->atol_angle < INFINITY, "atol_angle: give a finite number above 0 [rad]");
    REQUIRE(natural(s->max_step, 0), "max_step: give a finite number of at least 0 [s]; 0: chosen");
    REQUIRE(natural(s->first_step, 0), "first_step: give a finite number of at least 0 [s]; 0: chosen");
    REQUIRE(s->max_steps > 0.0, "max_steps: give a number above 0");
    REQUIRE(natural(s->output_step, 0), "output_step: give a finite number of at least 0 [s]; 0: every step");
    REQUIRE(natural(s->stop_displacement, 0), "stop_displacement: give a finite number of at least 0 [m]; 0: none");
    return MSFP_OK;
}

static int check_monitors(const msfp_scene *s, const char **message)
{
    const int all = (1 << MSFP_MONITORS) - 1;
    REQUIRE(!(s->monitors & ~all) && !(s->monitor_stop & ~all), "monitors: give bits 1 << MSFP_MONITOR_...");
    REQUIRE(s->monitor_normal == s->monitor_normal, "monitor_normal: give a number [N]");
    REQUIRE(natural(s->monitor_peak, 1) && natural(s->monitor_inertia, 1) && natural(s->monitor_time, 1) && natural(s->monitor_rise, 1)
                && natural(s->law_speed, 1),
            "monitor_peak, monitor_inertia, monitor_time, monitor_rise, law_speed: give numbers of at least 0");
    for (int j = 0; s->monitor_heating && j < NB; ++j)
        REQUIRE(natural(s->monitor_heating[j], 1), "monitor_heating: give numbers of at least 0 [K s^1/2/J]");
    for (int j = 0; s->monitor_reach && j < NB; ++j)
        REQUIRE(natural(s->monitor_reach[j], 1), "monitor_reach: give numbers of at least 0 [m]");
    for (int i = 0; s->law_load && i < 2 * NB; ++i)
        REQUIRE(s->law_load[i] == s->law_load[i], "law_load: give numbers [N]");
    REQUIRE(s->law_temperature[0] <= s->law_temperature[1], "law_temperature: give a range of temperatures [degC]");
    return MSFP_OK;
}

int msfp_check_scene(const msfp_scene *s, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
    REQUIRE(fabs(s->start_time) < INFINITY && s->end_time >= s->start_time && s->end_time < INFINITY,
            "end_time: give a finite time that is not before start_time [s]");
    int status = check_histories(s, message);
    status = status ? status : check_solver(s, message);
    status = status ? status : check_monitors(s, message);
    if (status)
        return status;
    const int state = NB * MSFP_NQ;
    REQUIRE(msfp_all_finite(s->q, state) && msfp_all_finite(s->v, state) && msfp_all_finite(s->f, 2 * NB)
                && msfp_all_finite(s->foot, 2) && msfp_all_finite(s->origin, 3),
            "q, v, f, foot, origin: give finite numbers");
    REQUIRE(MSFP_HEAT || !s->heat, "heat: the friction of this model does not depend on temperature; leave it NULL");
    REQUIRE(msfp_all_finite(s->heat, NB * MSFP_HEAT) && msfp_all_finite(s->monitor_heat, NB * MSFP_HEAT_STATES),
            "heat, monitor_heat: give finite numbers");
    return MSFP_OK;
}

/* ---- the two-port ---- */

static int check_interface(const double *top, const char **message)
{
    REQUIRE(top[MSFP_TOP_PARAMETERS_K] > 0.0 && top[MSFP_TOP_PARAMETERS_KV] > 0.0 && top[MSFP_TOP_PARAMETERS_KR] > 0.0,
            "bearing: top: give stiffness, vertical_stiffness and rotational_stiffness of the interface above 0");
    REQUIRE(top[MSFP_TOP_PARAMETERS_M] == 0.0, "bearing: top: a two-port supports no mass; give mass = 0");
#if !MSFP_PLANAR /* others were refused */
    REQUIRE(top[MSFP_TOP_PARAMETERS_X0X] == 0.0 && top[MSFP_TOP_PARAMETERS_X0Y] == 0.0,
            "bearing: top: the upper end is the anchor of a two-port; give anchor_x = anchor_y = 0");
#endif
    return MSFP_OK;
}

/* Coordinates of a bearing that is centred: separations alone. */
static int centred(const double *q)
{
    for (int i = 0; q && i < NB * MSFP_NQ; ++i)
        if (!(fabs(q[i]) < INFINITY) || (i % MSFP_NQ < 3 && q[i] != 0.0))
            return 0;
    return 1;
}

/* What both kinds of two-port ask of a scene. */
static int check_ends(const msfp_scene *s, const char **message)
{
    REQUIRE(fabs(s->start_time) < INFINITY, "start_time: give a finite time [s]");
    REQUIRE(s->method != MSFP_METHOD_DOPRI5, "method: give MSFP_METHOD_IMPLICIT or MSFP_METHOD_ESDIRK4");
    REQUIRE(!s->motion.pieces && !s->load.pieces && !s->support.pieces && !s->jump_count,
            "motion, load, support, jumps: leave them out; the ends of a two-port move as its trials say");
    REQUIRE(!s->stop_count && !s->span_count && s->output_step == 0.0 && s->stop_displacement == 0.0 && !s->stop_all_rims
                && !s->sampled && !s->quasistatic,
            "stops, span_ends, output_step, stop_displacement, stop_all_rims, sampled, quasistatic: leave them as "
            "scene_default does");
    REQUIRE(!s->v && !s->f && !s->foot && !s->heat && !s->origin && !s->monitor_heat,
            "v, f, foot, heat, origin, monitor_heat: leave them out; a two-port starts at rest");
    REQUIRE(centred(s->q), "q: give zero angles and finite separations; a two-port starts centred");
    const int status = check_solver(s, message);
    return status ? status : check_monitors(s, message);
}

int msfp_check_port(const msfp_scene *s, double axial_load, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
    REQUIRE(!MSFP_PLANAR && MSFP_SPIN_LOCKED && MSFP_TOP_ROTATION,
            "bearing: give one of a model for two-ports; export it with --top-rotation, in space, with locked spin");
    REQUIRE(natural(axial_load, 0), "axial_load: give a finite number of at least 0 [N]");
    const int status = check_ends(s, message);
    return status ? status : check_interface(s->bearing->parameters.top, message);
}

int msfp_check_entry(const msfp_port *port, const msfp_scene *state, const double *ends)
{
    if (port->committed.status)
        return port->committed.status;
    const int size = NB * MSFP_NQ;
    if (port->loaded || !state || !state->q || !state->v || !state->f || !ends || !msfp_valid_ends(ends, 0) ||
        !(fabs(state->start_time) < INFINITY) || (state->heat && !MSFP_HEAT))
        return MSFP_E_ARGUMENT;
    const int finite = msfp_all_finite(state->q, size) && msfp_all_finite(state->v, size) &&
                       msfp_all_finite(state->f, 2 * NB) && msfp_all_finite(state->foot, 2) &&
                       msfp_all_finite(state->origin, 3) && msfp_all_finite(state->heat, NB * MSFP_HEAT) &&
                       msfp_all_finite(state->monitor_heat, NB * MSFP_HEAT_STATES);
    return finite ? MSFP_OK : MSFP_E_FINITE;
}

int msfp_check_port_loaded(const msfp_scene *s, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
    REQUIRE(!MSFP_PLANAR && MSFP_SPIN_LOCKED && !MSFP_TOP_ROTATION,
            "bearing: give one of a model in space, with locked spin and without top rotation");
    const double *top = s->bearing->parameters.top;
    REQUIRE(top[MSFP_TOP_PARAMETERS_M] > 0.0, "bearing: top: give the supported mass above 0");
    return check_ends(s, message);
}

int msfp_check_trial(const msfp_port *port, double time, const double *ends, const char **message)
{
    static const double shortest = 1e-8; /* time of a trial [s], or its share of the time: a shorter one holds no step */
    if (message)
        *message = NULL;
    REQUIRE(port, "port: give a two-port of port_new");
    if (port->committed.status)
        return port->committed.status;
    REQUIRE(ends && msfp_valid_ends(ends, port->loaded), "ends: give finite numbers [2][3][6], rotations of at most 1.5 rad");
    const double start = port->committed.now.t, *from = &port->from.of[0][0][0];
    REQUIRE(time == start || (time < INFINITY && time - start >= shortest * fmax(1.0, fabs(start))),
            "time: give a finite time after that of the committed state [s]");
    for (int i = 0; time == start && i < MSFP_PORT_FREEDOMS * MSFP_ORDERS; ++i)
        REQUIRE(ends[i] == from[i], "time: give a later one; at that of the committed state the ends are elsewhere");
    return MSFP_OK;
}
