// SPDX-License-Identifier: Apache-2.0
// Worlds: from a scene and some of its frames to everything that rays need.
#include "accel/clock.h"
#include "render/local_time.h"
#include "render/report.h"
#include "render/shutter.h"
#include "render/world_parts.h"

#include <stdlib.h>
#include <string.h>

static bool check_top(const World *world, const RenderOptions *options, char *why) {
    return !options->validate || !world->top || boxtree_validate(world->top, why, BUILDS_MESSAGE);
}

// ---- Statistics

// Kappas are the widest, depths the greatest.
static void stats_add(AccelStats *sum, const AccelStats *more) {
    bool is_first = sum->n_prims == 0 && sum->n_segments == 0;
    sum->segment_seconds += more->segment_seconds;
    sum->build_seconds += more->build_seconds;
    sum->tree_bytes += more->tree_bytes;
    sum->segment_bytes += more->segment_bytes;
    sum->peak_bytes += more->peak_bytes;
    sum->n_prims += more->n_prims;
    sum->n_segments += more->n_segments;
    sum->n_nodes += more->n_nodes;
    sum->n_leaves += more->n_leaves;
    sum->n_references += more->n_references;
    sum->n_time_splits += more->n_time_splits;
    sum->n_depth = sum->n_depth > more->n_depth ? sum->n_depth : more->n_depth;
    sum->n_dropped += more->n_dropped;
    for (int i = 0; i < LEAF_REASONS; i++) {
        sum->leaves_by[i] += more->leaves_by[i];
    }
    if (more->kappa_max > 0) {
        sum->kappa_min = is_first || !(sum->kappa_max > 0) ? more->kappa_min
                                                           : fmin(sum->kappa_min, more->kappa_min);
        // Not the median of all, but one that no structure's median exceeds.
        sum->kappa_median = fmax(sum->kappa_median, more->kappa_median);
        sum->kappa_max = fmax(sum->kappa_max, more->kappa_max);
    }
}

static size_t max_size(size_t a, size_t b) {
    return a > b ? a : b;
}

// Times and work add up over blocks; sizes are those of the largest block, since one at a time is
// in memory.
static void count_samples(const World *world, RenderStats *stats) {
    const Assembly *parts = &world->parts;
    size_t vertex_bytes = 0;
    uint64_t n_triangles = 0, n_spheres = 0;
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        const Form *form = parts->forms[i];
        vertex_bytes += form_array_bytes(form);
        *(form->kind == GEOMETRY_SPHERES ? &n_spheres : &n_triangles) += form->n_prims;
        stats->n_keys += form->geometry.n_keys;
        stats->vertex_evaluations += (uint64_t)form->geometry.n_keys * form->sampler.all.n;
        stats->vertex_evaluations += form->report.evaluations;
        stats->tolerance_reached = fmax(stats->tolerance_reached, form->report.error);
    }
    stats->vertex_bytes = max_size(stats->vertex_bytes, vertex_bytes);
    stats->n_objects = parts->n_objects;
    stats->n_triangles = n_triangles;
    stats->n_spheres = n_spheres;
    stats->n_blocks++;
}

void world_count(const World *world, RenderStats *stats) {
    const AccelStats *top = &world->top_stats;
    AccelStats sum = {0};
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        const Form *form = world->parts.forms[i];
        stats_add(&sum, &form->stats);
        stats->n_structures++;
        stats->n_unbuilt += !form->accel;
    }
    stats->segment_seconds += sum.segment_seconds + top->segment_seconds;
    stats->build_seconds += sum.build_seconds + top->build_seconds;
    stats->segment_bytes = max_size(stats->segment_bytes, sum.segment_bytes);
    stats->tree_bytes = max_size(stats->tree_bytes, sum.tree_bytes + top->tree_bytes);
    stats_add(&stats->accel, &sum);
}

// ---- The world

void world_destroy(World *world) {
    if (!world) {
        return;
    }
    assembly_destroy(&world->parts);
    if (world->top) {
        boxtree_destroy(world->top);
    }
    builds_destroy(world->builds);
    Arena arena = world->arena;
    arena_free(&arena);
}

static void fix_all(Arena *arena, Body *bodies, uint32_t n) {
    size_t n_fixed = 0;
    for (uint32_t i = 0; i < n; i++) {
        n_fixed += !bodies[i].moves;
    }
    Placement *fixed = ARENA_ARRAY(arena, n_fixed, Placement);
    for (uint32_t i = 0; i < n; i++) {
        if (!bodies[i].moves) {
            *fixed = body_place(&bodies[i], NULL, 0);
            bodies[i].fixed = fixed++;
        }
    }
}

// What does not move is placed once and for all.
static void fix_bodies(World *world) {
    fix_all(&world->arena, world->parts.bodies, world->parts.n_bodies);
    fix_all(&world->arena, world->parts.planes, world->parts.n_planes);
}

