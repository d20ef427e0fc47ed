/* fmu_state.c: the state of a unit as one block of bytes without pointers, for this build of the unit. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "fmu.h"
#include "msfp_hash.h"

/* What comes first; then the snapshots of the two-port before and after the last step, where there is one. */
typedef struct {
    char token[40];
    uint64_t size, sum; /* of all bytes [-]; checksum of those after this field */
    int32_t phase, exchange, stepped, ready;
    fmu_step_data last;
    double values[FMU_VALUES];
} head;

static uint64_t checksum(const head *h)
{
    return msfp_hash(MSFP_HASH_START, (const char *)h + offsetof(head, phase), h->size - offsetof(head, phase));
}

size_t fmu_state_size(const fmu *f) { return sizeof(head) + 2 * f->size; }

void fmu_state_write(fmu *f, void *state)
{
    head *h = state;
    memset(h, 0, sizeof *h);
    strncpy(h->token, FMU_TOKEN, sizeof h->token - 1);
    h->size = fmu_state_size(f);
    h->phase = (int32_t)f->phase;
    h->exchange = f->exchange;
    h->stepped = f->stepped;
    h->ready = f->ready;
    h->last = f->last;
    memcpy(h->values, f->values, sizeof h->values);
    if (f->size) {
        memcpy((char *)state + sizeof *h, f->before, f->size);
        FMU_MODEL()->port_snapshot_write(f->port, (char *)state + sizeof *h + f->size);
    }
    h->sum = checksum(h);
}

size_t fmu_state_length(const void *state) { return (size_t)((const head *)state)->size; }

size_t fmu_state_valid(const void *state, size_t size)
{
    head h;
    if (!state || size < sizeof h)
        return 0;
    memcpy(&h, state, sizeof h);
    if (strncmp(h.token, FMU_TOKEN, sizeof h.token) != 0 || h.size != size)
        return 0;
    head *copy = malloc(size); /* the bytes of the importer may lie at any address */
    if (!copy)
        return 0;
    memcpy(copy, state, size);
    const int sound = checksum(copy) == h.sum;
    free(copy);
    return sound ? size : 0;
}

fmu_status fmu_state_read(fmu *f, const void *state)
{
    const head *h = state;
    const size_t size = (h->size - sizeof *h) / 2;
    if (h->exchange != f->exchange)
        return fmu_fail(f, FMU_ERROR, "state: it is of a unit instantiated for %s",
                        h->exchange ? "Model Exchange" : "Co-Simulation");
    const int same = f->ready && !memcmp(f->values + FMU_PARAMETERS, h->values + FMU_PARAMETERS,
                                         (FMU_CONTINUOUS - FMU_PARAMETERS) * sizeof *f->values);
    memcpy(f->values, h->values, sizeof f->values);
    f->phase = (fmu_phase)h->phase;
    f->known = 0;
    if (!h->ready) {
        fmu_release(f);
        return FMU_OK;
    }
    const fmu_status status = same ? FMU_OK : fmu_build(f); /* of the parameters of that state */
    if (status != FMU_OK)
        return status;
    if (f->size != size || FMU_MODEL()->port_snapshot_read(f->port, (const char *)state + sizeof *h + size, size) != MSFP_OK)
        return fmu_fail(f, FMU_ERROR, "state: it is of another build of this unit");
    memcpy(f->before, (const char *)state + sizeof *h, size);
    memcpy(f->values, h->values, sizeof f->values);
    memset(f->have, 0, sizeof f->have);
    f->stepped = h->stepped;
    f->last = h->last;
    return FMU_OK;
}
