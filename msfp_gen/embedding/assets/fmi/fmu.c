/* fmu.c: variables, steps and directional derivatives of a unit. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmu.h"

static const double time_tolerance = 1e-9; /* relative to max(1, t): a sum of communication steps is that of the unit */

fmu *fmu_new(const char *name, const char *token, int exchange, fmu_logger log, void (*callback)(void),
             void *environment)
{
    fmu *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->log = log;
    f->callback = callback;
    f->environment = environment;
    f->exchange = exchange;
    const size_t length = name ? strlen(name) : 0;
    f->name = calloc(length + 1, 1);
    if (f->name && length)
        memcpy(f->name, name, length + 1);
    if (!f->name || !length || !token || strcmp(token, FMU_TOKEN) != 0) {
        if (f->name)
            fmu_fail(f, FMU_ERROR, length ? "the token is not that of this unit: give the one of its modelDescription.xml"
                                          : "instance name: give one that is not empty");
        fmu_free(f);
        return NULL;
    }
    fmu_reset(f);
    return f;
}

void fmu_free(fmu *f)
{
    if (!f)
        return;
    fmu_release(f);
    free(f->name);
    free(f);
}

fmu_status fmu_go(fmu *f, fmu_phase phase)
{
    f->phase = phase;
    return FMU_OK;
}

fmu_status fmu_reset(fmu *f)
{
    fmu_release(f);
    memcpy(f->values, fmu_start, sizeof f->values);
    return fmu_go(f, FMU_INSTANTIATED);
}

int fmu_allowed(fmu *f, const char *call, unsigned phases)
{
    static const char *const words[] = { "before the initialization mode", "in the initialization mode", "while it runs",
                                         "in the event mode", "after its end" };
    if (!f)
        return 0;
    if (phases & FMU_AT(f->phase))
        return 1;
    fmu_fail(f, FMU_ERROR, "%s: this call is not allowed %s", call, words[f->phase]);
    return 0;
}

fmu_status fmu_begin(fmu *f, double start, double tolerance)
{
    if (!(fabs(start) < INFINITY))
        return fmu_fail(f, FMU_ERROR, "start time: give a finite number [s]");
    f->values[FMU_TIME] = start;
    if (tolerance > 0.0 && tolerance < INFINITY)
        f->values[FMU_SOLVER_RTOL] = tolerance;
    f->ready = 0;
    return FMU_OK;
}

fmu_status fmu_ready(fmu *f)
{
    if (!f->ready) {
        const fmu_status status = fmu_build(f);
        if (status != FMU_OK)
            return status;
    }
    return f->exchange && !f->known ? fmu_exchange_evaluate(f) : FMU_OK;
}

fmu_status fmu_initialised(fmu *f)
{
    const fmu_status status = fmu_ready(f);
    return status == FMU_OK ? fmu_go(f, f->exchange ? FMU_EVENTS : FMU_RUNNING) : status;
}

static int is_boolean(unsigned reference) { return reference >= FMU_BOOLEANS; }

fmu_status fmu_get(fmu *f, const unsigned *references, size_t count, int boolean, double *values)
{
    int computed = 0;
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= FMU_VALUES || is_boolean(references[i]) != boolean)
            return fmu_fail(f, FMU_ERROR, "value reference %u: there is no variable of this type", references[i]);
        computed |= references[i] >= FMU_OUTPUTS && !(references[i] >= FMU_PARAMETERS && references[i] < FMU_CONTINUOUS)
                    && !is_boolean(references[i]);
    }
    if (computed && f->phase != FMU_INSTANTIATED) {
        const fmu_status status = fmu_ready(f);
        if (status != FMU_OK)
            return status;
    }
    for (size_t i = 0; i < count; ++i)
        values[i] = f->values[references[i]];
    return FMU_OK;
}

