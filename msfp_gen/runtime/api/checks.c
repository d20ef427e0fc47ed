/* checks.c: what the interface refuses before anything is computed, each with one line that names it; and the identity
 * of what a run or a two-port computes from. Both go over the same lists of what there is. */
#include <math.h>
#include <string.h>
#include "api.h"
#include "msfp_checks.h"

enum { MOST_ITEMS = INT32_MAX / 64 }; /* of a list: sizes in bytes fit */
static const double time_tolerance = 1e-9; /* times closer than this share of max(1, t) are equal, as in run.c */
static const int signs[NB] = MSFP_SIGNS;

#define COUNT(array) (sizeof(array) / sizeof *(array))

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

static int in_range(const msfp_range *range, double x)
{
    return (x >= range->least && x <= range->most) || (range->zero && x == 0.0);
}

/* Whether values [range->at] are in their ranges. base: they are of the base, which has not all of them. */
static int check_ranges(const msfp_range *ranges, size_t count, const double *values, int base, const char **message)
{
    for (size_t i = 0; i < count; ++i) {
        const double x = values[ranges[i].at];
        REQUIRE(base && ranges[i].moving ? fabs(x) < INFINITY : in_range(ranges + i, x), ranges[i].message);
    }
    return MSFP_OK;
}

#define CHECK(ranges, values) check_ranges(ranges, COUNT(ranges), values, 0, message)

static int check_bodies(const double *bodies, const char **message)
{
    for (int k = 0; k <= NB; ++k) {
        const double *body = bodies + k * MSFP_BODY_VALUES_SIZE;
        const int status = check_ranges(msfp_body_ranges, COUNT(msfp_body_ranges), body, k == 0, message);
        if (status)
            return status;
        const char *excess = msfp_excess_of_body(body);
        REQUIRE(!excess, excess);
    }
    return MSFP_OK;
}

static int check_surfaces(const double *surfaces, const double *bodies, const char **message)
{
    for (int j = 0; j < NB; ++j) {
        const double *surface = surfaces + j * MSFP_SURFACE_VALUES_SIZE;
        const int status = CHECK(msfp_surface_ranges, surface);
        if (status)
            return status;
        const char *excess = msfp_excess_of_surface(surface, bodies + (signs[j] > 0 ? j + 1 : j) * MSFP_BODY_VALUES_SIZE);
        REQUIRE(!excess, excess);
    }
    return MSFP_OK;
}

static int check_top(const double *top, const char **message)
{
    const int status = CHECK(msfp_top_ranges, top);
    if (status || top[MSFP_TOP_VALUES_MASS] == 0.0)
        return status;
    REQUIRE(top[MSFP_TOP_VALUES_VERTICAL_STIFFNESS] > 0.0 || top[MSFP_TOP_VALUES_VERTICAL_DAMPING] == 0.0,
            "top: vertical_damping: a damper alone carries no mass; give vertical_stiffness as well");
    return CHECK(msfp_top_mass_ranges, top);
}

/* The stiffnesses of the top contain the unilateral contacts of all surfaces in series. */
static int check_contacts(const double *surfaces, const double *top, const char **message)
{
#if MSFP_UPLIFT
    double compliance = 0.0;
    for (int j = 0; j < NB; ++j)
        compliance += 1.0 / surfaces[(size_t)j * MSFP_SURFACE_VALUES_SIZE + MSFP_SURFACE_VALUES_SEAT_STIFFNESS];
    REQUIRE(compliance * fmax(top[MSFP_TOP_VALUES_STIFFNESS], top[MSFP_TOP_VALUES_VERTICAL_STIFFNESS]) < 1.0,
            "surfaces: seat_stiffness: the unilateral contacts of all surfaces in series must be stiffer than the top, "
            "whose stiffness and vertical_stiffness contain them; give more [N/m]");
#else
    (void)surfaces;
    (void)top;
    (void)message;
#endif
    return MSFP_OK;
}

int msfp_check_bearing(double gravity, const double *bodies, const double *surfaces, const double *top,
                       const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(bodies, "bodies: give numbers [n][body_size], the base first");
    REQUIRE(surfaces, "surfaces: give numbers [n - 1][surface_size], the lowest first");
    int status = CHECK(msfp_gravity_ranges, &gravity);
    status = status ? status : check_bodies(bodies, message);
    status = status ? status : check_surfaces(surfaces, bodies, message);
    status = status ? status : check_top(top, message);
    return status ? status : check_contacts(surfaces, top, message);
}

/* ---- a scene: its numbers, switches, arrays, lists of times and histories ---- */

static double number_at(const msfp_scene *s, size_t at) { return *(const double *)((const char *)s + at); }

static int integer_at(const msfp_scene *s, size_t at) { return *(const int *)((const char *)s + at); }

