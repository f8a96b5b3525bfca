// SPDX-License-Identifier: Apache-2.0
// How far an image is from a reference, in numbers.
//
// With d = a - b over all values of the compared channels that are finite in both images, b the
// reference, and mean() over those values:
//   mse            mean(d^2)
//   rmse           sqrt(mse)
//   relative_mse   mean(d^2 / (b^2 + 0.01 mean(b)^2)): each error against the brightness where it
//                  lies; the second term keeps black pixels from ruling the sum. The customary
//                  measure for rendered images (Fabrice Rousselle et al., Adaptive Sampling and
//                  Reconstruction using Greedy Error Minimization, 2011), whose constant 0.01 is
//                  here in units of the reference's own brightness, so that exposure cancels.
//   relative_rmse  rmse / |mean(b)|
//   psnr           10 log10(1 / mse), in decibels: the peak is 1
//   maximum        max |d|, and where: the first in order of rows, then columns, then channels
// 0/0 counts as 0 throughout.
#ifndef RENDER_COMPARE_H
#define RENDER_COMPARE_H

#include "render/image.h"

typedef struct {
    uint64_t n_values;       // compared: finite in both
    uint64_t n_not_finite_a; // values of the first image that are infinite or no number
    uint64_t n_not_finite_b; // of the second
    uint64_t n_different;    // of the compared, those with d != 0
    double mean_a, mean_b;
    double mse, rmse, relative_mse, relative_rmse, psnr;
    double maximum;
    uint32_t maximum_x, maximum_y; // the pixel, row 0 on top
    const char *maximum_channel;   // belongs to the first image; NULL while the maximum is 0
} Comparison;

// channel: the one to compare; NULL: R, G and B. False with one sentence in message[n] when the
// images cannot be compared: sizes differ, a channel is missing, or nothing is finite in both.
bool compare_images(const Image *a, const Image *b, const char *channel, Comparison *result,
                    char *message, size_t n);

#endif
