/* stage.c: one step of the building and its bearings: the stages of the method, and the error.
 *
 * Unknowns of a stage are the rates x of the attachments. Newton's method solves S x + f(x) = g (linear.c): f are the
 * forces of the bearings, each of which solves its own stage equations for the motion of its upper end. The derivatives
 * of f are kept as long as they reduce the residual.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "building.h"

enum { MOST_ITERATIONS = 30, HALVINGS = 5 };
static const double contraction = 0.1; /* an iteration that reduces the residual by less has the derivatives renewed */
static const double tolerance = 1e-3;  /* of the balance of a stage: share of rtol times the weight */

/* ---- motions ---- */

/* Value and two derivatives along E1, E2, E3. */
static void evaluate_ground(const msfp_piecewise *g, int *last, double t, double *out)
{
    const int k = *last = msfp_piece_at(g->knots, g->pieces, *last, t);
    const double s = t - g->knots[k], *c = g->coefficients + (size_t)k * 6 * (MSFP_DEGREE + 1);
    for (int i = 0; i < 3; ++i, c += MSFP_DEGREE + 1) {
        double value = 0.0, rate = 0.0, second = 0.0;
        for (int p = MSFP_DEGREE; p >= 0; --p) {
            second = second * s + 2.0 * rate;
            rate = rate * s + value;
            value = value * s + c[p];
        }
        out[i] = value;
        out[3 + i] = rate;
        out[6 + i] = second;
    }
}

void ground_at(msfp_building *b, double t)
{
    const msfp_building_scene *s = &b->scene;
    if (b->jump < s->jump_count && t >= s->jumps[b->jump])
        t = nextafter(s->jumps[b->jump], -INFINITY);
    for (int g = 0; g < s->grounds; ++g) {
        double start[MSFP_GROUND];
        int first = 0;
        evaluate_ground(&s->ground[g], &first, 0.0, start);
        evaluate_ground(&s->ground[g], &b->piece[g], t, b->ground + g * MSFP_GROUND);
        for (int i = 0; i < 3; ++i)
            b->ground[g * MSFP_GROUND + i] -= start[i];
    }
}

/* Motion of both ends of a bearing from that of the attachments. */
static void set_ends(msfp_building *b, int bearing, const double *u, const double *v, const double *a)
{
    const msfp_building_scene *s = &b->scene;
    const double *ground = b->ground + s->ground_of[bearing] * MSFP_GROUND, *motion[3] = { u, v, a };
    const double *rows = s->rows + (size_t)bearing * MSFP_WRENCH * s->attachments;
    int count;
    const int *own = columns_of(&b->moved, bearing, &count);
    double *ends = b->members[bearing].ends;
    memset(ends, 0, sizeof b->members[bearing].ends);
    for (int order = 0; order < 3; ++order) {
        memcpy(ends + order * MSFP_WRENCH, ground + 3 * order, 3 * sizeof *ends);
        for (int i = 0; i < MSFP_WRENCH; ++i)
            ends[(3 + order) * MSFP_WRENCH + i] = dot_at(count, own, rows + (size_t)i * s->attachments, motion[order]);
    }
}

static void place_now(msfp_building *b, int bearing)
{
    const int r = b->scene.attachments;
    set_ends(b, bearing, b->scratch, b->scratch + r, b->scratch + 2 * r);
}

void ends_now(msfp_building *b)
{
    for (int i = 0; i < b->scene.bearings; ++i)
        set_ends(b, i, b->u, b->v, b->a);
}

/* ---- tasks of the bearings ---- */

static void begin_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    const msfp_part *part = &b->scene.parts[bearing];
    place_now(b, bearing); /* of the expected end of the step */
    m->status = part->api->port_step_begin(part->port, b->trying, m->ends + 3 * MSFP_WRENCH);
}

static void solve_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    const msfp_part *part = &b->scene.parts[bearing];
    const int r = b->scene.attachments;
    set_ends(b, bearing, b->scratch, b->x, b->scratch + r);
    memcpy(m->previous, m->wrench + MSFP_WRENCH, sizeof m->previous);
    m->status = part->api->port_stage(part->port, b->solving, m->ends, m->wrench);
}

static void differentiate_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    m->status = b->scene.parts[bearing].api->port_stage_derivative(b->scene.parts[bearing].port, m->derivative);
}

static void end_bearing(msfp_building *b, int bearing)
{
    member *m = &b->members[bearing];
    m->status = b->scene.parts[bearing].api->port_step_end(b->scene.parts[bearing].port, &m->error, &m->share);
}

