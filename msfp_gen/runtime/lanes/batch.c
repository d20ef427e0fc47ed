/* batch.c: runs that take turns on one core, each on a stack of its own, so that the code of a run is what it is alone. */
#define _DEFAULT_SOURCE /* mmap, with pages of no file */
#include "batch.h"
#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { VALUES, TANGENTS, KINDS };

typedef struct {
    char *memory; /* of the stack; NULL: none yet */
    void *pointer;
    msfp_run *run;
    msfp_request *request; /* NULL: the run has ended */
    long values;           /* of its parameters */
} strand;

struct msfp_batch {
    strand strands[MSFP_MOST_RUNS];
    void *pointer; /* of the stack of who called msfp_batch_advance */
    int current, runs; /* runs: how many there are */
    long values;       /* how many sets of parameters there have been */
    int ready[MSFP_MOST_RUNS], ready_count;
    int waiting[KINDS][MSFP_MOST_RUNS], waiting_count[KINDS];
    lane_work *lanes;
    msfp_row *spare[MSFP_MOST_RUNS];
    size_t spare_capacity[MSFP_MOST_RUNS];
    int spare_count;
};

static __thread msfp_batch *active; /* a batch stays in the thread that calls msfp_batch_advance while it does */

/* Go on where `to` was left, and leave in *from where to come back to: the registers that a call keeps, on the stack. */
void msfp_switch(void **from, void *to) __attribute__((visibility("hidden")));
__asm__(".text\n"
        ".p2align 4\n"
        ".globl msfp_switch\n"
        ".hidden msfp_switch\n"
        ".type msfp_switch, @function\n"
        "msfp_switch:\n"
        "    pushq %rbp\n"
        "    pushq %rbx\n"
        "    pushq %r12\n"
        "    pushq %r13\n"
        "    pushq %r14\n"
        "    pushq %r15\n"
        "    movq %rsp, (%rdi)\n"
        "    movq %rsi, %rsp\n"
        "    popq %r15\n"
        "    popq %r14\n"
        "    popq %r13\n"
        "    popq %r12\n"
        "    popq %rbx\n"
        "    popq %rbp\n"
        "    ret\n"
        ".size msfp_switch, . - msfp_switch\n");

/* Where a strand begins; it never returns, the stack serves the next run. */
static void strand_main(void)
{
    for (;;) {
        strand *s = &active->strands[active->current];
        while (msfp_run_advance(s->run, LONG_MAX))
            ;
        s->request = NULL;
        msfp_switch(&s->pointer, active->pointer);
    }
}

static size_t page(void) { return (size_t)sysconf(_SC_PAGESIZE); }

/* What a run has on its stack is a few work areas; memory that is not touched is not taken. */
static size_t stack_size(void)
{
    const size_t wanted = 256 * 1024 + 12 * sizeof(msfp_work);
    return (wanted / page() + 1) * page();
}

/* A stack above a page that nobody may touch, ready to enter strand_main. Stacks begin at unlike places of a page: the
 * same lines of many of them would not fit a cache. */
