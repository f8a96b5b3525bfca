// SPDX-License-Identifier: Apache-2.0
// Tiles: each pixel belongs to one of them, and so to one thread.
#include "render/tiles.h"

#include "accel/clock.h"
#include "render/interrupt.h"

// Samples between two looks at the clock.
enum { CLOCK_EVERY = 256 };

typedef struct {
    const RenderOptions *options;
    const TilePass *pass;
    bool freeze;
    Film *film;
    Progress *progress;
    bool is_due; // set by the thread that sees it first
} Job;

typedef struct {
    PathTracer tracer;
    Job *job;
    uint32_t n_untold; // samples since the progress heard of them
} Worker;

static uint32_t least(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static bool is_stopped(const Job *job) {
    return interrupt_is_asked() || __atomic_load_n(&job->is_due, __ATOMIC_RELAXED);
}

static void tell_progress(Worker *worker) {
    Job *job = worker->job;
    progress_add(job->progress, worker->n_untold);
    worker->n_untold = 0;
    if (clock_seconds() >= job->pass->due) {
        __atomic_store_n(&job->is_due, true, __ATOMIC_RELAXED);
    }
}

static void trace_pixel(Worker *worker, uint32_t x, uint32_t y) {
    Job *job = worker->job;
    PathTracer *tracer = &worker->tracer;
    const Allocation *allocation = job->pass->allocation;
    const uint32_t n = allocation ? allocation_count(allocation, job->film, x, y) : job->pass->n;
    Sampler sampler =
        allocation ? sampler_pixel_halves(job->options->seed, job->freeze, tracer->frame, x, y)
                   : sampler_pixel(job->options->seed, job->freeze, tracer->frame, x, y);
    for (uint32_t i = film_count(job->film, x, y); i < n && !is_stopped(job); i++) {
        path_trace(tracer, &sampler, x, y, job->pass->first + i, job->film);
        if (++worker->n_untold == CLOCK_EVERY) {
            tell_progress(worker);
        }
    }
}

static void trace_tile(Worker *worker, uint32_t x0, uint32_t y0) {
    const Job *job = worker->job;
    uint32_t x1 = least(x0 + TILE_SIZE, job->film->x + job->film->width);
    uint32_t y1 = least(y0 + TILE_SIZE, job->film->y + job->film->height);
    for (uint32_t y = y0; y < y1; y++) {
        for (uint32_t x = x0; x < x1 && !is_stopped(job); x++) {
            trace_pixel(worker, x, y);
        }
    }
    if (worker->n_untold) {
        tell_progress(worker);
    }
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

TilesOutcome tiles_trace(const PathScene *paths, const World *world, const RenderOptions *options,
                         const TilePass *pass, Film *film, Progress *progress, RenderStats *stats,
                         PathTroubles *troubles) {
    const Scene *scene = paths->scene;
    Job job = {options, pass, scene->render.freeze, film, progress, false};
    const uint32_t columns = (film->width + TILE_SIZE - 1) / TILE_SIZE;
    const uint32_t rows = (film->height + TILE_SIZE - 1) / TILE_SIZE;
    Arena lights = {0};
    const PathScene framed = path_scene_frame(paths, &lights, world, pass->frame);
#pragma omp parallel num_threads((int)options->n_threads)
    {
        Arena arena = {0};
        Worker worker = {.job = &job};
        WorldView *view = world_view_new(world);
        path_tracer_init(&worker.tracer, &arena, &framed, view, pass->frame);
#pragma omp for schedule(dynamic, 1)
        for (uint32_t i = 0; i < columns * rows; i++) {
            if (!is_stopped(&job)) {
                trace_tile(&worker, film->x + i % columns * TILE_SIZE,
                           film->y + i / columns * TILE_SIZE);
            }
        }
#pragma omp critical(tiles)
        {
            add_counters(stats, &worker.tracer.counters);
            add_troubles(scene, troubles, &worker.tracer.troubles);
            world_view_destroy(view, &stats->rays);
        }
        arena_free(&arena);
    }
    arena_free(&lights);
    return interrupt_is_asked() ? TILES_INTERRUPTED : job.is_due ? TILES_DUE : TILES_DONE;
}
