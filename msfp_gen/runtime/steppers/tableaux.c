/* tableaux.c: the methods of implicit.c as data. tests/unit/runtime/test_esdirk.py checks their identities and the order of runs. */
#include "steppers.h"

#define ROOT2 1.41421356237309504880
#define W (ROOT2 / 4.0)
#define D (1.0 - ROOT2 / 2.0)

/* TR-BDF2 with the embedded third-order estimate of Hosea and Shampine (1996). */
static const msfp_tableau tr_bdf2 = {
    3,
    D,
    { { 0 }, { D }, { W, W } },
    { 0.0, 2.0 - ROOT2, 1.0 },
    { W - (1.0 - W) / 3.0, W - (3.0 * W + 1.0) / 3.0, D - D / 3.0 },
    3.0,
    { 1 }
};

/* The implicit part of ARK4(3)6L[2]SA of Kennedy and Carpenter (2003): order 4 with an embedded 3. */
static const msfp_tableau esdirk4 = {
    6,
    1.0 / 4,
    { { 0 },
      { 1.0 / 4 },
      { 8611.0 / 62500, -1743.0 / 31250 },
      { 5012029.0 / 34652500, -654441.0 / 2922500, 174375.0 / 388108 },
      { 15267082809.0 / 155376265600.0, -71443401.0 / 120774400, 730878875.0 / 902184768, 2285395.0 / 8070912 },
      { 82889.0 / 524892, 0.0, 15625.0 / 83664, 69875.0 / 102672, -2260.0 / 8211 } },
    { 0.0, 1.0 / 2, 83.0 / 250, 31.0 / 50, 17.0 / 20, 1.0 },
    { 82889.0 / 524892 - 4586570599.0 / 29645900160.0, 0.0, 15625.0 / 83664 - 178811875.0 / 945068544,
      69875.0 / 102672 - 814220225.0 / 1159782912, -2260.0 / 8211 + 3700637.0 / 11593932, 1.0 / 4 - 61727.0 / 225920 },
    4.0,
    { 2, 3, 4 }
};

const msfp_tableau *msfp_tableau_of(int method) { return method == MSFP_METHOD_ESDIRK4 ? &esdirk4 : &tr_bdf2; }

double msfp_control_order(int method) { return method == MSFP_METHOD_DOPRI5 ? 5.0 : msfp_tableau_of(method)->order; }
