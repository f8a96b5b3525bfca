// SPDX-License-Identifier: Apache-2.0
// Paths of frames, headers, writing.
#include "render/output.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/adaptive.h"
#include "render/cryptomatte.h"
#include "render/outfile.h"

// Settings that pictures depend on.
#define TRANSPARENT "transparent"
#define EXPOSURE    "exposure"
#define VIEW        "view"
#define HALF        "half"
#define COMPRESSION "compression"

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
    char message[OUTPUT_PATH_SIZE + OUTPUT_MESSAGE_SIZE + 32];
    snprintf(message, sizeof message, "cannot write '%s': %s", path, why);
    reporter->emit(reporter->context, 0, NULL, message);
    return false;
}

bool output_path(const RenderOptions *options, int64_t frame, const Reporter *reporter,
                 char path[OUTPUT_PATH_SIZE]) {
    return render_frame_path(options->out, frame, options->n_frames > 1, path, OUTPUT_PATH_SIZE) ||
           refuse(reporter, options->out,
                  "a pattern holds at most one number (#### or %04d), and 4095 bytes");
}

static size_t folder_length(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) : 0;
}

bool output_check_path(const char *path, char *message, size_t n) {
    OutFile file;
    if (!film_file_has_ending(path)) {
        return image_write_check(path, message, n);
    }
    if (!outfile_open(&file, path, message, n)) {
        return false;
    }
    outfile_abandon(&file);
    return true;
}

