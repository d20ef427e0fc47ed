/* checkpoint.c: a run takes over what an earlier run of the same scene had reached. */
#include <stdlib.h>
#include <string.h>
#include "run.h"

/* Whether every number that is used as an index is one: a file is never trusted with memory. */
static int sound(const msfp_run *run)
{
    int fine = run->next_jump >= 0 && run->next_jump <= run->jump_count;
    for (int i = 0; i < MSFP_DOF; ++i)
        fine = fine && run->pivots[i] >= 0 && run->pivots[i] < MSFP_DOF;
    return fine && (run->status == MSFP_OK || run->status == MSFP_STOPPED);
}

static void *copied(const void *items, size_t count, size_t size)
{
    void *copy = malloc((count ? count : 1) * size); /* never NULL but without memory */
    if (copy && count)
        memcpy(copy, items, count * size);
    return copy;
}

int msfp_run_restore(msfp_run *run, const char *state, const msfp_row *rows, size_t row_count,
                     const msfp_event *events, size_t event_count)
{
    msfp_run found = *run;
    memcpy((char *)&found + MSFP_CHECKPOINT_BEGIN, state, MSFP_CHECKPOINT_END - MSFP_CHECKPOINT_BEGIN);
    if (!sound(&found))
        return MSFP_E_FINITE;
    found.rows = copied(rows, row_count, sizeof *rows);
    found.events = copied(events, event_count, sizeof *events);
    if (!found.rows || !found.events) {
        msfp_run_free(&found);
        return MSFP_E_MEMORY;
    }
    found.row_count = found.row_capacity = row_count;
    found.event_count = found.event_capacity = event_count;
    msfp_run_free(run);
    *run = found;
    return MSFP_OK;
}
