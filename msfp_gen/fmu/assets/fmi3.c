/* fmi3.c: the functions of FMI 3.0, Co-Simulation and Model Exchange, over fmu.h. Declarations follow the standard. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "fmu.h"

#if defined(_WIN32)
#define FMI3_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI3_EXPORT __attribute__((visibility("default")))
#else
#define FMI3_EXPORT
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                                       fmi3String message);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set,
                                               fmi3Boolean get, fmi3Boolean finished, fmi3Boolean may_return,
                                               fmi3Boolean *returns, fmi3Float64 *at);

enum {
    BEFORE = FMU_AT(FMU_INSTANTIATED),
    INITIALISING = FMU_AT(FMU_INITIALISING),
    RUNNING = FMU_AT(FMU_RUNNING),
    EVENTS = FMU_AT(FMU_EVENTS),
    ENDED = FMU_AT(FMU_TERMINATED),
    STARTED = INITIALISING | RUNNING | EVENTS,
    ANY = BEFORE | STARTED | ENDED
};
#define REQUIRE(phases)                                                                                                \
    fmu *f = instance;                                                                                                 \
    if (!fmu_allowed(f, __func__, phases))                                                                             \
    return fmi3Error

static void send(const fmu *f, fmu_status status, const char *category, const char *text)
{
    if (f->callback)
        ((fmi3LogMessageCallback)f->callback)(f->environment, (fmi3Status)status, category, text);
}

static fmi3Status refuse(fmu *f, const char *text) { return (fmi3Status)fmu_fail(f, FMU_ERROR, "%s", text); }

FMI3_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMI3_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count,
                                           const fmi3String categories[])
{
    REQUIRE(ANY);
    (void)on, (void)count, (void)categories;
    return fmi3OK;
}

FMI3_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                      fmi3Boolean visible, fmi3Boolean on,
                                                      fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)resources, (void)visible, (void)on;
    return fmu_new(name, token, 1, send, (void (*)(void))log, environment);
}

/* Steps are done as a whole: they need no event mode, no early return and no intermediate variables. */
FMI3_EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                     fmi3Boolean visible, fmi3Boolean on, fmi3Boolean event_mode,
                                                     fmi3Boolean early_return, const fmi3ValueReference required[],
                                                     size_t required_count, fmi3InstanceEnvironment environment,
                                                     fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)resources, (void)visible, (void)on, (void)event_mode, (void)early_return, (void)required;
    (void)required_count, (void)update;
    return fmu_new(name, token, 0, send, (void (*)(void))log, environment);
}

FMI3_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                           fmi3Boolean visible, fmi3Boolean on,
                                                           fmi3InstanceEnvironment environment,
                                                           fmi3LogMessageCallback log,
                                                           void (*clock)(fmi3InstanceEnvironment environment),
                                                           void (*lock)(void), void (*unlock)(void))
{
    (void)name, (void)token, (void)resources, (void)visible, (void)on, (void)clock, (void)lock, (void)unlock;
    if (log)
        log(environment, fmi3Error, "logStatusError", "Scheduled Execution: this unit is for Co-Simulation");
    return NULL;
}

FMI3_EXPORT void fmi3FreeInstance(fmi3Instance instance) { fmu_free(instance); }

FMI3_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean defined, fmi3Float64 tolerance,
                                                   fmi3Float64 start, fmi3Boolean ends, fmi3Float64 stop)
{
    REQUIRE(BEFORE);
    (void)ends, (void)stop;
    const fmu_status status = fmu_begin(f, start, defined ? tolerance : 0.0);
    if (status == FMU_OK)
        f->phase = FMU_INITIALISING;
    return (fmi3Status)status;
}

FMI3_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    REQUIRE(INITIALISING);
    const fmu_status status = fmu_ready(f);
    if (status == FMU_OK)
        f->phase = f->exchange ? FMU_EVENTS : FMU_RUNNING;
    return (fmi3Status)status;
}

