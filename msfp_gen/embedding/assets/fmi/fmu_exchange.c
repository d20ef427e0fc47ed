/* fmu_exchange.c: Model Exchange: rates of the states of a bearing under a supported mass, which the importer integrates.
 *
 * States are the coordinates and rates of the bodies, and Y, Z of every surface. The equations are stiff while a surface
 * is stuck, and have kinks at the switches of friction and rims: the gaps of the rims are event indicators.
 */
#include <math.h>
#include <string.h>
#include "fmu.h"

#if FMU_EXCHANGE

enum { NB = FMU_SURFACES, MOTIONS = FMU_SURFACES * FMU_COORDINATES };
typedef char states_are_q_v_Y_Z[FMU_STATES == 2 * MOTIONS + 2 * NB ? 1 : -1];

/* Rates of the states, outputs and gaps at these states and inputs. */
static int evaluate(const fmu *f, const double *states, const double *inputs, double *derivatives, double *outputs,
                    double *gaps)
{
    double base[FMU_ORDERS][6], row[FMU_ROW_SIZE], none[FMU_FREEDOMS] = { 0.0 };
    const msfp_inputs at = { .q = states, .v = states + MOTIONS, .f = states + 2 * MOTIONS, .base = &base[0][0],
                             .load = inputs + 18 };
    fmu_base(inputs, base);
    const int status = FMU_MODEL()->accelerations(f->bearing, &at, 0, derivatives + MOTIONS, row,
                                                  derivatives + 2 * MOTIONS, NULL, NULL);
    if (status != MSFP_OK)
        return status;
    memcpy(derivatives, states + MOTIONS, MOTIONS * sizeof *states);
    fmu_outputs(f, row, none, inputs, outputs);
    if (gaps)
        memcpy(gaps, row + FMU_ROW_GAP, FMU_INDICATORS * sizeof *row);
    return MSFP_OK;
}

fmu_status fmu_exchange_evaluate(fmu *f)
{
    const int status = evaluate(f, f->values + FMU_CONTINUOUS, f->values + FMU_INPUTS, f->values + FMU_DERIVATIVES,
                                f->values + FMU_OUTPUTS, f->values + FMU_GAPS);
    if (status != MSFP_OK)
        return fmu_failure(f, FMU_DISCARD, "equations at the states given", status, NULL);
    f->known = 1;
    return FMU_OK;
}

/* How far a known may be moved in a central difference: the share of what it is in a bearing that moves. */
static double natural_size(unsigned known)
{
    return known < FMU_OUTPUTS ? fmu_nominals[known - FMU_INPUTS] : fmu_state_nominals[known - FMU_CONTINUOUS];
}

fmu_status fmu_exchange_derivative(const fmu *f, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity)
{
    static const double share = 1e-5;
    double largest = 0.0, found[2][FMU_STATES + FMU_OUTPUT_COUNT];
    for (size_t i = 0; i < unknown_count; ++i)
        if (!((unknowns[i] >= FMU_OUTPUTS && unknowns[i] < FMU_OUTPUTS + FMU_OUTPUT_COUNT)
              || (unknowns[i] >= FMU_DERIVATIVES && unknowns[i] < FMU_DERIVATIVES + FMU_STATES)))
            return fmu_fail(f, FMU_ERROR, "directional derivative: unknown %u is no output and no derivative", unknowns[i]);
    for (size_t j = 0; j < known_count; ++j) {
        if (!((knowns[j] >= FMU_INPUTS && knowns[j] < FMU_OUTPUTS)
              || (knowns[j] >= FMU_CONTINUOUS && knowns[j] < FMU_DERIVATIVES)))
            return fmu_fail(f, FMU_ERROR, "directional derivative: known %u is no input and no state", knowns[j]);
        largest = fmax(largest, fabs(seed[j]) / natural_size(knowns[j]));
    }
    memset(sensitivity, 0, unknown_count * sizeof *sensitivity);
    if (largest == 0.0)
        return FMU_OK;
    for (int side = 0; side < 2; ++side) {
        double values[FMU_VALUES];
        memcpy(values, f->values, sizeof values);
        for (size_t j = 0; j < known_count; ++j)
            values[knowns[j]] += (side ? share : -share) / largest * seed[j];
        const int status = evaluate(f, values + FMU_CONTINUOUS, values + FMU_INPUTS, found[side], found[side] + FMU_STATES,
                                    NULL);
        if (status != MSFP_OK)
            return fmu_failure(f, FMU_ERROR, "directional derivative", status, NULL);
    }
    for (size_t i = 0; i < unknown_count; ++i) {
        const unsigned at = unknowns[i] >= FMU_DERIVATIVES ? unknowns[i] - FMU_DERIVATIVES
                                                           : unknowns[i] - FMU_OUTPUTS + FMU_STATES;
        sensitivity[i] = (found[1][at] - found[0][at]) / (2.0 * share / largest);
    }
    return FMU_OK;
}

#else
static fmu_status refuse(const fmu *f)
{
    return fmu_fail(f, FMU_ERROR, "Model Exchange: this unit is for Co-Simulation");
}

fmu_status fmu_exchange_evaluate(fmu *f) { return refuse(f); }

fmu_status fmu_exchange_derivative(const fmu *f, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity)
{
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)sensitivity;
    return refuse(f);
}
#endif
