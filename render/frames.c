// SPDX-License-Identifier: Apache-2.0
// The run: blocks of frames, each sampled and built once, its frames traced and written one by one.
#include "render/render.h"

#include <string.h>

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

static int render_frame(Run *run, const World *world, int64_t frame) {
    double start = progress_clock();
    progress_frame(&run->progress, frame);
    bool is_complete = tiles_trace(&run->paths, world, run->options, frame, &run->film,
                                   &run->progress, run->stats, &run->troubles);
    double traced = progress_clock();
    run->stats->trace_seconds += traced - start;
    report_troubles(run);
    if (!is_complete) {
        return STATUS_INTERRUPTED;
    }
    bool is_written = output_write(&run->scene, run->options, &run->film, frame, run->reporter);
    run->stats->write_seconds += progress_clock() - traced;
    run->stats->n_frames += is_written;
    return is_written ? STATUS_FINE : STATUS_FILES;
}

// Renders the block that begins with frames[first]; *n gets its length.
static int render_block(Run *run, uint32_t first, uint32_t *n) {
    const RenderOptions *options = run->options;
    World *world = world_build(&run->scene, options, options->frames + first,
                               options->n_frames - first, run->reporter, n, run->stats);
    if (!world) {
        return interrupt_is_asked() ? STATUS_INTERRUPTED : STATUS_SCENE;
    }
    int status = STATUS_FINE;
    for (uint32_t i = 0; i < *n && status == STATUS_FINE; i++) {
        status = interrupt_is_asked() ? STATUS_INTERRUPTED
                                      : render_frame(run, world, options->frames[first + i]);
    }
    world_destroy(world);
    return status;
}

static void make_film(Run *run) {
    const RenderOptions *options = run->options;
    const FilmSettings *settings = &run->scene.film;
    bool is_crop = options->crop_x1 > 0;
    film_init(&run->film, &run->arena, settings->layers,
              is_crop ? options->crop_x1 - options->crop_x0 : settings->width,
              is_crop ? options->crop_y1 - options->crop_y0 : settings->height);
    run->film.x = options->crop_x0;
    run->film.y = options->crop_y0;
}

static int render_blocks(Run *run) {
    const RenderOptions *options = run->options;
    world_place_camera(&run->arena, &run->scene);
    survey_scene(&run->scene, options, run->reporter);
    path_scene_init(&run->paths, &run->arena, &run->scene);
    make_film(run);
    troubles_init(&run->troubles, &run->arena, &run->scene);
    troubles_init(&run->reported, &run->arena, &run->scene);
    uint64_t pixels = (uint64_t)run->film.width * run->film.height;
    progress_begin(&run->progress, options->progress, pixels * options->spp * options->n_frames);
    int status = STATUS_FINE;
    for (uint32_t first = 0, n = 0; first < options->n_frames && status == STATUS_FINE;
         first += n) {
        status = render_block(run, first, &n);
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
    if (options->has_layers) {
        run.scene.film.layers = options->layers;
    }
    interrupt_begin();
    int status = render_blocks(&run);
    interrupt_end();
    arena_free(&run.arena);
    return status;
}