/* The status of the first bearing that has failed, which is noted. */
int first_failure(msfp_building *b)
{
    for (int i = 0; i < b->scene.bearings; ++i)
        if (b->members[i].status) {
            b->bearing = i + 1;
            return b->members[i].status;
        }
    b->bearing = 0;
    return MSFP_OK;
}

/* The bearing, from 1, whose force has changed most in the last iteration. */
static int most_unsettled(const msfp_building *b)
{
    double most = -1.0;
    int bearing = 0;
    for (int j = 0; j < b->scene.bearings; ++j) {
        const member *m = &b->members[j];
        double size = 0.0;
        for (int k = 0; k < 3; ++k)
            size += fabs(m->wrench[MSFP_WRENCH + k] - m->previous[k]);
        if (size > most) {
            most = size;
            bearing = j + 1;
        }
    }
    return bearing;
}

/* ---- Newton's method ---- */

/* Forces of the bearings at the rates x, and the residual: the forces that are out of balance, whose size over the weight
 * is returned; infinite where a bearing has no solution. */
static double evaluate(msfp_building *b, double beta)
{
    const msfp_building_scene *s = &b->scene;
    const int r = s->attachments;
    double size = 0.0;
    msfp_stage_formula(b->Q, b->V, beta, 1.0 / beta, b->x, r, b->scratch, b->scratch + r);
    for_each_bearing(b, solve_bearing);
    if (first_failure(b))
        return INFINITY;
    memset(b->force, 0, (size_t)r * sizeof *b->force);
    for (int j = 0; j < s->bearings; ++j) {
        const member *m = &b->members[j];
        int count;
        const int *own = columns_of(&b->moved, j, &count);
        for (int k = 0; k < MSFP_WRENCH; ++k) {
            const double *row = s->rows + ((size_t)j * MSFP_WRENCH + k) * r, beyond = m->wrench[MSFP_WRENCH + k] - m->rest[k];
            for (int i = 0; i < count; ++i)
                b->force[own[i]] += row[own[i]] * beyond;
        }
    }
    multiply(r, b->now->system, b->x, b->residual);
    for (int i = 0; i < r; ++i) {
        b->residual[i] += b->force[i] - b->driving[i];
        const double share = fabs(b->residual[i]) / b->scale[i];
        size = share <= size ? size : share; /* also where it is not a number */
    }
    return size < INFINITY ? size : INFINITY;
}

/* Derivatives of the forces at the present rates, and their factors. */
static int differentiate(msfp_building *b, double beta)
{
    const msfp_building_scene *s = &b->scene;
    const size_t r = s->attachments;
    ++b->counts[MSFP_BUILDING_TANGENTS];
    for_each_bearing(b, differentiate_bearing);
    const int status = first_failure(b);
    if (status)
        return status;
    memset(b->tangent, 0, r * r * sizeof *b->tangent);
    for (int j = 0; j < s->bearings; ++j) {
        const double *rows = s->rows + (size_t)j * MSFP_WRENCH * r, *d = b->members[j].derivative;
        int count;
        const int *own = columns_of(&b->moved, j, &count);
        for (int k = 0; k < MSFP_WRENCH; ++k)
            for (int c = 0; c < count; ++c) {
                double sum = 0.0;
                for (int l = 0; l < MSFP_WRENCH; ++l)
                    sum += d[k * MSFP_WRENCH + l] * rows[l * r + own[c]];
                for (int i = 0; i < count; ++i)
                    b->tangent[own[i] * r + own[c]] += rows[k * r + own[i]] * sum;
            }
    }
    b->tangent_beta = beta;
    return factor_tangent(b);
}

static void move_ports(msfp_building *b, double factor)
{
    for (int i = 0; i < b->scene.attachments; ++i)
        b->x[i] -= factor * b->change[i];
}

/* One iteration from a residual of the given size; fresh: the derivatives are those at these rates. Returns the size
 * after it. */
static double iterate(msfp_building *b, double beta, double size, int fresh)
{
    double factor = 1.0;
    ++b->counts[MSFP_BUILDING_ITERATIONS];
    memcpy(b->change, b->residual, (size_t)b->scene.attachments * sizeof *b->change);
    solve_tangent(b, b->change);
    move_ports(b, factor);
    double next = evaluate(b, beta);
    for (int i = 0; fresh && !(next <= size) && i < HALVINGS; ++i) {
        factor *= 0.5;
        move_ports(b, -factor);
        next = evaluate(b, beta);
    }
    if (!fresh && !(next < size)) { /* old derivatives gave no descent: take the step back */
        move_ports(b, -1.0);
        next = evaluate(b, beta);
    }
    return next;
}

