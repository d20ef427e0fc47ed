/* observe.c: rows of output, energies, and the powers of the energy balance.
 *
 * Energies are relative to the frame that translates with the base (docs/model.md, choice 9).
 */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

enum { NB = MSFP_NB };

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Motion of the base as a block. */
static void frame(const msfp_point *at, double *base)
{
    msfp_base_motion_O_put(base, at->base[0]);
    msfp_base_motion_U_put(base, at->base[1]);
    msfp_base_motion_B_put(base, at->base[2]);
}

static void add_energy(msfp_mechanical *total, const double *one)
{
    total->kinetic += one[MSFP_ENERGY_KINETIC];
    total->potential += one[MSFP_ENERGY_POTENTIAL];
    total->power += one[MSFP_ENERGY_POWER];
}

msfp_mechanical msfp_mechanical_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w)
{
    double base[MSFP_BASE_MOTION_SIZE], one[MSFP_ENERGY_SIZE];
    msfp_mechanical total = { 0.0, 0.0, 0.0 };
    frame(at, base);
    for (int k = 1; k <= NB; ++k) {
        msfp_body_energy(p->body[k], w->body[k], base, one);
        add_energy(&total, one);
    }
    msfp_top_energy(p->top, w->body[NB], base, w->foot, one);
    add_energy(&total, one);
    return total;
}

static double friction_coefficient(const double *par, const double *contact)
{
#if MSFP_LAW
    (void)par;
    return contact[MSFP_CONTACT_MU];
#else
    (void)contact;
    return par[MSFP_SURFACE_PARAMETERS_MU];
#endif
}

/* Friction stores mu N d_y |f|^2/2; a sheared contact with the damping time T dissipates mu N d_y T |df/dt|^2; plastic
 * slip and the drilling moment dissipate the rest. */
msfp_friction_powers msfp_friction_power(const double *par, const double *contact)
{
    const double f[2] = { contact[MSFP_CONTACT_Y], msfp_contact_Z(contact) },
                 df[2] = { contact[MSFP_CONTACT_DY], msfp_contact_dZ(contact) },
                 slip[2] = { contact[MSFP_CONTACT_U], msfp_contact_v(contact) };
    const double limit = friction_coefficient(par, contact) * contact[MSFP_CONTACT_N];
    const double T = par[MSFP_SURFACE_PARAMETERS_TD], dy = par[MSFP_SURFACE_PARAMETERS_DY];
    msfp_friction_powers power = { 0.0, 0.0, -msfp_contact_drill(contact) };
    for (int i = 0; i < 2; ++i) {
        const double stored = limit * dy * f[i] * df[i], damped = limit * dy * T * df[i] * df[i];
        power.stored += stored;
        power.damped += damped;
        power.lost += limit * (f[i] + T * df[i]) * slip[i] - stored - damped;
    }
    return power;
}

/* Power dissipated in the unilateral contacts; a contact that lets go dissipates what its spring releases. */
static double unilateral_power(const msfp_work *w)
{
    double lost = 0.0;
#if MSFP_UPLIFT
    for (int j = 0; j < NB; ++j) {
        const double grip = w->unilateral[j][MSFP_UNILATERAL_GRIP], power = w->unilateral[j][MSFP_UNILATERAL_POWER];
        lost += grip > 0.0 ? power * (grip - 1.0) : -power;
    }
#else
    (void)w;
#endif
    return lost;
}

/* Ratio of lever arms: the rim force acts at R - p from the sphere centre, the gap is measured at R (3.20), (3.25). */
static double rim_lever(const double *par)
{
    return 1.0 - par[MSFP_SURFACE_PARAMETERS_PR] / par[MSFP_SURFACE_PARAMETERS_R];
}

/* Power dissipated by the damper of a rim, c (dg/dt)^2, never negative. Where the damper would pull, the rim exerts no
 * force and the damper dissipates what the spring releases. */
