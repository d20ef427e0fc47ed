/* table.c: the table of functions of the model, the only external name that a program needs. */
#include "msfp_fields.h"
#include "api.h"

#if defined(_WIN32)
#define VISIBLE __declspec(dllexport)
#elif defined(__GNUC__)
#define VISIBLE __attribute__((visibility("default")))
#else
#define VISIBLE
#endif

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

static const char *status_name(int status)
{
    if (status >= MSFP_E_ARGUMENT && status < MSFP_CALL_ERRORS)
        return msfp_call_error_names[status - MSFP_E_ARGUMENT];
    return msfp_status_name(status);
}

static const char *status_text(int status)
{
    if (status >= MSFP_E_ARGUMENT && status < MSFP_CALL_ERRORS)
        return msfp_call_errors[status - MSFP_E_ARGUMENT];
    return status >= 0 && status < MSFP_STATUSES ? msfp_status_texts[status] : "no status of this interface";
}

static const msfp_api table = {
    .abi_version = MSFP_ABI_VERSION,
    .n = MSFP_N,
    .m = MSFP_M,
    .p = MSFP_P,
    .name = MSFP_MODEL_NAME,
    .version = MSFP_VERSION,
    .spec = MSFP_SPEC,
    .description = MSFP_DESCRIPTION,
    .surfaces = MSFP_NB,
    .coordinates = MSFP_NQ,
    .dof = MSFP_DOF,
    .unknowns = MSFP_UNKNOWNS,
    .heat_states = MSFP_HEAT,
    .top_rotation = MSFP_TOP_ROTATION,
    .body_size = MSFP_BODY_VALUES_SIZE,
    .surface_size = MSFP_SURFACE_VALUES_SIZE,
    .top_size = MSFP_TOP_VALUES_SIZE,
    .body = msfp_body_fields,
    .surface = msfp_surface_fields,
    .top = msfp_top_fields,
    .row_size = MSFP_ROW_SIZE,
    .row_fields = COUNT(msfp_row_fields),
    .extremes_size = sizeof(msfp_extremes) / sizeof(double),
    .extremes_fields = COUNT(msfp_extremes_fields),
    .row = msfp_row_fields,
    .extremes = msfp_extremes_fields,
    .status_name = status_name,
    .status_text = status_text,
    .bearing_new = msfp_api_bearing_new,
    .bearing_free = msfp_api_bearing_free,
    .accelerations = msfp_api_accelerations,
    .observe = msfp_api_observe,
    .condensed = msfp_api_condensed,
    .momentum_balances = msfp_api_momentum_balances,
    .named_vectors = msfp_api_named_vectors,
    .scene_default = msfp_api_scene_default,
    .run_new = msfp_api_run_new,
    .run_free = msfp_api_run_free,
    .run_advance = msfp_api_run_advance,
    .run_progress = msfp_api_run_progress,
    .run_state = msfp_api_run_state,
    .run_counts = msfp_api_run_counts,
    .run_extremes = msfp_api_run_extremes,
    .run_trips = msfp_api_run_trips,
    .run_events = msfp_api_run_events,
    .run_rows = msfp_api_run_rows,
    .run_on_rows = msfp_api_run_on_rows,
    .run_record = msfp_api_run_record,
    .run_hold_rows = msfp_api_run_hold_rows,
    .run_drop_rows = msfp_drop_rows,
    .snapshot_size = msfp_snapshot_size,
    .snapshot_write = msfp_snapshot_write,
    .snapshot_read = msfp_api_snapshot_read,
    .snapshot_open = msfp_api_snapshot_open,
    .port_new = msfp_api_port_new,
    .port_free = msfp_port_free,
    .port_trial = msfp_api_port_trial,
    .port_wrench = msfp_api_port_wrench,
    .port_derivative = msfp_api_port_derivative,
    .port_row = msfp_api_port_row,
    .port_progress = msfp_api_port_progress,
    .port_counts = msfp_api_port_counts,
    .port_time = msfp_api_port_time,
    .port_commit = msfp_api_port_commit,
    .port_revert = msfp_port_revert,
    .port_snapshot_size = msfp_port_snapshot_size,
    .port_snapshot_write = msfp_port_snapshot_write,
    .port_snapshot_read = msfp_api_port_snapshot_read,
#if MSFP_GRADIENTS
    .gradients_start = msfp_api_gradients_start,
    .gradient_rows = msfp_gradient_rows,
    .gradient_events = msfp_gradient_events,
    .gradient_extremes = msfp_gradient_extremes,
#endif
    .port_method = msfp_api_port_method,
    .port_step_begin = msfp_api_port_step_begin,
    .port_stage = msfp_api_port_stage,
    .port_stage_derivative = msfp_api_port_stage_derivative,
    .port_step_end = msfp_api_port_step_end,
    .port_step_commit = msfp_api_port_step_commit,
    .port_jump = msfp_api_port_jump,
    .port_cause = msfp_api_port_cause,
    .port_new_loaded = msfp_api_port_new_loaded,
    .port_beside = msfp_api_port_beside,
    .port_tripped = msfp_api_port_tripped,
    .port_trips = msfp_api_port_trips,
    .port_state = msfp_api_port_state,
    .port_enter = msfp_api_port_enter,
};

VISIBLE const msfp_api *MSFP_MODEL(void);

const msfp_api *MSFP_MODEL(void) { return &table; }
