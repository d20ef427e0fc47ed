/* fmu_bearing.c: bearing and two-port of the parameters of a unit, its outputs, and what a failure says. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmu.h"
#include "port.h"

void fmu_release(fmu *f)
{
    const msfp_api *api = FMU_MODEL();
    api->port_free(f->port);
    api->bearing_free(f->bearing);
    free(f->before);
    f->port = NULL;
    f->bearing = NULL;
    f->before = NULL;
    f->size = 0;
    f->stepped = f->ready = f->known = 0;
}

fmu_status fmu_fail(const fmu *f, fmu_status status, const char *format, ...)
{
    char text[FMU_TEXT];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (f->log)
        f->log(f, status, status == FMU_DISCARD ? "logStatusDiscard" : "logStatusError", text);
    return status;
}

fmu_status fmu_failure(const fmu *f, fmu_status status, const char *what, int found, const char *message)
{
    const msfp_api *api = FMU_MODEL();
    msfp_progress progress = { 0 };
    if (message)
        return fmu_fail(f, status, "%s: %s", what, message);
    if (f->port && found < MSFP_E_ARGUMENT)
        api->port_progress(f->port, &progress);
    if (progress.status != found)
        return fmu_fail(f, status, "%s: %s: %s", what, api->status_name(found), api->status_text(found));
    if (progress.surface)
        return fmu_fail(f, status, "%s: %s at t = %.6g s, surface %d, %.4g: %s", what, api->status_name(found),
                        progress.time, progress.surface, progress.value, api->status_text(found));
    return fmu_fail(f, status, "%s: %s at t = %.6g s: %s", what, api->status_name(found), progress.time,
                    api->status_text(found));
}

#if FMU_UPLIFT
/* Separations at which the unilateral contacts carry the weights above them and the axial load. */
static void at_rest(const double *values, double *q)
{
    const double *bodies = values + FMU_BODIES, *surfaces = values + FMU_SURFACE_VALUES;
#if FMU_MASS
    double mass = values[FMU_TOP_MASS];
    const double load = 0.0;
#else
    double mass = 0.0;
    const double load = values[FMU_AXIAL_LOAD];
#endif
    memset(q, 0, NB * NQ * sizeof *q);
    for (int k = NB - 1; k >= 0; --k) {
        mass += bodies[(k + 1) * FMU_BODY_SIZE + FMU_BODY_MASS];
        q[k * NQ + NQ - 1] = -(load + values[FMU_GRAVITY] * mass) / surfaces[k * FMU_SURFACE_SIZE + FMU_SEAT_STIFFNESS];
    }
}
#endif

/* The top in the order of msfp.h: the parameters of the unit hold those of its numbers that this kind of top has. */
static void top_of(const double *values, double top[FMU_TOP_SIZE])
{
    static const int places[] = FMU_TOP_PLACES;
    memset(top, 0, FMU_TOP_SIZE * sizeof *top);
    for (size_t i = 0; i < sizeof places / sizeof *places; ++i)
        top[places[i]] = values[FMU_TOP_VALUES + i];
}

#if FMU_EXCHANGE
/* The states that an importer integrates, as they are in the two-port at the start. */
static void states_at_start(fmu *f)
{
    double row[FMU_ROW_SIZE], *states = f->values + FMU_CONTINUOUS;
    FMU_MODEL()->port_row(f->port, row);
    memcpy(states, row + FMU_ROW_Q, NB * NQ * sizeof *row);
    memcpy(states + NB * NQ, row + FMU_ROW_V, NB * NQ * sizeof *row);
    memcpy(states + 2 * NB * NQ, row + FMU_ROW_F, 2 * NB * sizeof *row);
    f->known = 0;
}
#endif

