/* port.c: trials of a two-port, their wrenches, and its snapshots. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "port.h"

void msfp_attach(msfp_history *history, const double *knots, const msfp_polynomials *polynomials)
{
    memset(history, 0, sizeof *history);
    history->pieces = MSFP_PORT_PIECES;
    history->knots = knots;
    history->coefficients = &polynomials->coefficients[0][0][0];
}

/* The histories of a run are the polynomials of the port. */
static void attach_all(msfp_port *port, msfp_run *run)
{
    msfp_attach(&run->motion, port->knots, &port->motion);
    msfp_attach(&run->load, port->knots, &port->load);
    msfp_attach(&run->support, port->knots, &port->support);
}

/* The state of `to` becomes that of `from`; rows and events stay apart. */
static void copy_state(msfp_run *to, const msfp_run *from)
{
    memcpy((char *)to + MSFP_SNAPSHOT_BEGIN, (const char *)from + MSFP_SNAPSHOT_BEGIN,
           MSFP_SNAPSHOT_END - MSFP_SNAPSHOT_BEGIN);
}

/* Start the committed run; the trial begins as a copy of it. Returns its status. */
static int begin(msfp_port *port, const msfp_parameters *p, const msfp_options *options, const double *q,
                 const double *v, const double *f)
{
    const uint64_t identity = port->committed.identity;
    msfp_history motion, load, support = { 0 };
    msfp_attach(&motion, port->knots, &port->motion);
    msfp_attach(&load, port->knots, &port->load);
    msfp_attach(&support, port->knots, &port->support);
    const int status = msfp_run_start(&port->committed, p, &motion, &load, &support, NULL, 0, options, q, v, f);
    port->committed.identity = identity;
    port->run = port->committed;
    port->run.rows = NULL;
    port->run.events = NULL;
    port->run.row_count = port->run.row_capacity = port->run.event_count = port->run.event_capacity = 0;
    attach_all(port, &port->run);
    port->committed.options.start_time = -INFINITY; /* a snapshot may be of any time */
    port->committed.options.duration = INFINITY;
    return status;
}

msfp_port *msfp_port_new(const msfp_parameters *p, const msfp_options *options, double axial_load, const double *q,
                         int loaded)
{
    static const double v[NB * MSFP_NQ] = { 0.0 }, f[NB * 2] = { 0.0 };
    msfp_port *port = calloc(1, sizeof *port);
    if (!port)
        return NULL;
    port->loaded = loaded;
    port->axial_load = axial_load;
    port->step.stage = MSFP_NO_STEP;
    msfp_port_paths(port, p, options->start_time, options->start_time + 1.0, &port->to);
    if (begin(port, p, options, q, v, f) == MSFP_OK) {
        memcpy(port->plate, port->committed.rows[0].top, sizeof port->plate);
        port->committed.rows[0].restraint += msfp_port_springs(port, &port->committed, &port->from);
        msfp_port_wrench_of(port, &port->committed, &port->from, port->wrench);
    }
    return port;
}

void msfp_port_free(msfp_port *port)
{
    if (!port)
        return;
    msfp_run_free(&port->committed);
    msfp_run_free(&port->run);
    free(port->times);
    free(port);
}

int msfp_port_enter(msfp_port *port, const msfp_options *options, const double *q, const double *v, const double *f,
                    const double *monitor_heat, const double *ends)
{
    msfp_run *run = &port->committed;
    memcpy(&port->from, ends, sizeof port->from);
    run->now.t = options->start_time;
    msfp_port_hold(port); /* springs too */
    const msfp_parameters parameters = run->parameters;
    msfp_run_free(run);
    msfp_run_free(&port->run);
    const int status = begin(port, &parameters, options, q, v, f);
    if (status == MSFP_OK) {
        msfp_port_dampers(port, run, &port->from, 0.0, &run->now);
        run->rows[0].restraint += msfp_port_springs(port, run, &port->from);
        msfp_port_wrench_of(port, run, &port->from, port->wrench);
    }
    if (monitor_heat)
        memcpy(run->monitor.heat, monitor_heat, sizeof run->monitor.heat);
    port->trial_state = NO_TRIAL;
    port->step.finished = port->step.moved = 0;
    port->step.stage = MSFP_NO_STEP;
    return status;
}

void msfp_port_prepare(msfp_port *port, msfp_run *run, double t, const msfp_ends *to)
{
    copy_state(run, &port->committed);
    memset(run->counts, 0, sizeof run->counts);
    run->row_count = run->event_count = 0;
    run->options.duration = t;
    msfp_port_paths(port, &run->parameters, run->now.t, t, to);
    attach_all(port, run); /* nothing of an earlier trial is left in the searches */
    if (port->loaded)
        return;
    /* The springs are fixed where end B is at the end: the load that its motion adds stays small beside the axial load. */
    run->now.energy += msfp_port_move_anchor(port, run, port->committed.rows[0].top, port->from.of[1][0], to->of[1][0]);
}

/* Record the end of the step just taken. */
static int record_time(msfp_port *port)
{
    if (port->time_count == port->time_capacity) {
        const size_t capacity = port->time_capacity ? 2 * port->time_capacity : 64;
        double *times = realloc(port->times, capacity * sizeof *times);
        if (!times)
            return MSFP_E_MEMORY;
        port->times = times;
        port->time_capacity = capacity;
    }
    port->times[port->time_count++] = port->run.now.t;
    return MSFP_OK;
}

