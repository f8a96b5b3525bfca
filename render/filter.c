// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions of the filters, inverted by bisection.
#include "render/filter.h"

#include <math.h>

static const double PI = 3.141592653589793;

// Half the width of the Gaussian, in standard deviations.
static const double GAUSSIAN_CUT = 3;

double filter_width(FilterKind kind, double width) {
    static const double usual[] = {[FILTER_BLACKMAN_HARRIS] = 3,
                                   [FILTER_BOX] = 1,
                                   [FILTER_TRIANGLE] = 2,
                                   [FILTER_GAUSSIAN] = 3};
    return width > 0 ? width : usual[kind];
}

// The integral from 0 to x in [0, 1] of the four-term Blackman-Harris window (Harris, "On the use
// of windows for harmonic analysis", 1978), over its whole integral.
static double blackman_harris(double x) {
    static const double a[4] = {0.35875, -0.48829, 0.14128, -0.01168};
    double sum = a[0] * x;
    for (int k = 1; k < 4; k++) {
        double frequency = 2 * PI * k;
        sum += a[k] * program_fold(OP_SIN, frequency * x, 0, 0) / frequency;
    }
    return sum / a[0];
}

// The integral from 0 to z of exp(-z^2 / 2), |z| <= 3, by its power series: terms reach 12 and are
// below 1e-17 from the fortieth on.
static double bell(double z) {
    double power = z, sum = z;
    for (int n = 1; n < 48; n++) {
        power *= -z * z / (2 * n);
        sum += power / (2 * n + 1);
    }
    return sum;
}

// Of the interval [0, 1] that the filter spans, below x.
static double cumulative(FilterKind kind, double x) {
    if (kind == FILTER_GAUSSIAN) {
        double z = (2 * x - 1) * GAUSSIAN_CUT;
        return 0.5 + 0.5 * bell(z) / bell(GAUSSIAN_CUT);
    }
    return blackman_harris(x);
}

static double invert(FilterKind kind, double u) {
    double lo = 0, hi = 1;
    for (int i = 0; i < 50; i++) {
        double middle = 0.5 * (lo + hi);
        if (cumulative(kind, middle) < u) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    return 0.5 * (lo + hi);
}

void filter_init(Filter *filter, FilterKind kind, double width) {
    filter->kind = kind;
    filter->width = filter_width(kind, width);
    if (kind == FILTER_BOX || kind == FILTER_TRIANGLE) {
        return;
    }
    for (int i = 0; i <= FILTER_CELLS; i++) {
        double root = (double)i / FILTER_CELLS;
        filter->inverse[i] =
            (invert(kind, 0.5 * (root * root) * (root * root)) - 0.5) * filter->width;
    }
    filter->inverse[0] = -0.5 * filter->width;
    filter->inverse[FILTER_CELLS] = 0;
}

// The lower half of the inverse, u in [0, 1/2].
static double lower_half(const Filter *filter, double u) {
    if (filter->kind == FILTER_TRIANGLE) {
        return (sqrt(2 * u) - 1) * 0.5 * filter->width;
    }
    double cell = sqrt(sqrt(2 * u)) * FILTER_CELLS;
    int i = cell < FILTER_CELLS ? (int)cell : FILTER_CELLS - 1;
    double f = cell - i;
    return filter->inverse[i] * (1 - f) + filter->inverse[i + 1] * f;
}

double filter_offset(const Filter *filter, double u) {
    if (filter->kind == FILTER_BOX) {
        return (u - 0.5) * filter->width;
    }
    // They are even: one half serves for both.
    return u < 0.5 ? lower_half(filter, u) : -lower_half(filter, 1 - u);
}