static const double *values_at(const msfp_scene *s, size_t at)
{
    return *(const double *const *)((const char *)s + at);
}

static const struct {
    size_t at;
    int most; /* least: 0 */
    const char *message;
} switches[] = {
    { offsetof(msfp_scene, method), MSFP_METHODS - 1, "method: give one of enum msfp_method" },
    { offsetof(msfp_scene, sampled), 1, "sampled: give 0 or 1" },
    { offsetof(msfp_scene, quasistatic), 1, "quasistatic: give 0 or 1" },
    { offsetof(msfp_scene, stop_all_rims), 1, "stop_all_rims: give 0 or 1" },
    { offsetof(msfp_scene, monitors), (1 << MSFP_MONITORS) - 1, "monitors: give bits 1 << MSFP_MONITOR_..." },
    { offsetof(msfp_scene, monitor_stop), (1 << MSFP_MONITORS) - 1, "monitor_stop: give bits 1 << MSFP_MONITOR_..." },
};

static const struct {
    size_t at, count;
    int strict; /* no two are equal */
    const char *message;
} lists[] = {
    { offsetof(msfp_scene, jumps), offsetof(msfp_scene, jump_count), 1, "jumps: give rising times [jump_count] [s]" },
    { offsetof(msfp_scene, stops), offsetof(msfp_scene, stop_count), 0, "stops: give rising times [stop_count] [s]" },
    { offsetof(msfp_scene, span_ends), offsetof(msfp_scene, span_count), 0,
      "span_ends: give rising times [span_count] [s]" },
};

/* No number is below the one before it, or, where `strict`, equal to it; all are finite. */
static int rising(const double *values, int count, int strict)
{
    for (int i = 0; i < count; ++i)
        if (!(fabs(values[i]) < INFINITY) || (i && !(strict ? values[i] > values[i - 1] : values[i] >= values[i - 1])))
            return 0;
    return 1;
}

static int valid_history(const msfp_piecewise *h)
{
    if (h->pieces < 0 || h->pieces > MOST_ITEMS)
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
    for (size_t i = 0; i < COUNT(lists); ++i) {
        const int count = integer_at(s, lists[i].count);
        const double *times = values_at(s, lists[i].at);
        REQUIRE(count >= 0 && count <= MOST_ITEMS && (!count || (times && rising(times, count, lists[i].strict))),
                lists[i].message);
    }
    REQUIRE(!s->span_count || s->span_steps, "span_steps: give the longest step of each interval [span_count] [s]");
    for (int i = 0; i < s->span_count; ++i)
        REQUIRE(s->span_steps[i] > 0.0, "span_steps: give numbers above 0 [s]");
    return MSFP_OK;
}

static int check_arrays(const msfp_scene *s, const char **message)
{
    for (size_t i = 0; i < COUNT(msfp_scene_arrays); ++i) {
        const msfp_range *range = &msfp_scene_arrays[i].range;
        const double *values = values_at(s, range->at);
        for (size_t k = 0; values && k < msfp_scene_arrays[i].count; ++k)
            REQUIRE(in_range(range, values[k]), range->message);
    }
    for (int j = 0; s->f && j < NB; ++j)
        REQUIRE(s->f[2 * j] * s->f[2 * j] + s->f[2 * j + 1] * s->f[2 * j + 1] <= MSFP_LARGEST_FRICTION_STATE,
                "f: friction does not exceed mu N; give Y^2 + Z^2 of at most 1");
    REQUIRE(MSFP_MEMORY || !s->memory, "memory: the friction of this model depends on none of the surface; leave it NULL");
    return MSFP_OK;
}

/* The bearing, numbers, switches and arrays. */
static int check_values(const msfp_scene *s, const char **message)
{
    for (size_t i = 0; i < COUNT(msfp_scene_ranges); ++i)
        REQUIRE(in_range(msfp_scene_ranges + i, number_at(s, msfp_scene_ranges[i].at)), msfp_scene_ranges[i].message);
    for (size_t i = 0; i < COUNT(switches); ++i) {
        const int value = integer_at(s, switches[i].at);
        REQUIRE(value >= 0 && value <= switches[i].most, switches[i].message);
    }
    REQUIRE(s->method != MSFP_METHOD_DOPRI5 || MSFP_DOPRI5,
            "method: MSFP_METHOD_DOPRI5 is for models with masses and without uplift; use MSFP_METHOD_IMPLICIT");
    REQUIRE(s->max_step == 0.0 || s->first_step <= s->max_step, "first_step: give at most max_step [s]");
    REQUIRE(s->law_temperature[0] <= s->law_temperature[1], "law_temperature: give a range of temperatures [degC]");
    for (int j = 0; MSFP_RIMS && j < NB; ++j) {
        const double *surface = s->bearing->parameters.surface[j];
        REQUIRE(surface[MSFP_SURFACE_PARAMETERS_RS] > 0.0,
                "bearing: bodies: rim_radius: give that of each slider, or take a model without rims [m]");
        REQUIRE(surface[MSFP_SURFACE_PARAMETERS_KC] > 0.0,
                "bearing: surfaces: rim_stiffness: give one above 0, or take a model without rims [N/m]");
    }
    return check_arrays(s, message);
}

