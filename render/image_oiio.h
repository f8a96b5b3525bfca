// SPDX-License-Identifier: Apache-2.0
// The C face of OpenImageIO: what st4-image.so exports, one table of functions under the name
// image_oiio. No exception leaves it. Pixels are interleaved, first row on top.
#ifndef RENDER_IMAGE_OIIO_H
#define RENDER_IMAGE_OIIO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct ImageOiioFile ImageOiioFile;
typedef struct ImageOiioTexture ImageOiioTexture;

typedef struct {
    uint32_t width, height, n_channels;
    bool is_srgb;         // the values of the colour channels are on the sRGB curve
    bool is_unassociated; // the colour channels are not multiplied by alpha
} ImageOiioInfo;

// Takes the bytes of a file, all at once. False: the writer fails as well.
typedef bool ImageOiioSink(void *context, const void *bytes, size_t size);

typedef struct {
    // pixels: [height][width][n_channels], n_channels 3 or 4 (the fourth is alpha, by which the
    // others are not multiplied), sRGB. format: "png", "jpg", ... Into memory, then to the sink:
    // the libraries behind some formats take a full disk for success, or exit.
    bool (*write)(const char *format, const uint8_t *pixels, uint32_t width, uint32_t height,
                  uint32_t n_channels, ImageOiioSink *sink, void *context, char *message, size_t n);
    // NULL with a message on failure; else close() it.
    ImageOiioFile *(*open)(const char *path, ImageOiioInfo *info, char *message, size_t n);
    const char *(*channel_name)(const ImageOiioFile *file, uint32_t channel);
    // values: [height][width][n_channels]; integers come as 0..1.
    bool (*read)(ImageOiioFile *file, float *values, char *message, size_t n);
    void (*close)(ImageOiioFile *file);

    // The texture system is made by the first of these; NULL with a message on failure. The same
    // file gives the same texture, which is never closed.
    ImageOiioTexture *(*open_texture)(const char *path, bool is_raw, char *message, size_t n);
    // at: s t, t upwards, then how both change along the sides of what is looked at: ds dt, ds dt.
    // From any thread. What can not be read is black.
    void (*look_up)(ImageOiioTexture *texture, const float at[6], float rgba[4]);
    void (*set_texture_memory)(size_t bytes); // nothing where there is no texture system
} ImageOiio;

#ifdef __cplusplus
extern "C" {
#endif
extern const ImageOiio image_oiio;
#ifdef __cplusplus
}
#endif

#endif
