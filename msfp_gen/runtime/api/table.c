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
    .memory_states = MSFP_MEMORY,
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
    MSFP_API_FUNCTIONS
};

VISIBLE const msfp_api *MSFP_MODEL(void);

const msfp_api *MSFP_MODEL(void) { return &table; }
