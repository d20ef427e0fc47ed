/* power_columns.c: directional derivatives of the powers whose integrals are the works of the energy balance
 * (observe.c). Where a damper or a contact switches they are those of the branch taken.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* vectorises loops over columns */
#endif
#include <math.h>
#include <string.h>
#include "gradients.h"

#if MSFP_GRADIENTS
enum { NB = MSFP_NB, C = MSFP_COLUMNS };
MSFP_STATIC_ASSERT(!MSFP_UPLIFT && !MSFP_TOP_ROTATION, gradients_of_powers); /* ModelSpec refuses them */

/* A vector along E1, E2, E3 and its columns. */
typedef struct {
    double of[3];
    msfp_columns d[3];
} vector;

/* sum += columns of a . b */
MSFP_INLINE void add_dot(const vector *a, const vector *b, double *sum)
{
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < C; ++c)
            sum[c] += a->of[i] * b->d[i][c] + a->d[i][c] * b->of[i];
}

MSFP_INLINE vector difference(const vector *a, const double *b, msfp_columns *const db)
{
    vector out;
    for (int i = 0; i < 3; ++i) {
        out.of[i] = a->of[i] - b[i];
        for (int c = 0; c < C; ++c)
            out.d[i][c] = a->d[i][c] - db[i][c];
    }
    return out;
}

/* Velocity, angular velocity and axis of a body. */
MSFP_INLINE vector velocity(const msfp_work *w, const msfp_work_columns *d, int k)
{
    vector out;
    msfp_body_V_get(w->body[k], out.of);
    msfp_get_polar(d->body[k] + MSFP_BODY_VX * C, out.d);
    return out;
}

MSFP_INLINE vector turning(const msfp_work *w, const msfp_work_columns *d, int k)
{
    vector out;
    msfp_body_wp_get(w->body[k], out.of);
#if MSFP_PLANAR
    msfp_get_axial(d->body[k] + MSFP_BODY_WPY * C, out.d);
#else
    msfp_get_axial(d->body[k] + MSFP_BODY_WPX * C, out.d);
#endif
    return out;
}

#if !MSFP_PLANAR
MSFP_INLINE vector axis(const msfp_work *w, const msfp_work_columns *d, int k)
{
    vector out;
    msfp_body_t3_get(w->body[k], out.of);
    msfp_get_polar(d->body[k] + MSFP_BODY_T3X * C, out.d);
    return out;
}
#endif

/* Power of the load (msfp_load_power). V, turn: velocity and angular velocity of the top plate. */
MSFP_INLINE void load_power(const msfp_point *at, const msfp_point_columns *dat, const vector *V, const vector *turn,
                            double *sum)
{
    const vector relative = difference(V, at->base[1], (msfp_columns *)dat->base[1]);
    vector part;
    memcpy(part.of, at->load, sizeof part.of);
    memcpy(part.d, dat->load, sizeof part.d);
    add_dot(&part, &relative, sum);
    memcpy(part.of, at->load + 3, sizeof part.of);
    memcpy(part.d, dat->load + 3, sizeof part.d);
    add_dot(&part, turn, sum);
}

/* Compression of the vertical spring of the top and its rate (msfp_settlement). */
MSFP_INLINE void settlement_columns(const msfp_parameters *p, const msfp_work_columns *d, msfp_columns out[2])
{
    static const int plate[2] = { MSFP_BODY_CZ, MSFP_BODY_VZ }, foot[2] = { MSFP_FOOT_Y, MSFP_FOOT_Y1 };
    const int sprung = msfp_top_is_sprung(p);
    for (int i = 0; i < 2; ++i)
        for (int c = 0; c < C; ++c)
            out[i][c] = sprung ? d->body[NB][plate[i] * C + c] - d->foot[foot[i] * C + c] : 0.0;
}

