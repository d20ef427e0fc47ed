/* pool.c: the bearings of one stage in threads. Each thread has its own bearings, so results do not depend on how many
 * threads there are. */
#include <stdlib.h>
#include "building.h"

static void work(msfp_building *b, int thread)
{
    const int count = b->scene.bearings, threads = b->pool.count;
    const int end = (int)((long)count * (thread + 1) / threads);
    for (int i = (int)((long)count * thread / threads); i < end; ++i)
        b->pool.what(b, i);
}

typedef struct {
    msfp_building *b;
    int thread;
} worker;

static void *serve(void *given)
{
    const worker at = *(worker *)given;
    pool *p = &at.b->pool;
    long seen = 0;
    free(given);
    pthread_mutex_lock(&p->lock);
    for (;;) {
        while (p->generation == seen && !p->ended)
            pthread_cond_wait(&p->begun, &p->lock);
        if (p->ended)
            break;
        seen = p->generation;
        pthread_mutex_unlock(&p->lock);
        work(at.b, at.thread);
        pthread_mutex_lock(&p->lock);
        if (--p->pending == 0)
            pthread_cond_signal(&p->done);
    }
    pthread_mutex_unlock(&p->lock);
    return NULL;
}

int pool_begin(msfp_building *b)
{
    pool *p = &b->pool;
    const int wanted = b->scene.threads < b->scene.bearings ? b->scene.threads : b->scene.bearings;
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->begun, NULL);
    pthread_cond_init(&p->done, NULL);
    p->count = 1;
    p->threads = calloc((size_t)(wanted > 1 ? wanted : 1), sizeof *p->threads);
    if (!p->threads)
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
    return MSFP_OK;
}

void pool_end(msfp_building *b)
{
    pool *p = &b->pool;
    if (!p->count)
        return;
    pthread_mutex_lock(&p->lock);
    p->ended = 1;
    pthread_cond_broadcast(&p->begun);
    pthread_mutex_unlock(&p->lock);
    for (int i = 0; i + 1 < p->count; ++i)
        pthread_join(p->threads[i], NULL);
    free(p->threads);
    pthread_cond_destroy(&p->begun);
    pthread_cond_destroy(&p->done);
    pthread_mutex_destroy(&p->lock);
}

void for_each_bearing(msfp_building *b, task *what)
{
    pool *p = &b->pool;
    p->what = what;
    if (p->count > 1) {
        pthread_mutex_lock(&p->lock);
        p->pending = p->count - 1;
        ++p->generation;
        pthread_cond_broadcast(&p->begun);
        pthread_mutex_unlock(&p->lock);
    }
    work(b, 0);
    if (p->count > 1) {
        pthread_mutex_lock(&p->lock);
        while (p->pending)
            pthread_cond_wait(&p->done, &p->lock);
        pthread_mutex_unlock(&p->lock);
    }
}