fmu_status fmu_build(fmu *f)
{
    const msfp_api *api = FMU_MODEL();
    const double *values = f->values;
    const char *message = NULL;
    double top[FMU_TOP_SIZE];
    msfp_scene scene;
    fmu_release(f);
    top_of(values, top);
    int status = api->bearing_new(values[FMU_GRAVITY], values + FMU_BODIES, values + FMU_SURFACE_VALUES, top, &f->bearing,
                                  &message);
    if (status != MSFP_OK)
        return fmu_failure(f, FMU_ERROR, "parameters", status, message);
    api->scene_default(&scene);
    scene.bearing = f->bearing;
    scene.start_time = values[FMU_TIME];
    scene.method = FMU_METHOD;
    scene.rtol = values[FMU_SOLVER_RTOL];
    scene.atol_angle = values[FMU_SOLVER_ANGLE_TOLERANCE] != 0.0 ? values[FMU_SOLVER_ANGLE_TOLERANCE] : 0.01 * scene.rtol;
    scene.max_step = values[FMU_SOLVER_MAX_STEP];
    scene.max_steps = values[FMU_SOLVER_MAX_STEPS];
#if FMU_UPLIFT
    double q[NB * NQ];
    at_rest(values, q);
    scene.q = q;
#endif
#if FMU_MASS
    status = api->port_new_loaded(&scene, &f->port, &message);
#else
    status = api->port_new(&scene, values[FMU_AXIAL_LOAD], &f->port, &message);
#endif
    if (status != MSFP_OK)
        return fmu_failure(f, FMU_ERROR, "start", status, message);
    f->size = api->port_snapshot_size(f->port);
    f->before = calloc(1, f->size);
    if (!f->before)
        return fmu_failure(f, FMU_ERROR, "start", MSFP_E_MEMORY, NULL);
    double row[FMU_ROW_SIZE], wrench[FMU_FREEDOMS], ends[FMU_ENDS] = { 0.0 };
    api->port_wrench(f->port, wrench);
    api->port_row(f->port, row);
    memset(f->plate, 0, sizeof f->plate);
    fmu_outputs(f, row, wrench, ends, f->values + FMU_OUTPUTS);
#if FMU_MASS
    memcpy(f->plate, f->values + FMU_OUTPUTS, sizeof f->plate);
    fmu_outputs(f, row, wrench, ends, f->values + FMU_OUTPUTS);
#endif
#if FMU_EXCHANGE
    if (f->exchange)
        states_at_start(f);
#endif
    f->ready = 1;
    return FMU_OK;
}

#if FMU_MASS
void fmu_base(const double *ends, double base[FMU_ORDERS][6])
{
    double rotation[FMU_ORDERS][3], angles[FMU_ORDERS][3];
    for (int order = 0; order < FMU_ORDERS; ++order)
        memcpy(rotation[order], ends + 6 * order + 3, sizeof rotation[order]);
    msfp_end_angles((const double(*)[3])rotation, angles);
    for (int order = 0; order < FMU_ORDERS; ++order) {
        memcpy(base[order], ends + 6 * order, 3 * sizeof *ends);
        memcpy(base[order] + 3, angles[order], sizeof angles[order]);
    }
}

/* Displacement, velocity and acceleration of r_nn since the start, and psi, theta, phi of the top plate with rates. */
static void motion_of_top(const fmu *f, const double *row, const double *ends, double *motion)
{
    double points[NB + 1][4][3][3], rotations[NB + 1][4][3], bases[NB + 1][3][3], base[FMU_ORDERS][6];
    const msfp_inputs at = { .q = row + FMU_ROW_Q, .v = row + FMU_ROW_V, .a = row + FMU_ROW_A, .base = &base[0][0] };
    fmu_base(ends, base);
    FMU_MODEL()->named_vectors(f->bearing, &at, &points[0][0][0][0], &rotations[0][0][0], &bases[0][0][0]);
    for (int order = 0; order < FMU_ORDERS; ++order) {
        const double *const rates[] = { at.q, at.v, at.a };
        for (int i = 0; i < 3; ++i) {
            motion[6 * order + i] = points[NB][2][order][i];
            motion[6 * order + 3 + i] = rates[order][(NB - 1) * NQ + i];
        }
    }
    for (int i = 0; i < 3; ++i)
        motion[i] -= f->plate[i];
}
#endif

/* What the outputs take from a row as it is. */
static void outputs_of_row(const double *row, const double *wrench, double *outputs)
{
#if FMU_MASS
    memcpy(outputs + FMU_TOP_FORCE, row + FMU_ROW_TOP_FORCE, 3 * sizeof *row);
    memcpy(outputs + FMU_BASE_FORCE, row + FMU_ROW_FORCE, 3 * sizeof *row);
    (void)wrench;
#else
    memcpy(outputs, wrench, FMU_FREEDOMS * sizeof *wrench);
#endif
    memcpy(outputs + FMU_SLIDING, row + FMU_ROW_SLIDING, NB * sizeof *row);
    memcpy(outputs + FMU_NORMAL, row + FMU_ROW_NORMAL, NB * sizeof *row);
}

void fmu_outputs(const fmu *f, const double *row, const double *wrench, const double *ends, double *outputs)
{
#if FMU_MASS
    motion_of_top(f, row, ends, outputs);
#else
    (void)f;
    (void)ends;
#endif
    outputs_of_row(row, wrench, outputs);
}

void fmu_output_derivatives(const double *row, const double *wrench, double *outputs)
{
#if FMU_MASS
    const double *const moved[FMU_ORDERS] = { row + FMU_ROW_TOP, row + FMU_ROW_SIZE, row + FMU_ROW_SIZE + 3 };
    const double *const rates[FMU_ORDERS] = { row + FMU_ROW_Q, row + FMU_ROW_V, row + FMU_ROW_A };
    for (int order = 0; order < FMU_ORDERS; ++order) {
        memcpy(outputs + 6 * order, moved[order], 3 * sizeof *row);
        memcpy(outputs + 6 * order + 3, rates[order] + (NB - 1) * NQ, 3 * sizeof *row);
    }
#endif
    outputs_of_row(row, wrench, outputs);
}