// Over what all shutters of the block see.
static void find_phases(World *world, uint32_t n_threads) {
    const Opening *open = world->openings, *last = open + world->n_openings - 1;
    double from = instant_seconds((Instant){open->frame, open->lo}, world->fps),
           to = instant_seconds((Instant){last->frame, last->hi}, world->fps);
    for (uint32_t i = 0; i < world->parts.n_sets; i++) {
        InstanceSet *set = &world->parts.sets[i];
        instance_phases(&world->arena, set, world->fps, from, to);
        instance_boxes(&world->arena, set, world->fps, open, world->n_openings, n_threads);
    }
}

World *world_build(const Scene *scene, const RenderOptions *options, const int64_t *frames,
                   uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken,
                   RenderStats *stats) {
    double start = clock_seconds();
    char why[BUILDS_MESSAGE] = "";
    World *world = world_sample(scene, options, frames, n_frames, reporter, n_taken);
    if (!world) {
        return NULL;
    }
    find_phases(world, options->n_threads);
    stats->sample_seconds += clock_seconds() - start;
    fix_bodies(world);
    world->builds =
        builds_new(world->parts.forms, world->parts.n_forms, options, world_memory(options), why);
    bool is_built = world->builds != NULL;
    if (is_built) {
        top_build(world, options, &world->top_stats);
        is_built = check_top(world, options, why);
    }
    if (!is_built) {
        report_error(reporter, scene->camera.where, why);
        world_destroy(world);
        return NULL;
    }
    count_samples(world, stats);
    return world;
}

double world_waited(const World *world) {
    return builds_waited(world->builds);
}

bool world_is_sound(const World *world, const Reporter *reporter) {
    const char *why = builds_failure(world->builds);
    if (why) {
        report_error(reporter, world->scene->camera.where, why);
    }
    return !why;
}

static Bounds placed_bounds(Placement place, Bounds local) {
    Bounds b = bounds_empty();
    if (!place.is_present || bounds_are_empty(local)) {
        return b;
    }
    for (int k = 0; k < 8; k++) {
        b = bounds_add(b, affine_point(&place.map, bounds_corner(local, k)));
    }
    return b;
}

// Of members with clocks, each as large as any of some is.
static Bounds set_bounds_at(const InstanceSet *set, double seconds) {
    enum { LOOKS = 16 };
    const Mover *points = &set->form->sampler.all;
    Bounds b = bounds_empty(), local = bounds_empty();
    uint32_t n = !set->form->users ? 1 : set->n < LOOKS ? set->n : LOOKS;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t k = (uint32_t)((uint64_t)i * set->n / n);
        local = bounds_join(local, mover_bounds(points, instance_seconds(set, k, seconds)));
    }
    for (uint32_t k = 0; k < set->n; k++) {
        b = bounds_join(b, placed_bounds(instance_place(set, k, seconds), local));
    }
    return b;
}

bool world_bounds_at(const Scene *scene, Instant at, Vec3 *lo, Vec3 *hi) {
    RenderOptions options = {.n_threads = 1};
    World *world = world_new(scene, &options, NULL);
    double seconds = instant_seconds(at, scene->film.fps);
    Bounds b = bounds_empty(), local = bounds_empty();
    const Form *form = NULL;
    for (uint32_t i = 0; i < world->parts.n_bodies; i++) {
        const Body *body = &world->parts.bodies[i];
        if (body->form != form || form->users) { // instances of one form follow each other
            form = body->form;
            double shown = form->users ? body_seconds(body, NULL, seconds) : seconds;
            local = mover_bounds(&form->sampler.all, shown);
        }
        b = bounds_join(b, placed_bounds(body_place(body, NULL, seconds), local));
    }
    for (uint32_t i = 0; i < world->parts.n_sets; i++) {
        b = bounds_join(b, set_bounds_at(&world->parts.sets[i], seconds));
    }
    world_destroy(world);
    *lo = b.lo;
    *hi = b.hi;
    return !bounds_are_empty(b);
}

void world_place_camera(Arena *arena, Scene *scene) {
    if (!scene->camera.automatic) {
        return;
    }
    const ShutterSettings *shutter = &scene->shutter;
    double delay = 0.5 * (shutter->first_delay + shutter->last_delay);
    Instant at = shutter_instant(shutter, scene->film.first_frame, delay, 0.5);
    Vec3 lo, hi;
    if (!world_bounds_at(scene, at, &lo, &hi)) {
        lo = vec3(-1, -1, -1);
        hi = vec3(1, 1, 1);
    }
    scene->camera.program = camera_automatic(arena, scene, lo, hi);
    scene->camera.automatic = false;
}
