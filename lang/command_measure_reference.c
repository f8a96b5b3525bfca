// SPDX-License-Identifier: Apache-2.0
// st4 measure: the picture that errors are measured against, and how far it can be trusted.
#include "lang/command_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/render.h"

enum { FIRST_SEED = 90001, PILOT_SPP = 4, MOST_SPP = 1 << 16, MESSAGE = 512 };

// Of the budget, for both halves together.
static const double SHARE = 0.35;

static int refuse(const char *path, const char *message) {
    fprintf(stderr, "st4: error: %s: %s\n", path, message);
    return STATUS_FILES;
}

// The mean of both halves, and their difference as the reference's own error.
static int average(Measure *measure) {
    MeasureReference *r = &measure->reference;
    char message[MESSAGE];
    ErrorParts parts;
    const Image two[2] = {r->halves[0], r->halves[r->n - 1]};
    if (!compare_parts(two, 2, r->halves, r->n, NULL, &parts, message, sizeof message)) {
        return refuse(r->paths[0], message);
    }
    if (!(fabs(parts.mean) > 0)) {
        return refuse(r->paths[0], "the reference is black: errors cannot be relative to it");
    }
    r->noise = parts.noise_of_ref / fabs(parts.mean);
    r->mean = r->halves[0];
    r->mean.channels = ARENA_ARRAY(measure->arena, r->mean.n_channels, ImageChannel);
    for (uint32_t c = 0; c < r->mean.n_channels; c++) {
        const ImageChannel *a = &r->halves[0].channels[c];
        const ImageChannel *b = image_channel(&r->halves[r->n - 1], a->name);
        size_t n = (size_t)r->mean.width * r->mean.height;
        float *values = ARENA_ARRAY(measure->arena, n, float);
        for (size_t i = 0; b && i < n; i++) {
            values[i] = 0.5f * (a->values[i] + b->values[i]);
        }
        r->mean.channels[c] = (ImageChannel){a->name, values, false};
    }
    return STATUS_OK;
}

static int read_halves(Measure *measure) {
    MeasureReference *r = &measure->reference;
    char message[MESSAGE];
    for (uint32_t i = 0; i < r->n; i++) {
        if (!image_read(measure->arena, r->paths[i], &r->halves[i], message, sizeof message)) {
            return refuse(r->paths[i], message);
        }
        if (r->halves[i].width != measure->width || r->halves[i].height != measure->height) {
            snprintf(message, sizeof message,
                     "%ux%u pixels, the scene is measured at %ux%u; --size changes that",
                     r->halves[i].width, r->halves[i].height, measure->width, measure->height);
            return refuse(r->paths[i], message);
        }
    }
    return average(measure);
}

static const char *state_path(const Measure *measure) {
    return measure_path(measure, "reference.txt");
}

// What an earlier call left, if it was of this scene.
static bool is_there(Measure *measure) {
    MeasureReference *r = &measure->reference;
    char hash[40] = "";
    FILE *file = fopen(state_path(measure), "r");
    bool fits = file && fscanf(file, "%39s %u %lf", hash, &r->spp, &r->seconds) == 3 &&
                strcmp(hash, measure->fingerprint) == 0;
    if (file) {
        fclose(file);
    }
    return fits;
}

static bool write_state(const Measure *measure) {
    FILE *file = fopen(state_path(measure), "w");
    if (!file) {
        return false;
    }
    fprintf(file, "%s %u %.3f\n", measure->fingerprint, measure->reference.spp,
            measure->reference.seconds);
    return fclose(file) == 0;
}

static void say_why(const Measure *measure) {
    char line[512];
    FILE *log = fopen(measure_path(measure, "log"), "r");
    while (log && fgets(line, sizeof line, log)) {
        fputs(line, stderr);
    }
    if (log) {
        fclose(log);
    }
}

// As many samples, a power of two, as fit into the share.
static uint32_t reference_spp(const Measure *measure, const MeasureWork *pilot) {
    double fixed = pilot->update + pilot->build, each = pilot->trace / PILOT_SPP;
    double most = (SHARE * measure->budget / 2 - fixed) / fmax(each, 1e-9);
    uint32_t spp = 16;
    while (2 * spp <= most && spp < MOST_SPP) {
        spp *= 2;
    }
    return spp;
}

static int make(Measure *measure) {
    MeasureReference *r = &measure->reference;
    MeasureSetting setting = {.spp = PILOT_SPP, .tolerance = 0.03};
    MeasureWork work;
    remove(state_path(measure)); // what it vouches for is overwritten now
    int status = measure_render(measure, "reference-1", &setting, FIRST_SEED, &work);
    r->spp = 0;
    r->seconds = 0;
    if (status == STATUS_OK) {
        setting.spp = reference_spp(measure, &work);
        r->spp = 2 * setting.spp;
    }
    for (uint32_t i = 0; i < 2 && status == STATUS_OK; i++) {
        if (!measure->is_quiet) {
            fprintf(stderr, "st4: reference, half %u of 2: %u samples per pixel\n", i + 1,
                    setting.spp);
        }
        status = measure_render(measure, i ? "reference-2" : "reference-1", &setting,
                                FIRST_SEED + i, &work);
        r->seconds += work.update + work.build + work.trace;
    }
    if (status && status != STATUS_INTERRUPTED) {
        say_why(measure);
    }
    if (status == STATUS_OK && !write_state(measure)) {
        return refuse(state_path(measure), "cannot write");
    }
    return status;
}

int measure_find_reference(Measure *measure) {
    MeasureReference *r = &measure->reference;
    size_t n;
    const char *const *given = options_list(measure->arena, measure->options, OPTION_REF, &n);
    if (n > 2) {
        fprintf(stderr, "st4: error: --ref: %zu files; one, or two halves, are expected\n", n);
        return STATUS_USAGE;
    }
    r->n = n ? (uint32_t)n : 2;
    for (uint32_t i = 0; i < r->n; i++) {
        r->paths[i] =
            n ? given[i] : measure_path(measure, i ? "reference-2.exr" : "reference-1.exr");
    }
    if (n == 0 && !is_there(measure)) {
        int status = make(measure);
        if (status) {
            return status;
        }
    }
    return read_halves(measure);
}
