/* tableau.h: the coefficients of a stiffly accurate ESDIRK method. Private to the runtime. */
#ifndef MSFP_TABLEAU_H
#define MSFP_TABLEAU_H
#include "msfp_model.h"

typedef struct {
    int stages;
    double gamma;
    double a[MSFP_STAGES][MSFP_STAGES]; /* strictly lower part; the diagonal is gamma but for the explicit first stage */
    double c[MSFP_STAGES];
    double e[MSFP_STAGES];              /* weights less embedded weights */
    double order;                       /* exponent of the step controller: order of the error estimate + 1 */
    int middle[MSFP_MIDDLES];           /* stages that dense output goes through; 0: none */
} msfp_tableau;

const msfp_tableau *msfp_tableau_of(int method);

#endif
