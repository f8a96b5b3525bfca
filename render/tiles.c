// SPDX-License-Identifier: Apache-2.0
// Tiles: each pixel belongs to one of them, and so to one thread.
#include "render/tiles.h"

#include "render/interrupt.h"

typedef struct {
    const RenderOptions *options;
    bool freeze;
    Film *film;
} Job;

static uint32_t least(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static void trace_pixel(PathTracer *tracer, const Job *job, uint32_t x, uint32_t y) {
    Sampler sampler = sampler_pixel(job->options->seed, job->freeze, tracer->frame, x, y);
    for (uint32_t i = 0; i < job->options->spp && !interrupt_is_asked(); i++) {
        path_trace(tracer, &sampler, x, y, i, job->film);
    }
}

static uint64_t trace_tile(PathTracer *tracer, const Job *job, uint32_t x0, uint32_t y0) {
    uint32_t x1 = least(x0 + TILE_SIZE, job->film->x + job->film->width);
    uint32_t y1 = least(y0 + TILE_SIZE, job->film->y + job->film->height);
    for (uint32_t y = y0; y < y1; y++) {
        for (uint32_t x = x0; x < x1; x++) {
            trace_pixel(tracer, job, x, y);
        }
    }
    return (uint64_t)(x1 - x0) * (y1 - y0) * job->options->spp;
}

static void add_counters(RenderStats *stats, const PathCounters *add) {
    stats->camera_rays += add->camera_rays;
    stats->shadow_rays += add->shadow_rays;
    stats->bounce_rays += add->bounce_rays;
    stats->lens_samples += add->lens_samples;
    stats->light_samples += add->light_samples;
    stats->time_samples += add->time_samples;
    stats->film_samples += add->film_samples;
    stats->dropped_samples += add->dropped_samples;
}

static void add_troubles(const Scene *scene, PathTroubles *troubles, const PathTroubles *add) {
    troubles->camera |= add->camera;
    for (uint32_t i = 0; i < scene->n_lights; i++) {
        troubles->lights[i] |= add->lights[i];
    }
    for (uint32_t i = 0; i < scene->n_materials; i++) {
        troubles->materials[i] |= add->materials[i];
    }
}

bool tiles_trace(const PathScene *paths, const World *world, const RenderOptions *options,
                 int64_t frame, Film *film, Progress *progress, RenderStats *stats,
                 PathTroubles *troubles) {
    const Scene *scene = paths->scene;
    const Job job = {options, scene->render.freeze, film};
    const uint32_t columns = (film->width + TILE_SIZE - 1) / TILE_SIZE;
    const uint32_t rows = (film->height + TILE_SIZE - 1) / TILE_SIZE;
    film_clear(film);
#pragma omp parallel num_threads((int)options->n_threads)
    {
        Arena arena = {0};
        PathTracer tracer;
        WorldView *view = world_view_new(world);
        path_tracer_init(&tracer, &arena, paths, view, frame);
#pragma omp for schedule(dynamic, 1)
        for (uint32_t i = 0; i < columns * rows; i++) {
            if (!interrupt_is_asked()) {
                uint64_t n = trace_tile(&tracer, &job, film->x + i % columns * TILE_SIZE,
                                        film->y + i / columns * TILE_SIZE);
                progress_add(progress, n);
            }
        }
#pragma omp critical(tiles)
        {
            add_counters(stats, &tracer.counters);
            add_troubles(scene, troubles, &tracer.troubles);
            world_view_destroy(view, &stats->rays);
        }
        arena_free(&arena);
    }
    return !interrupt_is_asked();
}