static int solve_stage(msfp_building *b, double beta)
{
    const double goal = tolerance * b->scene.rtol;
    double size = evaluate(b, beta);
    int fresh = 0, status = MSFP_OK;
    for (int i = 0; size > goal; ++i) {
        if (!(size < INFINITY))
            return b->bearing ? b->members[b->bearing - 1].status : MSFP_E_FINITE;
        if (i >= MOST_ITERATIONS) {
            b->bearing = most_unsettled(b);
            return MSFP_E_NEWTON;
        }
        fresh |= b->tangent_beta == 0.0;
        if (fresh)
            status = differentiate(b, beta);
        if (status)
            return status;
        const double before = size;
        size = iterate(b, beta, size, fresh);
        fresh = size > goal && !(size < contraction * before);
    }
    return MSFP_OK;
}

/* ---- stages ---- */

/* The forces that drive the rates of attachments and oscillators from Q and V [n]: those of inertia and of springs, on
 * the attachments also those of the oscillators. */
static void drive(msfp_building *b, const double *Q, const double *V, double beta)
{
    const msfp_building_scene *s = &b->scene;
    const int r = s->attachments, m = s->n - r;
    double *driving = b->driving;
    multiply(r, s->mass, V, driving);
    multiply(r, s->stiffness, Q, b->product);
    for (int k = 0; k < r; ++k)
        driving[k] = driving[k] / beta - b->product[k];
    strain_of(b, Q, b->strain);
    for (int k = 0; k < m; ++k) {
        const double force = s->springs[k] * b->strain[k];
        driving[r + k] = V[r + k] / beta - force;
        b->strain[k] = force + b->now->follow[k] * driving[r + k];
    }
    add_columns(r, m, s->shares_turned, b->strain, driving);
}

/* The rates v [n] of the oscillators from those of the attachments; rates of strain stay in b->strain. */
static void follow(msfp_building *b, double *v)
{
    const int r = b->scene.attachments, m = b->scene.n - r;
    memset(v + r, 0, (size_t)m * sizeof *v);
    strain_of(b, v, b->strain);
    for (int k = 0; k < m; ++k) {
        v[r + k] = b->driving[r + k] * b->now->inverse[k] - b->strain[k] * b->now->follow[k];
        b->strain[k] += v[r + k];
    }
}

/* Q, V and the driving forces; a first guess of the rates of the attachments. */
static void begin_stage(msfp_building *b, int i, double h, double beta)
{
    const int n = b->scene.n;
    const msfp_method_stages *m = &b->method;
    memcpy(b->Q, b->u, (size_t)n * sizeof *b->Q);
    memcpy(b->V, b->v, (size_t)n * sizeof *b->V);
    msfp_sum_stages(b->Q, b->stage_v, n, m->weights[i], i, h, n);
    msfp_sum_stages(b->V, b->stage_a, n, m->weights[i], i, h, n);
    drive(b, b->Q, b->V, beta);
    for (int c = 0; c < b->scene.attachments; ++c) {
        const double *a = b->stage_a + c;
        b->x[c] = msfp_guess_rate(m->shares, i, b->V[c], beta, a[0], a[(size_t)(i - 1) * n], h * b->slope[c]);
    }
}

/* Rates and accelerations of all coordinates in the stage just solved, with which the forces are in balance, and powers. */
static void end_stage(msfp_building *b, int i, double beta)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n, r = s->attachments;
    double *v = b->stage_v + i * n, *a = b->stage_a + i * n, *power = b->power[i];
    memcpy(v, b->residual, r * sizeof *v);
    solve_linear(b, v);
    for (size_t c = 0; c < r; ++c)
        v[c] = b->x[c] - v[c];
    follow(b, v);
    for (size_t c = 0; c < n; ++c)
        a[c] = 1.0 / beta * (v[c] - b->V[c]);
    power[DAMPED] = 0.0;
    if (b->damped) {
        multiply(s->attachments, s->damping, v, b->product);
        power[DAMPED] = dot(s->attachments, v, b->product);
    }
    for (size_t k = 0; k < n - r; ++k)
        power[DAMPED] += s->dampers[k] * b->strain[k] * b->strain[k];
    power[RECEIVED] = -dot(s->attachments, b->force, v);
    power[GROUND] = 0.0;
    for (int j = 0; j < s->bearings; ++j)
        power[GROUND] += dot(3, b->members[j].wrench, b->ground + s->ground_of[j] * MSFP_GROUND + 3);
}

