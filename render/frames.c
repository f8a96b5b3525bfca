// SPDX-License-Identifier: Apache-2.0
// The run: blocks of frames, each sampled and built once, its frames traced and written one by one.
#include "render/render.h"

#include <string.h>

#include "render/checkpoint.h"
#include "render/interrupt.h"
#include "render/output.h"
#include "render/survey.h"
#include "render/tiles.h"

enum { STATUS_FINE = 0, STATUS_SCENE = 1, STATUS_FILES = 3, STATUS_INTERRUPTED = 130 };

typedef struct {
    const RenderOptions *options;
    const Reporter *reporter;
    RenderStats *stats;
    Scene scene; // with its camera in place
    PathScene paths;
    Film film;
    Checkpoint checkpoint;
    int64_t *frames; // still to render
    uint32_t n_frames;
    uint64_t frame_samples; // of all pixels
    Progress progress;
    PathTroubles troubles, reported;
    Arena arena;
} Run;

static void warn_not_finite(const Run *run, SourceRef where, const char *what) {
    run->reporter->emit(run->reporter->context, where, "not-finite", what);
}

static bool is_new(bool trouble, bool *reported) {
    bool is_first = trouble && !*reported;
    *reported |= trouble;
    return is_first;
}

// Once for each thing, however many frames it is wrong in.
static void report_troubles(Run *run) {
    const Scene *scene = &run->scene;
    if (is_new(run->troubles.camera, &run->reported.camera)) {
        warn_not_finite(run, scene->camera.where,
                        "the camera is not finite, or looks at where it stands, at some instant; "
                        "it sees nothing then");
    }
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        if (is_new(run->troubles.lights[i], &run->reported.lights[i])) {
            warn_not_finite(run, scene->lights[i].where,
                            "the light is not finite at some instant; it is dark then");
        }
    }
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        if (is_new(run->troubles.materials[i], &run->reported.materials[i])) {
            warn_not_finite(
                run, scene->materials[i].where,
                "the material is not finite at some instant or place; it is black there");
        }
    }
}

static void troubles_init(PathTroubles *troubles, Arena *arena, const Scene *scene) {
    troubles->lights = ARENA_ARRAY(arena, scene->n_lights, bool);
    troubles->materials = ARENA_ARRAY(arena, scene->n_materials, bool);
}

// Traces what the film of the frame lacks, with a checkpoint now and then.
static bool trace_frame(Run *run, const World *world, int64_t frame, const char *picture,
                        const FilmOrigin *origin) {
    TilePass pass = {.frame = frame, .first = origin->first, .n = origin->n};
    TilesOutcome outcome;
    do {
        pass.due = run->checkpoint.due;
        outcome = tiles_trace(&run->paths, world, run->options, &pass, &run->film, &run->progress,
                              run->stats, &run->troubles);
        if (outcome != TILES_DONE) {
            checkpoint_save(&run->checkpoint, picture, &run->film, origin, run->reporter);
        }
    } while (outcome == TILES_DUE);
    return outcome == TILES_DONE;
}

// Whatever is in the way of the picture may be cleared away: the sums are kept if they can be.
static int refuse_picture(Run *run, const char *picture, const FilmOrigin *origin,
                          const char *why) {
    bool is_kept = checkpoint_save(&run->checkpoint, picture, &run->film, origin, run->reporter);
    Arena arena = {0};
    const char *kept = is_kept ? "; its checkpoint is kept, --resume writes it again" : "";
    run->reporter->emit(run->reporter->context, 0, NULL,
                        arena_printf(&arena, "cannot write '%s': %s%s", picture, why, kept));
    arena_free(&arena);
    return STATUS_FILES;
}

// The film gets what is there of the frame already. False: reported.
static bool begin_film(Run *run, const char *picture, const FilmOrigin *origin) {
    bool is_fine = checkpoint_begin(&run->checkpoint, run->options, picture, &run->film, origin,
                                    run->reporter);
    progress_skip(&run->progress, film_counts(&run->film).total);
    return is_fine;
}

