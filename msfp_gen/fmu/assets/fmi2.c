/* fmi2.c: the functions of FMI 2.0, Co-Simulation and Model Exchange, over fmu.h. Declarations follow the standard. */
#include <stdlib.h>
#include <string.h>
#include "fmu.h"

#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif

typedef void *fmi2Component;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(void *environment, fmi2String instance, fmi2Status status, fmi2String category,
                                   fmi2String message, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(void *environment, fmi2Status status);
    void *componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged,
        valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

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
    fmu *f = c;                                                                                                        \
    if (!fmu_allowed(f, __func__, phases))                                                                             \
    return fmi2Error

static void send(const fmu *f, fmu_status status, const char *category, const char *text)
{
    char format[2 * FMU_TEXT], *to = format;
    for (; *text; *to++ = *text++) /* importers may format the text, or not */
        if (*text == '%')
            *to++ = '%';
    *to = '\0';
    if (f->callback)
        ((fmi2CallbackLogger)f->callback)(f->environment, f->name, (fmi2Status)status, category, format);
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    REQUIRE(ANY);
    (void)on, (void)count, (void)categories;
    return fmi2OK;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                                          const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean on)
{
    (void)resources, (void)visible, (void)on;
    return fmu_new(name, token, type == fmi2ModelExchange, send, functions ? (void (*)(void))functions->logger : NULL,
                   functions ? functions->componentEnvironment : NULL);
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) { fmu_free(c); }

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                                           fmi2Boolean ends, fmi2Real stop)
{
    REQUIRE(BEFORE);
    (void)ends, (void)stop;
    return (fmi2Status)fmu_begin(f, start, defined ? tolerance : 0.0);
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    REQUIRE(BEFORE);
    f->phase = FMU_INITIALISING;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    REQUIRE(INITIALISING);
    const fmu_status status = fmu_ready(f);
    if (status == FMU_OK)
        f->phase = f->exchange ? FMU_EVENTS : FMU_RUNNING;
    return (fmi2Status)status;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    REQUIRE(RUNNING | EVENTS);
    f->phase = FMU_TERMINATED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    REQUIRE(ANY);
    fmu_reset(f);
    return fmi2OK;
}

/* ---- values ---- */

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    REQUIRE(ANY);
    return (fmi2Status)fmu_get(f, vr, nvr, 0, value);
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    REQUIRE(ANY);
    return (fmi2Status)fmu_set(f, vr, nvr, 0, value);
}

FMI2_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    REQUIRE(ANY);
    fmu_status status = FMU_OK;
    for (size_t i = 0; i < nvr && status == FMU_OK; ++i) {
        double x = 0.0;
        status = fmu_get(f, vr + i, 1, 1, &x);
        value[i] = x != 0.0;
    }
    return (fmi2Status)status;
}

FMI2_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                      const fmi2Boolean value[])
{
    REQUIRE(ANY);
    fmu_status status = FMU_OK;
    for (size_t i = 0; i < nvr && status == FMU_OK; ++i) {
        const double x = value[i] != 0;
        status = fmu_set(f, vr + i, 1, 1, &x);
    }
    return (fmi2Status)status;
}

/* There are no variables of the other types. */
static fmi2Status none(fmu *f, size_t nvr, const char *type)
{
    return nvr ? (fmi2Status)fmu_fail(f, FMU_ERROR, "there are no variables of type %s", type) : fmi2OK;
}

#define NO_VARIABLES(Type)                                                                                             \
    FMI2_EXPORT fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,                   \
                                         fmi2##Type value[])                                                           \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return none(f, nvr, #Type);                                                                                    \
    }                                                                                                                  \
    FMI2_EXPORT fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,                   \
                                         const fmi2##Type value[])                                                     \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return none(f, nvr, #Type);                                                                                    \
    }
NO_VARIABLES(Integer)
NO_VARIABLES(String)

/* ---- the state of the unit ---- */

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    REQUIRE(ANY);
    if (!state)
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: give the address of one");
    free(*state);
    *state = malloc(fmu_state_size(f));
    if (!*state)
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: no memory");
    fmu_state_write(f, *state);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    REQUIRE(ANY);
    return state ? (fmi2Status)fmu_state_read(f, state) : (fmi2Status)fmu_fail(f, FMU_ERROR, "state: give one");
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    REQUIRE(ANY);
    if (!state || !size)
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: give one, and the address of a size");
    *size = fmu_state_length(state);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    REQUIRE(ANY);
    if (!state || size < fmu_state_length(state))
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: %zu bytes are too few for it", size);
    memcpy(bytes, state, fmu_state_length(state));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    REQUIRE(ANY);
    if (!state || !fmu_state_valid(bytes, size))
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: these bytes are no state of this unit, or are damaged");
    free(*state);
    *state = malloc(size);
    if (!*state)
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "state: no memory");
    memcpy(*state, bytes, size);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                                    size_t unknown_count, const fmi2ValueReference knowns[],
                                                    size_t known_count, const fmi2Real seed[], fmi2Real sensitivity[])
{
    REQUIRE(STARTED | ENDED);
    return (fmi2Status)fmu_derivative(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity);
}