/* k x + c v, with columns, from a spring and a damper of the top. */
MSFP_INLINE void spring_force(const double *t, const double *dt, int k, int damper, double x, const double *dx,
                              double v, const double *dv, double *force, double *d)
{
    *force = t[k] * x + t[damper] * v;
    for (int c = 0; c < C; ++c)
        d[c] = dt[k * C + c] * x + t[k] * dx[c] + dt[damper * C + c] * v + t[damper] * dv[c];
}

/* Power of everything that moves as prescribed (msfp_prescribed_power). V: velocity of the top plate. */
MSFP_INLINE void prescribed_power(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_point *at,
                                  const msfp_point_columns *dat, const msfp_work *w, const msfp_work_columns *d,
                                  const vector *V, double *sum)
{
    vector place, anchor, rig, base, force, moment;
    double settlement[2];
    msfp_columns sunk[2];
    msfp_body_C_get(w->body[NB], place.of);
    msfp_get_polar(d->body[NB] + MSFP_BODY_CX * C, place.d);
    msfp_top_parameters_x0_get(p->top, anchor.of);
    msfp_get_polar(dp->top + MSFP_TOP_PARAMETERS_X0X * C, anchor.d);
    const vector x = difference(&place, anchor.of, anchor.d);
    for (int i = 0; i < 2; ++i)
        spring_force(p->top, dp->top, MSFP_TOP_PARAMETERS_K, MSFP_TOP_PARAMETERS_C, x.of[i], x.d[i], V->of[i], V->d[i],
                     &rig.of[i], rig.d[i]);
    msfp_settlement(p, w, settlement);
    settlement_columns(p, d, sunk);
    spring_force(p->top, dp->top, MSFP_TOP_PARAMETERS_KV, MSFP_TOP_PARAMETERS_CV, settlement[0], sunk[0], settlement[1],
                 sunk[1], &rig.of[2], rig.d[2]);
    if (msfp_sprung_mass(p) != 0.0) { /* the spring of a rig has a fixed end, that under a mass has not */
        rig.of[2] = 0.0;
        memset(rig.d[2], 0, sizeof rig.d[2]);
    }
    memcpy(base.of, at->base[1], sizeof base.of);
    memcpy(base.d, dat->base[1], sizeof base.d);
    add_dot(&rig, &base, sum);
    msfp_force_F_get(w->force[0], force.of);
    msfp_moment_M_get(w->moment[0], moment.of);
    msfp_get_polar(d->force[0], force.d);
    msfp_get_axial(d->moment[0], moment.d);
    const vector plate = velocity(w, d, 0), turn = turning(w, d, 0);
    const vector relative = difference(&plate, at->base[1], (msfp_columns *)dat->base[1]);
    add_dot(&force, &relative, sum);
    add_dot(&moment, &turn, sum);
}

/* Power that the dampers of the top dissipate (drive_power). */
MSFP_INLINE void top_damping(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                             const msfp_work_columns *d, const vector *V, const vector *turn, double *sum)
{
    static const int damper[3] = { MSFP_TOP_PARAMETERS_C, MSFP_TOP_PARAMETERS_CR, MSFP_TOP_PARAMETERS_CV };
    double settlement[2], square[3] = { V->of[0] * V->of[0] + V->of[1] * V->of[1], 0.0, 0.0 };
    msfp_columns sunk[2], half[3] = { { 0.0 } }; /* of half the squares */
    msfp_settlement(p, w, settlement);
    settlement_columns(p, d, sunk);
    for (int i = 0; i < 3; ++i) {
        square[1] += turn->of[i] * turn->of[i];
        for (int c = 0; c < C; ++c) {
            half[0][c] += i < 2 ? V->of[i] * V->d[i][c] : 0.0;
            half[1][c] += turn->of[i] * turn->d[i][c];
        }
    }
    square[2] = settlement[1] * settlement[1];
    for (int c = 0; c < C; ++c)
        half[2][c] = settlement[1] * sunk[1][c];
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < C; ++c)
            sum[c] += dp->top[damper[i] * C + c] * square[i] + 2.0 * p->top[damper[i]] * half[i][c];
}

