// SPDX-License-Identifier: Apache-2.0
// The channels of two images that are compared with each other, for the files that do so.
#ifndef RENDER_COMPARE_PAIR_H
#define RENDER_COMPARE_PAIR_H

#include "render/compare.h"

typedef struct {
    const ImageChannel *a[COMPARE_CHANNELS], *b[COMPARE_CHANNELS];
    size_t n_channels; // >= 1
    uint32_t width, height;
    bool is_color; // red, green, blue in this order
} ComparePair;

// layer as for compare_images. False with a sentence in message[n].
bool compare_pair(const Image *a, const Image *b, const char *layer, ComparePair *pair,
                  char *message, size_t n);

// False with a sentence where a value of either is not finite.
bool compare_pair_is_finite(const ComparePair *pair, char *message, size_t n);

#endif
