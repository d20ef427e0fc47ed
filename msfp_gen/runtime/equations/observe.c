/* observe.c: rows of output, energies, and the powers of the energy balance.
 *
 * Energies are relative to the frame that translates with the base (docs/model.md, choice 9).
 */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"

void msfp_base_motion(const msfp_point *at, double *base)
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
    msfp_base_motion(at, base);
    for (int k = 1; k <= NB; ++k) {
        msfp_body_energy(p->body[k], w->body[k], base, one);
        add_energy(&total, one);
    }
    msfp_top_energy(p->top, w->body[NB], base, w->foot, one);
    add_energy(&total, one);
    return total;
}

void msfp_closed_rim(const msfp_work *w, int j, double *rim)
{
    rim[MSFP_CLOSED_RIM_G] = w->rim_gap[j];
    rim[MSFP_CLOSED_RIM_DG] = w->rim_rate[j];
}

/* Energy and power of the rim of surface j [MSFP_RIM_ENERGY_SIZE]; zero while the gap is open. */
static void rim(const msfp_parameters *p, const msfp_work *w, int j, double *out)
{
    memset(out, 0, MSFP_RIM_ENERGY_SIZE * sizeof *out);
#if MSFP_RIMS
    double closed[MSFP_CLOSED_RIM_SIZE];
    if (w->rim_gap[j] >= 0.0)
        return;
    msfp_closed_rim(w, j, closed);
    msfp_rim_energy(p->surface[j], closed, out);
#else
    (void)p;
    (void)w;
    (void)j;
#endif
}

msfp_input_parts msfp_powers(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                             const msfp_mechanical *mechanical, double power[MSFP_WORKS])
{
    double base[MSFP_BASE_MOTION_SIZE], force[MSFP_FORCE_SIZE], moment[MSFP_MOMENT_SIZE], top[MSFP_TOP_POWER_SIZE],
        friction[MSFP_FRICTION_POWER_SIZE], closed[MSFP_RIM_ENERGY_SIZE], one[MSFP_POWER_SIZE];
    msfp_base_motion(at, base);
    msfp_force_F_put(force, at->load);
    msfp_moment_M_put(moment, at->load + 3);
#if MSFP_TOP_ROTATION
    double upright[MSFP_UPRIGHT_SIZE];
    msfp_support_axis(at, upright);
#endif
    msfp_top_power(p->top, w->body[NB], w->foot MSFP_IF_TOP_ROTATION(upright), w->x[NB], base, force, moment, top);
    msfp_base_power(w->body[0], base, w->force[0], w->moment[0], one);
    const msfp_input_parts parts = { top[MSFP_TOP_POWER_LOAD], top[MSFP_TOP_POWER_PRESCRIBED] + one[0] };
    memset(power, 0, MSFP_WORKS * sizeof *power);
    power[MSFP_WORK_INPUT] = mechanical->power + parts.load + top[MSFP_TOP_POWER_SUPPORT] + parts.prescribed;
    power[MSFP_WORK_TOP_DISSIPATED] = top[MSFP_TOP_POWER_DAMPED];
    for (int j = 0; j < NB; ++j) {
        msfp_lock_power(w->body[j + 1], &w->lock[j], one);
        power[MSFP_WORK_INPUT] += one[0];
        msfp_friction_power(p->surface[j], w->contact[j], friction);
        power[MSFP_WORK_FRICTION_STORED] += friction[MSFP_FRICTION_POWER_STORED];
        power[MSFP_WORK_FRICTION_DISSIPATED] += friction[MSFP_FRICTION_POWER_LOST];
        power[MSFP_WORK_CONTACT_DISSIPATED] += friction[MSFP_FRICTION_POWER_DAMPED];
        rim(p, w, j, closed);
        power[MSFP_WORK_RIM_DISSIPATED] += closed[MSFP_RIM_ENERGY_LOST];
#if MSFP_UPLIFT
        power[MSFP_WORK_SEAT_DISSIPATED] += w->unilateral[j][MSFP_UNILATERAL_LOST];
#endif
    }
    return parts;
}

double msfp_heating(const msfp_parameters *p, const msfp_work *w, int j)
{
    double friction[MSFP_FRICTION_POWER_SIZE];
    msfp_friction_power(p->surface[j], w->contact[j], friction);
    return friction[MSFP_FRICTION_POWER_LOST];
}

/* Energies of the springs [J]: of the top, with the compression of its vertical spring [m]; of rims and contacts. */
typedef struct {
    double top[MSFP_RESTRAINT_SIZE], rims, unilateral;
} springs;

static springs spring_energies(const msfp_parameters *p, const msfp_point *at, const msfp_work *w)
{
    springs s = { .rims = 0.0 };
    double closed[MSFP_RIM_ENERGY_SIZE];
#if MSFP_TOP_ROTATION
    double upright[MSFP_UPRIGHT_SIZE];
    msfp_support_axis(at, upright);
#else
    (void)at;
#endif
    msfp_restraint(p->top, w->body[NB], w->foot MSFP_IF_TOP_ROTATION(upright), s.top);
    for (int j = 0; j < NB; ++j) {
        rim(p, w, j, closed);
        s.rims += closed[MSFP_RIM_ENERGY_STORED];
#if MSFP_UPLIFT
        s.unilateral += w->unilateral[j][MSFP_UNILATERAL_STORED];
#endif
    }
    return s;
}

double msfp_stored_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                          const msfp_mechanical *mechanical)
{
    const springs s = spring_energies(p, at, w);
    return mechanical->kinetic + mechanical->potential + s.top[MSFP_RESTRAINT_STORED] + s.rims + s.unilateral;
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
    const springs stored = spring_energies(p, at, w);
    double sliding[MSFP_GAP_SIZE];
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
    row->top_settlement = p->settlement_ratio * stored.top[MSFP_RESTRAINT_SETTLEMENT];
    row->kinetic = mechanical->kinetic;
    row->potential = mechanical->potential;
    row->restraint = stored.top[MSFP_RESTRAINT_STORED];
    row->rim_stored = stored.rims;
    row->seat_stored = stored.unilateral;
#if MSFP_UPLIFT
    for (int j = 0; j < NB; ++j)
        row->compression[j] = msfp_compression(p, w, j);
#endif
}
