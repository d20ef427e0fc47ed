/* fmi.h: the functions that FMI 2.0 and FMI 3.0 have in common; included once, by fmi2.c or fmi3.c.
 *
 * Before, these define FMI(name), the name of a function or type in their version, fmi_instance and fmi_real. Every
 * function is declared by the headers of the standard (standard/), with which a compiler compares its definition.
 */
#include <stdlib.h>
#include <string.h>
#include "fmu.h"

#ifdef __GNUC__ /* functions of the standard have arguments that this unit does not need */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
/* NOLINTBEGIN(misc-unused-parameters,bugprone-macro-parentheses): the same; a list of parameters has its own. */

enum {
    BEFORE = FMU_AT(FMU_INSTANTIATED),
    INITIALISING = FMU_AT(FMU_INITIALISING),
    RUNNING = FMU_AT(FMU_RUNNING),
    EVENTS = FMU_AT(FMU_EVENTS),
    ENDED = FMU_AT(FMU_TERMINATED),
    STARTED = INITIALISING | RUNNING | EVENTS,
    ANY = BEFORE | STARTED | ENDED
};

/* The function `name`, allowed in these phases: `result` is a status, of the unit `f`. */
#define FUNCTION(name, phases, parameters, result)                                                                     \
    FMI(Status) FMI(name) parameters                                                                                   \
    {                                                                                                                  \
        fmu *f = instance;                                                                                             \
        return (FMI(Status))(fmu_allowed(f, __func__, phases) ? (result) : FMU_ERROR);                                 \
    }
/* A function that this unit does not have, and why. */
#define REFUSED(name, parameters, reason) FUNCTION(name, ANY, parameters, fmu_fail(f, FMU_ERROR, "%s: " reason, __func__))

FUNCTION(SetDebugLogging, ANY, (fmi_instance instance, FMI(Boolean) on, size_t count, const FMI(String) categories[]),
         FMU_OK)
void FMI(FreeInstance)(fmi_instance instance) { fmu_free(instance); }
FUNCTION(ExitInitializationMode, INITIALISING, (fmi_instance instance), fmu_initialised(f))
FUNCTION(Terminate, RUNNING | EVENTS, (fmi_instance instance), fmu_go(f, FMU_TERMINATED))
FUNCTION(Reset, ANY, (fmi_instance instance), fmu_reset(f))

/* ---- values ---- */

typedef FMI(ValueReference) reference;

static fmu_status get_booleans(fmu *f, const reference *references, size_t count, FMI(Boolean) *values)
{
    fmu_status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; ++i) {
        double x = 0.0;
        status = fmu_get(f, references + i, 1, 1, &x);
        values[i] = x != 0.0;
    }
    return status;
}

static fmu_status set_booleans(fmu *f, const reference *references, size_t count, const FMI(Boolean) *values)
{
    fmu_status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; ++i) {
        const double x = values[i] ? 1.0 : 0.0;
        status = fmu_set(f, references + i, 1, 1, &x);
    }
    return status;
}

/* Of a type of which this unit has no variables. */
static fmu_status no_variables(const fmu *f, size_t count, const char *type)
{
    return count ? fmu_fail(f, FMU_ERROR, "there are no variables of type %s", type) : FMU_OK;
}

/* ---- the state of the unit ---- */

FUNCTION(GetFMUState, ANY, (fmi_instance instance, FMI(FMUState) *state), fmu_state_get(f, state))
FUNCTION(SetFMUState, ANY, (fmi_instance instance, FMI(FMUState) state), fmu_state_set(f, state))
FMI(Status) FMI(FreeFMUState)(fmi_instance instance, FMI(FMUState) *state) { return (FMI(Status))fmu_state_free(state); }
FUNCTION(SerializedFMUStateSize, ANY, (fmi_instance instance, FMI(FMUState) state, size_t *size),
         fmu_state_length(f, state, size))
FUNCTION(SerializeFMUState, ANY, (fmi_instance instance, FMI(FMUState) state, FMI(Byte) bytes[], size_t size),
         fmu_state_to_bytes(f, state, bytes, size))
FUNCTION(DeserializeFMUState, ANY,
         (fmi_instance instance, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state),
         fmu_state_from_bytes(f, bytes, size, state))

/* ---- Model Exchange ---- */

FUNCTION(EnterEventMode, RUNNING | EVENTS, (fmi_instance instance), fmu_enter(f, __func__, FMU_EVENTS))
FUNCTION(EnterContinuousTimeMode, EVENTS, (fmi_instance instance), fmu_enter(f, __func__, FMU_RUNNING))
FUNCTION(CompletedIntegratorStep, RUNNING,
         (fmi_instance instance, FMI(Boolean) no_state_before, FMI(Boolean) *enter, FMI(Boolean) *terminate),
         (*enter = *terminate = 0, FMU_OK))
FUNCTION(SetTime, RUNNING | EVENTS, (fmi_instance instance, fmi_real time), fmu_set_time(f, __func__, time))
FUNCTION(SetContinuousStates, RUNNING | EVENTS, (fmi_instance instance, const fmi_real states[], size_t count),
         fmu_set_states(f, states, count))

#define LIST(name, source, size)                                                                                       \
    FUNCTION(name, STARTED | ENDED, (fmi_instance instance, fmi_real values[], size_t count),                          \
             fmu_get_list(f, source, size, values, count))
LIST(GetEventIndicators, f->values + FMU_GAPS, FMU_INDICATORS)
LIST(GetContinuousStates, f->values + FMU_CONTINUOUS, FMU_STATES)
LIST(GetNominalsOfContinuousStates, fmu_state_nominals, FMU_STATES)
/* NOLINTEND(misc-unused-parameters,bugprone-macro-parentheses) */