int msfp_port_trial(msfp_port *port, double t, const double *to)
{
    msfp_run *run = &port->run;
    memcpy(&port->to, to, sizeof port->to);
    port->trial_state = NO_TRIAL;
    port->step.stage = MSFP_NO_STEP;
    port->step.finished = 0;
    port->time_count = 0;
    if (t == port->committed.now.t) {
        copy_state(run, &port->committed);
        port->trial_state = TRIAL_OF_NO_DURATION;
        return MSFP_OK;
    }
    msfp_port_prepare(port, run, t, &port->to);
    for (int more = 1; more;) {
        const long before = run->counts[MSFP_COUNT_STEPS];
        more = msfp_run_advance(run, 1);
        if (run->counts[MSFP_COUNT_STEPS] > before && run->status == MSFP_OK)
            run->status = record_time(port);
    }
    port->trial_state = run->status == MSFP_OK ? TRIAL_SOLVED : NO_TRIAL;
    return run->status;
}

static const msfp_run *current(const msfp_port *port)
{
    return port->trial_state == TRIAL_SOLVED ? &port->run : &port->committed;
}

const msfp_row *msfp_port_row(const msfp_port *port)
{
    const msfp_run *run = current(port);
    return &run->rows[run->row_count - 1];
}

void msfp_port_wrench(const msfp_port *port, double *wrench)
{
    if (port->trial_state == TRIAL_SOLVED)
        msfp_port_wrench_of(port, &port->run, &port->to, wrench);
    else
        memcpy(wrench, port->wrench, sizeof port->wrench);
}

int msfp_port_commit(msfp_port *port)
{
    if (port->trial_state == NO_TRIAL)
        return MSFP_E_ARGUMENT;
    if (port->trial_state == TRIAL_SOLVED) {
        msfp_port_wrench(port, port->wrench);
        port->committed.rows[0] = *msfp_port_row(port);
        copy_state(&port->committed, &port->run);
        port->from = port->to;
    }
    port->trial_state = NO_TRIAL;
    return MSFP_OK;
}

void msfp_port_revert(msfp_port *port)
{
    port->step.stage = MSFP_NO_STEP;
    port->step.finished = 0;
    port->trial_state = NO_TRIAL;
    port->time_count = 0;
    copy_state(&port->run, &port->committed);
}

/* ---- snapshots: what the port adds, its checksum, and the snapshot of the committed run with one row ---- */

int msfp_valid_ends(const double *ends, int loaded)
{
    if (!msfp_all_finite(ends, sizeof(msfp_ends) / sizeof *ends))
        return 0;
    for (int end = 0; end < MSFP_ENDS - loaded; ++end) {
        const double *turn = ends + end * MSFP_ORDERS * MSFP_END_FREEDOMS + 3;
        if (!(sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]) <= MSFP_LARGEST_TURN))
            return 0;
    }
    return 1;
}

/* All numbers: no bytes between them. */
typedef struct {
    msfp_ends from;
    double wrench[MSFP_PORT_FREEDOMS];
    double moves[MSFP_DOF][MSFP_END_FREEDOMS], moved; /* as in msfp_port_step */
} head;

enum { HEAD = sizeof(head) + sizeof(uint64_t) };

size_t msfp_port_snapshot_size(const msfp_port *port) { return HEAD + msfp_snapshot_size(&port->committed, 1); }

void msfp_port_snapshot_write(const msfp_port *port, void *snapshot)
{
    head h;
    h.from = port->from;
    memcpy(h.wrench, port->wrench, sizeof h.wrench);
    memcpy(h.moves, port->step.moves, sizeof h.moves);
    h.moved = port->step.moved;
    const uint64_t sum = msfp_hash(MSFP_HASH_START, &h, sizeof h);
    memcpy(snapshot, &h, sizeof h);
    memcpy((char *)snapshot + sizeof h, &sum, sizeof sum);
    msfp_snapshot_write(&port->committed, 1, (char *)snapshot + HEAD);
}

int msfp_port_snapshot_read(msfp_port *port, const void *snapshot, size_t size)
{
    head h;
    uint64_t sum;
    if (size != msfp_port_snapshot_size(port)) /* one row, no events */
        return MSFP_E_SNAPSHOT;
    memcpy(&h, snapshot, sizeof h);
    memcpy(&sum, (const char *)snapshot + sizeof h, sizeof sum);
    if (sum != msfp_hash(MSFP_HASH_START, &h, sizeof h) || !msfp_valid_ends(&h.from.of[0][0][0], port->loaded) ||
        !msfp_all_finite(h.wrench, MSFP_PORT_FREEDOMS) ||
        !msfp_all_finite(&h.moves[0][0], MSFP_DOF * MSFP_END_FREEDOMS))
        return MSFP_E_SNAPSHOT;
    msfp_run found = port->committed;
    found.rows = NULL; /* those of `committed` stay until the snapshot is accepted */
    found.events = NULL;
    int status = msfp_snapshot_read(&found, (const char *)snapshot + HEAD, size - HEAD);
    if (status)
        return status == MSFP_E_MEMORY ? status : MSFP_E_SNAPSHOT;
    if (found.status != MSFP_OK) {
        msfp_run_free(&found);
        return MSFP_E_SNAPSHOT;
    }
    msfp_run_free(&port->committed);
    port->committed = found;
    port->from = h.from;
    memcpy(port->wrench, h.wrench, sizeof h.wrench);
    memcpy(port->step.moves, h.moves, sizeof h.moves);
    port->step.moved = h.moved != 0.0;
    msfp_port_revert(port);
    return MSFP_OK;
}
