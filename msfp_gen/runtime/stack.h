/* stack.h: what the files that loop over bodies and surfaces share. Private to the runtime. */
#ifndef MSFP_STACK_H
#define MSFP_STACK_H
#include "msfp_kernels.h"

#define DOF MSFP_DOF
#define NB MSFP_NB
#define NA MSFP_NA
#define ND MSFP_ND
#define VECTOR MSFP_FORCE_SIZE  /* components of a force */
#define MOMENT MSFP_MOMENT_SIZE /* components of a moment */
#define SPACE MSFP_SPACE         /* directions of a translation */
#define FRICTION MSFP_FRICTION_SIZE
#define PAIR (MSFP_PLANAR ? 1 : 2) /* tilts of a body */
#if MSFP_LAW
#define LAW(...) , __VA_ARGS__ /* one more argument where the friction coefficient is an unknown */
#else
#define LAW(...)
#endif
#if MSFP_TURNED
#define TURNED(...) , __VA_ARGS__ /* one more argument where the support of the top plate turns */
#else
#define TURNED(...)
#endif

/* Field of block coordinates: angle i of order 0, 1, 2. */
static inline int coordinate(int order, int i) { return MSFP_PLANAR ? order : 3 * order + i; }

#if MSFP_UPLIFT
/* Field of block coordinates: component i of the separation, order 0, 1, 2. */
static inline int separation(int order, int i) { return MSFP_COORDINATES_DX + SPACE * order + i; }
#endif

/* Field of block coordinates: unknown i of a body. */
static inline int field(int order, int i)
{
#if MSFP_UPLIFT
    if (i >= NA)
        return separation(order, i - NA);
#endif
    return coordinate(order, i);
}

#if MSFP_FLOW
/* A slip (over d_y) with friction Y along it: what of it is left once friction has come back to zero, where Y then is. 0:
 * friction does not come so far; it goes back on a line, dY = ds/d_y. */
MSFP_INLINE int msfp_grows(double *Y, double *slip)
{
    if (*Y >= 0.0)
        return 1;
    if (*slip <= -*Y) {
        *Y += *slip;
        return 0;
    }
    *slip += *Y;
    *Y = 0.0;
    return 1;
}

/* Y after a slip (over d_y): (3.18) integrated. Friction that grows is dY = (1 - Y^2) ds/d_y, so Y = tanh. */
MSFP_INLINE double msfp_flown(double Y, double slip)
{
    const double sign = slip < 0.0 ? -1.0 : 1.0;
    double y = sign * Y, far = fabs(slip);
    if (!msfp_grows(&y, &far) || y == 1.0) /* 1: it has slid for long */
        return sign * y;
    const double left = (1.0 - y) * exp(-2.0 * far);
    return sign * (1.0 + y - left) / (1.0 + y + left);
}

/* What friction has lost on the way, over mu N d_y: the integral of Y^3 in slip while it grows. */
MSFP_INLINE double msfp_flow_loss(double Y, double slip)
{
    double y = slip < 0.0 ? -Y : Y, far = fabs(slip);
    if (!msfp_grows(&y, &far))
        return 0.0;
    if (y == 1.0)
        return far;
    const double left = (1.0 - y) * exp(-2.0 * far), end = (1.0 + y - left) / (1.0 + y + left);
    return far + log(0.5 * (1.0 + y + left)) - 0.5 * (end * end - y * y);
}

/* Slip per turn (3.19), over d_y: in the plane it does not depend on where the normal is. */
MSFP_INLINE double msfp_reach(const double *par)
{
    return -par[MSFP_SURFACE_PARAMETERS_SIGN] * par[MSFP_SURFACE_PARAMETERS_R] / par[MSFP_SURFACE_PARAMETERS_DY];
}
#endif

/* kinematics.c */
void msfp_ground(const msfp_point *at, double *body);
void msfp_base(const msfp_parameters *p, const msfp_point *at, msfp_work *w); /* body 0, for the others to start from */
void msfp_kinematics(const msfp_parameters *p, const msfp_point *at, msfp_work *w);
void msfp_kinematics_tangent(const msfp_parameters *p, const msfp_point *at, msfp_work *w);
void msfp_top(const msfp_parameters *p, const msfp_point *at, msfp_work *w);
void msfp_top_columns(const msfp_parameters *p, const msfp_point *at, msfp_work *w, const double *dload /* [6][DOF] or NULL */);

#if !MSFP_UPLIFT
/* Fields of what a body's own unknowns change (columns.c): first the inputs of a contact beside its force. */
enum {
    SCREW = MSFP_SCREW_SIZE,
    MINE = MSFP_OWN_SIZE,
    MINE_P = MSFP_LOCAL_SIZE - VECTOR,
    MINE_F = MINE_P + VECTOR,
    MINE_M = MINE_F + VECTOR,
    MINE_WP = MINE_M + MOMENT
};
#endif

/* seat.c */
void msfp_seat(const msfp_parameters *p, msfp_work *w, int j);
void msfp_seat_columns(const msfp_parameters *p, msfp_work *w, int j);
void msfp_split_moment(msfp_work *w, int j);
void msfp_split_columns(msfp_work *w, int j);

/* surface.c */
/* Jacobians of what a surface does in what it is given: moment and N of the contacts, in lanes; rims. */
typedef struct {
    double contact[(MOMENT + 1) * MSFP_LOCAL_SIZE * MSFP_LANES], rim[NB][MSFP_RIM_SIZE * MSFP_RIM_LOCAL];
} msfp_slopes;
void msfp_rim_force(const msfp_parameters *p, msfp_work *w, int j, double *drim);
void msfp_rim_columns(const msfp_work *w, int j, const double *drim, double *dforce, double *dmoment);
/* How much of its rim's force a surface presses against: all of it, but no more than it carries itself where bodies may
 * part; a rim met in flight turns the bodies and presses nothing. */
double msfp_rim_share(const msfp_work *w, int j);
/* Moment of surface j on the body above, in the basis of the body below. */
void msfp_surface_moment(const msfp_work *w, int j, double *moment);
/* Force, slip, friction and moment of all surfaces; slopes (or NULL): for the tangent. */
int msfp_surfaces(const msfp_parameters *p, msfp_work *w, const msfp_seed *seed, double f[NB][2], msfp_slopes *slopes);

/* columns.c, parting.c where bodies may part: the tangent, after an evaluation. */
void msfp_columns(const msfp_parameters *p, const msfp_point *at, const msfp_seed *seed, msfp_work *w, const msfp_slopes *slopes,
                  double *tangent);

/* contact.c */
/* Y, Z and the contact of all surfaces; condensed (or NULL): Jacobian of moment and N in what a surface is given, in lanes. */
int msfp_contacts(const msfp_parameters *p, msfp_work *w, const msfp_seed *seed, double f[NB][2], double *condensed);
#if MSFP_LAW
/* Temperature of the surfaces, and a sound value for Newton to start from. */
void msfp_surroundings(const msfp_point *at, msfp_work *w);
#endif

#endif
