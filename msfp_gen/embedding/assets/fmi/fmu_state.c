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

static uint64_t sum_of(const head *h)
{
    return msfp_hash(MSFP_HASH_START, (const char *)h + offsetof(head, phase), h->size - offsetof(head, phase));
}

static void *allocated(const fmu *f, size_t size)
{
    void *bytes = malloc(size);
    if (!bytes)
        fmu_fail(f, FMU_ERROR, "state: no memory");
    return bytes;
}

fmu_status fmu_state_get(fmu *f, void **state)
{
    const size_t size = sizeof(head) + 2 * f->size;
    if (!state)
        return fmu_fail(f, FMU_ERROR, "state: give the address of one");
    free(*state);
    head *h = *state = allocated(f, size);
    if (!h)
        return FMU_ERROR;
    memset(h, 0, sizeof *h);
    strncpy(h->token, FMU_TOKEN, sizeof h->token - 1);
    h->size = size;
    h->phase = (int32_t)f->phase;
    h->exchange = f->exchange;
    h->stepped = f->stepped;
    h->ready = f->ready;
    h->last = f->last;
    memcpy(h->values, f->values, sizeof h->values);
    if (f->size) {
        memcpy((char *)(h + 1), f->before, f->size);
        FMU_MODEL()->port_snapshot_write(f->port, (char *)(h + 1) + f->size);
    }
    h->sum = sum_of(h);
    return FMU_OK;
}

fmu_status fmu_state_free(void **state)
{
    if (state) {
        free(*state);
        *state = NULL;
    }
    return FMU_OK;
}

fmu_status fmu_state_length(const fmu *f, const void *state, size_t *size)
{
    if (!state || !size)
        return fmu_fail(f, FMU_ERROR, "state: give one, and the address of a size");
    *size = (size_t)((const head *)state)->size;
    return FMU_OK;
}

fmu_status fmu_state_to_bytes(const fmu *f, const void *state, void *bytes, size_t size)
{
    const head *h = state;
    if (!h || size < h->size)
        return fmu_fail(f, FMU_ERROR, "state: %zu bytes are too few for it", size);
    memcpy(bytes, h, h->size);
    return FMU_OK;
}

fmu_status fmu_state_from_bytes(const fmu *f, const void *bytes, size_t size, void **state)
{
    if (state && bytes && size >= sizeof(head)) {
        head *h = allocated(f, size); /* the bytes of the importer may lie at any address */
        if (!h)
            return FMU_ERROR;
        memcpy(h, bytes, size);
        if (strncmp(h->token, FMU_TOKEN, sizeof h->token) == 0 && h->size == size && sum_of(h) == h->sum) {
            free(*state);
            *state = h;
            return FMU_OK;
        }
        free(h);
    }
    return fmu_fail(f, FMU_ERROR, "state: these bytes are no state of this unit, or are damaged");
}

fmu_status fmu_state_set(fmu *f, const void *state)
{
    const head *h = state;
    if (!h)
        return fmu_fail(f, FMU_ERROR, "state: give one");
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