bool output_check(const RenderOptions *options, const Reporter *reporter) {
    char path[OUTPUT_PATH_SIZE], checked[OUTPUT_PATH_SIZE], message[OUTPUT_MESSAGE_SIZE];
    for (uint32_t i = 0; i < options->n_frames; i++) {
        if (!output_path(options, options->frames[i], reporter, path)) {
            return false;
        }
        // Thousands of frames in one folder are checked once.
        size_t folder = folder_length(path);
        if (i > 0 && folder == folder_length(checked) && !memcmp(path, checked, folder)) {
            continue;
        }
        if (!output_check_path(path, message, sizeof message)) {
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

static void copy_attributes(Arena *arena, const ImageAttribute *from, size_t n, ImageAttribute **to,
                            uint32_t *n_to) {
    *to = ARENA_ARRAY(arena, n, ImageAttribute);
    *n_to = (uint32_t)n;
    memcpy(*to, from, n * sizeof *from);
}

void output_describe(const Scene *scene, const RenderOptions *options, int64_t frame, Arena *arena,
                     FilmOrigin *origin) {
    const ShutterSettings *shutter = &scene->shutter;
    const FilmSettings *film = &scene->film;
    const char *interval = arena_printf(arena, "%.17g to %.17g frame periods", shutter->open,
                                        shutter->open + shutter->length);
    const ImageAttribute attributes[] = {
        text("software", options->software ? options->software : "st4"),
        text("sceneHash", scene->hash),
        text("command", options->command_line),
        text("seed", arena_printf(arena, "%llu", (unsigned long long)options->seed)),
        text("shutter", interval),
        number("samples", ATTRIBUTE_INT, 0), // known when the picture is written
        number("frame", ATTRIBUTE_INT, (double)frame),
        number("expTime", ATTRIBUTE_FLOAT, shutter->length / film->fps),
        rate("framesPerSecond", film->fps),
    };
    const ImageAttribute settings[] = {
        number("tolerance", ATTRIBUTE_FLOAT, options->tolerance),
        number("bake", ATTRIBUTE_INT, options->bake),
        number("adaptive", ATTRIBUTE_INT, options->is_adaptive),
        number(TRANSPARENT, ATTRIBUTE_INT, film->transparent),
        number(EXPOSURE, ATTRIBUTE_FLOAT, film->exposure),
        number(VIEW, ATTRIBUTE_INT, film->view),
        number(HALF, ATTRIBUTE_INT, film->half),
        number(COMPRESSION, ATTRIBUTE_INT, film->compression),
    };
    bool is_crop = options->crop_x1 > 0;
    uint32_t first = options->first_sample ? options->first_sample - 1 : 0;
    *origin = (FilmOrigin){
        .width = is_crop ? options->crop_x1 - options->crop_x0 : film->width,
        .height = is_crop ? options->crop_y1 - options->crop_y0 : film->height,
        .x = options->crop_x0,
        .y = options->crop_y0,
        .full_width = film->width,
        .full_height = film->height,
        .layers = film->layers | (options->is_adaptive ? FILM_HALVES : 0),
        .first = first,
        .n = (options->last_sample ? options->last_sample : options->spp) - first,
        .spp = options->spp,
    };
    origin->stops[STOP_NOISE] = arena_printf(arena, "noise %.15g", options->noise);
    origin->stops[STOP_SAMPLES] = arena_printf(arena, "samples %.15g", options->mean_spp);
    origin->stops[STOP_TIME] = arena_printf(arena, "time %.15g", options->seconds);
    copy_attributes(arena, attributes, sizeof attributes / sizeof *attributes, &origin->attributes,
                    &origin->n_attributes);
    copy_attributes(arena, settings, sizeof settings / sizeof *settings, &origin->settings,
                    &origin->n_settings);
}

static double setting(const FilmOrigin *origin, const char *name) {
    for (uint32_t i = 0; i < origin->n_settings; i++) {
        if (!strcmp(origin->settings[i].name, name)) {
            return origin->settings[i].number;
        }
    }
    return 0;
}

// One of an enumeration whose last is `last`: a file may say anything.
static unsigned word(const FilmOrigin *origin, const char *name, unsigned last) {
    double value = setting(origin, name);
    return value > 0 && value <= last ? (unsigned)value : 0;
}

// What an image takes of them.
static FilmSettings picture_settings(const FilmOrigin *origin) {
    return (FilmSettings){
        .transparent = setting(origin, TRANSPARENT) != 0,
        .exposure = setting(origin, EXPOSURE),
        .view = word(origin, VIEW, VIEW_RAW),
        .half = setting(origin, HALF) != 0,
        .compression = word(origin, COMPRESSION, COMPRESSION_NONE),
    };
}

// What makes the same picture again: where a bound on time or samples ended it, the samples that
// were taken by then.
static const char *adaptive_command(Arena *arena, const FilmOrigin *origin, const char *command) {
    return origin->stopped == origin->stops[STOP_NOISE]
               ? arena_printf(arena, "%s --%s", command, origin->stopped)
               : arena_printf(arena, "%s --noise 0 --spp %.15g", command,
                              (double)origin->level / LEVEL_SAMPLE);
}

// The origin's attributes, with how many samples there are.
static void add_header(const FilmOrigin *origin, Arena *arena, Image *image) {
    copy_attributes(arena, origin->attributes, origin->n_attributes, &image->attributes,
                    &image->n_attributes);
    const double level = (double)origin->level / LEVEL_SAMPLE;
    for (uint32_t i = 0; i < image->n_attributes; i++) {
        ImageAttribute *a = &image->attributes[i];
        if (!strcmp(a->name, "samples")) {
            *a = origin->stopped ? number("samples", ATTRIBUTE_FLOAT, level)
                                 : number("samples", ATTRIBUTE_INT, origin->n);
        } else if (!strcmp(a->name, "command")) {
            a->string = origin->stopped ? adaptive_command(arena, origin, a->string)
                                        : arena_printf(arena, "%s --spp %u", a->string, origin->n);
        }
    }
}

// With what was reached, of a film in halves that is finished.
static void add_reached(const FilmOrigin *origin, Arena *arena, Image *image) {
    ImageAttribute *attributes = ARENA_ARRAY(arena, image->n_attributes + 2, ImageAttribute);
    if (origin->stopped) {
        memcpy(attributes, image->attributes, image->n_attributes * sizeof *attributes);
        attributes[image->n_attributes++] = number("noise", ATTRIBUTE_FLOAT, origin->noise);
        attributes[image->n_attributes++] = text("stopped", origin->stopped);
        image->attributes = attributes;
    }
}

static bool is_part(const FilmOrigin *origin) {
    return origin->width < origin->full_width || origin->height < origin->full_height;
}

static ImageCrop crop_of(const FilmOrigin *origin) {
    return is_part(origin) ? (ImageCrop){(int32_t)origin->x, (int32_t)origin->y, origin->full_width,
                                         origin->full_height}
                           : (ImageCrop){0};
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

bool output_write(const char *path, const Film *film, const FilmOrigin *origin, char *message,
                  size_t n) {
    if (film_file_has_ending(path)) {
        return film_file_write(path, film, origin, message, n);
    }
    Arena arena = {0};
    Image image;
    const FilmSettings settings = picture_settings(origin);
    film_image(film, &arena, &image);
    add_header(origin, &arena, &image);
    add_reached(origin, &arena, &image);
    cryptomatte_add(origin->names, film, &arena, &image);
    image.crop = crop_of(origin);
    image.compression = settings.compression;
    if (settings.half) {
        use_halves(&image);
    }
    bool is_written = image_write(path, &image, &settings, message, n);
    arena_free(&arena);
    return is_written;
}

// What the picture shows follows from the rest, and is not known before it is rendered.
static void drop_names(Image *image) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < image->n_attributes; i++) {
        const ImageAttribute *a = &image->attributes[i];
        if (strncmp(a->name, CRYPTOMATTE_PREFIX, strlen(CRYPTOMATTE_PREFIX)) != 0) {
            image->attributes[n++] = *a;
        }
    }
    image->n_attributes = n;
}

// Whether a picture of a film in halves was ended by a bound that this one has too.
static bool has_stop(const Image *found, const FilmOrigin *origin) {
    bool has_one = false;
    for (uint32_t i = 0; i < found->n_attributes; i++) {
        const ImageAttribute *a = &found->attributes[i];
        for (int k = 0; k < RENDER_STOPS && !strcmp(a->name, "stopped"); k++) {
            has_one |= a->kind == ATTRIBUTE_STRING && strcmp(a->string, origin->stops[k]) == 0;
        }
    }
    return has_one;
}

static bool picture_is_made(Arena *arena, const char *path, const FilmOrigin *origin) {
    char message[OUTPUT_MESSAGE_SIZE];
    Image found, wanted = {0};
    FilmDifference difference;
    ImageCrop crop = crop_of(origin);
    add_header(origin, arena, &wanted);
    if (!image_read_exr_header(arena, path, &found, message, sizeof message)) {
        return false;
    }
    drop_names(&found);
    bool is_adaptive = origin->layers & FILM_HALVES;
    return (!is_adaptive || has_stop(&found, origin)) && found.width == origin->width &&
           found.height == origin->height && found.crop.x == crop.x && found.crop.y == crop.y &&
           found.crop.width == crop.width && found.crop.height == crop.height &&
           film_attributes_agree(arena, found.attributes, found.n_attributes, wanted.attributes,
                                 wanted.n_attributes, !is_adaptive, &difference);
}

static bool sums_are_made(Arena *arena, const char *path, const FilmOrigin *origin) {
    char message[OUTPUT_MESSAGE_SIZE];
    FilmOrigin found;
    FilmDifference difference;
    return film_file_read_origin(arena, path, &found, message, sizeof message) &&
           found.first == origin->first && found.n == origin->n && found.spp == origin->spp &&
           film_origin_agrees(arena, &found, origin, &difference);
}

bool output_is_made(const char *path, const FilmOrigin *origin) {
    Arena arena = {0};
    bool is_made = film_file_has_ending(path) ? sums_are_made(&arena, path, origin)
                                              : picture_is_made(&arena, path, origin);
    arena_free(&arena);
    return is_made;
}
