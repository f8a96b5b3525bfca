// SPDX-License-Identifier: Apache-2.0
// Box and Blackman-Harris filters, inverted by bisection.
#include "render/filter.h"

#include <math.h>

static const double PI = 3.141592653589793;

double filter_radius(FilterKind kind) {
    return kind == FILTER_BOX ? 0.5 : 1.5;
}

// The integral from 0 to x in [0, 1] of the four-term Blackman-Harris window (Harris, "On the use
// of windows for harmonic analysis", 1978), over its whole integral.
static double cumulative(double x) {
    static const double a[4] = {0.35875, -0.48829, 0.14128, -0.01168};
    double sum = a[0] * x;
    for (int k = 1; k < 4; k++) {
        double frequency = 2 * PI * k;
        sum += a[k] * program_fold(OP_SIN, frequency * x, 0, 0) / frequency;
    }
    return sum / a[0];
}

static double invert(double u) {
    double lo = 0, hi = 1;
    for (int i = 0; i < 50; i++) {
        double middle = 0.5 * (lo + hi);
        if (cumulative(middle) < u) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    return 0.5 * (lo + hi);
}

void filter_init(Filter *filter, FilterKind kind) {
    filter->kind = kind;
    if (kind == FILTER_BOX) {
        return;
    }
    const double width = 2 * filter_radius(kind);
    for (int i = 0; i <= FILTER_CELLS; i++) {
        double root = (double)i / FILTER_CELLS;
        filter->inverse[i] = (invert(0.5 * (root * root) * (root * root)) - 0.5) * width;
    }
    filter->inverse[0] = -filter_radius(kind);
    filter->inverse[FILTER_CELLS] = 0;
}

double filter_offset(const Filter *filter, double u) {
    if (filter->kind == FILTER_BOX) {
        return u - 0.5;
    }
    // The bell is even: one half serves for both.
    double cell = sqrt(sqrt(2 * (u < 0.5 ? u : 1 - u))) * FILTER_CELLS;
    int i = cell < FILTER_CELLS ? (int)cell : FILTER_CELLS - 1;
    double f = cell - i;
    double offset = filter->inverse[i] * (1 - f) + filter->inverse[i + 1] * f;
    return u < 0.5 ? offset : -offset;
}
