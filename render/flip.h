// SPDX-License-Identifier: Apache-2.0
// FLIP: how large the difference is that an observer sees who flips between two pictures.
//
// Pontus Andersson, Jim Nilsson, Tomas Akenine-Moeller, Magnus Oskarsson, Kalle Astroem and Mark
// Fairchild, FLIP: A Difference Evaluator for Alternating Images (2020), for pictures on a display;
// Pontus Andersson, Jim Nilsson, Peter Shirley and Tomas Akenine-Moeller, Visualizing Errors in
// Rendered High Dynamic Range Images (2021), for linear light of any range: the largest FLIP over
// n = max(2, ceil(stops)) exposures, from the one that brings the brightest pixel of the reference
// to 0.85 behind the ACES curve to the one that does so with its median. A median below 2^-16 of
// the brightest counts as that.
//
// Errors are in [0, 1] for each pixel, 0 where nothing is to be seen; equal even fields of pure
// green and pure blue are 1 apart. Beyond its border a picture goes on as its last pixel.
#ifndef RENDER_FLIP_H
#define RENDER_FLIP_H

#include <stdint.h>

// Of a display 0.7 m wide with 3840 pixels, seen from 0.7 m: pixels per degree, 3840 pi / 180.
#define FLIP_PIXELS_PER_DEGREE 67.0206432765823

// R, G, B in linear light, each [height][width], finite.
typedef struct {
    const float *planes[3];
    uint32_t width, height;
} FlipImage;

// The mean error over all pixels, both of one size. map: NULL, or [height][width] for the errors.
// Values are clipped to [0, 1] first. pixels_per_degree in [1, 400]: more counts as 400.
double flip_ldr(const FlipImage *test, const FlipImage *reference, double pixels_per_degree,
                float *map);

// The same over exposures; values below 0 are clipped. Costs n flip_ldr. A black reference is taken
// as it is, by one exposure of 0.
double flip_hdr(const FlipImage *test, const FlipImage *reference, double pixels_per_degree,
                float *map);

#endif