static int prepare(strand *s, int slot)
{
    const size_t size = stack_size();
    if (!s->memory) {
        char *memory = mmap(NULL, size + page(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED)
            return MSFP_E_MEMORY;
        if (mprotect(memory, page(), PROT_NONE)) {
            munmap(memory, size + page());
            return MSFP_E_MEMORY;
        }
        s->memory = memory;
    }
    void **top = (void **)(s->memory + page() + size - 64 - 1088 * (size_t)slot % 16384);
    top = (void **)((uintptr_t)top & ~(uintptr_t)63);
    *--top = NULL; /* as after a call: the return address lies 8 beside a multiple of 16 */
    *--top = (void *)(uintptr_t)strand_main;
    for (int i = 0; i < 6; ++i)
        *--top = NULL;
    s->pointer = top;
    return MSFP_OK;
}

int msfp_batch_width(void) { return MSFP_WIDTH; }

msfp_batch *msfp_batch_new(void)
{
    msfp_batch *b = calloc(1, sizeof *b);
    if (b && !(b->lanes = msfp_lanes_new())) {
        free(b);
        return NULL;
    }
    return b;
}

void msfp_batch_free(msfp_batch *b)
{
    for (int i = 0; b && i < MSFP_MOST_RUNS; ++i)
        if (b->strands[i].memory)
            munmap(b->strands[i].memory, stack_size() + page());
    while (b && b->spare_count)
        free(b->spare[--b->spare_count]);
    if (b)
        free(b->lanes);
    free(b);
}

void msfp_batch_reuse(msfp_batch *b, msfp_run *run)
{
    if (b->spare_count == MSFP_MOST_RUNS || !run->rows)
        return;
    b->spare[b->spare_count] = run->rows;
    b->spare_capacity[b->spare_count++] = run->row_capacity;
    run->rows = NULL;
    run->row_count = run->row_capacity = 0;
}

/* A run that begins writes its rows where another had its. */
static void give_spare(msfp_batch *b, msfp_run *run)
{
    if (!b->spare_count || b->spare_capacity[b->spare_count - 1] <= run->row_capacity)
        return;
    msfp_row *rows = b->spare[--b->spare_count];
    memcpy(rows, run->rows, run->row_count * sizeof *rows);
    free(run->rows);
    run->rows = rows;
    run->row_capacity = b->spare_capacity[b->spare_count];
}

int msfp_batch_put(msfp_batch *b, int slot, msfp_run *run)
{
    strand *s = &b->strands[slot];
    if (!s->pointer) {
        const int status = prepare(s, slot);
        if (status)
            return status;
    }
    give_spare(b, run);
    s->values = ++b->values;
    for (int i = 0; i < MSFP_MOST_RUNS; ++i)
        if (b->strands[i].run && !memcmp(&b->strands[i].run->parameters, &run->parameters, sizeof run->parameters))
            s->values = b->strands[i].values;
    s->run = run;
    ++b->runs;
    b->ready[b->ready_count++] = slot;
    return MSFP_OK;
}

int msfp_batch_asked(msfp_request *request)
{
    if (!active || active->runs <= MSFP_FEW)
        return 0;
    strand *s = &active->strands[active->current];
    s->request = request;
    request->values = s->values;
    msfp_switch(&s->pointer, active->pointer);
    return 1;
}

/* Every run that can goes on to its next request or to its end. */
static int go_on(msfp_batch *b, int *ended)
{
    int count = 0;
    while (b->ready_count) {
        const int slot = b->current = b->ready[--b->ready_count];
        strand *s = &b->strands[slot];
        active = b;
        msfp_switch(&b->pointer, s->pointer);
        active = NULL;
        if (s->request) {
            const int kind = s->request->tangent ? TANGENTS : VALUES;
            b->waiting[kind][b->waiting_count[kind]++] = slot;
        } else
            ended[count++] = slot;
        s->run = s->request ? s->run : NULL;
    }
    b->runs -= count;
    return count;
}

/* As many of a kind as a vector holds; with enough runs there always are as many. Those that wait longest come first. */
static int answer(msfp_batch *b)
{
    msfp_request *requests[MSFP_WIDTH];
    const int kind = b->waiting_count[TANGENTS] > b->waiting_count[VALUES] || b->waiting_count[TANGENTS] >= MSFP_WIDTH;
    int *waiting = b->waiting[kind], count = b->waiting_count[kind];
    count = count < MSFP_WIDTH ? count : MSFP_WIDTH;
    if (!count)
        return 0;
    for (int i = 0; i < count; ++i) {
        requests[i] = b->strands[waiting[i]].request;
        b->ready[b->ready_count++] = waiting[i];
    }
    msfp_lanes(b->lanes, requests, count);
    b->waiting_count[kind] -= count;
    memmove(waiting, waiting + count, (size_t)b->waiting_count[kind] * sizeof *waiting);
    return count;
}

int msfp_batch_advance(msfp_batch *b, long evaluations, int *ended)
{
    int count = go_on(b, ended);
    while (!count && evaluations > 0) {
        const int answered = answer(b);
        if (!answered)
            break;
        evaluations -= answered;
        count = go_on(b, ended);
    }
    return count;
}