/* Whether a variable may be set now. */
static int may_be_set(const fmu *f, unsigned reference)
{
    if (reference >= FMU_INPUTS && reference < FMU_OUTPUTS)
        return f->phase != FMU_TERMINATED;
    const int state = reference >= FMU_CONTINUOUS && reference < FMU_DERIVATIVES;
    if (state)
        return f->exchange && f->phase != FMU_TERMINATED;
    const int parameter = (reference >= FMU_PARAMETERS && reference < FMU_CONTINUOUS) || is_boolean(reference);
    return parameter && (f->phase == FMU_INSTANTIATED || f->phase == FMU_INITIALISING);
}

fmu_status fmu_set(fmu *f, const unsigned *references, size_t count, int boolean, const double *values)
{
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= FMU_VALUES || is_boolean(references[i]) != boolean)
            return fmu_fail(f, FMU_ERROR, "value reference %u: there is no variable of this type", references[i]);
        if (!may_be_set(f, references[i]))
            return fmu_fail(f, FMU_ERROR,
                            "%s: it cannot be set now; inputs may be set until the end, parameters until the end of the "
                            "initialization mode, outputs never", fmu_names[references[i]]);
        if (!(fabs(values[i]) < INFINITY))
            return fmu_fail(f, FMU_ERROR, "%s: give a finite number", fmu_names[references[i]]);
        if (references[i] >= FMU_CONTINUOUS && references[i] < FMU_DERIVATIVES && !f->ready) { /* it sets all states */
            const fmu_status status = fmu_build(f);
            if (status != FMU_OK)
                return status;
        }
    }
    for (size_t i = 0; i < count; ++i) {
        f->values[references[i]] = values[i];
        if (references[i] >= FMU_PARAMETERS && references[i] < FMU_CONTINUOUS)
            f->ready = 0;
    }
    if (count)
        f->known = 0;
    return FMU_OK;
}

static int exchanging(const fmu *f, const char *call)
{
    if (!f->exchange)
        fmu_fail(f, FMU_ERROR, "%s: this instance is for Co-Simulation", call);
    return f->exchange;
}

fmu_status fmu_enter(fmu *f, const char *call, fmu_phase phase)
{
    return exchanging(f, call) ? fmu_go(f, phase) : FMU_ERROR;
}

fmu_status fmu_set_time(fmu *f, const char *call, double time)
{
    if (!exchanging(f, call))
        return FMU_ERROR;
    if (!(fabs(time) < INFINITY))
        return fmu_fail(f, FMU_ERROR, "%s: give a finite number [s]", call);
    f->values[FMU_TIME] = time; /* the equations do not contain it */
    return FMU_OK;
}

fmu_status fmu_set_states(fmu *f, const double *states, size_t count)
{
    if (!f->exchange || count != FMU_STATES)
        return fmu_fail(f, FMU_ERROR, "states: %zu numbers; this instance has %d", count, f->exchange ? FMU_STATES : 0);
    for (size_t i = 0; i < count; ++i)
        if (!(fabs(states[i]) < INFINITY))
            return fmu_fail(f, FMU_ERROR, "%s: give a finite number", fmu_names[FMU_CONTINUOUS + i]);
    memcpy(f->values + FMU_CONTINUOUS, states, count * sizeof *states);
    f->known = 0;
    return FMU_OK;
}

fmu_status fmu_get_list(fmu *f, const double *list, size_t size, double *values, size_t count)
{
    if (!f->exchange || count != size)
        return fmu_fail(f, FMU_ERROR, "Model Exchange: %zu numbers asked; this instance has %zu", count,
                        f->exchange ? size : (size_t)0);
    const fmu_status status = fmu_ready(f);
    if (status == FMU_OK && count)
        memcpy(values, list, count * sizeof *values);
    return status;
}

/* ---- steps ---- */

/* Motion of the ends [end][order][6] at the end of a step: the inputs; where they are those of its begin, what follows
 * from them with accelerations that go on as since the last communication point. */
