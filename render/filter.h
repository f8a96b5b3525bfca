// SPDX-License-Identifier: Apache-2.0
// The pixel filter, by importance sampling: a sample is placed with the filter's density around the
// centre of its pixel and counts there fully, and in no other pixel (Ernst, Stamminger and Greiner,
// "Filter importance sampling", 2006). So all samples weigh the same, and sums stay exact; a filter
// that is negative somewhere, such as Mitchell's, has no such density and is not offered.
//
// All are products of one function of x and one of y, here over the width w: box, 1; triangle,
// 1 - |2x/w|; gaussian, exp(-(6x/w)^2 / 2), cut off at three standard deviations; blackman-harris,
// the four-term window (Harris 1978).
#ifndef RENDER_FILTER_H
#define RENDER_FILTER_H

#include "render/scene.h"

enum { FILTER_CELLS = 512 };

typedef struct {
    FilterKind kind;
    double width; // pixels
    // The lower half of the inverse of the cumulative distribution, at equal steps of the fourth
    // root of 2u: in it the long tail is nearly straight.
    double inverse[FILTER_CELLS + 1];
} Filter;

// width: pixels, the whole extent; 0: the usual one.
void filter_init(Filter *filter, FilterKind kind, double width);

// u in [0, 1] to an offset from the pixel's centre along one axis, ascending, in
// [-width/2, width/2]; right to 0.00004 of the width.
double filter_offset(const Filter *filter, double u);

// The width where 0 stands for the usual one: 3 (blackman-harris, gaussian), 2 (triangle), 1 (box).
double filter_width(FilterKind kind, double width);

#endif
