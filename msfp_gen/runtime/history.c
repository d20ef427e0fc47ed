/* history.c: prescribed histories (base motion, loads) as piecewise polynomials. */
#include "msfp_model.h"

void msfp_history_at(msfp_history *h, double t, int orders, double out[][6])
{
    int i = h->last;
    while (i + 1 < h->pieces && t >= h->knots[i + 1])
        ++i;
    while (i > 0 && t < h->knots[i])
        --i;
    h->last = i;
    const double s = t - h->knots[i];
    const double *piece = h->coefficients + (size_t)i * 6 * (MSFP_DEGREE + 1);
    for (int channel = 0; channel < 6; ++channel) {
        const double *c = piece + channel * (MSFP_DEGREE + 1);
        double value = 0.0, rate = 0.0, second = 0.0;
        int degree = MSFP_DEGREE; /* most pieces are cubic or constant */
        while (degree > 0 && c[degree] == 0.0)
            --degree;
        if (orders == 1) {
            for (int k = degree; k >= 0; --k)
                value = value * s + c[k];
            out[0][channel] = value;
            continue;
        }
        for (int k = degree; k >= 0; --k) {
            second = second * s + 2.0 * rate;
            rate = rate * s + value;
            value = value * s + c[k];
        }
        out[0][channel] = value;
        if (orders > 1)
            out[1][channel] = rate;
        if (orders > 2)
            out[2][channel] = second;
    }
}