static void extrapolate(const fmu *f, fmu_step_data *s)
{
    const double *given = f->values + FMU_INPUTS, h = s->end - s->begin;
    s->span = f->stepped ? f->last.end - f->last.begin : 0.0;
    memcpy(s->ends, given, sizeof s->ends);
    for (int k = 0; k < FMU_FREEDOMS; ++k) {
        const int at = k / 6 * 18 + k % 6;
        const double *x = given + at;
        const double slope = s->span > 0.0 ? (x[12] - f->last.accelerations[k]) / s->span : 0.0;
        s->accelerations[k] = x[12];
        if (f->values[FMU_INPUTS_AT_STEP_END] != 0.0)
            continue;
        s->ends[at] = x[0] + h * (x[6] + h * (x[12] / 2.0 + h * slope / 6.0));
        s->ends[at + 6] = x[6] + h * (x[12] + h * slope / 2.0);
        s->ends[at + 12] = x[12] + h * slope;
    }
}

fmu_status fmu_step(fmu *f, const char *call, double time, double step)
{
    if (f->exchange)
        return fmu_fail(f, FMU_ERROR, "%s: this instance is for Model Exchange", call);
    const fmu_status status = fmu_ready(f);
    if (status != FMU_OK)
        return status;
    const msfp_api *api = FMU_MODEL();
    const double start = api->port_time(f->port);
    if (!(fabs(time - start) <= time_tolerance * fmax(1.0, fabs(start))))
        return fmu_fail(f, FMU_ERROR, "communication point = %.12g s: the unit is at %.12g s; go on from there", time, start);
    if (!(step > 0.0 && step < INFINITY))
        return fmu_fail(f, FMU_ERROR, "communication step = %.6g s: give a finite number above 0", step);
    fmu_step_data now = { .begin = start, .end = time + step };
    double row[FMU_ROW_SIZE], wrench[FMU_FREEDOMS];
    const char *message = NULL;
    extrapolate(f, &now);
    const int found = api->port_trial(f->port, now.end, now.ends, &message);
    if (found != MSFP_OK)
        return fmu_failure(f, FMU_ERROR, "step", found, message);
    api->port_wrench(f->port, wrench);
    api->port_row(f->port, row);
    api->port_snapshot_write(f->port, f->before);
    api->port_commit(f->port);
    f->stepped = 1;
    f->last = now;
    memset(f->have, 0, sizeof f->have);
    f->values[FMU_TIME] = now.end;
    fmu_outputs(f, row, wrench, now.ends, f->values + FMU_OUTPUTS);
    return FMU_OK;
}

/* ---- directional derivatives of a step: of the outputs at its end with respect to the inputs that it used ---- */

/* How displacements, rates and accelerations at the end of a step change with an input of an order. */
static void direction_of(const fmu *f, int order, double direction[FMU_ORDERS])
{
    const double h = f->last.end - f->last.begin, share = f->last.span > 0.0 ? h / f->last.span : 0.0;
    memset(direction, 0, FMU_ORDERS * sizeof *direction);
    direction[order] = 1.0;
    if (f->values[FMU_INPUTS_AT_STEP_END] != 0.0)
        return;
    if (order == 1)
        direction[0] = h;
    if (order == 2)
        direction[0] = h * h * (0.5 + share / 6.0), direction[1] = h * (1.0 + 0.5 * share), direction[2] = 1.0 + share;
}