/* Power of the moments that lock the spin, and of the spin of the top against its rotational spring. */
MSFP_INLINE void spin_power(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                            const msfp_work_columns *d, double *sum)
{
#if !MSFP_PLANAR
    const double stiffness = p->top[MSFP_TOP_PARAMETERS_KR], phi = w->x[NB][MSFP_COORDINATES_PHI];
    for (int k = 1; k <= NB; ++k) {
        const vector t3 = axis(w, d, k), turn = turning(w, d, k);
        const double spin = t3.of[0] * turn.of[0] + t3.of[1] * turn.of[1] + t3.of[2] * turn.of[2];
        const double moment = w->lock[k - 1] - (k == NB ? stiffness * phi : 0.0);
        msfp_columns dspin = { 0.0 };
        add_dot(&t3, &turn, dspin);
        for (int c = 0; c < C; ++c) {
            const double held = dp->top[MSFP_TOP_PARAMETERS_KR * C + c] * phi +
                                stiffness * d->x[NB][MSFP_COORDINATES_PHI * C + c];
            sum[c] += moment * dspin[c] + (d->lock[k - 1][c] - (k == NB ? held : 0.0)) * spin;
        }
    }
#else
    (void)p;
    (void)dp;
    (void)w;
    (void)d;
    (void)sum;
#endif
}

/* Powers of friction at one surface (msfp_friction_power). */
MSFP_INLINE void friction_power(const double *par, const double *dpar, const double *contact, const double *dcontact,
                                msfp_columns *power)
{
#if MSFP_LAW
    const double mu = contact[MSFP_CONTACT_MU], *dmu = dcontact + MSFP_CONTACT_MU * C;
#else
    const double mu = par[MSFP_SURFACE_PARAMETERS_MU], *dmu = dpar + MSFP_SURFACE_PARAMETERS_MU * C;
#endif
    const double N = contact[MSFP_CONTACT_N], T = par[MSFP_SURFACE_PARAMETERS_TD], dy = par[MSFP_SURFACE_PARAMETERS_DY];
    for (int i = 0; i < MSFP_SHEAR_SIZE; ++i) {
        const double f = contact[MSFP_CONTACT_Y + i], rate = contact[MSFP_CONTACT_DY + i];
        const double slip = contact[MSFP_CONTACT_U + i], g = f + T * rate;
        for (int c = 0; c < C; ++c) {
            const double df = dcontact[(MSFP_CONTACT_Y + i) * C + c], drate = dcontact[(MSFP_CONTACT_DY + i) * C + c];
            const double dT = dpar[MSFP_SURFACE_PARAMETERS_TD * C + c], ddy = dpar[MSFP_SURFACE_PARAMETERS_DY * C + c];
            const double dlimit = dmu[c] * N + mu * dcontact[MSFP_CONTACT_N * C + c], dg = df + dT * rate + T * drate;
            const double depth = dlimit * dy + mu * N * ddy; /* of mu N d_y */
            const double stored = depth * f * rate + mu * N * dy * (df * rate + f * drate);
            const double damped = depth * T * rate * rate + mu * N * dy * (dT * rate + 2.0 * T * drate) * rate;
            const double all = dlimit * g * slip + mu * N * (dg * slip + g * dcontact[(MSFP_CONTACT_U + i) * C + c]);
            power[MSFP_WORK_FRICTION_STORED][c] += stored;
            power[MSFP_WORK_CONTACT_DISSIPATED][c] += damped;
            power[MSFP_WORK_FRICTION_DISSIPATED][c] += all - stored - damped;
        }
    }
#if !MSFP_PLANAR
    for (int c = 0; c < C; ++c)
        power[MSFP_WORK_FRICTION_DISSIPATED][c] -= dcontact[MSFP_CONTACT_DRILL * C + c];
#endif
}

