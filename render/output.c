// SPDX-License-Identifier: Apache-2.0
// Paths of frames, headers, writing.
#include "render/output.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/cryptomatte.h"

enum { PATH_SIZE = 4096, MESSAGE_SIZE = 512 };

// Where in a pattern the frame's number goes.
typedef struct {
    size_t first, last; // replaced: [first, last)
    int width;
    bool is_found;
} NumberPlace;

// "#", or "%0Nd": its length, or 0 where the % begins something else.
static size_t number_length(const char *s, int *width) {
    if (*s == '#') {
        *width = (int)strspn(s, "#");
        return (size_t)*width;
    }
    size_t n = strspn(s + 1, "0123456789");
    *width = atoi(s + 1);
    return n >= 1 && n <= 3 && s[1] == '0' && s[1 + n] == 'd' ? n + 2 : 0;
}

static bool find_number(const char *pattern, NumberPlace *place) {
    *place = (NumberPlace){0};
    for (const char *s = pattern; *s;) {
        if (*s != '#' && *s != '%') {
            s++;
            continue;
        }
        int width;
        size_t length = number_length(s, &width);
        if (length == 0 || place->is_found) {
            return false;
        }
        place->first = (size_t)(s - pattern);
        place->last = place->first + length;
        place->width = width;
        place->is_found = true;
        s += length;
    }
    return true;
}

static size_t ending_of(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    return dot && dot != name ? (size_t)(dot - path) : strlen(path);
}

bool render_frame_path(const char *pattern, int64_t frame, bool many, char *path, size_t size) {
    NumberPlace place;
    if (!find_number(pattern, &place)) {
        return false;
    }
    int n;
    if (place.is_found) {
        n = snprintf(path, size, "%.*s%0*lld%s", (int)place.first, pattern, place.width,
                     (long long)frame, pattern + place.last);
    } else if (many) {
        size_t ending = ending_of(pattern);
        n = snprintf(path, size, "%.*s.%04lld%s", (int)ending, pattern, (long long)frame,
                     pattern + ending);
    } else {
        n = snprintf(path, size, "%s", pattern);
    }
    return n >= 0 && (size_t)n < size;
}

static bool refuse(const Reporter *reporter, const char *path, const char *why) {
    char message[PATH_SIZE + MESSAGE_SIZE + 32];
    snprintf(message, sizeof message, "cannot write '%s': %s", path, why);
    reporter->emit(reporter->context, 0, NULL, message);
    return false;
}

static bool frame_path(const RenderOptions *options, int64_t frame, const Reporter *reporter,
                       char path[PATH_SIZE]) {
    return render_frame_path(options->out, frame, options->n_frames > 1, path, PATH_SIZE) ||
           refuse(reporter, options->out,
                  "a pattern holds at most one number (#### or %04d), and 4095 bytes");
}

static size_t folder_length(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) : 0;
}

bool output_check(const RenderOptions *options, const Reporter *reporter) {
    char path[PATH_SIZE], checked[PATH_SIZE], message[MESSAGE_SIZE];
    for (uint32_t i = 0; i < options->n_frames; i++) {
        if (!frame_path(options, options->frames[i], reporter, path)) {
            return false;
        }
        // Thousands of frames in one folder are checked once.
        size_t folder = folder_length(path);
        if (i > 0 && folder == folder_length(checked) && !memcmp(path, checked, folder)) {
            continue;
        }
        if (!image_write_check(path, message, sizeof message)) {
            return refuse(reporter, path, message);
        }
        memcpy(checked, path, sizeof checked);
    }
    return true;
}

void render_rate(double fps, int32_t *numerator, uint32_t *denominator) {
    *numerator = 0;
    *denominator = 1;
    for (uint32_t d = 1; d <= 10010; d++) {
        double rounded = rint(fps * d);
        if (rounded > INT32_MAX) {
            break;
        }
        *numerator = (int32_t)rounded;
        *denominator = d;
        if (fabs(rounded / d - fps) < 1e-6) {
            break;
        }
    }
}

static ImageAttribute rate(const char *name, double fps) {
    ImageAttribute attribute = {.name = name, .kind = ATTRIBUTE_RATIONAL};
    render_rate(fps, &attribute.numerator, &attribute.denominator);
    return attribute;
}

static ImageAttribute text(const char *name, const char *value) {
    return (ImageAttribute){.name = name, .kind = ATTRIBUTE_STRING, .string = value ? value : ""};
}

static ImageAttribute number(const char *name, AttributeKind kind, double value) {
    return (ImageAttribute){.name = name, .kind = kind, .number = value};
}

static void add_header(const Scene *scene, const RenderOptions *options, int64_t frame,
                       Arena *arena, Image *image) {
    const ShutterSettings *shutter = &scene->shutter;
    const char *interval = arena_printf(arena, "%.17g to %.17g frame periods", shutter->open,
                                        shutter->open + shutter->length);
    const ImageAttribute attributes[] = {
        text("software", options->software ? options->software : "st4"),
        text("sceneHash", scene->hash),
        text("command", options->command_line),
        text("seed", arena_printf(arena, "%llu", (unsigned long long)options->seed)),
        text("shutter", interval),
        number("samples", ATTRIBUTE_INT, options->spp),
        number("frame", ATTRIBUTE_INT, (double)frame),
        number("expTime", ATTRIBUTE_FLOAT, shutter->length / scene->film.fps),
        rate("framesPerSecond", scene->film.fps),
    };
    image->n_attributes = sizeof attributes / sizeof *attributes;
    image->attributes = ARENA_ARRAY(arena, image->n_attributes, ImageAttribute);
    memcpy(image->attributes, attributes, sizeof attributes);
}

// Color, coverage and albedo; what is too bright for 16 bits is as bright as they can say.
static void use_halves(Image *image) {
    static const char *const names[] = {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B"};
    const float most = 65504;
    for (uint32_t c = 0; c < image->n_channels; c++) {
        ImageChannel *channel = &image->channels[c];
        for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
            channel->half |= strcmp(channel->name, names[k]) == 0;
        }
        for (size_t i = 0; channel->half && i < (size_t)image->width * image->height; i++) {
            channel->values[i] = channel->values[i] < most ? channel->values[i] : most;
        }
    }
}

bool output_write(const Scene *scene, const RenderOptions *options, const Film *film, int64_t frame,
                  const Reporter *reporter) {
    char path[PATH_SIZE], message[MESSAGE_SIZE];
    Arena arena = {0};
    Image image;
    film_image(film, &arena, &image);
    add_header(scene, options, frame, &arena, &image);
    cryptomatte_add(scene, film, &arena, &image);
    if (film->width < scene->film.width || film->height < scene->film.height) {
        image.crop =
            (ImageCrop){(int32_t)film->x, (int32_t)film->y, scene->film.width, scene->film.height};
    }
    image.compression = scene->film.compression;
    if (scene->film.half) {
        use_halves(&image);
    }
    bool is_written = frame_path(options, frame, reporter, path) &&
                      (image_write(path, &image, &scene->film, message, sizeof message) ||
                       refuse(reporter, path, message));
    arena_free(&arena);
    return is_written;
}
