// SPDX-License-Identifier: Apache-2.0
// The pixel filter, by importance sampling: a sample is placed with the filter's density around the
// centre of its pixel and counts there fully, and in no other pixel (Ernst, Stamminger and Greiner,
// "Filter importance sampling", 2006).
#ifndef RENDER_FILTER_H
#define RENDER_FILTER_H

#include "render/scene.h"

enum { FILTER_CELLS = 512 };

typedef struct {
    FilterKind kind;
    // The lower half of the inverse of the cumulative distribution, at equal steps of the fourth
    // root of 2u: in it the long tail is nearly straight.
    double inverse[FILTER_CELLS + 1];
} Filter;

void filter_init(Filter *filter, FilterKind kind);

// u in [0, 1] to an offset from the pixel's centre along one axis, ascending. Box: [-1/2, 1/2];
// Blackman-Harris: [-3/2, 3/2], right to 0.0001 pixel.
double filter_offset(const Filter *filter, double u);

// How far from its pixel's centre a sample can lie.
double filter_radius(FilterKind kind);

#endif
