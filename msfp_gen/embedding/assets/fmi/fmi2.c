/* fmi2.c: the functions of FMI 2.0, Co-Simulation and Model Exchange, over fmu.h. */
#include "fmi2Functions.h"

#define FMI(name) fmi2##name
/* As FMI 3.0 spells them. */
#define fmi2FMUState fmi2FMUstate
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
typedef fmi2Component fmi_instance;
typedef fmi2Real fmi_real;
#include "fmi.h"
/* NOLINTBEGIN(misc-unused-parameters,bugprone-macro-parentheses): as in fmi.h */

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

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean on)
{
    return fmu_new(name, token, type == fmi2ModelExchange, send, functions ? (void (*)(void))functions->logger : NULL,
                   functions ? functions->componentEnvironment : NULL);
}

FUNCTION(SetupExperiment, BEFORE,
         (fmi2Component instance, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop),
         fmu_begin(f, start, defined ? tolerance : 0.0))
FUNCTION(EnterInitializationMode, BEFORE, (fmi2Component instance), fmu_go(f, FMU_INITIALISING))

FUNCTION(GetReal, ANY, (fmi2Component instance, const reference vr[], size_t nvr, fmi2Real values[]),
         fmu_get(f, vr, nvr, 0, values))
FUNCTION(SetReal, ANY, (fmi2Component instance, const reference vr[], size_t nvr, const fmi2Real values[]),
         fmu_set(f, vr, nvr, 0, values))
FUNCTION(GetBoolean, ANY, (fmi2Component instance, const reference vr[], size_t nvr, fmi2Boolean values[]),
         get_booleans(f, vr, nvr, values))
FUNCTION(SetBoolean, ANY, (fmi2Component instance, const reference vr[], size_t nvr, const fmi2Boolean values[]),
         set_booleans(f, vr, nvr, values))

#define NO_VARIABLES(Type)                                                                                             \
    FUNCTION(Get##Type, ANY, (fmi2Component instance, const reference vr[], size_t nvr, fmi2##Type values[]),          \
             no_variables(f, nvr, #Type))                                                                              \
    FUNCTION(Set##Type, ANY, (fmi2Component instance, const reference vr[], size_t nvr, const fmi2##Type values[]),    \
             no_variables(f, nvr, #Type))
NO_VARIABLES(Integer)
NO_VARIABLES(String)

FUNCTION(GetDirectionalDerivative, STARTED | ENDED,
         (fmi2Component instance, const reference unknowns[], size_t unknown_count, const reference knowns[],
          size_t known_count, const fmi2Real seed[], fmi2Real sensitivity[]),
         fmu_derivative(f, unknowns, unknown_count, knowns, known_count, seed, sensitivity))

/* ---- Co-Simulation ---- */

FUNCTION(DoStep, RUNNING, (fmi2Component instance, fmi2Real time, fmi2Real step, fmi2Boolean no_state_before),
         fmu_step(f, __func__, time, step))
REFUSED(CancelStep, (fmi2Component instance), "no step is pending")
REFUSED(SetRealInputDerivatives,
        (fmi2Component instance, const reference vr[], size_t nvr, const fmi2Integer order[], const fmi2Real values[]),
        "rates and accelerations are inputs of this unit")
REFUSED(GetRealOutputDerivatives,
        (fmi2Component instance, const reference vr[], size_t nvr, const fmi2Integer order[], fmi2Real values[]),
        "this unit has none")

/* Steps never end later: what a pending step would be asked. */
#define STATUS(name, type, known, result, is_not)                                                                      \
    FUNCTION(name, ANY, (fmi2Component instance, const fmi2StatusKind kind, type value),                               \
             kind == (known) && value ? (*value = (result), FMU_OK)                                                    \
                                      : fmu_fail(f, FMU_ERROR, "%s: kind %d " is_not, __func__, (int)kind))
STATUS(GetStatus, fmi2Status *, fmi2DoStepStatus, fmi2OK, "has no status")
STATUS(GetRealStatus, fmi2Real *, fmi2LastSuccessfulTime, f->values[FMU_TIME], "is no number")
STATUS(GetBooleanStatus, fmi2Boolean *, fmi2Terminated, 0, "is no Boolean")
STATUS(GetStringStatus, fmi2String *, fmi2PendingStatus, "", "is no text")
FUNCTION(GetIntegerStatus, ANY, (fmi2Component instance, const fmi2StatusKind kind, fmi2Integer *value),
         fmu_fail(f, FMU_ERROR, "%s: kind %d is no integer", __func__, (int)kind))

/* ---- Model Exchange ---- */

FUNCTION(NewDiscreteStates, EVENTS, (fmi2Component instance, fmi2EventInfo *info), (memset(info, 0, sizeof *info), FMU_OK))
LIST(GetDerivatives, f->values + FMU_DERIVATIVES, FMU_STATES)
/* NOLINTEND(misc-unused-parameters,bugprone-macro-parentheses) */
