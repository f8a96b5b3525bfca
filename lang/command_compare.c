// SPDX-License-Identifier: Apache-2.0
// st4 compare: how much a picture differs from a reference, or a film from another.
#include "lang/command_compare.h"

#include <math.h>
#include <string.h>

#include "render/render.h"

enum { PATH_SIZE = 4096, MESSAGE = 512 };

typedef struct {
    Arena *arena;
    const Options *options;
    Metric metric;
    CompareReport report;
    size_t capacity; // of the report's records
    FlickerSum *flicker;
    bool is_uneven; // one picture has values that are no number where the other has some
} Run;

static int refuse(const char *a, const char *b, const char *message) {
    fprintf(stderr, "st4: error: %s%s%s: %s\n", a, b ? " and " : "", b ? b : "", message);
    return STATUS_FILES;
}

// Values that are no number in one picture alone are a difference that no mean shows.
static void warn_not_finite(Run *run, const CompareRecord *record) {
    const Comparison *result = &record->numbers;
    if (result->n_not_finite_a || result->n_not_finite_b) {
        fprintf(stderr, "st4: warning: %llu and %llu values are not finite and were left out\n",
                (unsigned long long)result->n_not_finite_a,
                (unsigned long long)result->n_not_finite_b);
    }
    run->is_uneven |= result->n_not_finite_a != result->n_not_finite_b;
}

static bool is_perceived(Metric metric) {
    return metric == METRIC_SSIM || metric == METRIC_FLIP || metric == METRIC_HDRFLIP;
}

// What is seen takes longer than all the numbers, so -q asks for it only where it prints it.
static bool wants_seen(const Run *run) {
    return is_perceived(run->metric) || !option_flag(run->options, OPTION_QUIET);
}

// ---- Pictures of differences

// Black, red, yellow, white, in linear light: what is brighter is worse.
static void heat(float error, float rgb[3]) {
    float x = 3 * error;
    for (int c = 0; c < 3; c++) {
        float v = x - (float)c;
        rgb[c] = v > 0 ? v < 1 ? v : 1 : 0;
    }
}

// In place of the differences, three channels of color: the errors in map.
static void make_heat(Arena *arena, const float *map, Image *image) {
    static const char *const names[3] = {"R", "G", "B"};
    const size_t n = (size_t)image->width * image->height;
    image->n_channels = 3;
    image->channels = ARENA_ARRAY(arena, 3, ImageChannel);
    for (int c = 0; c < 3; c++) {
        image->channels[c] = (ImageChannel){names[c], ARENA_ARRAY(arena, n, float), false};
    }
    for (size_t i = 0; i < n; i++) {
        float rgb[3];
        heat(map[i], rgb);
        for (int c = 0; c < 3; c++) {
            image->channels[c].values[i] = rgb[c];
        }
    }
}

// Of what has no FLIP: the largest difference of a pixel, against the largest of all.
static const float *relative_map(Arena *arena, const Image *difference) {
    const size_t n = (size_t)difference->width * difference->height;
    float *map = ARENA_ARRAY(arena, n, float), most = 0;
    for (size_t i = 0; i < n; i++) {
        for (uint32_t c = 0; c < difference->n_channels; c++) {
            float d = fabsf(difference->channels[c].values[i]);
            map[i] = isfinite(d) && d > map[i] ? d : map[i];
        }
        most = map[i] > most ? map[i] : most;
    }
    for (size_t i = 0; i < n && most > 0; i++) {
        map[i] /= most;
    }
    return map;
}

static int write_difference(const Run *run, Arena *arena, const Image *a, const Image *b,
                            const CompareRecord *record, float *map) {
    const char *pattern = run->options->values[OPTION_DIFF].text;
    char path[PATH_SIZE], message[MESSAGE];
    Image image;
    if (!render_frame_path(pattern, record->frame, run->report.is_film, path, sizeof path)) {
        return refuse(pattern, NULL, "not a pattern: one run of #, or one %04d is expected");
    }
    if (!compare_difference(arena, a, b, record->layer, &image, message, sizeof message)) {
        return refuse(record->a_path, record->b_path, message);
    }
    if (!image_is_exr(path)) {
        make_heat(arena, isnan(record->seen.flip) ? relative_map(arena, &image) : map, &image);
    }
    return image_write(path, &image, &(FilmSettings){0}, message, sizeof message)
               ? STATUS_OK
               : refuse(path, NULL, message);
}

