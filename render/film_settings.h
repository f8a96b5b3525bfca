// SPDX-License-Identifier: Apache-2.0
// What a scene says of its film: plain values, known before the first ray.
#ifndef RENDER_FILM_SETTINGS_H
#define RENDER_FILM_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

// Layers of the picture besides its colour and coverage; sets of them are 1 << LAYER_...
typedef enum {
#define LAYER(id, name, channels, help) LAYER_##id,
#include "render/layers.def"
#undef LAYER
    LAYER_COUNT
} Layer;

// Where nothing is said of layers.
#define LAYERS_DEFAULT (1u << LAYER_Z | 1u << LAYER_NORMAL | 1u << LAYER_SAMPLES)

// Over how much of its neighbourhood a pixel is averaged.
typedef enum {
    FILTER_BLACKMAN_HARRIS, // the default: a bell 3 pixels wide
    FILTER_BOX,             // the pixel's own square
} FilterKind;

typedef struct {
    uint32_t width, height;          // 1..65536
    double fps;                      // > 0
    int64_t first_frame, last_frame; // inclusive, frame 1 begins at t = 0
    const char *out;                 // pattern of the output's path, or NULL
    FilterKind filter;
    bool transparent; // the sky is not part of the picture
    double exposure;  // stops, for 8-bit pictures only
    uint32_t layers;  // a set
} FilmSettings;

#endif