static int make_picture(Run *run, const World *world, int64_t frame, const char *picture,
                        const FilmOrigin *origin) {
    char message[OUTPUT_MESSAGE_SIZE];
    double start = progress_clock();
    if (!begin_film(run, picture, origin)) {
        return STATUS_FILES;
    }
    bool is_complete = trace_frame(run, world, frame, picture, origin);
    double traced = progress_clock();
    run->stats->trace_seconds += traced - start;
    report_troubles(run);
    if (!is_complete) {
        return STATUS_INTERRUPTED;
    }
    bool is_written = output_write(picture, &run->film, origin, message, sizeof message);
    run->stats->write_seconds += progress_clock() - traced;
    if (!is_written) {
        return refuse_picture(run, picture, origin, message);
    }
    run->stats->n_frames++;
    checkpoint_remove(picture);
    return STATUS_FINE;
}

static int render_frame(Run *run, const World *world, int64_t frame) {
    char picture[OUTPUT_PATH_SIZE];
    if (!output_path(run->options, frame, run->reporter, picture)) {
        return STATUS_FILES;
    }
    Arena arena = {0};
    FilmOrigin origin;
    output_describe(&run->scene, run->options, frame, &arena, &origin);
    progress_frame(&run->progress, frame);
    int status = make_picture(run, world, frame, picture, &origin);
    arena_free(&arena);
    return status;
}

// Renders a block that begins with frames[0], of n; *n_taken gets its length.
static int render_block(Run *run, const int64_t *frames, uint32_t n, uint32_t *n_taken) {
    World *world =
        world_build(&run->scene, run->options, frames, n, run->reporter, n_taken, run->stats);
    if (!world) {
        return interrupt_is_asked() ? STATUS_INTERRUPTED : STATUS_SCENE;
    }
    int status = STATUS_FINE;
    for (uint32_t i = 0; i < *n_taken && status == STATUS_FINE; i++) {
        status = interrupt_is_asked() ? STATUS_INTERRUPTED : render_frame(run, world, frames[i]);
    }
    world_destroy(world);
    return status;
}

static bool is_made(const Run *run, int64_t frame) {
    char picture[OUTPUT_PATH_SIZE];
    Arena arena = {0};
    FilmOrigin origin;
    output_describe(&run->scene, run->options, frame, &arena, &origin);
    bool found = run->options->resume && output_path(run->options, frame, run->reporter, picture) &&
                 output_is_made(picture, &origin);
    arena_free(&arena);
    return found;
}

// Which frames are still to render.
static void find_frames(Run *run) {
    const RenderOptions *options = run->options;
    run->frames = ARENA_ARRAY(&run->arena, options->n_frames, int64_t);
    for (uint32_t i = 0; i < options->n_frames; i++) {
        if (is_made(run, options->frames[i])) {
            progress_skip(&run->progress, run->frame_samples);
        } else {
            run->frames[run->n_frames++] = options->frames[i];
        }
    }
}

static int render_blocks(Run *run) {
    const RenderOptions *options = run->options;
    const FilmSettings *settings = &run->scene.film;
    world_place_camera(&run->arena, &run->scene);
    survey_scene(&run->scene, options, run->reporter);
    path_scene_init(&run->paths, &run->arena, &run->scene);
    film_init(&run->film, &run->arena, settings->width, settings->height);
    troubles_init(&run->troubles, &run->arena, &run->scene);
    troubles_init(&run->reported, &run->arena, &run->scene);
    uint64_t spp =
        options->last_sample ? options->last_sample - options->first_sample + 1 : options->spp;
    run->frame_samples = (uint64_t)settings->width * settings->height * spp;
    progress_begin(&run->progress, options->progress, run->frame_samples * options->n_frames);
    find_frames(run);
    int status = STATUS_FINE;
    for (uint32_t i = 0, n = 0; i < run->n_frames && status == STATUS_FINE; i += n) {
        status = render_block(run, run->frames + i, run->n_frames - i, &n);
    }
    progress_end(&run->progress);
    return status;
}

int render_frames(const Scene *scene, const RenderOptions *options, const Reporter *reporter,
                  RenderStats *stats) {
    if (!output_check(options, reporter)) {
        return STATUS_FILES;
    }
    Run run = {.options = options, .reporter = reporter, .stats = stats, .scene = *scene};
    interrupt_begin();
    int status = render_blocks(&run);
    interrupt_end();
    arena_free(&run.arena);
    return status;
}