// ---- Numbers

static const char *keep(Run *run, const char *text) {
    return text ? arena_string(run->arena, text, strlen(text)) : NULL;
}

static int compare_layer(Run *run, Arena *arena, const Image *a, const Image *b,
                         CompareRecord record) {
    CompareReport *report = &run->report;
    const size_t n_pixels = (size_t)b->width * b->height;
    char message[MESSAGE];
    if (!compare_images(a, b, record.layer, &record.numbers, message, sizeof message)) {
        return refuse(record.a_path, record.b_path, message);
    }
    bool is_drawn = run->options->values[OPTION_DIFF].is_set;
    float *map = is_drawn ? ARENA_ARRAY(arena, n_pixels, float) : NULL;
    record.seen = (Perceived){NAN, NAN, NAN};
    if ((wants_seen(run) || is_drawn) &&
        !compare_perceived(a, b, record.layer, run->metric == METRIC_HDRFLIP, &record.seen, map,
                           message, sizeof message)) {
        record.not_seen = keep(run, message);
    }
    warn_not_finite(run, &record);
    record.layer = keep(run, record.layer); // the pictures go, their names are printed later
    record.numbers.maximum_channel = keep(run, record.numbers.maximum_channel);
    report->records = arena_grow(run->arena, report->records, report->n_records, &run->capacity,
                                 sizeof *report->records);
    report->records[report->n_records++] = record;
    return is_drawn ? write_difference(run, arena, a, b, &record, map) : STATUS_OK;
}

// The names of all layers: those of the reference, and what the other has beside them, which is
// then missing.
static int compare_all_layers(Run *run, Arena *arena, const Image *a, const Image *b,
                              CompareRecord record) {
    const Image *images[] = {b, a};
    for (int i = 0; i < 2; i++) {
        uint32_t n, n_known;
        const char *const *layers = compare_layers(run->arena, images[i], &n);
        const char *const *known = compare_layers(run->arena, b, &n_known);
        for (uint32_t k = 0; k < n; k++) {
            bool is_done = false;
            for (uint32_t j = 0; i == 1 && j < n_known; j++) {
                is_done |= strcmp(layers[k], known[j]) == 0;
            }
            record.layer = layers[k];
            int status = is_done ? STATUS_OK : compare_layer(run, arena, a, b, record);
            if (status) {
                return status;
            }
        }
    }
    return STATUS_OK;
}

static bool wants_all_layers(const Options *options) {
    const char *layer = options->values[OPTION_LAYER].text;
    return layer && strcmp(layer, "all") == 0;
}

static const char *layer_of(const Options *options) {
    const char *layer = options->values[OPTION_LAYER].text;
    const char *channel = options->values[OPTION_CHANNEL].text;
    return layer ? layer : channel ? channel : "";
}

static int compare_pictures(Run *run, CompareRecord record) {
    Arena arena = {0};
    char message[MESSAGE];
    Image a, b;
    int status = STATUS_OK;
    if (!image_read(&arena, record.a_path, &a, message, sizeof message)) {
        status = refuse(record.a_path, NULL, message);
    } else if (!image_read(&arena, record.b_path, &b, message, sizeof message)) {
        status = refuse(record.b_path, NULL, message);
    } else if (wants_all_layers(run->options)) {
        status = compare_all_layers(run, &arena, &a, &b, record);
    } else {
        status = compare_layer(run, &arena, &a, &b, record);
    }
    if (status == STATUS_OK && run->report.is_film) {
        if (flicker_add(run->flicker, &a, &b, record.layer, message, sizeof message)) {
            Flicker flicker = flicker_result(run->flicker);
            run->report.flicker = flicker;
            run->report.records[run->report.n_records - 1].change =
                flicker.n_frames > 1 ? flicker.last_change : NAN;
        } else {
            status = refuse(record.a_path, record.b_path, message);
        }
    }
    arena_free(&arena);
    return status;
}

