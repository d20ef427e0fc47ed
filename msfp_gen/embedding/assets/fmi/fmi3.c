/* fmi3.c: the functions of FMI 3.0, Co-Simulation and Model Exchange, over fmu.h. */
#include "fmi3Functions.h"

#define FMI(name) fmi3##name
typedef fmi3Instance fmi_instance;
typedef fmi3Float64 fmi_real;
#include "fmi.h"
/* NOLINTBEGIN(misc-unused-parameters,bugprone-macro-parentheses): as in fmi.h */

static void send(const fmu *f, fmu_status status, const char *category, const char *text)
{
    if (f->callback)
        ((fmi3LogMessageCallback)f->callback)(f->environment, (fmi3Status)status, category, text);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean on, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return fmu_new(name, token, 1, send, (void (*)(void))log, environment);
}

/* Steps are done as a whole: they need no event mode, no early return and no intermediate variables. */
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t required_count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    return fmu_new(name, token, 0, send, (void (*)(void))log, environment);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean on, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    if (log)
        log(environment, fmi3Error, "logStatusError", "Scheduled Execution: this unit is for Co-Simulation");
    return NULL;
}

FUNCTION(EnterInitializationMode, BEFORE,
         (fmi3Instance instance, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean ends,
          fmi3Float64 stop),
         fmu_begin(f, start, defined ? tolerance : 0.0) == FMU_OK ? fmu_go(f, FMU_INITIALISING) : FMU_ERROR)

/* ---- values ---- */

/* The result where there is a number for every variable. */
#define COUNTED(fits, result) (fits) ? (result) : fmu_fail(f, FMU_ERROR, "%s: give one value a variable", __func__)
#define VARIABLES(Type, get, set)                                                                                      \
    FUNCTION(Get##Type, ANY,                                                                                           \
             (fmi3Instance instance, const reference vr[], size_t nvr, fmi3##Type values[], size_t count), get)        \
    FUNCTION(Set##Type, ANY,                                                                                           \
             (fmi3Instance instance, const reference vr[], size_t nvr, const fmi3##Type values[], size_t count), set)
VARIABLES(Float64, COUNTED(count == nvr, fmu_get(f, vr, nvr, 0, values)),
          COUNTED(count == nvr, fmu_set(f, vr, nvr, 0, values)))
VARIABLES(Boolean, COUNTED(count == nvr, get_booleans(f, vr, nvr, values)),
          COUNTED(count == nvr, set_booleans(f, vr, nvr, values)))

#define NO_VARIABLES(Type) VARIABLES(Type, no_variables(f, nvr, #Type), no_variables(f, nvr, #Type))
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
FUNCTION(GetBinary, ANY,
         (fmi3Instance instance, const reference vr[], size_t nvr, size_t sizes[], fmi3Binary values[], size_t count),
         no_variables(f, nvr, "Binary"))
FUNCTION(SetBinary, ANY,
         (fmi3Instance instance, const reference vr[], size_t nvr, const size_t sizes[], const fmi3Binary values[],
          size_t count),
         no_variables(f, nvr, "Binary"))

/* Every output, and every derivative, may depend on all inputs and states. */
REFUSED(GetNumberOfVariableDependencies, (fmi3Instance instance, reference vr, size_t *count),
        "see ModelStructure in modelDescription.xml")
REFUSED(GetVariableDependencies,
        (fmi3Instance instance, reference dependent, size_t dependent_elements[], reference independents[],
         size_t elements[], fmi3DependencyKind kinds[], size_t count),
        "see ModelStructure in modelDescription.xml")

/* ---- derivatives ---- */

FUNCTION(GetDirectionalDerivative, STARTED | ENDED,
         (fmi3Instance instance, const reference unknowns[], size_t unknown_count, const reference knowns[],
          size_t known_count, const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[],
          size_t sensitivity_count),
         COUNTED(seed_count == known_count && sensitivity_count == unknown_count,
                 fmu_derivative(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity)))
FUNCTION(GetAdjointDerivative, STARTED | ENDED,
         (fmi3Instance instance, const reference unknowns[], size_t unknown_count, const reference knowns[],
          size_t known_count, const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[],
          size_t sensitivity_count),
         COUNTED(seed_count == unknown_count && sensitivity_count == known_count,
                 fmu_adjoint(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity)))

/* ---- modes and clocks that this unit does not have ---- */

REFUSED(EnterConfigurationMode, (fmi3Instance instance), "this unit has no structural parameters")
REFUSED(ExitConfigurationMode, (fmi3Instance instance), "this unit has no structural parameters")
REFUSED(ActivateModelPartition, (fmi3Instance instance, reference clock, fmi3Float64 time),
        "this unit is not for Scheduled Execution")

#define NO_CLOCK(name, ...) FUNCTION(name, ANY, (fmi3Instance instance, const reference vr[], size_t nvr, __VA_ARGS__), \
                                     no_variables(f, nvr, "Clock"))
NO_CLOCK(GetClock, fmi3Clock values[])
NO_CLOCK(SetClock, const fmi3Clock values[])
NO_CLOCK(GetShiftDecimal, fmi3Float64 shifts[])
NO_CLOCK(SetShiftDecimal, const fmi3Float64 shifts[])
NO_CLOCK(GetShiftFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NO_CLOCK(SetShiftFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NO_CLOCK(GetIntervalDecimal, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NO_CLOCK(SetIntervalDecimal, const fmi3Float64 intervals[])
NO_CLOCK(GetIntervalFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
NO_CLOCK(SetIntervalFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])

FUNCTION(EvaluateDiscreteStates, INITIALISING | EVENTS, (fmi3Instance instance), FMU_OK)
FUNCTION(UpdateDiscreteStates, EVENTS,
         (fmi3Instance instance, fmi3Boolean *update, fmi3Boolean *terminate, fmi3Boolean *nominals, fmi3Boolean *values,
          fmi3Boolean *defined, fmi3Float64 *next),
         (*update = *terminate = *nominals = *values = *defined = 0, *next = 0.0, FMU_OK))

/* ---- Co-Simulation ---- */

FUNCTION(EnterStepMode, EVENTS | RUNNING, (fmi3Instance instance),
         fmu_fail(f, FMU_ERROR, "%s: this unit has no event mode in Co-Simulation", __func__))
REFUSED(GetOutputDerivatives,
        (fmi3Instance instance, const reference vr[], size_t nvr, const fmi3Int32 orders[], fmi3Float64 values[],
         size_t count),
        "this unit has none")
static fmu_status do_step(fmu *f, const char *call, double time, double step, double *reached)
{
    const fmu_status status = fmu_step(f, call, time, step);
    *reached = f->values[FMU_TIME];
    return status;
}

FUNCTION(DoStep, RUNNING,
         (fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_state_before, fmi3Boolean *event,
          fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached),
         (*event = *terminate = *early = 0, do_step(f, __func__, time, step, reached)))

/* ---- Model Exchange ---- */

LIST(GetContinuousStateDerivatives, f->values + FMU_DERIVATIVES, FMU_STATES)
FUNCTION(GetNumberOfEventIndicators, ANY, (fmi3Instance instance, size_t *count),
         (*count = f->exchange ? FMU_INDICATORS : 0, FMU_OK))
FUNCTION(GetNumberOfContinuousStates, ANY, (fmi3Instance instance, size_t *count),
         (*count = f->exchange ? FMU_STATES : 0, FMU_OK))
/* NOLINTEND(misc-unused-parameters,bugprone-macro-parentheses) */
