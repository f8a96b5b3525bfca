// SPDX-License-Identifier: Apache-2.0
// Image files: which reader or writer, the shared object behind the formats that are not EXR.
#include "render/image.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "render/display.h"
#include "render/image_oiio.h"
#include "render/outfile.h"
#include "render/plugin.h"

#define LIBRARY "st4-image.so"

// What can be written in 8 bits, beside EXR.
static const char *const formats[] = {"png", "jpg", "jpeg", "tif", "tiff", "bmp", "tga", "webp"};
enum { N_FORMATS = sizeof formats / sizeof formats[0] };

const ImageChannel *image_channel(const Image *image, const char *name) {
    for (uint32_t i = 0; i < image->n_channels; i++) {
        if (strcmp(image->channels[i].name, name) == 0) {
            return &image->channels[i];
        }
    }
    return NULL;
}

bool image_library_is_loaded(void) {
    return plugin_is_loaded(LIBRARY);
}

// "" where there is none.
static const char *ending(const char *path) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    return dot ? dot + 1 : "";
}

bool image_is_exr(const char *path) {
    return strcasecmp(ending(path), "exr") == 0;
}

// Channels missing come as an error; the colour of an image with alpha is divided by it, since
// 8-bit formats want it so, before the curve.
bool image_bytes(const Image *image, const FilmSettings *film, uint8_t *bytes, char *message,
                 size_t n) {
    const bool alpha = film->transparent;
    static const char *const names[4] = {"R", "G", "B", "A"};
    const float *values[4];
    size_t n_channels = alpha ? 4 : 3, n_pixels = (size_t)image->width * image->height;
    for (size_t c = 0; c < n_channels; c++) {
        const ImageChannel *channel = image_channel(image, names[c]);
        if (!channel) {
            snprintf(message, n, "the image has no channel %s", names[c]);
            return false;
        }
        values[c] = channel->values;
    }
    Display display;
    display_init(&display, film->view, film->exposure);
    for (size_t i = 0; i < n_pixels; i++, bytes += n_channels) {
        double a = alpha ? (double)values[3][i] : 1, gain = a > 0 ? 1 / a : 0, color[3];
        for (size_t c = 0; c < 3; c++) {
            color[c] = (double)values[c][i] * gain;
        }
        display_color(&display, color, bytes);
        if (alpha) {
            bytes[3] = (uint8_t)(255 * (a > 0 ? fmin(a, 1) : 0) + 0.5);
        }
    }
    return true;
}

// Where the bytes of a picture go.
typedef struct {
    const char *path;
    char *message;
    size_t n;
} Target;

static bool write_file(void *context, const void *bytes, size_t size) {
    const Target *to = context;
    OutFile file;
    return outfile_open(&file, to->path, to->message, to->n) &&
           outfile_write(&file, bytes, size, to->message, to->n) &&
           outfile_commit(&file, to->message, to->n);
}

static bool write_bytes(const char *path, const char *format, const uint8_t *bytes,
                        const Image *image, uint32_t n_channels, char *message, size_t n) {
    const ImageOiio *library = plugin_symbol(LIBRARY, "image_oiio", message, n);
    if (!library) {
        return false;
    }
    char why[256] = "";
    message[0] = '\0';
    Target to = {path, message, n};
    if (library->write(format, bytes, image->width, image->height, n_channels, write_file, &to, why,
                       sizeof why)) {
        return true;
    }
    if (!message[0]) { // not the file's fault
        snprintf(message, n, "cannot write: %s", why);
    }
    return false;
}

static const char *find_format(const char *path, char *message, size_t n) {
    for (size_t i = 0; i < N_FORMATS; i++) {
        if (strcasecmp(ending(path), formats[i]) == 0) {
            return formats[i];
        }
    }
    int at = snprintf(message, n, "the name's ending is none of .exr");
    for (size_t i = 0; i < N_FORMATS && at > 0 && (size_t)at < n; i++) {
        at += snprintf(message + at, n - (size_t)at, ", .%s", formats[i]);
    }
    return NULL;
}

