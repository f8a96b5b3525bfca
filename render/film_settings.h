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
    FILTER_BLACKMAN_HARRIS, // the default
    FILTER_BOX,
    FILTER_TRIANGLE,
    FILTER_GAUSSIAN,
} FilterKind;

// How 8-bit pictures are made from linear light; see render/display.h.
typedef enum { VIEW_SRGB, VIEW_NEUTRAL, VIEW_RAW } ViewKind;

// How the pixels of an EXR are packed, all without loss.
typedef enum {
    COMPRESSION_ZIP,
    COMPRESSION_ZIPS,
    COMPRESSION_PIZ,
    COMPRESSION_RLE,
    COMPRESSION_NONE,
} Compression;

typedef struct {
    uint32_t width, height;          // 1..65536
    double fps;                      // > 0
    int64_t first_frame, last_frame; // inclusive, frame 1 begins at t = 0
    const char *out;                 // pattern of the output's path, or NULL
    FilterKind filter;
    double filter_width; // pixels; 0: the filter's usual one
    bool transparent;    // the sky is not part of the picture
    double exposure;     // stops, for 8-bit pictures only
    ViewKind view;
    bool half; // EXR: color, coverage and albedo in 16 bits
    Compression compression;
    uint32_t layers; // a set
} FilmSettings;

#endif