#if MSFP_RIMS
/* Power that the damper of a closed rim dissipates, (pushed - spring) damper lever/c_c (rim_power of observe.c). */
MSFP_INLINE void rim_power(const msfp_parameters *p, const msfp_parameter_columns *dp, const msfp_work *w,
                           const msfp_work_columns *d, int j, double *sum)
{
    const double *par = p->surface[j], *dpar = dp->surface[j], *rim = d->rim[j], gap = w->rim_gap[j];
    const double k = par[MSFP_SURFACE_PARAMETERS_KC], cc = par[MSFP_SURFACE_PARAMETERS_CC];
    const double R = par[MSFP_SURFACE_PARAMETERS_R], offset = par[MSFP_SURFACE_PARAMETERS_PR], lever = 1.0 - offset / R;
    const double spring = k * gap, damper = w->rim_sum[j] - spring, pushed = fmin(w->rim_sum[j], 0.0) - spring;
    double own[MSFP_RIM_SIZE * C];
    if (w->rim_sum[j] == 0.0 || gap >= 0.0)
        return;
    if (!w->rim_active[j]) {
        msfp_rim_columns(p, dp, w, j, d, own);
        rim = own;
    }
    for (int c = 0; c < C; ++c) {
        const double dcc = dpar[MSFP_SURFACE_PARAMETERS_CC * C + c];
        const double dspring = dpar[MSFP_SURFACE_PARAMETERS_KC * C + c] * gap + k * rim[MSFP_RIM_G * C + c];
        const double ddamper = rim[MSFP_RIM_FC * C + c] - dspring;
        const double dpushed = (w->rim_sum[j] < 0.0 ? rim[MSFP_RIM_FC * C + c] : 0.0) - dspring;
        const double dlever =
            (offset / R * dpar[MSFP_SURFACE_PARAMETERS_R * C + c] - dpar[MSFP_SURFACE_PARAMETERS_PR * C + c]) / R;
        if (cc > 0.0)
            sum[c] +=
                ((dpushed * damper + pushed * ddamper) * lever + pushed * damper * (dlever - lever * dcc / cc)) / cc;
        else if (dcc != 0.0) /* without a damper its force has the columns c_c' dg/dt alone, its power c_c' (dg/dt)^2 */
            sum[c] += ddamper * ddamper / dcc * lever;
    }
}
#endif

MSFP_COLUMNWISE void msfp_columns_of_powers(const msfp_parameters *p, const msfp_parameter_columns *dp,
                                            const msfp_point *at, const msfp_point_columns *dat, const msfp_work *w,
                                            const msfp_work_columns *d, msfp_power_columns *power)
{
    const vector V = velocity(w, d, NB), turn = turning(w, d, NB);
    msfp_columns mechanical[MSFP_ENERGY_SIZE];
    memset(power, 0, sizeof *power);
    msfp_mechanical_columns(p, dp, at, dat, w, d, mechanical);
    load_power(at, dat, &V, &turn, power->load);
    prescribed_power(p, dp, at, dat, w, d, &V, power->prescribed);
    double *input = power->of[MSFP_WORK_INPUT];
    spin_power(p, dp, w, d, input);
    for (int c = 0; c < C; ++c)
        input[c] += mechanical[MSFP_ENERGY_POWER][c] + power->load[c] + power->prescribed[c];
    top_damping(p, dp, w, d, &V, &turn, power->of[MSFP_WORK_TOP_DISSIPATED]);
    for (int j = 0; j < NB; ++j) {
        friction_power(p->surface[j], dp->surface[j], w->contact[j], d->contact[j], power->of);
#if MSFP_RIMS
        rim_power(p, dp, w, d, j, power->of[MSFP_WORK_RIM_DISSIPATED]);
#endif
    }
}
#endif
