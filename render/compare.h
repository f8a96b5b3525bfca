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

// layer: a channel of that name, or all channels "layer.*" (at most COMPARE_CHANNELS); NULL: R, G
// and B. False with one sentence in message[n] when the images cannot be compared: sizes differ, a
// channel is missing in one of them, or nothing is finite in both.
enum { COMPARE_CHANNELS = 16 };
bool compare_images(const Image *a, const Image *b, const char *layer, Comparison *result,
                    char *message, size_t n);

// The layers of an image, for the above: "" (R, G, B and A), then all others, each once, in the
// order of the channels. From the arena; *n gets how many.
const char *const *compare_layers(Arena *arena, const Image *image, uint32_t *n);

// The error of renderings, split into the part that their noise is and the part that more samples
// would not remove. All pictures are independent of each other: other seeds.
typedef struct {
    double mean;        // of the reference
    double noise;       // standard deviation of a value of one rendering
    double bias_square; // an estimate without bias of its own: near 0 it may be negative
    double bias_error;  // standard error of bias_square, for pixels that are independent
    double
        noise_of_ref; // standard deviation of the reference; NaN: one picture alone does not tell
} ErrorParts;

// a: n >= 2 renderings with the same settings. b: one reference, or two halves of it, whose noise
// then drops out of the bias, since products of independent noises are 0 in the mean. Values that
// are not finite anywhere are left out. False as for compare_images, which see for the layer.
bool compare_parts(const Image *a, uint32_t n, const Image *b, uint32_t n_b, const char *layer,
                   ErrorParts *parts, char *message, size_t size);

// What an observer sees of the difference, b the reference.
typedef struct {
    double ssim;     // render/ssim.h, mean over the channels; NaN: less than 11 pixels
    double flip;     // render/flip.h, for colors only, else NaN
    double hdr_flip; // NaN unless asked for
} Perceived;

// Colors (R, G, B, or "layer.R", ".G", ".B") are taken as displayed, clipped to [0, 1]; for SSIM
// behind the curve of sRGB. Other channels are compared by SSIM alone, over the range of the
// reference. map: NULL, or [height][width] for FLIP's errors. False with one sentence when that
// cannot be done, as for compare_images, and where a value is not finite.
bool compare_perceived(const Image *a, const Image *b, const char *layer, bool wants_hdr,
                       Perceived *result, float *map, char *message, size_t n);

// The difference a - b of a layer, for image_write: channels named as b's, whose names it borrows.
// False as for compare_images.
bool compare_difference(Arena *arena, const Image *a, const Image *b, const char *layer,
                        Image *difference, char *message, size_t n);

// How the error d = a - b of a film changes from frame to frame: a steady one is seen as a wrong
// picture, a changing one as flicker.
typedef struct {
    uint32_t n_frames;
    double deviation; // root mean square over values of the standard deviation of d over the frames
    double change;    // root mean square of d(frame) - d(frame before); 0 for less than 2 frames
    double last_change; // the same, between the last two frames alone
    double mean_b;
} Flicker;

typedef struct FlickerSum FlickerSum;
FlickerSum *flicker_new(Arena *arena);
// The next frame. False as for compare_images, where its size is not that of the frames before, and
// where a value is not finite.
bool flicker_add(FlickerSum *sum, const Image *a, const Image *b, const char *layer, char *message,
                 size_t n);
Flicker flicker_result(const FlickerSum *sum);

#endif
