/* The plain loop that our kernel is measured against: the same station, effects written out, built by benchmarks/simulation.py. */
#include <math.h>

#define N 6
#define M 2
#define D 3

static double play(double u, double half_width, double *memory) {
    *memory = fmin(fmax(*memory, u - half_width), u + half_width);
    return *memory;
}

static double dead_zone(double u, double half_width) {
    double excess = fabs(u) - half_width;
    return excess > 0.0 ? copysign(excess, u) : 0.0;
}

static void advance(int n, const double *a, const double *b, double u, double *x) {
    double next[N];
    for (int i = 0; i < n; i++) {
        double total = b[i] * u;
        for (int j = 0; j < n; j++) total += a[i * n + j] * x[j];
        next[i] = total;
    }
    for (int i = 0; i < n; i++) x[i] = next[i];
}

static double dot(int n, const double *c, const double *x) {
    double total = 0.0;
    for (int i = 0; i < n; i++) total += c[i] * x[i];
    return total;
}

/* matrices: pressure a b c, position a b c, disturbance a b c; parameters: hysteresis, dead zone, upper, lower, rest,
   position dead zone, backlash */
void run(long samples, const double *m, const double *p, const double *voltages, double *outputs) {
    const double *a1 = m, *b1 = a1 + N * N, *c1 = b1 + N;
    const double *a2 = c1 + N, *b2 = a2 + M * M, *c2 = b2 + M;
    const double *a3 = c2 + M, *b3 = a3 + D * D, *c3 = b3 + D;
    double x1[N] = {0}, x2[M] = {0}, x3[D] = {0}, magnet = voltages[0], slack = 0.0, pressure = 0.0, position = 0.0;
    for (long k = 0; k < samples; k++) {
        outputs[2 * k] = pressure + p[4];
        outputs[2 * k + 1] = position;
        double u = dead_zone(play(voltages[2 * k], p[0], &magnet), p[1]);
        u = fmin(fmax(u, p[3]), p[2]);
        double before = pressure;
        advance(N, a1, b1, u, x1);
        pressure = dot(N, c1, x1);
        advance(D, a3, b3, 0.5 * (before + pressure), x3);
        advance(M, a2, b2, dead_zone(voltages[2 * k + 1], p[5]), x2);
        position = play(dot(M, c2, x2) + dot(D, c3, x3), p[6], &slack);
    }
}
