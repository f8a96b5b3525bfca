// SPDX-License-Identifier: Apache-2.0
// Accumulated motion blur: each subframe is a scene whose shutter is an instant.
#include "render/accumulate.h"

#include "accel/clock.h"
#include "render/interrupt.h"

bool accumulate_applies(const Scene *scene, const RenderOptions *options) {
    return options->subframes > 0 && render_scene_blurs(scene);
}

// What there is to say of a shape is said by the first subframe.
static void emit_errors(void *context, SourceRef where, const char *name, const char *message) {
    const Reporter *reporter = context;
    if (!name) {
        reporter->emit(reporter->context, where, name, message);
    }
}

static int trace_subframe(const PathScene *paths, const RenderOptions *options,
                          const TilePass *pass, const Reporter *reporter, Film *film,
                          Progress *progress, RenderStats *stats, PathTroubles *troubles) {
    uint32_t n;
    World *world = world_build(paths->scene, options, &pass->frame, 1, reporter, &n, stats);
    if (!world) {
        return interrupt_is_asked() ? 130 : 1;
    }
    double start = clock_seconds();
    TilesOutcome outcome =
        tiles_trace(paths, world, options, pass, film, progress, stats, troubles);
    stats->trace_seconds += clock_seconds() - start - world_waited(world) / options->n_threads;
    bool is_sound = world_is_sound(world, reporter);
    world_count(world, stats);
    world_destroy(world);
    return !is_sound ? 1 : outcome == TILES_DONE ? 0 : 130;
}

int accumulate_trace(const Scene *scene, const RenderOptions *options, int64_t frame,
                     const Reporter *reporter, Film *film, Progress *progress, RenderStats *stats,
                     PathTroubles *troubles) {
    Arena arena = {0};
    Scene sharp = *scene;
    RenderOptions share = *options;
    Reporter quiet = {emit_errors, (void *)(uintptr_t)reporter};
    PathScene paths;
    uint32_t n = options->subframes;
    share.is_still = true;
    sharp.shutter.length = 0;
    path_scene_init(&paths, &arena, &sharp);
    int status = 0;
    for (uint32_t i = 0; i < n && status == 0; i++) {
        paths.instant = (i + 0.5) / n;
        const TilePass pass = {.frame = frame, .n = (i + 1) * (options->spp / n), .due = INFINITY};
        sharp.shutter.open = scene->shutter.open + paths.instant * scene->shutter.length;
        status = trace_subframe(&paths, &share, &pass, i ? &quiet : reporter, film, progress, stats,
                                troubles);
    }
    arena_free(&arena);
    return status;
}