/* ---- Co-Simulation ---- */

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_state_before)
{
    REQUIRE(RUNNING);
    double reached;
    (void)no_state_before;
    if (f->exchange)
        return (fmi2Status)fmu_fail(f, FMU_ERROR, "fmi2DoStep: this instance is for Model Exchange");
    return (fmi2Status)fmu_step(f, time, step, &reached);
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    REQUIRE(ANY);
    return (fmi2Status)fmu_fail(f, FMU_ERROR, "fmi2CancelStep: no step is pending");
}

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                                   const fmi2Integer order[], const fmi2Real value[])
{
    REQUIRE(ANY);
    (void)vr, (void)nvr, (void)order, (void)value;
    return (fmi2Status)fmu_fail(f, FMU_ERROR, "fmi2SetRealInputDerivatives: rates and accelerations are inputs of this unit");
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                                    const fmi2Integer order[], fmi2Real value[])
{
    REQUIRE(ANY);
    (void)vr, (void)nvr, (void)order, (void)value;
    return (fmi2Status)fmu_fail(f, FMU_ERROR, "fmi2GetRealOutputDerivatives: this unit has none");
}

/* Steps never end later: what a pending step would be asked. */
#define STATUS(Function, type, known, result, is_not)                                                                  \
    FMI2_EXPORT fmi2Status fmi2Get##Function(fmi2Component c, const fmi2StatusKind kind, type value)                   \
    {                                                                                                                  \
        REQUIRE(ANY);                                                                                                  \
        if (kind != (known) || !value)                                                                                 \
            return (fmi2Status)fmu_fail(f, FMU_ERROR, "%s: kind %d " is_not, __func__, (int)kind);                     \
        *value = (result);                                                                                             \
        return fmi2OK;                                                                                                 \
    }
STATUS(Status, fmi2Status *, fmi2DoStepStatus, fmi2OK, "has no status")
STATUS(RealStatus, fmi2Real *, fmi2LastSuccessfulTime, f->values[FMU_TIME], "is no number")
STATUS(BooleanStatus, fmi2Boolean *, fmi2Terminated, 0, "is no Boolean")
STATUS(StringStatus, fmi2String *, fmi2PendingStatus, "", "is no text")

FMI2_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    REQUIRE(ANY);
    (void)value;
    return (fmi2Status)fmu_fail(f, FMU_ERROR, "fmi2GetIntegerStatus: kind %d is no integer", (int)kind);
}

/* ---- Model Exchange ---- */

FMI2_EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi2Status)fmu_enter(f, __func__, FMU_EVENTS);
}

FMI2_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    REQUIRE(EVENTS);
    memset(info, 0, sizeof *info);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    REQUIRE(EVENTS);
    return (fmi2Status)fmu_enter(f, __func__, FMU_RUNNING);
}

FMI2_EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_state_before, fmi2Boolean *enter,
                                                   fmi2Boolean *terminate)
{
    REQUIRE(RUNNING);
    (void)no_state_before;
    *enter = *terminate = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi2Status)fmu_set_time(f, __func__, time);
}

FMI2_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    REQUIRE(RUNNING | EVENTS);
    return (fmi2Status)fmu_set_states(f, x, nx);
}

#define GET(function, source, size)                                                                                    \
    FMI2_EXPORT fmi2Status fmi2Get##function(fmi2Component c, fmi2Real values[], size_t count)                         \
    {                                                                                                                  \
        REQUIRE(STARTED | ENDED);                                                                                      \
        return (fmi2Status)fmu_get_list(f, source, size, values, count);                                               \
    }
GET(Derivatives, f->values + FMU_DERIVATIVES, FMU_STATES)
GET(EventIndicators, f->values + FMU_GAPS, FMU_INDICATORS)
GET(ContinuousStates, f->values + FMU_CONTINUOUS, FMU_STATES)
GET(NominalsOfContinuousStates, fmu_state_nominals, FMU_STATES)