FMI3_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi3Status)fmu_enter(f, __func__, FMU_EVENTS);
}

FMI3_EXPORT fmi3Status fmi3Terminate(fmi3Instance instance)
{
    REQUIRE(RUNNING | EVENTS);
    f->phase = FMU_TERMINATED;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3Reset(fmi3Instance instance)
{
    REQUIRE(ANY);
    fmu_reset(f);
    return fmi3OK;
}

/* ---- values ---- */

FMI3_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                      fmi3Float64 values[], size_t count)
{
    REQUIRE(ANY);
    return count == nvr ? (fmi3Status)fmu_get(f, vr, nvr, 0, values) : refuse(f, "fmi3GetFloat64: give one value a variable");
}

FMI3_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                      const fmi3Float64 values[], size_t count)
{
    REQUIRE(ANY);
    return count == nvr ? (fmi3Status)fmu_set(f, vr, nvr, 0, values) : refuse(f, "fmi3SetFloat64: give one value a variable");
}

FMI3_EXPORT fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                      fmi3Boolean values[], size_t count)
{
    REQUIRE(ANY);
    fmu_status status = FMU_OK;
    if (count != nvr)
        return refuse(f, "fmi3GetBoolean: give one value a variable");
    for (size_t i = 0; i < nvr && status == FMU_OK; ++i) {
        double x = 0.0;
        status = fmu_get(f, vr + i, 1, 1, &x);
        values[i] = x != 0.0;
    }
    return (fmi3Status)status;
}

FMI3_EXPORT fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                      const fmi3Boolean values[], size_t count)
{
    REQUIRE(ANY);
    fmu_status status = FMU_OK;
    if (count != nvr)
        return refuse(f, "fmi3SetBoolean: give one value a variable");
    for (size_t i = 0; i < nvr && status == FMU_OK; ++i) {
        const double x = values[i];
        status = fmu_set(f, vr + i, 1, 1, &x);
    }
    return (fmi3Status)status;
}

/* There are no variables of the other types. */
static fmi3Status none(fmu *f, size_t nvr, const char *type)
{
    return nvr ? (fmi3Status)fmu_fail(f, FMU_ERROR, "there are no variables of type %s", type) : fmi3OK;
}

#define NO_VARIABLES(Type)                                                                                             \
    FMI3_EXPORT fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,             \
                                         fmi3##Type values[], size_t count)                                            \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)values, (void)count;                                                                           \
        return none(f, nvr, #Type);                                                                                    \
    }                                                                                                                  \
    FMI3_EXPORT fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,             \
                                         const fmi3##Type values[], size_t count)                                      \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)values, (void)count;                                                                           \
        return none(f, nvr, #Type);                                                                                    \
    }
NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)

FMI3_EXPORT fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, size_t sizes[],
                                     fmi3Binary values[], size_t count)
{
    REQUIRE(ANY);
    (void)vr, (void)sizes, (void)values, (void)count;
    return none(f, nvr, "Binary");
}

FMI3_EXPORT fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                     const size_t sizes[], const fmi3Binary values[], size_t count)
{
    REQUIRE(ANY);
    (void)vr, (void)sizes, (void)values, (void)count;
    return none(f, nvr, "Binary");
}

FMI3_EXPORT fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, fmi3Clock values[])
{
    REQUIRE(ANY);
    (void)vr, (void)values;
    return none(f, nvr, "Clock");
}

FMI3_EXPORT fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                    const fmi3Clock values[])
{
    REQUIRE(ANY);
    (void)vr, (void)values;
    return none(f, nvr, "Clock");
}

/* Every output, and every derivative, may depend on all inputs and states, as modelDescription.xml says. */
FMI3_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr, size_t *count)
{
    REQUIRE(ANY);
    (void)vr, (void)count;
    return refuse(f, "fmi3GetNumberOfVariableDependencies: see ModelStructure in modelDescription.xml");
}

