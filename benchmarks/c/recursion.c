/* Accelerations of a chain of NB bodies on joints with two angles each by the articulated-body recursion, in plain C:
 * the chain of a triple pendulum with the moments of its surfaces given. O(n), no matrix of the system; what any
 * evaluation of accelerations is held against. Prints nanoseconds.
 *
 * R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, table 7.1, about the joint centres, in world axes.
 */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define NB 4
#define BATCHES 30
#define COUNT 20000

typedef struct {
    double m, jt, ja, c, e; /* mass, inertias, arms along the axis to the centre of mass and to the next joint */
} body;

static const body bodies[NB] = {
    { 0.45, 3.01e-4, 5.85e-4, -0.46, -0.39 }, { 0.34, 1.15e-4, 1.11e-4, -0.05, 0.1 },
    { 0.45, 3.01e-4, 5.85e-4, 0.07, 0.55 }, { 8.0, 3.14e-2, 6.25e-2, 0.48, 0.49 },
};

static void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Bias and articulated inertia of one body about its joint: [rotation, translation]. */
static void inertia(const body *b, const double *t3, const double *w, const double *load, double I[6][6], double p[6])
{
    double c[3], wc[3], wwc[3], Jw[3], gyro[3], turning[3];
    memset(I, 0, 36 * sizeof(double));
    for (int i = 0; i < 3; ++i)
        c[i] = b->c * t3[i];
    const double square = dot(c, c), along = dot(t3, w);
    for (int i = 0; i < 3; ++i) {
        Jw[i] = b->jt * w[i] + (b->ja - b->jt) * along * t3[i];
        for (int j = 0; j < 3; ++j)
            I[i][j] = (i == j) * (b->jt + b->m * square) + (b->ja - b->jt) * t3[i] * t3[j] - b->m * c[i] * c[j];
        I[3 + i][3 + i] = b->m;
    }
    I[0][4] = I[4][0] = -b->m * c[2];
    I[0][5] = I[5][0] = b->m * c[1];
    I[1][3] = I[3][1] = b->m * c[2];
    I[1][5] = I[5][1] = -b->m * c[0];
    I[2][3] = I[3][2] = -b->m * c[1];
    I[2][4] = I[4][2] = b->m * c[0];
    cross(w, c, wc);
    cross(w, wc, wwc);
    cross(w, Jw, gyro);
    for (int i = 0; i < 3; ++i)
        p[3 + i] = b->m * wwc[i] - load[i];
    cross(c, wwc, turning);
    for (int i = 0; i < 3; ++i)
        p[i] = gyro[i] + b->m * turning[i];
    cross(c, load, turning);
    for (int i = 0; i < 3; ++i)
        p[i] -= turning[i];
}

