/* scene.c: a run from its scene, and its rows handed to a callback, for the table of functions. */
#include <stdlib.h>
#include <string.h>
#include "api.h"

void msfp_api_scene_default(msfp_scene *scene)
{
    memset(scene, 0, sizeof *scene);
    scene->method = MSFP_METHOD_IMPLICIT;
    scene->rtol = 1e-4;
    scene->atol_angle = 1e-6;
    scene->max_steps = 1e7;
}

static msfp_history history_of(const msfp_piecewise *given)
{
    static const double knots[2] = { 0.0, 1.0 }, zero[6 * (MSFP_DEGREE + 1)] = { 0.0 };
    msfp_history h;
    memset(&h, 0, sizeof h);
    h.pieces = given->pieces ? given->pieces : 1;
    h.knots = given->pieces ? given->knots : knots;
    h.coefficients = given->pieces ? given->coefficients : zero;
    return h;
}

static void copy_monitors(msfp_options *o, const msfp_scene *s)
{
    o->monitors = s->monitors;
    o->monitor_stop = s->monitor_stop;
    o->monitor_normal = s->monitor_normal;
    o->monitor_peak = s->monitor_peak;
    o->monitor_inertia = s->monitor_inertia;
    o->monitor_time = s->monitor_time;
    o->monitor_rise = s->monitor_rise;
    if (s->monitor_heating)
        memcpy(o->monitor_heating, s->monitor_heating, sizeof o->monitor_heating);
    if (s->monitor_reach)
        memcpy(o->monitor_reach, s->monitor_reach, sizeof o->monitor_reach);
    o->law_speed = s->law_speed;
    if (s->law_load)
        memcpy(o->law_load, s->law_load, sizeof o->law_load);
    memcpy(o->law_temperature, s->law_temperature, sizeof o->law_temperature);
}

msfp_options msfp_scene_options(const msfp_scene *s)
{
    msfp_options o;
    memset(&o, 0, sizeof o);
    o.method = s->method;
    o.rtol = s->rtol;
    o.atol_angle = s->atol_angle;
    o.max_step = s->max_step;
    o.first_step = s->first_step;
    o.max_steps = s->max_steps;
    o.duration = s->end_time;
    o.output_step = s->output_step;
    o.stop_displacement = s->stop_displacement;
    o.stop_all_rims = s->stop_all_rims;
    o.sampled = s->sampled;
    o.quasistatic = s->quasistatic;
    o.stop_count = s->stop_count;
    o.stops = s->stops;
    o.span_count = s->span_count;
    o.span_ends = s->span_ends;
    o.span_steps = s->span_steps;
    o.start_time = s->start_time;
    o.origin = s->origin;
    o.foot = s->foot;
    o.memory = s->memory;
    copy_monitors(&o, s);
    return o;
}

int msfp_api_run_new(const msfp_scene *scene, msfp_run **run, const char **message)
{
    static const double zero[NB * MSFP_NQ + 2 * NB] = { 0.0 };
    if (!run)
        return msfp_refuse(message, "run: give the address of a handle");
    *run = NULL;
    const int wrong = msfp_check_scene(scene, message);
    if (wrong)
        return wrong;
    msfp_run *new_run = calloc(1, sizeof *new_run);
    if (!new_run)
        return MSFP_E_MEMORY;
    const msfp_history motion = history_of(&scene->motion), load = history_of(&scene->load),
                       support = history_of(&scene->support);
    const msfp_options options = msfp_scene_options(scene);
    const double *q = scene->q ? scene->q : zero, *v = scene->v ? scene->v : zero, *f = scene->f ? scene->f : zero;
    msfp_run_start(new_run, &scene->bearing->parameters, &motion, &load, &support, scene->jumps, scene->jump_count,
                   &options, q, v, f);
    if (scene->monitor_heat)
        memcpy(new_run->monitor.heat, scene->monitor_heat, sizeof new_run->monitor.heat);
    new_run->options.origin = new_run->options.foot = new_run->options.memory = NULL; /* need not outlive this call */
    new_run->identity = msfp_identity(scene);
    *run = new_run;
    return new_run->status;
}

void msfp_api_run_free(msfp_run *run)
{
    if (!run)
        return;
#if MSFP_GRADIENTS
    msfp_gradients_free(run);
#endif
    msfp_run_free(run);
    free(run);
}

int msfp_api_run_record(msfp_run *run) { return run ? msfp_write_now(run) : MSFP_E_ARGUMENT; }

#if MSFP_GRADIENTS
int msfp_api_gradients_start(msfp_run *run, const msfp_gradient_inputs *inputs)
{
    const int wrong = msfp_check_gradients(run, inputs);
    return wrong ? wrong : msfp_gradients_start(run, inputs);
}
#endif

/* Hand over the rows that the callback has not received, and keep the last one. Returns what the callback returns. */
static int deliver(msfp_run *run)
{
    const size_t count = run->row_count, begin = run->rows_taken > run->rows_before ? run->rows_taken - run->rows_before : 0;
    int ended = 0;
    if (begin < count)
        ended = run->callback(run->user, (const double *)(run->rows + begin), count - begin);
    run->rows_taken = run->rows_before + count;
    msfp_run_drop_rows(run);
    return ended;
}

int msfp_api_run_advance(msfp_run *run, long steps)
{
    if (!run->callback)
        return msfp_run_advance(run, steps);
    int more = msfp_run_advance(run, 0);
    int ended = deliver(run);
    for (long i = 0; i < steps && more && !ended; ++i) {
        more = msfp_run_advance(run, 1);
        ended = deliver(run);
    }
    return more;
}

void msfp_api_run_on_rows(msfp_run *run, msfp_row_callback callback, void *user)
{
    run->callback = callback;
    run->user = user;
}

int msfp_api_port_method(int method, msfp_method_stages *stages)
{
    if (method < 0 || method >= MSFP_METHODS || method == MSFP_METHOD_DOPRI5 || !stages)
        return MSFP_E_ARGUMENT;
    const msfp_tableau *tableau = msfp_tableau_of(method);
    stages->count = tableau->stages;
    stages->diagonal = tableau->gamma;
    stages->order = tableau->order;
    memcpy(stages->weights, tableau->a, sizeof stages->weights);
    memcpy(stages->shares, tableau->c, sizeof stages->shares);
    memcpy(stages->errors, tableau->e, sizeof stages->errors);
    return MSFP_OK;
}