/* Kinetic and strain energy; returns their sum. */
static double energies_of(msfp_building *b, const double *u, const double *v, double energies[2])
{
    const msfp_building_scene *s = &b->scene;
    const int r = s->attachments, m = s->n - r;
    multiply(r, s->mass, v, b->product);
    energies[0] = 0.5 * (dot(r, v, b->product) + dot(m, v + r, v + r));
    multiply(r, s->stiffness, u, b->product);
    energies[1] = 0.5 * dot(r, u, b->product);
    strain_of(b, u, b->strain);
    for (int k = 0; k < m; ++k)
        energies[1] += 0.5 * s->springs[k] * b->strain[k] * b->strain[k];
    return energies[0] + energies[1];
}

/* Error of the building in the norm of energy, over the tolerance. The embedded estimate of a stiff mode is as large as
 * its ringing, which the method damps, so the estimate is filtered as those of the bearings are (Hosea and Shampine
 * 1996): the last stage is solved with its history moved by it. whole: energy at the end of the step [J]. */
static double building_error(msfp_building *b, double h, double beta, double whole)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n;
    const double share = tangent_share(b) / beta;
    double *eu = b->Q, *ev = b->V, *y = b->product;
    const int last = b->method.count - 1;
    memset(eu, 0, n * sizeof *eu);
    memset(ev, 0, n * sizeof *ev);
    for (int j = 0; j <= last; ++j) {
        msfp_add(eu, b->stage_v + j * n, h * b->method.errors[j], s->n);
        msfp_add(ev, b->stage_a + j * n, h * b->method.errors[j], s->n);
    }
    drive(b, eu, ev, beta);
    for (int i = 0; i < s->attachments; ++i) {
        int count;
        const int *columns = columns_of(&b->coupled, i, &count);
        b->driving[i] -= share * dot_at(count, columns, b->tangent + (size_t)i * s->attachments, eu);
    }
    memcpy(y, b->driving, (size_t)s->attachments * sizeof *y);
    solve_tangent(b, y);
    follow(b, y);
    for (size_t c = 0; c < n; ++c)
        eu[c] += beta * y[c];
    memcpy(ev, y, n * sizeof *ev);
    double of_error[2];
    const double wrong = energies_of(b, eu, ev, of_error);
    return sqrt(wrong / fmax(b->energy, whole)) / s->rtol;
}

static int all_stages(msfp_building *b, double h, double beta)
{
    const int n = b->scene.n, r = b->scene.attachments;
    memcpy(b->stage_v, b->v, (size_t)n * sizeof *b->v);
    memcpy(b->stage_a, b->a, (size_t)n * sizeof *b->a);
    for (int k = 0; k < r; ++k) { /* the ends expected at the end of the step */
        b->scratch[k] = b->u[k] + h * (b->v[k] + 0.5 * h * b->a[k]);
        b->scratch[r + k] = b->scratch[2 * r + k] = 0.0;
    }
    b->trying = h;
    for_each_bearing(b, begin_bearing);
    int status = first_failure(b);
    for (int i = 1; i < b->method.count && !status; ++i) {
        b->solving = i;
        ground_at(b, b->t + b->method.shares[i] * h);
        begin_stage(b, i, h, beta);
        status = solve_stage(b, beta);
        if (!status)
            end_stage(b, i, beta);
    }
    return status;
}

int try_step(msfp_building *b, double h, double *error, double *share, int *worst)
{
    const int n = b->scene.n;
    b->bearing = 0;
    int status = factor_linear(b, h);
    const double beta = b->method.diagonal * b->now->length;
    status = status ? status : all_stages(b, h, beta);
    if (status)
        return status;
    for (int c = 0; c < n; ++c)
        b->next_u[c] = b->Q[c] + beta * b->stage_v[(size_t)(b->method.count - 1) * n + c];
    for_each_bearing(b, end_bearing);
    if ((status = first_failure(b)))
        return status;
    *worst = 0;
    const double whole = energies_of(b, b->next_u, b->stage_v + (size_t)(b->method.count - 1) * n, b->next_energies);
    *error = b->tangent_beta > 0.0 ? building_error(b, h, beta, whole) : 0.0;
    *share = 1.0;
    for (int i = 0; i < b->scene.bearings; ++i) {
        if (b->members[i].error > *error) {
            *error = b->members[i].error;
            *worst = i + 1;
        }
        *share = b->members[i].share < *share ? b->members[i].share : *share;
    }
    return *error < INFINITY ? MSFP_OK : MSFP_E_FINITE;
}