static void accelerations(const double q[NB][2], const double v[NB][2], const double moment[NB + 1][3], const double *base,
                          const double *load, double a[NB][2])
{
    static double S[NB][2][6], I[NB][6][6], U[NB][2][6], D[NB][2][2], p[NB][6], bias[NB][6], arm[NB][3], u[NB][2];
    double t1[3] = { 1, 0, 0 }, t2[3] = { 0, 1, 0 }, t3[3] = { 0, 0, 1 }, w[3] = { 0, 0, 0 };
    for (int k = 0; k < NB; ++k) {
        const double sp = sin(q[k][0]), cp = cos(q[k][0]), st = sin(q[k][1]), ct = cos(q[k][1]);
        double first[3], second[3], rate[3], spun[3], old[3], weight[3], middle;
        memcpy(first, t1, sizeof first);
        memcpy(old, w, sizeof old);
        for (int i = 0; i < 3; ++i) {
            second[i] = cp * t2[i] + sp * t3[i];
            middle = cp * t3[i] - sp * t2[i];
            t1[i] = ct * first[i] - st * middle;
            t3[i] = st * first[i] + ct * middle;
            t2[i] = second[i];
            w[i] += v[k][0] * first[i] + v[k][1] * second[i];
        }
        for (int i = 0; i < 3; ++i) {
            S[k][0][i] = first[i];
            S[k][1][i] = second[i];
            S[k][0][3 + i] = S[k][1][3 + i] = 0.0;
            spun[i] = old[i] + v[k][0] * first[i];
        }
        cross(old, first, rate);
        double rate2[3];
        cross(spun, second, rate2);
        for (int i = 0; i < 3; ++i) {
            bias[k][i] = v[k][0] * rate[i] + v[k][1] * rate2[i];
            bias[k][3 + i] = 0.0;
            arm[k][i] = bodies[k].e * t3[i];
            weight[i] = i == 2 ? -9.8 * bodies[k].m : 0.0;
        }
        inertia(&bodies[k], t3, w, weight, I[k], p[k]);
        if (k + 1 < NB) { /* acceleration of the next joint less what the tangent carries: the centripetal part */
            double turned[3];
            cross(w, arm[k], turned);
            cross(w, turned, bias[k] + 3);
        } else
            for (int i = 0; i < 3; ++i) {
                double lever[3];
                cross(arm[k], load, lever);
                p[k][i] -= lever[i];
                p[k][3 + i] -= load[i];
            }
        for (int i = 0; i < 3; ++i)
            p[k][i] -= moment[k][i] - moment[k + 1][i];
    }
    for (int k = NB - 1; k >= 0; --k) {
        double offset[6] = { 0 };
        if (k > 0)
            memcpy(offset + 3, bias[k - 1] + 3, 3 * sizeof(double));
        memcpy(offset, bias[k], 3 * sizeof(double));
        for (int r = 0; r < 2; ++r)
            for (int i = 0; i < 6; ++i) {
                U[k][r][i] = 0.0;
                for (int j = 0; j < 3; ++j)
                    U[k][r][i] += I[k][i][j] * S[k][r][j];
            }
        double m[2][2];
        for (int r = 0; r < 2; ++r) {
            for (int c = 0; c < 2; ++c)
                m[r][c] = dot(S[k][r], U[k][c]);
            u[k][r] = -dot(S[k][r], p[k]);
        }
        const double determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
        D[k][0][0] = m[1][1] / determinant;
        D[k][1][1] = m[0][0] / determinant;
        D[k][0][1] = D[k][1][0] = -m[0][1] / determinant;
        if (k == 0)
            break;
        double A[6][6], total[6];
        for (int i = 0; i < 6; ++i) {
            for (int j = 0; j < 6; ++j) {
                A[i][j] = I[k][i][j];
                for (int r = 0; r < 2; ++r)
                    for (int c = 0; c < 2; ++c)
                        A[i][j] -= U[k][r][i] * D[k][r][c] * U[k][c][j];
            }
            total[i] = p[k][i];
            for (int r = 0; r < 2; ++r)
                for (int c = 0; c < 2; ++c)
                    total[i] += U[k][r][i] * D[k][r][c] * u[k][c];
        }
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j)
                total[i] += A[i][j] * offset[j];
        /* to the joint below: X^T A X with X = [1 0; -arm x 1] */
        const double *s = arm[k - 1];
        const double X[3][3] = { { 0, s[2], -s[1] }, { -s[2], 0, s[0] }, { s[1], -s[0], 0 } };
        double B[6][3], turned[3];
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 3; ++j)
                B[i][j] = A[i][j] + A[i][3] * X[0][j] + A[i][4] * X[1][j] + A[i][5] * X[2][j];
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) {
                I[k - 1][i][j] += B[i][j] + X[0][i] * B[3][j] + X[1][i] * B[4][j] + X[2][i] * B[5][j];
                I[k - 1][i][3 + j] += A[i][3 + j] + X[0][i] * A[3][3 + j] + X[1][i] * A[4][3 + j] + X[2][i] * A[5][3 + j];
                I[k - 1][3 + i][j] += B[3 + i][j];
                I[k - 1][3 + i][3 + j] += A[3 + i][3 + j];
            }
        cross(s, total + 3, turned);
        for (int i = 0; i < 3; ++i) {
            p[k - 1][i] += total[i] + turned[i];
            p[k - 1][3 + i] += total[3 + i];
        }
    }
    double now[6] = { 0, 0, 0, base[0], base[1], base[2] };
    for (int k = 0; k < NB; ++k) {
        if (k > 0) {
            double swept[3];
            cross(now, arm[k - 1], swept);
            for (int i = 0; i < 3; ++i)
                now[3 + i] += swept[i] + bias[k - 1][3 + i];
        }
        for (int i = 0; i < 3; ++i)
            now[i] += bias[k][i];
        double left[2];
        for (int r = 0; r < 2; ++r) {
            left[r] = u[k][r];
            for (int i = 0; i < 6; ++i)
                left[r] -= U[k][r][i] * now[i];
        }
        for (int r = 0; r < 2; ++r)
            a[k][r] = D[k][r][0] * left[0] + D[k][r][1] * left[1];
        for (int i = 0; i < 3; ++i)
            now[i] += S[k][0][i] * a[k][0] + S[k][1][i] * a[k][1];
    }
}

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

int main(void)
{
    double q[NB][2], v[NB][2], a[NB][2], first[NB][2], moment[NB + 1][3] = { { 0 } }, sink = 0.0, best = 1e30;
    const double base[3] = { 0.5, 0.2, 0.0 }, load[3] = { 100.0, 50.0, -112e3 };
    for (int k = 0; k < NB; ++k)
        for (int i = 0; i < 2; ++i) {
            q[k][i] = 0.01 * (k + 1) - 0.03 * i;
            v[k][i] = 0.1 * (i + 1);
            moment[k][i] = 30.0 * (i + 1) - k;
        }
    accelerations((const double(*)[2])q, (const double(*)[2])v, (const double(*)[3])moment, base, load, first);
    for (int batch = 0; batch < BATCHES; ++batch) {
        const double begin = now_ns();
        for (int i = 0; i < COUNT; ++i) {
            accelerations((const double(*)[2])q, (const double(*)[2])v, (const double(*)[3])moment, base, load, a);
            sink += a[0][0];
            q[0][0] += 1e-12 * a[0][0];
        }
        const double each = (now_ns() - begin) / COUNT;
        best = each < best ? each : best;
    }
    printf("%.1f", best);
    for (int k = 0; k < NB; ++k)
        printf(" %.15g %.15g", first[k][0], first[k][1]);
    printf("\n");
    return isnan(sink);
}