bool image_write_check(const char *path, char *message, size_t n) {
    if (!image_is_exr(path) &&
        (!find_format(path, message, n) || !plugin_symbol(LIBRARY, "image_oiio", message, n))) {
        return false;
    }
    OutFile file;
    if (!outfile_open(&file, path, message, n)) {
        return false;
    }
    outfile_abandon(&file);
    return true;
}

bool image_write(const char *path, const Image *image, const FilmSettings *film, char *message,
                 size_t n) {
    if (image_is_exr(path)) {
        return image_write_exr(path, image, message, n);
    }
    const char *format = find_format(path, message, n);
    if (!format) {
        return false;
    }
    uint32_t n_channels = film->transparent ? 4 : 3;
    uint8_t *bytes = malloc((size_t)image->width * image->height * n_channels);
    if (!bytes) {
        snprintf(message, n, "cannot write: %s", strerror(ENOMEM));
        return false;
    }
    bool done = image_bytes(image, film, bytes, message, n) &&
                write_bytes(path, format, bytes, image, n_channels, message, n);
    free(bytes);
    return done;
}

// From interleaved values to planes, linear, multiplied by alpha: as in EXR files.
static void spread(Image *image, const ImageOiioInfo *info, const float *values) {
    size_t n_pixels = (size_t)info->width * info->height;
    const ImageChannel *alpha = image_channel(image, "A");
    for (uint32_t c = 0; c < info->n_channels; c++) {
        ImageChannel *channel = &image->channels[c];
        bool is_colour = channel != alpha;
        for (size_t i = 0; i < n_pixels; i++) {
            float v = values[i * info->n_channels + c];
            channel->values[i] =
                is_colour && info->is_srgb ? (float)display_linear_from_srgb((double)v) : v;
        }
    }
    for (uint32_t c = 0; alpha && info->is_unassociated && c < info->n_channels; c++) {
        ImageChannel *channel = &image->channels[c];
        for (size_t i = 0; channel != alpha && i < n_pixels; i++) {
            channel->values[i] *= alpha->values[i];
        }
    }
}

static bool read_file(Arena *arena, const ImageOiio *library, ImageOiioFile *file,
                      const ImageOiioInfo *info, Image *image, char *message, size_t n) {
    size_t n_pixels = (size_t)info->width * info->height;
    float *values = malloc(n_pixels * info->n_channels * sizeof *values);
    if (!values) {
        snprintf(message, n, "cannot read: %s", strerror(ENOMEM));
        return false;
    }
    bool done = library->read(file, values, message, n);
    if (done) {
        *image = (Image){info->width, info->height, .n_channels = info->n_channels};
        image->channels = ARENA_ARRAY(arena, info->n_channels, ImageChannel);
        for (uint32_t c = 0; c < info->n_channels; c++) {
            const char *name = library->channel_name(file, c);
            image->channels[c].name = arena_string(arena, name, strlen(name));
            image->channels[c].values = ARENA_ARRAY(arena, n_pixels, float);
        }
        spread(image, info, values);
    }
    free(values);
    return done;
}

bool image_read(Arena *arena, const char *path, Image *image, char *message, size_t n) {
    if (image_is_exr(path)) {
        return image_read_exr(arena, path, image, message, n);
    }
    *image = (Image){0};
    struct stat s;
    if (stat(path, &s) != 0) {
        snprintf(message, n, "cannot read: %s", strerror(errno));
        return false;
    }
    if (!S_ISREG(s.st_mode)) {
        snprintf(message, n, "cannot read: not a regular file");
        return false;
    }
    const ImageOiio *library = plugin_symbol(LIBRARY, "image_oiio", message, n);
    ImageOiioInfo info;
    char why[256] = "";
    ImageOiioFile *file = library ? library->open(path, &info, why, sizeof why) : NULL;
    if (!file) {
        if (library) {
            snprintf(message, n, "cannot read: %s", why);
        }
        return false;
    }
    bool done = read_file(arena, library, file, &info, image, message, n);
    library->close(file);
    return done;
}
