/* pool.c: the bearings of one stage in threads. Each bearing is computed by one thread, so results do not depend on how
 * many there are, nor on which thread it is.
 *
 * A stage takes some tens of microseconds, in which a thread that sleeps is not even woken. Threads therefore look for
 * work for some time before they sleep, and one that has done its own bearings takes those that others have left. What
 * ends a stage is its last bearing: a thread that the system does not run holds up nobody, unless it was stopped in the
 * middle of a bearing. On a machine with other work this is frequent, and threads are slower than one; so both are timed.
 */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */
#include <stdlib.h>
#include <time.h>
#include "building.h"

enum {
    LOOKS = 10000, /* for work before a thread sleeps: some tenths of a millisecond */
    CALLS = 32,    /* between two looks at the clock */
    RARELY = 16    /* longest time for which the faster way is kept, over KEPT */
};
#define TRIAL 0.01 /* for which the slower way is timed again [s] */
#define KEPT 0.2   /* for which the faster way is kept [s], and four times as long each time that it stays this */
#define CLEARLY 0.95 /* time of a faster way over that of the present one, so that noise does not count */

#define LOAD(variable) __atomic_load_n(&(variable), __ATOMIC_SEQ_CST)
#define STORE(variable, value) __atomic_store_n(&(variable), value, __ATOMIC_SEQ_CST)
#define ADD(variable, value) __atomic_add_fetch(&(variable), value, __ATOMIC_SEQ_CST)

/* Tell the processor that this thread only waits. */
static inline void relax(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ __volatile__("yield");
#endif
}

/* First bearing of a thread. */
static int first_of(const msfp_building *b, int thread)
{
    return (int)((long)b->scene.bearings * thread / b->pool.count);
}

/* The bearings of a thread, then those of the others that are left. */
static void take_work(msfp_building *b, int thread)
{
    pool *p = &b->pool;
    for (int k = 0; k < p->count; ++k) {
        const int of = (thread + k) % p->count, end = first_of(b, of + 1);
        for (int i; (i = ADD(p->taken[of], 1) - 1) < end;) {
            p->what(b, i);
            if (ADD(p->unfinished, -1) == 0 && LOAD(p->waiting)) {
                pthread_mutex_lock(&p->lock);
                pthread_cond_signal(&p->done);
                pthread_mutex_unlock(&p->lock);
            }
        }
    }
}

typedef struct {
    msfp_building *b;
    int thread;
} worker;

/* Wait for work other than that of generation `seen`; returns its generation, or -1 at the end. */
static long next_generation(pool *p, long seen)
{
    for (int i = 0; i < LOOKS && LOAD(p->generation) == seen; ++i)
        relax();
    if (LOAD(p->generation) == seen) {
        pthread_mutex_lock(&p->lock);
        ADD(p->sleeping, 1);
        while (LOAD(p->generation) == seen)
            pthread_cond_wait(&p->begun, &p->lock);
        ADD(p->sleeping, -1);
        pthread_mutex_unlock(&p->lock);
    }
    return LOAD(p->generation);
}

static void *serve(void *given)
{
    const worker at = *(worker *)given;
    pool *p = &at.b->pool;
    long seen = 0;
    free(given);
    while ((seen = next_generation(p, seen)) != ENDED)
        take_work(at.b, at.thread);
    return NULL;
}

int pool_begin(msfp_building *b)
{
    pool *p = &b->pool;
    const int wanted = b->scene.threads < b->scene.bearings ? b->scene.threads : b->scene.bearings;
    const size_t most = (size_t)(wanted > 1 ? wanted : 1);
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->begun, NULL);
    pthread_cond_init(&p->done, NULL);
    p->count = 1;
    p->threads = calloc(most, sizeof *p->threads);
    p->taken = calloc(most, sizeof *p->taken);
    if (!p->threads || !p->taken)
        return MSFP_E_MEMORY;
    while (p->count < wanted) { /* fewer where the system gives no more */
        worker *at = malloc(sizeof *at);
        if (!at)
            return MSFP_E_MEMORY;
        *at = (worker){ b, p->count };
        if (pthread_create(&p->threads[p->count - 1], NULL, serve, at)) {
            free(at);
            break;
        }
        ++p->count;
    }
    p->together = !b->scene.timed;
    p->period = TRIAL;
    return MSFP_OK;
}

/* Begin a generation: threads that sleep are woken. */
static void begin_generation(pool *p, long generation)
{
    STORE(p->generation, generation);
    if (LOAD(p->sleeping)) {
        pthread_mutex_lock(&p->lock);
        pthread_cond_broadcast(&p->begun);
        pthread_mutex_unlock(&p->lock);
    }
}

void pool_end(msfp_building *b)
{
    pool *p = &b->pool;
    if (!p->count)
        return;
    begin_generation(p, ENDED);
    for (int i = 0; i + 1 < p->count; ++i)
        pthread_join(p->threads[i], NULL);
    free(p->threads);
    free(p->taken);
    pthread_cond_destroy(&p->begun);
    pthread_cond_destroy(&p->done);
    pthread_mutex_destroy(&p->lock);
}

/* Time of the clock [s]. */
static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Keep the faster way, alone or together, and time the other one for a short while from time to time. */
static void choose_way(pool *p)
{
    if (++p->calls % CALLS)
        return;
    const double time = now(), taken = time - p->since;
    if (p->since == 0.0) { /* the first calls find nothing in the caches */
        p->since = time;
        p->calls = 0;
        return;
    }
    if (taken < (p->trial ? TRIAL : p->period))
        return;
    p->each[p->together] = taken / (double)p->calls;
    if (p->trial && p->each[p->together] < CLEARLY * p->each[!p->together]) {
        p->period = KEPT; /* and stay */
        p->trial = 0;
    } else {
        if (p->trial)
            p->period = fmin(4.0 * p->period, RARELY * KEPT);
        p->together = !p->together;
        p->trial = !p->trial;
    }
    p->since = time;
    p->calls = 0;
}

void for_each_bearing(msfp_building *b, task *what)
{
    pool *p = &b->pool;
    if (p->count > 1 && b->scene.timed)
        choose_way(p);
    if (p->count == 1 || !p->together) {
        for (int i = 0; i < b->scene.bearings; ++i)
            what(b, i);
        return;
    }
    p->what = what;
    STORE(p->unfinished, b->scene.bearings);
    for (int i = 0; i < p->count; ++i) /* a late thread may begin here, which finds all in its place */
        STORE(p->taken[i], first_of(b, i));
    begin_generation(p, p->generation + 1);
    take_work(b, 0);
    for (int i = 0; i < LOOKS && LOAD(p->unfinished); ++i)
        relax();
    if (LOAD(p->unfinished)) {
        pthread_mutex_lock(&p->lock);
        STORE(p->waiting, 1);
        while (LOAD(p->unfinished))
            pthread_cond_wait(&p->done, &p->lock);
        STORE(p->waiting, 0);
        pthread_mutex_unlock(&p->lock);
    }
}