static const char *frame_path(Run *run, const char *pattern, int64_t frame) {
    char path[PATH_SIZE];
    return render_frame_path(pattern, frame, true, path, sizeof path) ? keep(run, path) : pattern;
}

static int compare_films(Run *run) {
    const char *a = run->options->operands[0], *b = run->options->operands[1];
    char message[PATH_SIZE];
    size_t n;
    run->flicker = flicker_new(run->arena);
    const int64_t *frames = compare_find_frames(run->arena, a, b, &n, message, sizeof message);
    if (!frames) {
        fprintf(stderr, "st4: error: %s\n", message);
        return STATUS_FILES;
    }
    int status = STATUS_OK;
    for (size_t i = 0; i < n && status == STATUS_OK; i++) {
        CompareRecord record = {.frame = frames[i],
                                .a_path = frame_path(run, a, frames[i]),
                                .b_path = frame_path(run, b, frames[i]),
                                .layer = layer_of(run->options)};
        status = compare_pictures(run, record);
    }
    return status;
}

// What was asked for together and does not go together.
static bool check_usage(const Run *run) {
    const Options *options = run->options;
    bool a_is_film = compare_is_pattern(options->operands[0]);
    const char *wrong = NULL;
    if (a_is_film != compare_is_pattern(options->operands[1])) {
        wrong = "a pattern of frames can be compared with another pattern only";
    } else if (run->metric == METRIC_FLICKER && !a_is_film) {
        wrong = "--metric flicker is of films: two names with #### are expected";
    } else if (options->values[OPTION_LAYER].is_set && options->values[OPTION_CHANNEL].is_set) {
        wrong = "--layer and --channel exclude each other";
    } else if (wants_all_layers(options) && a_is_film) {
        wrong = "not supported yet: --layer all of films; name one layer";
    } else if (wants_all_layers(options) && options->values[OPTION_DIFF].is_set) {
        wrong = "--diff draws one layer: name it by --layer";
    }
    if (wrong) {
        fprintf(stderr, "st4: error: %s\n", wrong);
    }
    return !wrong;
}

// The worst of all records decides. A measure that could not be taken is an error where it alone
// was asked for.
static int judge(const Run *run) {
    const OptionValue *bound = &run->options->values[OPTION_FAIL_ABOVE];
    bool is_less_worse = run->metric == METRIC_PSNR || run->metric == METRIC_SSIM;
    bool is_far = false, is_asked = bound->is_set || option_flag(run->options, OPTION_QUIET);
    for (size_t i = 0; i < run->report.n_records; i++) {
        const CompareRecord *record = &run->report.records[i];
        double measured = compare_metric(&run->report, record, run->metric);
        if (isnan(measured) && is_perceived(run->metric) && is_asked) {
            return refuse(record->a_path, record->b_path,
                          record->not_seen             ? record->not_seen
                          : run->metric == METRIC_SSIM ? "SSIM needs 11 pixels in width and height"
                                                       : "FLIP is of colors: channels R, G and B");
        }
        is_far |= is_less_worse ? measured < bound->number : measured > bound->number;
        if (option_flag(run->options, OPTION_QUIET) && !option_flag(run->options, OPTION_JSON) &&
            (run->metric != METRIC_FLICKER || i == 0)) {
            printf("%.9g\n", measured);
        }
    }
    return bound->is_set && (is_far || run->is_uneven) ? STATUS_SCENE : STATUS_OK;
}

int command_compare(Arena *arena, const Options *options) {
    Run run = {.arena = arena,
               .options = options,
               .metric = (Metric)options->values[OPTION_METRIC].integer};
    const char *a = options->operands[0], *b = options->operands[1];
    if (!check_usage(&run)) {
        return STATUS_USAGE;
    }
    run.report.is_film = compare_is_pattern(a);
    CompareRecord record = {.a_path = a, .b_path = b, .layer = layer_of(options), .change = NAN};
    int status = run.report.is_film ? compare_films(&run) : compare_pictures(&run, record);
    if (status) {
        return status;
    }
    if (option_flag(options, OPTION_JSON)) {
        compare_print_json(&run.report, a, b);
    } else if (!option_flag(options, OPTION_QUIET)) {
        compare_print_text(&run.report);
    }
    return judge(&run);
}
