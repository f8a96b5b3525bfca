// SPDX-License-Identifier: Apache-2.0
// The sky as a picture of all directions, equirectangular: its first row is up (+y), its middle
// lies towards -z, and +x is to the right of it. Between the middles of pixels it is linear.
//
// Directions are drawn in proportion to luminance above its mean over the sphere, by inverting the
// distribution of rows and then of columns. What is below the mean is left to reflected rays, which
// find it as well (Karlik et al., "MIS compensation: optimizing sampling techniques in multiple
// importance sampling", 2019): a sky of one colour is not sampled at all.
#ifndef RENDER_SKY_IMAGE_H
#define RENDER_SKY_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"
#include "accel/vec.h"

typedef struct {
    uint32_t width, height;
    const float *rgb;     // [height][width][3], linear, finite, >= 0
    const double *rows;   // [height + 1]: distribution of rows, 0..1; NULL: it is not sampled
    const float *columns; // [height][width + 1]: within each row, 0..1
} SkyImage;

// By render/image.h: 8-bit files are taken to be on the sRGB curve, EXR and HDR to be linear.
// What is negative or not finite counts as 0. False with one sentence in message[n], without the
// file's name.
bool sky_image_read(Arena *arena, const char *path, SkyImage *image, char *message, size_t n);

// From values as they are; rgb is kept, and changed where it is no radiance.
SkyImage sky_image_from(Arena *arena, float *rgb, uint32_t width, uint32_t height);

// dir is unit, in the image's own space.
void sky_image_radiance(const SkyImage *image, Vec3 dir, double rgb[3]);

// Only where image->rows is there; u, v in [0, 1). density: per steradian, > 0.
Vec3 sky_image_sample(const SkyImage *image, double u, double v, double *density);
double sky_image_density(const SkyImage *image, Vec3 dir);

#endif
