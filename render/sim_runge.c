// SPDX-License-Identifier: Apache-2.0
// Dormand and Prince's coefficients.
#include "render/sim_runge.h"

const double runge_time[RUNGE_STAGES] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};

static const double share[RUNGE_STAGES][RUNGE_STAGES - 1] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};

// The result of order 5 less that of order 4.
static const double error_share[RUNGE_STAGES] = {
    71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

static const double way_share[RUNGE_STAGES] = {
    -12715105075.0 / 11282082432,  0,
    87487479700.0 / 32700410799,   -10690763975.0 / 1880347072,
    701980252875.0 / 199316789632, -1453857185.0 / 822651844,
    69997945.0 / 29380423};

void runge_look(uint32_t stage, double step, size_t n, const double *y, double *const k[],
                double *out) {
    const double *first = k[0], a = step * share[stage][0];
    for (size_t i = 0; i < n; i++) {
        out[i] = y[i] + a * first[i];
    }
    for (uint32_t s = 1; s < stage; s++) {
        const double *rates = k[s], b = step * share[stage][s];
        for (size_t i = 0; i < n; i++) {
            out[i] += b * rates[i];
        }
    }
}

static double weighted(const double weights[RUNGE_STAGES], double *const k[], size_t i) {
    double sum = 0;
    for (int s = 0; s < RUNGE_STAGES; s++) {
        sum += weights[s] * k[s][i];
    }
    return sum;
}

double runge_error(double step, double *const k[], size_t i) {
    return step * weighted(error_share, k, i);
}

void runge_way(double step, double y, double to, double *const k[], size_t i,
               double c[SIM_COEFFICIENTS]) {
    double rise = to - y;
    double bend = step * k[0][i] - rise, turn = rise - step * k[RUNGE_STAGES - 1][i] - bend;
    double more = step * weighted(way_share, k, i);
    // y + s (rise + (1 - s) (bend + s (turn + (1 - s) more)))
    c[0] = y;
    c[1] = rise + bend;
    c[2] = turn + more - bend;
    c[3] = -turn - 2 * more;
    c[4] = more;
    c[5] = 0;
}
