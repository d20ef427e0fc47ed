/* seat.c: the one-sided seat of a slider, where bodies may part (docs/uplift.md). */
#include <math.h>
#include <string.h>
#include "stack.h"

#if MSFP_UPLIFT
static const int signs[NB] = MSFP_SIGNS;

/* The body that carries the footprint of surface j. */
static int slider_of(int j) { return signs[j] > 0 ? j + 1 : j; }

/* Compression along the slider's axis and across it. */
static void compression(const msfp_work *w, int j, double *along, double *across)
{
    double d[3], axis[3], square = 0.0;
    msfp_coordinates_d_get(w->x[j + 1], d);
    msfp_body_t3_get(w->body[slider_of(j)], axis);
    *along = -(d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2]);
    for (int i = 0; i < 3; ++i)
        square += (d[i] + *along * axis[i]) * (d[i] + *along * axis[i]);
    *across = sqrt(square);
}

/* Whether a compression points into the footprint. */
static int inside(const double *par, double along, double across)
{
    return across * par[MSFP_SURFACE_PARAMETERS_CA] <= along * par[MSFP_SURFACE_PARAMETERS_SA];
}

double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    double along, across;
    const double *par = p->surface[j];
    compression(w, j, &along, &across);
    if (inside(par, along, across))
        return sqrt(along * along + across * across);
    return par[MSFP_SURFACE_PARAMETERS_CA] * along + par[MSFP_SURFACE_PARAMETERS_SA] * across;
}

/* Force of the seat of surface j, into force[j]; zero where it is open or its damping would pull. */
void msfp_seat(const msfp_parameters *p, msfp_work *w, int j)
{
    double along, across, *seat = w->seat[j];
    compression(w, j, &along, &across);
    seat[MSFP_SEAT_GRIP] = seat[MSFP_SEAT_STORED] = seat[MSFP_SEAT_POWER] = 0.0;
    if (msfp_compression(p, w, j) > 0.0) {
        if (inside(p->surface[j], along, across))
            msfp_seat_inside(p->surface[j], w->body[slider_of(j)], w->x[j + 1], seat);
        else
            msfp_seat_edge(p->surface[j], w->body[slider_of(j)], w->x[j + 1], seat);
    }
    if (seat[MSFP_SEAT_GRIP] <= 0.0)
        memset(seat, 0, (VECTOR + MOMENT) * sizeof *seat);
    memcpy(w->force[j], seat, sizeof w->force[j]);
}

/* Columns of its force, into dforce[j], and of its moment; w holds the seat itself. */
void msfp_seat_columns(const msfp_parameters *p, msfp_work *w, int j)
{
    const int k = slider_of(j);
    double along, across, seat[MSFP_SEAT_SIZE], *dseat = w->dseat[j];
    compression(w, j, &along, &across);
    if (w->seat[j][MSFP_SEAT_GRIP] <= 0.0)
        memset(dseat, 0, sizeof w->dseat[j]);
    else if (inside(p->surface[j], along, across))
        msfp_seat_inside_tangent(p->surface[j], w->body[k], w->x[j + 1], seat, w->dbody[k], w->dx[j + 1], dseat);
    else
        msfp_seat_edge_tangent(p->surface[j], w->body[k], w->x[j + 1], seat, w->dbody[k], w->dx[j + 1], dseat);
    memcpy(w->dforce[j], dseat, sizeof w->dforce[j]);
}

/* The wrench of a surface is (F, M) about the centre of its concave side; on its slider's side the seat adds its moment. */
void msfp_split_moment(msfp_work *w, int j)
{
    const double *turning = w->seat[j] + VECTOR;
    const int above = signs[j] > 0;
    memcpy(w->below[j], w->moment[j], sizeof w->below[j]);
    double *on = above ? w->moment[j] : w->below[j];
    for (int i = 0; i < MOMENT; ++i) /* moment_below is what the body below receives, reversed */
        on[i] += above ? turning[i] : -turning[i];
}

void msfp_split_columns(msfp_work *w, int j)
{
    const double *dturning = w->dseat[j] + VECTOR * DOF;
    const int above = signs[j] > 0;
    memcpy(w->dbelow[j], w->dmoment[j], sizeof w->dbelow[j]);
    double *don = above ? w->dmoment[j] : w->dbelow[j];
    for (int i = 0; i < MOMENT * DOF; ++i)
        don[i] += above ? dturning[i] : -dturning[i];
}
#else
double msfp_compression(const msfp_parameters *p, const msfp_work *w, int j)
{
    (void)p;
    (void)w;
    (void)j;
    return 1.0;
}
#endif
