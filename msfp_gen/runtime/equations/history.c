/* history.c: prescribed histories (base motion, loads) as piecewise polynomials. */
#include <string.h>
#include "equations.h"

enum { GIVEN = 6, PADDED = MSFP_CHANNELS };

#ifdef __GNUC__ /* a cache line holds 8 numbers */
#define PREFETCH(piece)                                                                                                \
    do {                                                                                                               \
        for (int line = 0; line < GIVEN * (MSFP_DEGREE + 1); line += 8)                                                \
            __builtin_prefetch((piece) + line);                                                                        \
    } while (0)
#else
#define PREFETCH(piece) (void)0
#endif

/* Copy the coefficients of piece i, [power][channel]. */
static void hold(msfp_history *h, int i)
{
    const double *piece = h->coefficients + (size_t)i * GIVEN * (MSFP_DEGREE + 1);
    for (int k = 0; k <= MSFP_DEGREE; ++k)
        for (int channel = 0; channel < PADDED; ++channel)
            h->powers[k][channel] = channel < GIVEN ? piece[channel * (MSFP_DEGREE + 1) + k] : 0.0;
    if (i + 1 < h->pieces) /* the run needs the next piece soon */
        PREFETCH(piece + GIVEN * (MSFP_DEGREE + 1));
    h->held = i + 1;
    h->degree = MSFP_DEGREE;
    for (int zero = 1; h->degree > 0 && zero; h->degree -= zero)
        for (int channel = 0; channel < GIVEN; ++channel)
            zero = zero && h->powers[h->degree][channel] == 0.0;
}

/* Find the piece that holds t, starting at the last one found. */
static void find(msfp_history *h, double t)
{
    const int i = h->last = msfp_piece_at(h->knots, h->pieces, h->last, t);
    if (h->held != i + 1)
        hold(h, i);
}

void msfp_history_at(msfp_history *h, double t, int orders, double out[][6])
{
    find(h, t);
    const double s = t - h->knots[h->last];
    double found[3][PADDED];
    for (int channel = 0; channel < PADDED; channel += MSFP_PACK_SIZE) {
        msfp_pack value = *(const msfp_pack *)(h->powers[h->degree] + channel), rate = { 0.0 }, second = { 0.0 };
        for (int k = h->degree - 1; k >= 0; --k) {
            second = second * s + 2.0 * rate;
            rate = rate * s + value;
            value = value * s + *(const msfp_pack *)(h->powers[k] + channel);
        }
        *(msfp_pack *)(found[0] + channel) = value;
        *(msfp_pack *)(found[1] + channel) = rate;
        *(msfp_pack *)(found[2] + channel) = second;
    }
    for (int order = 0; order < orders; ++order)
        memcpy(out[order], found[order], sizeof out[order]);
}
