/* stage.c: one step of the building and its bearings: the stages of the method, and the error.
 *
 * Unknowns of a stage are the rates x of the attachments. Newton's method solves x = x_0 - G f(x): x_0 are the rates
 * without forces of the bearings, G is the mobility of the attachments, f the forces of the bearings, each of which
 * solves its own stage equations for the motion of its upper end. The derivatives of f are kept as long as they reduce
 * the residual.
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

/* The attachments of a vector of all coordinates. */
static void pick(const msfp_building *b, const double *all, double *attached)
{
    for (int i = 0; i < b->scene.attachments; ++i)
        attached[i] = all[b->scene.attached[i]];
}

static void place_now(msfp_building *b, int bearing)
{
    const int r = b->scene.attachments;
    set_ends(b, bearing, b->scratch, b->scratch + r, b->scratch + 2 * r);
}

void ends_now(msfp_building *b)
{
    const int r = b->scene.attachments;
    pick(b, b->u, b->scratch);
    pick(b, b->v, b->scratch + r);
    pick(b, b->a, b->scratch + 2 * r);
    for (int i = 0; i < b->scene.bearings; ++i)
        place_now(b, i);
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

/* Forces of the bearings at the rates x, and the residual: in rates, and as the forces that are out of balance, whose
 * size over the weight is returned; infinite where a bearing has no solution. */
static double evaluate(msfp_building *b, double beta)
{
    const msfp_building_scene *s = &b->scene;
    int r = s->attachments, one = 1, info;
    char lower[] = "L";
    double size = 0.0;
    for (int i = 0; i < r; ++i) {
        const int c = s->attached[i];
        b->scratch[i] = b->Q[c] + beta * b->x[i];
        b->scratch[r + i] = (b->x[i] - b->V[c]) / beta;
    }
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
    multiply(r, b->now->mobility, b->force, b->residual);
    for (int i = 0; i < r; ++i)
        b->residual[i] += b->x[i] - b->free[s->attached[i]];
    memcpy(b->balance, b->residual, (size_t)r * sizeof *b->balance);
    s->lapack.potrs(lower, &r, &one, b->now->mobility_factors, &r, b->balance, &r, &info);
    for (int i = 0; i < r; ++i) {
        const double share = fabs(b->balance[i]) / b->scale[i];
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
    b->factored_beta = 0.0;
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

/* Q, V, and the rates without forces of the bearings; a first guess of the rates of the attachments. */
static void begin_stage(msfp_building *b, int i, double h)
{
    const int n = b->scene.n;
    const msfp_method_stages *m = &b->method;
    const double beta = m->diagonal * h;
    memcpy(b->Q, b->u, (size_t)n * sizeof *b->Q);
    memcpy(b->V, b->v, (size_t)n * sizeof *b->V);
    for (int j = 0; j < i; ++j) {
        msfp_add(b->Q, b->stage_v + (size_t)j * n, h * m->weights[i][j], n);
        msfp_add(b->V, b->stage_a + (size_t)j * n, h * m->weights[i][j], n);
    }
    multiply(n, b->scene.mass, b->V, b->free);
    multiply(n, b->scene.stiffness, b->Q, b->product);
    for (int k = 0; k < n; ++k)
        b->free[k] = -(b->free[k] / -beta + b->product[k]);
    solve_linear(b, b->free);
    for (int k = 0; k < b->scene.attachments; ++k) {
        const int c = b->scene.attached[k];
        const double *a = b->stage_a + c;
        const double slope = i > 1 ? (a[(size_t)(i - 1) * n] - a[0]) / m->shares[i - 1] : h * b->slope[c];
        b->x[k] = b->V[c] + beta * (a[0] + m->shares[i] * slope);
    }
}

/* The rates v of all coordinates with those that forces at the attachments take from them. */
static void follow_back(msfp_building *b, const double *force, double *v)
{
    for (int k = 0; k < b->scene.attachments; ++k)
        b->scratch[k] = -force[k];
    add_columns(b->scene.n, b->scene.attachments, b->now->follow, b->scratch, v);
}

/* Rates and accelerations of all coordinates in the stage just solved, and powers. */
static void end_stage(msfp_building *b, int i, double beta)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n;
    double *v = b->stage_v + i * n, *a = b->stage_a + i * n, *power = b->power[i];
    memcpy(v, b->free, n * sizeof *v);
    follow_back(b, b->force, v);
    for (size_t c = 0; c < n; ++c)
        a[c] = (v[c] - b->V[c]) / beta;
    multiply(s->n, s->damping, v, b->product);
    power[DAMPED] = dot(s->n, v, b->product);
    power[RECEIVED] = power[GROUND] = 0.0;
    for (int k = 0; k < s->attachments; ++k)
        power[RECEIVED] -= b->force[k] * v[s->attached[k]];
    for (int j = 0; j < s->bearings; ++j)
        power[GROUND] += dot(3, b->members[j].wrench, b->ground + s->ground_of[j] * MSFP_GROUND + 3);
}

/* Kinetic and strain energy; returns their sum. */
static double energies_of(msfp_building *b, const double *u, const double *v, double *product, double energies[2])
{
    const int n = b->scene.n;
    multiply(n, b->scene.mass, v, product);
    energies[0] = 0.5 * dot(n, v, product);
    multiply(n, b->scene.stiffness, u, product);
    energies[1] = 0.5 * dot(n, u, product);
    return energies[0] + energies[1];
}

/* The product of the tangent and a vector of the attachments. */
static void push(const msfp_building *b, const double *x, double *force)
{
    const size_t r = b->scene.attachments;
    for (size_t i = 0; i < r; ++i) {
        int count;
        const int *columns = columns_of(&b->coupled, (int)i, &count);
        force[i] = dot_at(count, columns, b->tangent + i * r, x);
    }
}

/* Error of the building in the norm of energy, over the tolerance. The embedded estimate of a stiff mode is as large as
 * its ringing, which the method damps, so the estimate is filtered as those of the bearings are (Hosea and Shampine
 * 1996): the last stage is solved with its history moved by it. whole: energy at the end of the step [J]. */
static double building_error(msfp_building *b, double h, double whole)
{
    const msfp_building_scene *s = &b->scene;
    const size_t n = s->n, r = s->attachments;
    const double beta = b->method.diagonal * h;
    double *eu = b->Q, *ev = b->V, *y = b->free, *moved = b->residual;
    const int last = b->method.count - 1;
    memset(eu, 0, n * sizeof *eu);
    memset(ev, 0, n * sizeof *ev);
    for (int j = 0; j <= last; ++j) {
        msfp_add(eu, b->stage_v + j * n, h * b->method.errors[j], s->n);
        msfp_add(ev, b->stage_a + j * n, h * b->method.errors[j], s->n);
    }
    multiply(s->n, s->mass, ev, y);
    multiply(s->n, s->stiffness, eu, b->product);
    for (size_t c = 0; c < n; ++c)
        y[c] = y[c] / -beta + b->product[c];
    pick(b, eu, moved);
    push(b, moved, b->balance);
    for (size_t k = 0; k < r; ++k)
        y[s->attached[k]] += b->balance[k] / beta;
    for (size_t c = 0; c < n; ++c)
        y[c] = -y[c];
    solve_linear(b, y);
    pick(b, y, moved);
    solve_tangent(b, moved);
    push(b, moved, b->balance);
    follow_back(b, b->balance, y);
    for (size_t c = 0; c < n; ++c)
        eu[c] += beta * y[c];
    double of_error[2];
    const double wrong = energies_of(b, eu, y, ev, of_error);
    return sqrt(wrong / fmax(b->energy, whole)) / s->rtol;
}

/* Take the tangent of the last step for steps of another length: stiffness prevails over damping. */
static int prepare_tangent(msfp_building *b, double beta)
{
    const size_t count = (size_t)b->scene.attachments * b->scene.attachments;
    if (b->tangent_beta == 0.0)
        return MSFP_OK;
    for (size_t i = 0; i < count && beta != b->tangent_beta; ++i)
        b->tangent[i] *= beta / b->tangent_beta;
    b->factored_beta = beta == b->tangent_beta ? b->factored_beta : 0.0;
    b->tangent_beta = beta;
    return factor_tangent(b);
}

static int all_stages(msfp_building *b, double h)
{
    const int n = b->scene.n, r = b->scene.attachments;
    const double beta = b->method.diagonal * h;
    memcpy(b->stage_v, b->v, (size_t)n * sizeof *b->v);
    memcpy(b->stage_a, b->a, (size_t)n * sizeof *b->a);
    for (int k = 0; k < r; ++k) { /* the ends expected at the end of the step */
        const int c = b->scene.attached[k];
        b->scratch[k] = b->u[c] + h * (b->v[c] + 0.5 * h * b->a[c]);
        b->scratch[r + k] = b->scratch[2 * r + k] = 0.0;
    }
    b->trying = h;
    for_each_bearing(b, begin_bearing);
    int status = first_failure(b);
    for (int i = 1; i < b->method.count && !status; ++i) {
        b->solving = i;
        ground_at(b, b->t + b->method.shares[i] * h);
        begin_stage(b, i, h);
        status = solve_stage(b, beta);
        if (!status)
            end_stage(b, i, beta);
    }
    return status;
}

int try_step(msfp_building *b, double h, double *error, double *share, int *worst)
{
    const int n = b->scene.n;
    const double beta = b->method.diagonal * h;
    b->bearing = 0;
    int status = factor_linear(b, beta);
    status = status ? status : prepare_tangent(b, beta);
    status = status ? status : all_stages(b, h);
    if (status)
        return status;
    for (int c = 0; c < n; ++c)
        b->next_u[c] = b->Q[c] + beta * b->stage_v[(size_t)(b->method.count - 1) * n + c];
    for_each_bearing(b, end_bearing);
    if ((status = first_failure(b)))
        return status;
    *worst = 0;
    const double whole =
        energies_of(b, b->next_u, b->stage_v + (size_t)(b->method.count - 1) * n, b->product, b->next_energies);
    *error = b->tangent_beta > 0.0 ? building_error(b, h, whole) : 0.0;
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