int msfp_check_scene(const msfp_scene *s, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
    const int status = check_values(s, message);
    if (status)
        return status;
    REQUIRE(s->end_time >= s->start_time, "end_time: give a time that is not before start_time [s]");
    REQUIRE(s->output_step == 0.0 || (s->end_time - s->start_time) / s->output_step <= MSFP_MAX_ROWS,
            "output_step: the rows exceed the limit of 1e8; give a longer one [s]");
    REQUIRE(!MSFP_HEAT || s->end_time - s->start_time <= MSFP_LONGEST_HEATING,
            "end_time: heating is computed for 1000 s; give at most that, or a law without temperature [s]");
    return check_histories(s, message);
}

/* ---- identity ---- */

static uint64_t hash_number(uint64_t sum, double x) { return msfp_hash(sum, &x, sizeof x); }

static uint64_t hash_list(uint64_t sum, const double *values, int count)
{
    return msfp_hash(msfp_hash(sum, &count, sizeof count), values, (size_t)count * sizeof *values);
}

static uint64_t hash_history(uint64_t sum, const msfp_piecewise *h)
{
    sum = hash_list(sum, h->knots, h->pieces ? h->pieces + 1 : 0);
    return hash_list(sum, h->coefficients, h->pieces * 6 * (MSFP_DEGREE + 1));
}

static uint64_t hash_array(uint64_t sum, const msfp_array *array, const double *values)
{
    if (!values && !array->zero)
        return hash_number(sum, NAN);
    for (size_t i = 0; i < array->count; ++i)
        sum = hash_number(sum, values ? values[i] : 0.0);
    return sum;
}

uint64_t msfp_identity(const msfp_scene *s)
{
    static const char model[] = MSFP_VERSION " " MSFP_SPEC;
    uint64_t sum = msfp_hash(MSFP_HASH_START, model, sizeof model);
    sum = msfp_hash(sum, &s->bearing->parameters, offsetof(msfp_parameters, body_values)); /* numbers alone */
    for (size_t i = 0; i < COUNT(msfp_scene_ranges); ++i)
        sum = hash_number(sum, number_at(s, msfp_scene_ranges[i].at));
    for (size_t i = 0; i < COUNT(switches); ++i)
        sum = hash_number(sum, integer_at(s, switches[i].at));
    for (size_t i = 0; i < COUNT(msfp_scene_arrays); ++i)
        sum = hash_array(sum, msfp_scene_arrays + i, values_at(s, msfp_scene_arrays[i].range.at));
    for (size_t i = 0; i < COUNT(lists); ++i)
        sum = hash_list(sum, values_at(s, lists[i].at), integer_at(s, lists[i].count));
    sum = hash_list(sum, s->span_steps, s->span_count);
    sum = hash_history(sum, &s->motion);
    sum = hash_history(sum, &s->load);
    sum = hash_history(sum, &s->support);
    return sum ? sum : 1; /* 0: of any scene */
}

#if MSFP_GRADIENTS
/* Whether an index into derivatives of a history is one, -1: zero; one history of each parameter at most. */
static int valid_column(double index, int count, const double *coefficients, size_t size)
{
    if (!(index >= -1.0 && index < count && floor(index) == index))
        return 0;
    return index < 0.0 || (coefficients && msfp_all_finite(coefficients + (size_t)index * size, size));
}

int msfp_check_gradients(const msfp_run *run, const msfp_gradient_inputs *in)
{
    if (!run || run->gradients || run->counts[MSFP_COUNT_STEPS] || run->callback || !in || in->count < 0 ||
        in->count > MOST_ITEMS || in->step_count < 0 || in->step_count > MOST_ITEMS ||
        (in->step_count && !(in->steps && rising(in->steps, in->step_count, 1) && in->steps[0] > run->now.t)))
        return MSFP_E_ARGUMENT;
    const struct {
        const double *values;
        size_t of_each;
    } arrays[] = { { in->gravity, 1 },    { in->bodies, (NB + 1) * MSFP_BODY_VALUES_SIZE }, { in->surfaces, NB * MSFP_SURFACE_VALUES_SIZE },
                   { in->top, MSFP_TOP_VALUES_SIZE }, { in->q, NB * MSFP_NQ }, { in->v, NB * MSFP_NQ }, { in->f, NB * 2 },
                   { in->motion, 1 },     { in->load, 1 } };
    for (size_t i = 0; in->count && i < COUNT(arrays); ++i)
        if (!arrays[i].values || !msfp_all_finite(arrays[i].values, arrays[i].of_each * (size_t)in->count))
            return MSFP_E_ARGUMENT;
    const size_t motion = (size_t)run->motion.pieces * 6 * (MSFP_DEGREE + 1), load = (size_t)run->load.pieces * 6 * (MSFP_DEGREE + 1);
    for (int i = 0; i < in->count; ++i)
        if (!valid_column(in->motion[i], in->count, in->motions, motion) || !valid_column(in->load[i], in->count, in->loads, load))
            return MSFP_E_ARGUMENT;
    return MSFP_OK;
}
#endif