static double rim_power(const msfp_parameters *p, const msfp_work *w, int j)
{
    const double *par = p->surface[j], gap = w->rim_gap[j], spring = par[MSFP_SURFACE_PARAMETERS_KC] * gap;
    const double damper = w->rim_sum[j] - spring;
    if (gap >= 0.0 || par[MSFP_SURFACE_PARAMETERS_CC] == 0.0)
        return 0.0;
    return (fmin(w->rim_sum[j], 0.0) - spring) * damper / par[MSFP_SURFACE_PARAMETERS_CC] * rim_lever(par);
}

#if MSFP_TOP_ROTATION
/* Power of a rotating support. On return `turning` is the angular velocity of the top plate relative to it. */
static double support_power(const double *t, const msfp_point *at, const double *axis, double *turning)
{
    double upright[MSFP_UPRIGHT_SIZE], e[3], w[3], moment[3];
    msfp_support_axis(at, upright);
    msfp_upright_e_get(upright, e);
    msfp_upright_w_get(upright, w);
    for (int i = 0; i < 3; ++i)
        turning[i] -= w[i];
    for (int i = 0; i < 3; ++i)
        moment[i] =
            t[MSFP_TOP_PARAMETERS_KR] * (e[(i + 1) % 3] * axis[(i + 2) % 3] - e[(i + 2) % 3] * axis[(i + 1) % 3]) +
            t[MSFP_TOP_PARAMETERS_CR] * turning[i];
    return -dot3(moment, w);
}
#endif

double msfp_load_power(const msfp_point *at, const msfp_work *w)
{
    double V[3], turning[3], power = 0.0;
    msfp_body_V_get(w->body[NB], V);
    msfp_body_wp_get(w->body[NB], turning);
    for (int i = 0; i < 3; ++i)
        power += at->load[i] * (V[i] - at->base[1][i]) + at->load[3 + i] * turning[i];
    return power;
}

double msfp_prescribed_power(const msfp_parameters *p, const msfp_point *at, const msfp_work *w)
{
    const double *t = p->top;
    double C[3], V[3], relative[3], turning[3], force[3], moment[3], anchor[3], settlement[2], power = 0.0;
    msfp_body_C_get(w->body[NB], C);
    msfp_body_V_get(w->body[NB], V);
    msfp_top_parameters_x0_get(t, anchor);
    for (int i = 0; i < 2; ++i)
        power += (t[MSFP_TOP_PARAMETERS_K] * (C[i] - anchor[i]) + t[MSFP_TOP_PARAMETERS_C] * V[i]) * at->base[1][i];
    msfp_settlement(p, w, settlement);
    if (msfp_sprung_mass(p) == 0.0) /* the vertical spring of a rig has a fixed end */
        power += (t[MSFP_TOP_PARAMETERS_KV] * settlement[0] + t[MSFP_TOP_PARAMETERS_CV] * settlement[1]) *
                 at->base[1][2];
    msfp_body_V_get(w->body[0], relative);
    msfp_body_wp_get(w->body[0], turning);
    msfp_force_F_get(w->force[0], force);
    msfp_moment_M_get(w->moment[0], moment);
    for (int i = 0; i < 3; ++i)
        relative[i] -= at->base[1][i];
    return power + dot3(force, relative) + dot3(moment, turning);
}

/* Power of all prescribed motions and of the loads; damped: power dissipated by the dampers of the top. */
static double drive_power(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, double *damped)
{
    const double *body = w->body[NB], *t = p->top;
    double V[3], turning[3], axis[3], settlement[2];
    msfp_body_V_get(body, V);
    msfp_body_wp_get(body, turning);
    msfp_body_t3_get(body, axis);
    msfp_settlement(p, w, settlement);
    double power = msfp_load_power(at, w);
    power -= t[MSFP_TOP_PARAMETERS_KR] * msfp_coordinates_phi(w->x[NB]) * dot3(axis, turning);
#if MSFP_TOP_ROTATION
    power += support_power(t, at, axis, turning);
#endif
    *damped =
        t[MSFP_TOP_PARAMETERS_C] * (V[0] * V[0] + V[1] * V[1]) + t[MSFP_TOP_PARAMETERS_CR] * dot3(turning, turning) +
        t[MSFP_TOP_PARAMETERS_CV] * settlement[1] * settlement[1];
    return power + msfp_prescribed_power(p, at, w);
}

