// SPDX-License-Identifier: Apache-2.0
// Structural similarity: whether two pictures have the same local means, contrasts and structures.
//
// Zhou Wang, Alan Bovik, Hamid Sheikh and Eero Simoncelli, Image Quality Assessment: From Error
// Visibility to Structural Similarity (2004), equation 13 with C1 = (0.01 range)^2 and C2 = (0.03
// range)^2, in windows of 11x11 values weighted by a Gaussian of standard deviation 1.5 pixels, the
// variances those of the window as a population. The mean is over all windows that lie within the
// picture. That is scikit-image's structural_similarity(..., gaussian_weights=True, sigma=1.5,
// use_sample_covariance=False).
#ifndef RENDER_SSIM_H
#define RENDER_SSIM_H

#include <stdint.h>

enum { SSIM_WINDOW = 11 };

// a, b: [height][width], finite, may be the same; width, height >= SSIM_WINDOW; range > 0: between
// the least and the greatest value that the kind of picture can have. In [-1, 1], 1 where equal.
double ssim_mean(const float *a, const float *b, uint32_t width, uint32_t height, double range);

#endif
