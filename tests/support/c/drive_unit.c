/* Drives a unit of FMI 2.0 as an importer does, for valgrind: steps, states, derivatives, a refusal.
 *
 * It is linked with the unit. Arguments: the GUID, the folder of the resources, the value reference of the first output.
 * Inputs are 1 ... 36: the upper end moves along E1. Prints the outputs of the last step, and once more after going back to a state.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *step_finished, *environment;
} callbacks;

enum { INPUTS = 36, OUTPUTS = 12, STEPS = 12 };
void *fmi2Instantiate(const char *, int, const char *, const char *, const callbacks *, int, int);
int fmi2SetupExperiment(void *, int, double, double, int, double), fmi2EnterInitializationMode(void *);
int fmi2ExitInitializationMode(void *), fmi2DoStep(void *, double, double, int);
int fmi2SetReal(void *, const unsigned *, size_t, const double *);
int fmi2GetReal(void *, const unsigned *, size_t, double *);
int fmi2GetDirectionalDerivative(void *, const unsigned *, size_t, const unsigned *, size_t, const double *, double *);
int fmi2GetFMUstate(void *, void **), fmi2SetFMUstate(void *, void *), fmi2FreeFMUstate(void *, void **);
int fmi2SerializedFMUstateSize(void *, void *, size_t *), fmi2SerializeFMUstate(void *, void *, char *, size_t);
int fmi2DeSerializeFMUstate(void *, const char *, size_t, void **);
void fmi2FreeInstance(void *);

static const double step = 0.02;
static int refusals;

static void logger(void *environment, const char *name, int status, const char *category, const char *text, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)text;
    ++refusals;
}

static void require(int status, const char *what)
{
    if (status)
        fprintf(stderr, "%s: status %d\n", what, status), exit(3);
}

static void advance(void *unit, unsigned first, int i, double *outputs)
{
    unsigned inputs[INPUTS], references[OUTPUTS];
    double values[INPUTS] = { 0.0 };
    const double w = 3.14159265358979, t = step * (i + 1), u = 0.02;
    for (unsigned k = 0; k < INPUTS; ++k)
        inputs[k] = k + 1;
    for (unsigned k = 0; k < OUTPUTS; ++k)
        references[k] = first + k;
    values[18] = u * (1.0 - cos(w * t));
    values[24] = u * w * sin(w * t);
    values[30] = u * w * w * cos(w * t);
    require(fmi2SetReal(unit, inputs, INPUTS, values),
            "set");
    require(fmi2DoStep(unit, step * i, step, 1), "step");
    require(fmi2GetReal(unit, references, OUTPUTS, outputs),
            "get");
}

/* Serialise a state, and make another one of the bytes. */
static void *copied(void *unit, void *state)
{
    size_t size = 0;
    void *other = NULL;
    require(fmi2SerializedFMUstateSize(unit, state, &size), "size");
    char *bytes = malloc(size);
    require(fmi2SerializeFMUstate(unit, state, bytes, size), "serialise");
    require(fmi2DeSerializeFMUstate(unit, bytes, size, &other),
            "deserialise");
    bytes[size / 2] ^= 1;
    void *damaged = NULL;
    if (!fmi2DeSerializeFMUstate(unit, bytes, size, &damaged))
        exit(4);
    free(bytes);
    return other;
}

static void print(const double *outputs)
{
    for (int i = 0; i < OUTPUTS; ++i)
        printf("%.17g ", outputs[i]);
    printf("\n");
}

int main(int count, char **arguments)
{
    if (count < 4)
        return 1;
    const unsigned first = (unsigned)atoi(arguments[3]), known = 19;
    callbacks given = { logger, calloc, free, NULL, NULL };
    double outputs[OUTPUTS], again[OUTPUTS], derivative;
    void *state = NULL;
    void *unit = fmi2Instantiate("unit", 1, arguments[1], arguments[2], &given, 0, 0);
    require(!unit, "instantiate");
    require(fmi2SetupExperiment(unit, 0, 0.0, 0.0, 0, 0.0),
            "set up");
    require(fmi2EnterInitializationMode(unit), "enter");
    require(fmi2ExitInitializationMode(unit), "exit");
    for (int i = 0; i < STEPS; ++i) {
        if (i == STEPS / 2)
            require(fmi2GetFMUstate(unit, &state), "get state");
        advance(unit, first, i, outputs);
    }
    require(fmi2GetDirectionalDerivative(unit, &first, 1, &known, 1, &(double){ 1.0 }, &derivative),
            "derivative");
    void *other = copied(unit, state);
    require(fmi2SetFMUstate(unit, other), "set state");
    for (int i = STEPS / 2; i < STEPS; ++i)
        advance(unit, first, i, again);
    require(fmi2FreeFMUstate(unit, &state), "free state");
    require(fmi2FreeFMUstate(unit, &other), "free state");
    fmi2FreeInstance(unit);
    print(outputs);
    print(again);
    return memcmp(outputs, again, sizeof again) || !isfinite(derivative) || !refusals;
}