/* With locked spin a body still rotates about its axis, by psi' sin(theta): the moments that lock the spin do work of
 * the order of the tilt squared. */
static double lock_power(const msfp_work *w)
{
    double power = 0.0, axis[3], turning[3];
    for (int k = 1; k <= NB; ++k) {
        msfp_body_t3_get(w->body[k], axis);
        msfp_body_wp_get(w->body[k], turning);
        power += w->lock[k - 1] * dot3(axis, turning);
    }
    return power;
}

void msfp_powers_without_friction(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                                  const msfp_mechanical *mechanical, double power[MSFP_WORKS])
{
    memset(power, 0, MSFP_WORKS * sizeof *power);
    power[MSFP_WORK_INPUT] =
        mechanical->power + drive_power(p, at, w, &power[MSFP_WORK_TOP_DISSIPATED]) + lock_power(w);
    power[MSFP_WORK_SEAT_DISSIPATED] = unilateral_power(w);
    for (int j = 0; j < NB; ++j) {
        power[MSFP_WORK_CONTACT_DISSIPATED] += msfp_friction_power(p->surface[j], w->contact[j]).damped;
        if (w->rim_sum[j] != 0.0)
            power[MSFP_WORK_RIM_DISSIPATED] += rim_power(p, w, j);
    }
}

void msfp_powers(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_mechanical *mechanical,
                 double power[MSFP_WORKS])
{
    msfp_powers_without_friction(p, at, w, mechanical, power);
    for (int j = 0; j < NB; ++j) {
        const msfp_friction_powers friction = msfp_friction_power(p->surface[j], w->contact[j]);
        power[MSFP_WORK_FRICTION_STORED] += friction.stored;
        power[MSFP_WORK_FRICTION_DISSIPATED] += friction.lost;
    }
}

static double restraint_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w)
{
    const double *t = p->top;
    double C[3], axis[3], anchor[3], held[3] = { 0.0, 0.0, 1.0 }, lean = 0.0, settlement[2];
    msfp_body_C_get(w->body[NB], C);
    msfp_body_t3_get(w->body[NB], axis);
    msfp_top_parameters_x0_get(t, anchor);
    const double x = C[0] - anchor[0], y = C[1] - anchor[1];
#if MSFP_TOP_ROTATION
    double upright[MSFP_UPRIGHT_SIZE];
    msfp_support_axis(at, upright);
    msfp_upright_e_get(upright, held);
#else
    (void)at;
#endif
    for (int i = 0; i < 3; ++i) /* 1 - t3 . e, without cancellation at small tilt */
        lean += 0.5 * (axis[i] - held[i]) * (axis[i] - held[i]);
    msfp_settlement(p, w, settlement);
    return 0.5 * t[MSFP_TOP_PARAMETERS_K] * (x * x + y * y) + t[MSFP_TOP_PARAMETERS_KR] * lean +
           0.5 * t[MSFP_TOP_PARAMETERS_KV] * settlement[0] * settlement[0];
}

static double rim_energy(const msfp_parameters *p, const double *gap)
{
    double total = 0.0;
    for (int j = 0; j < NB && MSFP_RIMS; ++j)
        if (gap[j] < 0.0)
            total += 0.5 * p->surface[j][MSFP_SURFACE_PARAMETERS_KC] * gap[j] * gap[j] * rim_lever(p->surface[j]);
    return total;
}

