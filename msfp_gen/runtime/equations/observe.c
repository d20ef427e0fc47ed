/* observe.c: rows of output, energies, and the powers of the energy balance.
 *
 * Energies are relative to the frame that translates with the base (docs/model.md, choice 9).
 */
#include <math.h>
#include <string.h>
#include "equations.h"
#include "msfp_kernels.h"
#include "msfp_schedule.h"

/* Motion of the base as the block `base_motion`. */
static void base_motion(const msfp_point *at, double *base)
{
    msfp_base_motion_O_put(base, at->base[0]);
    msfp_base_motion_U_put(base, at->base[1]);
    msfp_base_motion_B_put(base, at->base[2]);
}

void msfp_set_observed(const msfp_point *at, msfp_blocks *s)
{
    base_motion(at, s->base_motion);
    msfp_force_F_put(s->load_force, at->load);
    msfp_moment_M_put(s->load_moment, at->load + 3);
#if MSFP_TOP_ROTATION
    msfp_support_axis(at, s->upright);
#endif
}

msfp_mechanical msfp_mechanical_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w)
{
    msfp_blocks s;
    base_motion(at, s.base_motion);
    msfp_mechanical_values(p, w, &s);
    const msfp_mechanical total = { s.energy[MSFP_ENERGY_KINETIC], s.energy[MSFP_ENERGY_POTENTIAL],
                                    s.energy[MSFP_ENERGY_POWER] };
    return total;
}

void msfp_gap_of_rim(const msfp_work *w, int j, double *rim)
{
    rim[MSFP_RIM_MOTION_G] = w->rim_gap[j];
    rim[MSFP_RIM_MOTION_DG] = w->rim_rate[j];
}

msfp_input_parts msfp_powers(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                             const msfp_mechanical *mechanical, double power[MSFP_WORKS])
{
    msfp_blocks s;
    msfp_set_observed(at, &s);
    s.energy[MSFP_ENERGY_POWER] = mechanical->power;
    msfp_powers_values(p, w, &s);
    memcpy(power, s.works, MSFP_WORKS * sizeof *power);
    const msfp_input_parts parts = { s.works[MSFP_WORKS_LOAD], s.works[MSFP_WORKS_PRESCRIBED] };
    return parts;
}

double msfp_heating(const msfp_parameters *p, const msfp_work *w, int j)
{
    double friction[MSFP_FRICTION_POWER_SIZE];
    msfp_friction_power(p->surface[j], w->contact[j], friction);
    return friction[MSFP_FRICTION_POWER_LOST];
}

#if MSFP_CLOSED_FORM
void msfp_end_of_load(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, double *end)
{
    msfp_blocks s;
    msfp_set_observed(at, &s);
    msfp_loaded_values(p, w, &s);
    memcpy(end, s.load_end, sizeof s.load_end);
}

double msfp_work_of_load(const double *from, const double *to)
{
    double work;
    msfp_load_work(from, to, &work);
    return work;
}
#endif

double msfp_stored_energy(const msfp_parameters *p, const msfp_point *at, const msfp_work *w,
                          const msfp_mechanical *mechanical)
{
    msfp_blocks s;
    msfp_set_observed(at, &s);
    msfp_springs_values(p, w, &s);
    double stored = mechanical->kinetic + mechanical->potential + s.restraint[MSFP_RESTRAINT_STORED];
#if MSFP_RIMS
    stored += s.rim_energy[MSFP_RIM_ENERGY_STORED];
#endif
#if MSFP_UPLIFT
    stored += s.unilateral_energy[MSFP_UNILATERAL_ENERGY_STORED];
#endif
    return stored;
}

double msfp_length_of(const double pair[2])
{
    double size;
    msfp_extreme_length(pair, &size);
    return size;
}

void msfp_bound_friction(double f[2], const double most[2])
{
    double bounded[MSFP_FRICTION_SIZE];
    msfp_bounded_friction(f, most, bounded);
    memcpy(f, bounded, sizeof bounded);
}

void msfp_evaluate_state(const msfp_parameters *p, const msfp_point *at, msfp_stage_weights *weights, msfp_work *w,
                         double g[NB][2])
{
    double residual[MSFP_DOF];
    memset(weights, 0, sizeof *weights);
    memcpy(weights->fp, at->f, sizeof weights->fp);
    memcpy(g, at->f, sizeof at->f);
#if MSFP_LAW
    memset(w->coefficient, 0, sizeof w->coefficient);
#endif
    msfp_condensed(p, at, weights, w, g, residual, NULL);
}

void msfp_observe(const msfp_parameters *p, const msfp_point *at, msfp_work *w, msfp_row *row)
{
    double g[NB][2];
    msfp_stage_weights weights;
    msfp_evaluate_state(p, at, &weights, w, g);
    const msfp_mechanical mechanical = msfp_mechanical_energy(p, at, w);
    msfp_record(p, at, w, &mechanical, row);
}

void msfp_record(const msfp_parameters *p, const msfp_point *at, const msfp_work *w, const msfp_mechanical *mechanical,
                 msfp_row *row)
{
    msfp_blocks s;
    double sliding[MSFP_GAP_SIZE], angles[MSFP_CONTACT_ANGLES_SIZE];
    memcpy(row->q, at->q, sizeof row->q);
    memcpy(row->v, at->v, sizeof row->v);
    memcpy(row->a, at->a, sizeof row->a);
    memcpy(row->f, at->f, sizeof row->f);
    for (int j = 0; j < NB; ++j) {
        const double *contact = w->contact[j];
        row->normal[j] = contact[MSFP_CONTACT_N];
        msfp_contact_angles(contact, angles);
        row->angles[j][0] = msfp_contact_angles_psi(angles);
        row->angles[j][1] = angles[MSFP_CONTACT_ANGLES_THETA];
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
#if MSFP_MEMORY
        row->MSFP_REMEMBERED[j] = contact[MSFP_CONTACT_MEMORY];
#endif
    }
    memcpy(row->base, at->base[0], sizeof row->base);
    memcpy(row->base_angles, at->base[0] + 3, sizeof row->base_angles);
    msfp_body_C_get(w->body[NB], row->top);
    row->top[1] += MSFP_PLANAR ? at->base[0][1] : 0.0;
    msfp_force_F_get(w->force[NB], row->top_force);
    msfp_moment_M_get(w->moment[NB], row->top_moment);
    msfp_set_observed(at, &s);
    msfp_springs_values(p, w, &s);
    row->top_settlement = s.restraint[MSFP_RESTRAINT_SETTLEMENT];
    row->kinetic = mechanical->kinetic;
    row->potential = mechanical->potential;
    row->restraint = s.restraint[MSFP_RESTRAINT_STORED];
    row->rim_stored = row->seat_stored = 0.0;
#if MSFP_RIMS
    row->rim_stored = s.rim_energy[MSFP_RIM_ENERGY_STORED];
#endif
#if MSFP_UPLIFT
    row->seat_stored = s.unilateral_energy[MSFP_UNILATERAL_ENERGY_STORED];
    for (int j = 0; j < NB; ++j)
        row->compression[j] = msfp_compression(p, w, j);
#endif
}