/* The two-port takes the step once more; afterwards it is as it was, bit by bit. */
static fmu_status differentiate(fmu *f, int order)
{
    const msfp_api *api = FMU_MODEL();
    double direction[FMU_ORDERS], wrenches[FMU_FREEDOMS][FMU_FREEDOMS], rows[FMU_ROW_SIZE + 6][FMU_FREEDOMS];
    const char *message = NULL;
    direction_of(f, order, direction);
    int status = api->port_snapshot_read(f->port, f->before, f->size);
    if (status == MSFP_OK)
        status = api->port_trial(f->port, f->last.end, f->last.ends, &message);
    if (status == MSFP_OK)
        status = api->port_row_derivative(f->port, direction, wrenches[0], rows[0]);
    for (int freedom = 0; freedom < FMU_FREEDOMS && status == MSFP_OK; ++freedom) {
        double wrench[FMU_FREEDOMS], row[FMU_ROW_SIZE + 6], outputs[FMU_OUTPUT_COUNT];
        for (int i = 0; i < FMU_FREEDOMS; ++i)
            wrench[i] = wrenches[i][freedom];
        for (size_t i = 0; i < FMU_ROW_SIZE + 6; ++i)
            row[i] = rows[i][freedom];
        fmu_output_derivatives(row, wrench, outputs);
        for (int i = 0; i < FMU_OUTPUT_COUNT; ++i)
            f->jacobian[order][i][freedom] = outputs[i];
    }
    /* Back to the end of the step. */
    api->port_revert(f->port);
    if (api->port_trial(f->port, f->last.end, f->last.ends, NULL) == MSFP_OK)
        api->port_commit(f->port);
    if (status != MSFP_OK)
        return fmu_failure(f, FMU_ERROR, "directional derivative", status, message);
    f->have[order] = 1;
    return FMU_OK;
}

fmu_status fmu_derivative(fmu *f, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns,
                          size_t known_count, const double *seed, double *sensitivity)
{
    if (f->exchange) {
        const fmu_status status = fmu_ready(f);
        return status == FMU_OK
                   ? fmu_exchange_derivative(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity)
                   : status;
    }
    for (size_t i = 0; i < unknown_count; ++i)
        if (unknowns[i] < FMU_OUTPUTS || unknowns[i] >= FMU_OUTPUTS + FMU_OUTPUT_COUNT)
            return fmu_fail(f, FMU_ERROR, "directional derivative: unknown %u is no output", unknowns[i]);
    for (size_t j = 0; j < known_count; ++j)
        if (knowns[j] < FMU_INPUTS || knowns[j] >= FMU_OUTPUTS)
            return fmu_fail(f, FMU_ERROR, "directional derivative: known %u is no input", knowns[j]);
    if (f->phase == FMU_RUNNING && !f->stepped)
        return fmu_fail(f, FMU_ERROR, "directional derivative: it is that of the last step; make a step first");
    memset(sensitivity, 0, unknown_count * sizeof *sensitivity);
    for (size_t j = 0; j < known_count; ++j) {
        const int input = (int)(knowns[j] - FMU_INPUTS), order = input % 18 / 6, freedom = input / 18 * 6 + input % 6;
        if (!f->stepped || seed[j] == 0.0) /* at the start the outputs do not depend on the inputs */
            continue;
        if (!f->have[order]) {
            const fmu_status status = differentiate(f, order);
            if (status != FMU_OK)
                return status;
        }
        for (size_t i = 0; i < unknown_count; ++i)
            sensitivity[i] += f->jacobian[order][unknowns[i] - FMU_OUTPUTS][freedom] * seed[j];
    }
    return FMU_OK;
}

fmu_status fmu_adjoint(fmu *f, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns, size_t known_count,
                       const double *seed, double *sensitivity)
{
    double column[FMU_STATES + FMU_OUTPUT_COUNT] = { 0.0 };
    if (unknown_count > sizeof column / sizeof *column)
        return fmu_fail(f, FMU_ERROR, "adjoint derivative: no variable twice");
    for (size_t j = 0; j < known_count; ++j) {
        const double one = 1.0;
        const fmu_status status = fmu_derivative(f, unknowns, unknown_count, knowns + j, 1, &one, column);
        if (status != FMU_OK)
            return status;
        sensitivity[j] = 0.0;
        for (size_t i = 0; i < unknown_count; ++i)
            sensitivity[j] += column[i] * seed[i];
    }
    return FMU_OK;
}
