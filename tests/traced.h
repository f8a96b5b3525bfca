// SPDX-License-Identifier: Apache-2.0
// One frame of a scene built by hand, traced into a film: what the tracer measures.
#ifndef TESTS_TRACED_H
#define TESTS_TRACED_H

#include "render/tiles.h"
#include "tests/scenes.h"

// Of frame 1. The film lives in the test's arena. Asserts that nothing is wrong with the camera and
// that no sample was dropped.
static inline const Film *traced(TestScene *test, uint32_t spp, RenderStats *stats) {
    Arena *arena = &test->arena;
    RenderOptions options = test_options(test, spp);
    const int64_t frame = 1;
    uint32_t n_taken;
    PathScene paths;
    PathTroubles troubles = {.lights = ARENA_ARRAY(arena, test->scene.n_lights, bool),
                             .materials = ARENA_ARRAY(arena, test->scene.n_materials, bool)};
    Progress progress = {.kind = PROGRESS_NONE};
    Film *film = ARENA_NEW(arena, Film);
    film_init(film, arena, test->scene.film.width, test->scene.film.height);
    path_scene_init(&paths, arena, &test->scene);
    World *world = world_build(&test->scene, &options, &frame, 1, &test->reporter, &n_taken, stats);
    assert_non_null(world);
    assert_true(tiles_trace(&paths, world, &options, frame, film, &progress, stats, &troubles));
    world_destroy(world);
    assert_false(troubles.camera);
    assert_int_equal(stats->dropped_samples, 0);
    return film;
}

// Channel c (r g b alpha) of a pixel, counted row by row.
static inline double traced_channel(const Film *film, int pixel, int c) {
    return (double)film->pixels[pixel].sum[c] / 0x1p28 / film->pixels[pixel].n;
}

#endif
