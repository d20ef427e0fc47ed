/* history.c: prescribed histories (base motion, loads) as piecewise polynomials. */
#include <string.h>
#include "msfp_model.h"

static void hold(msfp_history *h, int i)
{
    const double *piece = h->coefficients + (size_t)i * 6 * (MSFP_DEGREE + 1);
    for (int channel = 0; channel < 6; ++channel)
        for (int k = 0; k <= MSFP_DEGREE; ++k)
            h->powers[k][channel] = piece[channel * (MSFP_DEGREE + 1) + k];
    h->held = i + 1;
    h->degree = MSFP_DEGREE;
    for (int blank = 1; h->degree > 0 && blank; h->degree -= blank)
        for (int channel = 0; channel < 6; ++channel)
            blank = blank && h->powers[h->degree][channel] == 0.0;
}

void msfp_history_at(msfp_history *h, double t, int orders, double out[][6])
{
    int i = h->last;
    while (i + 1 < h->pieces && t >= h->knots[i + 1])
        ++i;
    while (i > 0 && t < h->knots[i])
        --i;
    h->last = i;
    if (h->held != i + 1)
        hold(h, i);
    const double s = t - h->knots[i];
    double value[6] = { 0.0 }, rate[6] = { 0.0 }, second[6] = { 0.0 };
    for (int k = h->degree; k >= 0; --k)
        for (int channel = 0; channel < 6; ++channel) {
            if (orders > 1) {
                second[channel] = second[channel] * s + 2.0 * rate[channel];
                rate[channel] = rate[channel] * s + value[channel];
            }
            value[channel] = value[channel] * s + h->powers[k][channel];
        }
    memcpy(out[0], value, sizeof value);
    if (orders > 1)
        memcpy(out[1], rate, sizeof rate);
    if (orders > 2)
        memcpy(out[2], second, sizeof second);
}