FMI3_EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                                   size_t dependent_elements[], fmi3ValueReference independents[],
                                                   size_t elements[], fmi3DependencyKind kinds[], size_t count)
{
    REQUIRE(ANY);
    (void)dependent, (void)dependent_elements, (void)independents, (void)elements, (void)kinds, (void)count;
    return refuse(f, "fmi3GetVariableDependencies: see ModelStructure in modelDescription.xml");
}

/* ---- the state of the unit ---- */

FMI3_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    REQUIRE(ANY);
    if (!state)
        return refuse(f, "state: give the address of one");
    free(*state);
    *state = malloc(fmu_state_size(f));
    if (!*state)
        return refuse(f, "state: no memory");
    fmu_state_write(f, *state);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    REQUIRE(ANY);
    return state ? (fmi3Status)fmu_state_read(f, state) : refuse(f, "state: give one");
}

FMI3_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    REQUIRE(ANY);
    if (!state || !size)
        return refuse(f, "state: give one, and the address of a size");
    *size = fmu_state_length(state);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    REQUIRE(ANY);
    if (!state || size < fmu_state_length(state))
        return (fmi3Status)fmu_fail(f, FMU_ERROR, "state: %zu bytes are too few for it", size);
    memcpy(bytes, state, fmu_state_length(state));
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                               fmi3FMUState *state)
{
    REQUIRE(ANY);
    if (!state || !fmu_state_valid(bytes, size))
        return refuse(f, "state: these bytes are no state of this unit, or are damaged");
    free(*state);
    *state = malloc(size);
    if (!*state)
        return refuse(f, "state: no memory");
    memcpy(*state, bytes, size);
    return fmi3OK;
}

/* ---- derivatives ---- */

FMI3_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                                    size_t unknown_count, const fmi3ValueReference knowns[],
                                                    size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                                                    fmi3Float64 sensitivity[], size_t sensitivity_count)
{
    REQUIRE(STARTED | ENDED);
    if (seed_count != known_count || sensitivity_count != unknown_count)
        return refuse(f, "directional derivative: give one number a variable");
    return (fmi3Status)fmu_derivative(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity);
}

FMI3_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                                size_t unknown_count, const fmi3ValueReference knowns[],
                                                size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                                                fmi3Float64 sensitivity[], size_t sensitivity_count)
{
    REQUIRE(STARTED | ENDED);
    double column[FMU_STATES + FMU_OUTPUT_COUNT];
    if (seed_count != unknown_count || sensitivity_count != known_count || unknown_count > sizeof column / sizeof *column)
        return refuse(f, "adjoint derivative: give one number a variable, and no variable twice");
    for (size_t j = 0; j < known_count; ++j) {
        const double one = 1.0;
        const fmu_status status = fmu_derivative(f, unknowns, unknown_count, knowns + j, 1, &one, column);
        if (status != FMU_OK)
            return (fmi3Status)status;
        sensitivity[j] = 0.0;
        for (size_t i = 0; i < unknown_count; ++i)
            sensitivity[j] += column[i] * seed[i];
    }
    return fmi3OK;
}

/* ---- modes and clocks that this unit does not have ---- */

FMI3_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    REQUIRE(ANY);
    return refuse(f, "fmi3EnterConfigurationMode: this unit has no structural parameters");
}

FMI3_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    REQUIRE(ANY);
    return refuse(f, "fmi3ExitConfigurationMode: this unit has no structural parameters");
}

#define NO_CLOCK_DECIMAL(Function, CONST)                                                                              \
    FMI3_EXPORT fmi3Status fmi3##Function(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,            \
                                          CONST fmi3Float64 values[])                                                  \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)values;                                                                                        \
        return none(f, nvr, "Clock");                                                                                  \
    }
