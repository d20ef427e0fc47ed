/* history.c: prescribed histories (base motion, loads) as piecewise polynomials. */
#include <string.h>
#include "msfp_model.h"

enum { GIVEN = 6, ROOM = MSFP_CHANNELS };

#ifdef __GNUC__ /* a line of the cache holds 8 numbers */
#define FETCH(piece) do { for (int line = 0; line < GIVEN * (MSFP_DEGREE + 1); line += 8) __builtin_prefetch((piece) + line); } while (0)
#else
#define FETCH(piece) (void)0
#endif

static void hold(msfp_history *h, int i)
{
    const double *piece = h->coefficients + (size_t)i * GIVEN * (MSFP_DEGREE + 1);
    for (int k = 0; k <= MSFP_DEGREE; ++k)
        for (int channel = 0; channel < ROOM; ++channel)
            h->powers[k][channel] = channel < GIVEN ? piece[channel * (MSFP_DEGREE + 1) + k] : 0.0;
    FETCH(piece + GIVEN * (MSFP_DEGREE + 1)); /* the next, which a run comes to some time later */
    h->held = i + 1;
    h->degree = MSFP_DEGREE;
    for (int blank = 1; h->degree > 0 && blank; h->degree -= blank)
        for (int channel = 0; channel < GIVEN; ++channel)
            blank = blank && h->powers[h->degree][channel] == 0.0;
}

/* The piece that holds t: the one found last, or a neighbour. */
static void find(msfp_history *h, double t)
{
    int i = h->last;
    while (i + 1 < h->pieces && t >= h->knots[i + 1])
        ++i;
    while (i > 0 && t < h->knots[i])
        --i;
    h->last = i;
    if (h->held != i + 1)
        hold(h, i);
}

void msfp_history_at(msfp_history *h, double t, int orders, double out[][6])
{
    find(h, t);
    const double s = t - h->knots[h->last];
    double found[3][ROOM];
    for (int channel = 0; channel < ROOM; channel += MSFP_WHOLE) {
        msfp_whole value = *(const msfp_whole *)(h->powers[h->degree] + channel), rate = { 0.0 }, second = { 0.0 };
        for (int k = h->degree - 1; k >= 0; --k) {
            second = second * s + 2.0 * rate;
            rate = rate * s + value;
            value = value * s + *(const msfp_whole *)(h->powers[k] + channel);
        }
        *(msfp_whole *)(found[0] + channel) = value;
        *(msfp_whole *)(found[1] + channel) = rate;
        *(msfp_whole *)(found[2] + channel) = second;
    }
    for (int order = 0; order < orders; ++order)
        memcpy(out[order], found[order], sizeof out[order]);
}