/* ---- the two-port ---- */

#if MSFP_MOVING_ENDS
uint64_t msfp_port_identity(const msfp_scene *s, double axial_load, int loaded)
{
    msfp_scene fixed = *s;
    fixed.start_time = fixed.end_time = 0.0; /* its committed state may be of any time */
    return hash_number(hash_number(msfp_identity(&fixed), axial_load), loaded);
}

static int check_interface(const double *top, const char **message)
{
    const double values[MSFP_TOP_VALUES_SIZE] = { [MSFP_TOP_VALUES_STIFFNESS] = top[MSFP_TOP_PARAMETERS_K],
                                             [MSFP_TOP_VALUES_VERTICAL_STIFFNESS] = top[MSFP_TOP_PARAMETERS_KV],
                                             [MSFP_TOP_VALUES_ROTATIONAL_STIFFNESS] = top[MSFP_TOP_PARAMETERS_KR] };
    REQUIRE(top[MSFP_TOP_PARAMETERS_M] == 0.0, "bearing: top: a two-port supports no mass; give mass = 0");
    REQUIRE(top[MSFP_TOP_PARAMETERS_X0X] == 0.0 && top[MSFP_TOP_PARAMETERS_X0Y] == 0.0,
            "bearing: top: the upper end is the anchor of a two-port; give anchor_x = anchor_y = 0");
    return CHECK(msfp_interface_ranges, values);
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
    REQUIRE(s->method != MSFP_METHOD_DOPRI5, "method: give MSFP_METHOD_IMPLICIT or MSFP_METHOD_ESDIRK4");
    REQUIRE(!s->motion.pieces && !s->load.pieces && !s->support.pieces && !s->jump_count,
            "motion, load, support, jumps: leave them out; the ends of a two-port move as its trials say");
    REQUIRE(!s->stop_count && !s->span_count && s->output_step == 0.0 && s->stop_displacement == 0.0 && !s->stop_all_rims
                && !s->sampled && !s->quasistatic,
            "stops, span_ends, output_step, stop_displacement, stop_all_rims, sampled, quasistatic: leave them as "
            "scene_default does");
    REQUIRE(!s->v && !s->f && !s->foot && !s->memory && !s->origin && !s->monitor_heat,
            "v, f, foot, memory, origin, monitor_heat: leave them out; a two-port starts at rest");
    REQUIRE(centred(s->q), "q: give zero angles and finite separations; a two-port starts centred");
    return check_values(s, message);
}

int msfp_check_port(const msfp_scene *s, double axial_load, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
    int status = CHECK(msfp_axial_load_ranges, &axial_load);
    status = status ? status : check_ends(s, message);
    return status ? status : check_interface(s->bearing->parameters.top, message);
}

int msfp_check_entry(const msfp_port *port, const msfp_scene *state, const double *ends)
{
    if (!port)
        return MSFP_E_ARGUMENT;
    if (port->committed.status)
        return port->committed.status;
    if (port->loaded || !state || !state->q || !state->v || !state->f || !ends || !msfp_valid_ends(ends, 0) ||
        !(fabs(state->start_time) < INFINITY))
        return MSFP_E_ARGUMENT;
    return check_arrays(state, NULL);
}

int msfp_check_port_loaded(const msfp_scene *s, const char **message)
{
    if (message)
        *message = NULL;
    REQUIRE(s, "scene: give a scene");
    REQUIRE(s->bearing, "bearing: give a bearing of bearing_new");
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
#else
static int no_port(msfp_port **port, const char **message)
{
    if (port)
        *port = NULL;
    REQUIRE(port, "port: give the address of a handle");
    return msfp_refuse(message, "bearing: give one of a model for two-ports; export it with --top-rotation, in space, with "
                                "locked spin");
}

int msfp_api_port_new(const msfp_scene *scene, double axial_load, msfp_port **port, const char **message)
{
    (void)scene;
    (void)axial_load;
    return no_port(port, message);
}

int msfp_api_port_new_loaded(const msfp_scene *scene, msfp_port **port, const char **message)
{
    (void)scene;
    return no_port(port, message);
}

void msfp_port_free(msfp_port *port) { (void)port; }
#endif
