/* fmu.h: a bearing as a Functional Mock-up Unit, behind the functions of FMI 2.0 (fmi2.c) and FMI 3.0 (fmi3.c).
 *
 * Every variable is a number in one array; its index is its value reference. The bearing is stepped by the two-port of
 * msfp.h. A state of the unit is one block of bytes without pointers.
 */
#ifndef FMU_H
#define FMU_H
#include <stddef.h>
#include "fmu_model.h"

/* What calls return, with the values of fmi2Status and fmi3Status. */
typedef enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL } fmu_status;

typedef enum { FMU_INSTANTIATED, FMU_INITIALISING, FMU_RUNNING, FMU_EVENTS, FMU_TERMINATED } fmu_phase;
/* Phases as bits, for fmu_allowed. */
#define FMU_AT(phase) (1u << (phase))

enum { FMU_ENDS = 36, FMU_ORDERS = 3, FMU_FREEDOMS = 12, FMU_TEXT = 640, FMU_STATES = FMU_DERIVATIVES - FMU_CONTINUOUS,
       FMU_INDICATORS = FMU_BOOLEANS - FMU_GAPS };

/* A step: its begin and end, the motion of the ends at its end, the accelerations given at its begin, and the span over
 * which their slope was taken; 0: there was no step before. */
typedef struct {
    double begin, end, ends[FMU_ENDS], accelerations[FMU_FREEDOMS], span;
} fmu_step_data;

typedef struct fmu fmu;
typedef void (*fmu_logger)(const fmu *f, fmu_status status, const char *category, const char *text);

struct fmu {
    fmu_logger log;
    void (*callback)(void); /* of the importer; `log` knows its type */
    void *environment;
    char *name;
    int exchange; /* Model Exchange: the importer integrates */
    fmu_phase phase;
    double values[FMU_VALUES];
    int ready; /* bearing, port and outputs are those of the parameters */
    int known; /* in Model Exchange: derivatives and outputs are those of states and inputs */
    msfp_bearing *bearing;
    msfp_port *port;
    /* The last step: the committed state before it, and the motion of the ends at its end. */
    int stepped;
    unsigned char *before;
    size_t size;
    fmu_step_data last;
    double plate[3]; /* where r_nn is at the start [m] */
    /* Derivatives of the outputs with respect to the ends, for each order of the inputs; computed when asked. */
    int have[FMU_ORDERS];
    double jacobian[FMU_ORDERS][FMU_OUTPUT_COUNT][FMU_FREEDOMS];
};

/* ---- fmu.c: what both versions of the standard share ---- */
/* Every message says why a call failed, so all are sent: there is no debug logging to switch on. */

/* NULL: no memory, or another unit's token. */
fmu *fmu_new(const char *name, const char *token, int exchange, fmu_logger log, void (*callback)(void),
             void *environment);
void fmu_free(fmu *f);
/* Whether a call may be made in this phase; phases: bits FMU_AT. */
int fmu_allowed(fmu *f, const char *call, unsigned phases);
fmu_status fmu_reset(fmu *f);
fmu_status fmu_go(fmu *f, fmu_phase phase);
/* Length of the run: start [s], and the relative tolerance where it is defined (else 0). */
fmu_status fmu_begin(fmu *f, double start, double tolerance);
fmu_status fmu_ready(fmu *f);
/* Ready, and in the phase after the initialization mode. */
fmu_status fmu_initialised(fmu *f);
fmu_status fmu_get(fmu *f, const unsigned *references, size_t count, int boolean, double *values);
fmu_status fmu_set(fmu *f, const unsigned *references, size_t count, int boolean, const double *values);
/* Of Model Exchange alone, as `call`: enter a phase; the time of the importer [s]. */
fmu_status fmu_enter(fmu *f, const char *call, fmu_phase phase);
fmu_status fmu_set_time(fmu *f, const char *call, double time);
/* All states; a list of `size` numbers as they are now. */
fmu_status fmu_set_states(fmu *f, const double *states, size_t count);
fmu_status fmu_get_list(fmu *f, const double *list, size_t size, double *values, size_t count);
/* In Co-Simulation, as `call`: from `time` to `time + step` [s]. */
fmu_status fmu_step(fmu *f, const char *call, double time, double step);
/* sensitivity [unknowns] += derivative along seed [knowns]. */
fmu_status fmu_derivative(fmu *f, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns,
                          size_t known_count, const double *seed, double *sensitivity);
/* sensitivity [knowns] = sum over unknowns of seed times derivative. */
fmu_status fmu_adjoint(fmu *f, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns, size_t known_count,
                       const double *seed, double *sensitivity);

/* ---- fmu_state.c: the state of a unit as bytes, as the functions of the standard with these names ---- */

fmu_status fmu_state_get(fmu *f, void **state);
fmu_status fmu_state_set(fmu *f, const void *state);
fmu_status fmu_state_free(void **state);
fmu_status fmu_state_length(const fmu *f, const void *state, size_t *size);
fmu_status fmu_state_to_bytes(const fmu *f, const void *state, void *bytes, size_t size);
fmu_status fmu_state_from_bytes(const fmu *f, const void *bytes, size_t size, void **state);

/* ---- fmu_bearing.c: the bearing of the parameters ---- */

/* Make bearing and two-port, and the outputs at the start. */
fmu_status fmu_build(fmu *f);
void fmu_release(fmu *f);
/* Outputs of a row and of the wrenches [12], the ends at `ends`; outputs [FMU_OUTPUT_COUNT]. */
void fmu_outputs(const fmu *f, const double *row, const double *wrench, const double *ends, double *outputs);
/* Their derivatives by a freedom of the ends, from those that port_row_derivative gives. */
void fmu_output_derivatives(const double *row, const double *wrench, double *outputs);
/* Send a message, and return its status; of a call of msfp.h, what it found. */
fmu_status fmu_fail(const fmu *f, fmu_status status, const char *format, ...);
fmu_status fmu_failure(const fmu *f, fmu_status status, const char *what, int found, const char *message);
#if FMU_MASS
/* Base motion [order][u_1..3, psi, theta, phi] of the lower end of `ends`. */
void fmu_base(const double *ends, double base[FMU_ORDERS][6]);
#endif

/* ---- fmu_exchange.c: Model Exchange ---- */

/* Derivatives, outputs and event indicators at the present states and inputs. */
fmu_status fmu_exchange_evaluate(fmu *f);
/* As fmu_derivative, of a unit that is ready. */
fmu_status fmu_exchange_derivative(const fmu *f, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity);

#endif
