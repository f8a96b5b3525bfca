// SPDX-License-Identifier: Apache-2.0
// Structural similarity. The window's weights are a product, so rows are filtered first, then
// columns.
#include "render/ssim.h"

#include <math.h>
#include <stdlib.h>

#include "accel/arena.h"

enum { RADIUS = SSIM_WINDOW / 2, N_MOMENTS = 5 };

// Of one pixel, or of one window: means of a, b, a^2, b^2, ab.
typedef struct {
    double of[N_MOMENTS];
} Moments;

static void make_weights(double weight[SSIM_WINDOW]) {
    const double sigma = 1.5;
    double sum = 0;
    for (int i = 0; i < SSIM_WINDOW; i++) {
        double x = i - RADIUS;
        weight[i] = exp(-0.5 * x * x / (sigma * sigma));
        sum += weight[i];
    }
    for (int i = 0; i < SSIM_WINDOW; i++) {
        weight[i] /= sum;
    }
}

static void filter_row(const float *a, const float *b, uint32_t n_windows, const double *weight,
                       Moments *row) {
    for (uint32_t x = 0; x < n_windows; x++) {
        Moments m = {{0}};
        for (int i = 0; i < SSIM_WINDOW; i++) {
            double p = (double)a[x + (uint32_t)i], q = (double)b[x + (uint32_t)i];
            const double of[N_MOMENTS] = {p, q, p * p, q * q, p * q};
            for (int k = 0; k < N_MOMENTS; k++) {
                m.of[k] += weight[i] * of[k];
            }
        }
        row[x] = m;
    }
}

static double similarity(const Moments *m, double c1, double c2) {
    double a = m->of[0], b = m->of[1];
    double var_a = m->of[2] - a * a, var_b = m->of[3] - b * b, covariance = m->of[4] - a * b;
    return (2 * a * b + c1) * (2 * covariance + c2) / ((a * a + b * b + c1) * (var_a + var_b + c2));
}

// The mean over the windows whose middles lie in one row; rows: the ring of filtered rows, the
// window's uppermost is number `first`.
static double row_mean(const Moments *rows, uint32_t first, uint32_t n_windows,
                       const double *weight, double range) {
    double sum = 0, c1 = 0.01 * range * 0.01 * range, c2 = 0.03 * range * 0.03 * range;
    for (uint32_t x = 0; x < n_windows; x++) {
        Moments m = {{0}};
        for (uint32_t i = 0; i < SSIM_WINDOW; i++) {
            const Moments *row = rows + (size_t)((first + i) % SSIM_WINDOW) * n_windows + x;
            for (int k = 0; k < N_MOMENTS; k++) {
                m.of[k] += weight[i] * row->of[k];
            }
        }
        sum += similarity(&m, c1, c2);
    }
    return sum / n_windows;
}

double ssim_mean(const float *a, const float *b, uint32_t width, uint32_t height, double range) {
    double weight[SSIM_WINDOW], sum = 0;
    uint32_t n_windows = width - SSIM_WINDOW + 1, n_rows = height - SSIM_WINDOW + 1;
    Arena arena = {0};
    Moments *rows = ARENA_ARRAY(&arena, (size_t)SSIM_WINDOW * n_windows, Moments);
    make_weights(weight);
    for (uint32_t y = 0; y < height; y++) {
        const size_t at = (size_t)y * width;
        filter_row(a + at, b + at, n_windows, weight, rows + (size_t)(y % SSIM_WINDOW) * n_windows);
        if (y + 1 >= SSIM_WINDOW) {
            sum += row_mean(rows, y + 1 - SSIM_WINDOW, n_windows, weight, range);
        }
    }
    arena_free(&arena);
    return sum / n_rows;
}
