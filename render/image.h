// SPDX-License-Identifier: Apache-2.0
// Image files. EXR by OpenEXRCore, here; everything else by OpenImageIO, behind one C++ file that
// is a shared object of its own (st4-image.so) and is loaded at the first use: linked in, it would
// cost a quarter of a second and 130 MB at every start.
#ifndef RENDER_IMAGE_H
#define RENDER_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"
#include "render/film_settings.h"

typedef struct {
    const char *name; // "R", "Z", "normal.X", ...
    float *values;    // [height][width], first row on top
    bool half;        // stored in 16 bits
} ImageChannel;

typedef enum { ATTRIBUTE_STRING, ATTRIBUTE_INT, ATTRIBUTE_FLOAT, ATTRIBUTE_RATIONAL } AttributeKind;

typedef struct {
    const char *name;
    AttributeKind kind;
    const char *string;
    double number;     // INT, FLOAT
    int32_t numerator; // RATIONAL
    uint32_t denominator;
} ImageAttribute;

// Where it is a part of a larger picture, that one's size and its own corner in it; else 0.
typedef struct {
    int32_t x, y;
    uint32_t width, height;
} ImageCrop;

typedef struct {
    uint32_t width, height;
    uint32_t n_channels, n_attributes;
    ImageChannel *channels;
    ImageAttribute *attributes;
    ImageCrop crop;
    Compression compression;
} Image;

// All functions: false with one sentence in message[n], without the file's name.
// Files are written under a temporary name in the same folder, synced, and renamed.

// By its ending.
bool image_is_exr(const char *path);

// One part, scan lines. Of a crop the data window is the crop, the display window the picture.
bool image_write_exr(const char *path, const Image *image, char *message, size_t n);
bool image_read_exr(Arena *arena, const char *path, Image *image, char *message, size_t n);
// Size and attributes alone.
bool image_read_exr_header(Arena *arena, const char *path, Image *image, char *message, size_t n);

// By the path's ending: .exr as above, else 8-bit PNG, TIFF, JPEG... of the channels R, G, B (and A
// where the film is transparent), by the film's view and exposure.
bool image_write(const char *path, const Image *image, const FilmSettings *film, char *message,
                 size_t n);

// The bytes of such a picture, R G B (and A) by pixel: bytes[height][width][3 or 4].
bool image_bytes(const Image *image, const FilmSettings *film, uint8_t *bytes, char *message,
                 size_t n);

// Whether image_write can be expected to work: the ending is known, its library can be loaded, the
// folder takes files. To be asked before hours of rendering.
bool image_write_check(const char *path, char *message, size_t n);
// .exr as above, else by OpenImageIO, sRGB to linear for 8-bit files.
bool image_read(Arena *arena, const char *path, Image *image, char *message, size_t n);

const ImageChannel *image_channel(const Image *image, const char *name); // NULL: none

// True once the shared object is in memory: for the test that plain runs never load it.
bool image_library_is_loaded(void);

#endif