static double unilateral_energy(const msfp_work *w)
{
    double total = 0.0;
#if MSFP_UPLIFT
    for (int j = 0; j < NB; ++j)
        total += w->unilateral[j][MSFP_UNILATERAL_STORED];
#else
    (void)w;
#endif
    return total;
}

double msfp_stored_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                          const msfp_mechanical *mechanical)
{
    return mechanical->kinetic + mechanical->potential + restraint_energy(p, at, w) + rim_energy(p, w->rim_gap) +
           unilateral_energy(w);
}

void msfp_evaluate_state(const msfp_parameters *p, const msfp_point *at, msfp_seed *seed, msfp_work *w,
                         double g[NB][2])
{
    double residual[MSFP_DOF];
    memset(seed, 0, sizeof *seed);
    memcpy(seed->fp, at->f, sizeof seed->fp);
    memcpy(g, at->f, sizeof at->f);
#if MSFP_LAW
    memset(w->coefficient, 0, sizeof w->coefficient);
#endif
    msfp_condensed(p, at, seed, w, g, residual, NULL);
}

void msfp_observe(const msfp_parameters *p, const msfp_point *at, msfp_work *w, msfp_row *row)
{
    double g[NB][2];
    msfp_seed seed;
    msfp_evaluate_state(p, at, &seed, w, g);
    const msfp_mechanical mechanical = msfp_mechanical_energy(p, at, w);
    msfp_record(p, at, w, &mechanical, row);
}

void msfp_record(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_mechanical *mechanical,
                 msfp_row *row)
{
    double sliding[MSFP_GAP_SIZE], settlement[2];
    memcpy(row->q, at->q, sizeof row->q);
    memcpy(row->v, at->v, sizeof row->v);
    memcpy(row->a, at->a, sizeof row->a);
    memcpy(row->f, at->f, sizeof row->f);
    for (int j = 0; j < NB; ++j) {
        const double *contact = w->contact[j];
        row->normal[j] = contact[MSFP_CONTACT_N];
        row->angles[j][0] = MSFP_PLANAR ? 0.0 : msfp_angle(msfp_contact_sp(contact), msfp_contact_cp(contact));
        row->angles[j][1] = msfp_angle(contact[MSFP_CONTACT_ST], contact[MSFP_CONTACT_CT]);
        msfp_gap(p->surface[j], w->body[j + 1], sliding);
        row->sliding[j] = sliding[MSFP_GAP_S];
        row->gap[j] = MSFP_UPLIFT && MSFP_RIMS ? w->rim_gap[j] : sliding[MSFP_GAP_G];
        row->rim[j] = w->rim_active[j] ? -w->rim[j][MSFP_RIM_FC] : 0.0;
        row->slip[j][0] = contact[MSFP_CONTACT_U];
        row->slip[j][1] = msfp_contact_v(contact);
        msfp_force_F_get(w->force[j], row->force[j]);
#if MSFP_LAW
        row->mu[j] = contact[MSFP_CONTACT_MU];
#endif
#if MSFP_HEAT
        row->temperature[j] = contact[MSFP_CONTACT_T];
#endif
    }
    memcpy(row->base, at->base[0], sizeof row->base);
    msfp_body_C_get(w->body[NB], row->top);
    row->top[1] += MSFP_PLANAR ? at->base[0][1] : 0.0;
    msfp_force_F_get(w->force[NB], row->top_force);
    msfp_moment_M_get(w->moment[NB], row->top_moment);
    msfp_settlement(p, w, settlement);
    row->top_settlement = p->settlement_ratio * settlement[0];
    row->kinetic = mechanical->kinetic;
    row->potential = mechanical->potential;
    row->restraint = restraint_energy(p, at, w);
    row->rim_stored = rim_energy(p, row->gap);
    row->seat_stored = unilateral_energy(w);
#if MSFP_UPLIFT
    for (int j = 0; j < NB; ++j)
        row->compression[j] = msfp_compression(p, w, j);
#endif
}