#define NO_CLOCK_FRACTION(Function, CONST)                                                                             \
    FMI3_EXPORT fmi3Status fmi3##Function(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,            \
                                          CONST fmi3UInt64 counters[], CONST fmi3UInt64 resolutions[])                 \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)counters, (void)resolutions;                                                                   \
        return none(f, nvr, "Clock");                                                                                  \
    }
NO_CLOCK_DECIMAL(GetShiftDecimal, )
NO_CLOCK_DECIMAL(SetIntervalDecimal, const)
NO_CLOCK_DECIMAL(SetShiftDecimal, const)
NO_CLOCK_FRACTION(GetShiftFraction, )
NO_CLOCK_FRACTION(SetIntervalFraction, const)
NO_CLOCK_FRACTION(SetShiftFraction, const)

FMI3_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                              fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    REQUIRE(ANY);
    (void)vr, (void)intervals, (void)qualifiers;
    return none(f, nvr, "Clock");
}

FMI3_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                               fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                               fmi3IntervalQualifier qualifiers[])
{
    REQUIRE(ANY);
    (void)vr, (void)counters, (void)resolutions, (void)qualifiers;
    return none(f, nvr, "Clock");
}

FMI3_EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time)
{
    REQUIRE(ANY);
    (void)clock, (void)time;
    return refuse(f, "fmi3ActivateModelPartition: this unit is not for Scheduled Execution");
}

FMI3_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    REQUIRE(INITIALISING | EVENTS);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *update, fmi3Boolean *terminate,
                                                fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *defined,
                                                fmi3Float64 *next)
{
    REQUIRE(EVENTS);
    *update = *terminate = *nominals = *values = *defined = false;
    *next = 0.0;
    return fmi3OK;
}

/* ---- Co-Simulation ---- */

FMI3_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    REQUIRE(EVENTS | RUNNING);
    return refuse(f, "fmi3EnterStepMode: this unit has no event mode in Co-Simulation");
}

FMI3_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                                const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
{
    REQUIRE(ANY);
    (void)vr, (void)nvr, (void)orders, (void)values, (void)count;
    return refuse(f, "fmi3GetOutputDerivatives: this unit has none");
}

FMI3_EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_state_before,
                                  fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    REQUIRE(RUNNING);
    (void)no_state_before;
    *event = *terminate = *early = false;
    *reached = f->values[FMU_TIME];
    return f->exchange ? refuse(f, "fmi3DoStep: this instance is for Model Exchange")
                       : (fmi3Status)fmu_step(f, time, step, reached);
}

/* ---- Model Exchange ---- */

FMI3_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    REQUIRE(EVENTS);
    return (fmi3Status)fmu_enter(f, __func__, FMU_RUNNING);
}

FMI3_EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_state_before, fmi3Boolean *enter,
                                                   fmi3Boolean *terminate)
{
    REQUIRE(RUNNING);
    (void)no_state_before;
    *enter = *terminate = false;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi3Status)fmu_set_time(f, __func__, time);
}

FMI3_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi3Status)fmu_set_states(f, states, count);
}

#define GET(function, source, size)                                                                                    \
    FMI3_EXPORT fmi3Status fmi3Get##function(fmi3Instance instance, fmi3Float64 values[], size_t count)                \
    {                                                                                                                  \
        REQUIRE(STARTED | ENDED);                                                                                      \
        return (fmi3Status)fmu_get_list(f, source, size, values, count);                                               \
    }
GET(ContinuousStateDerivatives, f->values + FMU_DERIVATIVES, FMU_STATES)
GET(EventIndicators, f->values + FMU_GAPS, FMU_INDICATORS)
GET(ContinuousStates, f->values + FMU_CONTINUOUS, FMU_STATES)
GET(NominalsOfContinuousStates, fmu_state_nominals, FMU_STATES)

FMI3_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count)
{
    REQUIRE(ANY);
    *count = f->exchange ? FMU_INDICATORS : 0;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count)
{
    REQUIRE(ANY);
    *count = f->exchange ? FMU_STATES : 0;
    return fmi3OK;
}
