// SPDX-License-Identifier: Apache-2.0
// Worlds: from a scene and some of its frames to everything that rays need.
#include "render/world_parts.h"

#include <stdlib.h>
#include <string.h>

enum {
    MAX_CELLS = 1 << 20, // of one shutter, where something moves
};
static const size_t DEFAULT_MEMORY = (size_t)4 << 30;

static void world_error(const Reporter *reporter, SourceRef where, const char *message) {
    if (reporter && reporter->emit) {
        reporter->emit(reporter->context, where, NULL, message);
    }
}

// ---- How many frames

// What a form had planned before a frame that turned out to be one too many.
typedef struct {
    size_t n_spans, n_seen;
    SampleReport report;
} Mark;

static ShutterSpan shutter_of(const Scene *scene, int64_t frame) {
    return shutter_span(frame, scene->shutter.open, scene->shutter.length);
}

static size_t plan_frame(World *world, int64_t frame, uint32_t n_threads) {
    ShutterSpan shutter = shutter_of(world->scene, frame);
    Assembly *parts = &world->parts;
    size_t bytes = 0;
#pragma omp parallel for schedule(dynamic) num_threads(n_threads) reduction(+ : bytes)
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        form_plan(parts->forms[i], &shutter);
        bytes += form_bytes(parts->forms[i]);
    }
    return bytes;
}

static bool anything_moves(const Assembly *parts) {
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        if (parts->forms[i]->moves) {
            return true;
        }
    }
    for (uint32_t i = 0; i < parts->n_bodies; i++) {
        if (parts->bodies[i].moves) {
            return true;
        }
    }
    return false;
}

// Plans frame after frame until the memory is full. 0: the shutter is open for too long.
static uint32_t plan_frames(World *world, const RenderOptions *options, const int64_t *frames,
                            uint32_t n_frames) {
    Assembly *parts = &world->parts;
    size_t memory = options->memory ? options->memory : DEFAULT_MEMORY;
    if (!anything_moves(parts)) {
        return n_frames;
    }
    if (shutter_of(world->scene, frames[0]).n_cells > MAX_CELLS) {
        return 0;
    }
    Mark *marks = ARENA_ARRAY(&world->arena, parts->n_forms, Mark);
    for (uint32_t k = 0; k < n_frames; k++) {
        for (uint32_t i = 0; i < parts->n_forms; i++) {
            const Form *form = parts->forms[i];
            marks[i] = (Mark){form->n_spans, form->n_seen, form->report};
        }
        size_t with = plan_frame(world, frames[k], options->n_threads);
        if (k > 0 && with > memory) {
            for (uint32_t i = 0; i < parts->n_forms; i++) {
                Form *form = parts->forms[i];
                form->n_spans = marks[i].n_spans;
                form->n_seen = marks[i].n_seen;
                form->report = marks[i].report;
            }
            return k;
        }
    }
    return n_frames;
}

static int compare_openings(const void *a, const void *b) {
    const Opening *o = a, *p = b;
    if (o->frame != p->frame) {
        return o->frame < p->frame ? -1 : 1;
    }
    return (o->lo > p->lo) - (o->lo < p->lo);
}

// One opening for each cell that the shutters reach, from the first one's start to the last's end.
static Opening *gather_openings(World *world, const int64_t *frames, uint32_t n_frames, size_t *n) {
    size_t capacity = 0, all = 0, kept = 0;
    Opening *list = NULL;
    bool moves = anything_moves(&world->parts);
    for (uint32_t k = 0; k < (moves ? n_frames : 1); k++) {
        ShutterSpan shutter = shutter_of(world->scene, frames[k]);
        for (uint64_t i = 0; i < (moves ? shutter.n_cells : 1); i++) {
            list = arena_grow(&world->arena, list, all, &capacity, sizeof *list);
            list[all++] = shutter_opening(&shutter, i);
        }
    }
    qsort(list, all, sizeof *list, compare_openings);
    for (size_t i = 0; i < all; i++) {
        if (kept > 0 && list[kept - 1].frame == list[i].frame) {
            list[kept - 1].hi = fmax(list[kept - 1].hi, list[i].hi);
        } else {
            list[kept++] = list[i];
        }
    }
    *n = kept;
    return list;
}

// ---- Sampling and building

typedef struct {
    Form *form;
    uint32_t key;
} KeyJob;

// Every key of every form, in parallel; what a key holds depends on nothing else.
static bool store_forms(World *world, uint32_t n_threads) {
    Assembly *parts = &world->parts;
    double first = film_first_seconds(world->scene);
    size_t n_jobs = 0, at = 0;
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        if (!form_store(parts->forms[i], first)) {
            return false;
        }
        n_jobs += parts->forms[i]->geometry.n_keys;
    }
    Arena scratch = {0};
    KeyJob *jobs = ARENA_ARRAY(&scratch, n_jobs, KeyJob);
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        for (uint32_t k = 0; k < parts->forms[i]->geometry.n_keys; k++) {
            jobs[at++] = (KeyJob){parts->forms[i], k};
        }
    }
#pragma omp parallel for schedule(dynamic) num_threads(n_threads)
    for (size_t i = 0; i < n_jobs; i++) {
        form_store_key(jobs[i].form, jobs[i].key);
    }
    arena_free(&scratch);
    return true;
}

static size_t array_bytes(const Form *form) {
    const Geometry *g = &form->geometry;
    size_t per_key = (size_t)g->n_vertices * (g->radius ? 4 : 3) * sizeof(float);
    per_key += form->normal ? form->smoothing.n_normals * sizeof(uint32_t) : 0;
    return per_key * g->n_keys;
}

// Each structure's share of the memory is as the work in it.
static double weight_of(const Form *form) {
    return (double)form->n_prims * form->geometry.n_keys;
}

enum { MESSAGE = 256 };

// Few forms are built one after the other by all threads, many by one thread each: what is built is
// the same.
static bool build_forms(World *world, const RenderOptions *options, char *why) {
    Assembly *parts = &world->parts;
    uint32_t n = parts->n_forms, n_failed = 0;
    uint32_t across = n >= 2 * options->n_threads ? options->n_threads : 1;
    double total = 0;
    size_t arrays = 0, memory = options->memory ? options->memory : DEFAULT_MEMORY;
    for (uint32_t i = 0; i < n; i++) {
        total += weight_of(parts->forms[i]);
        arrays += array_bytes(parts->forms[i]);
    }
    // Trees get what the arrays leave, and at least a quarter: a single frame may need too much.
    memory = arrays < memory - memory / 4 ? memory - arrays : memory / 4;
#pragma omp parallel for schedule(dynamic) num_threads(across)
    for (uint32_t i = 0; i < n; i++) {
        char message[MESSAGE] = "";
        AccelOptions accel = options->accel_options;
        accel.n_threads = across > 1 ? 1 : options->n_threads;
        if (accel.memory == 0) {
            accel.memory = (size_t)((double)memory * (weight_of(parts->forms[i]) / total)) + 4096;
        }
        if (!form_build(parts->forms[i], options->accel, &accel, options->validate, message,
                        sizeof message)) {
#pragma omp critical(world_build_failure)
            {
                n_failed++;
                memcpy(why, message, sizeof message);
            }
        }
    }
    return n_failed == 0;
}

static bool check_top(const World *world, const RenderOptions *options, char *why) {
    return !options->validate || !world->top || boxtree_validate(world->top, why, MESSAGE);
}

// ---- Statistics

void stats_add(AccelStats *sum, const AccelStats *more) {
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
static void count_world(const World *world, const AccelStats *top, RenderStats *stats) {
    const Assembly *parts = &world->parts;
    AccelStats sum = {0};
    size_t vertex_bytes = 0;
    uint64_t n_triangles = 0, n_spheres = 0;
    for (uint32_t i = 0; i < parts->n_forms; i++) {
        const Form *form = parts->forms[i];
        stats_add(&sum, &form->stats);
        vertex_bytes += array_bytes(form);
        *(form->kind == GEOMETRY_SPHERES ? &n_spheres : &n_triangles) += form->n_prims;
        stats->n_keys += form->geometry.n_keys;
        stats->vertex_evaluations += (uint64_t)form->geometry.n_keys * form->sampler.all.n;
        stats->vertex_evaluations += form->report.evaluations;
        stats->tolerance_reached = fmax(stats->tolerance_reached, form->report.error);
    }
    stats->segment_seconds += sum.segment_seconds + top->segment_seconds;
    stats->build_seconds += sum.build_seconds + top->build_seconds;
    stats->vertex_bytes = max_size(stats->vertex_bytes, vertex_bytes);
    stats->segment_bytes = max_size(stats->segment_bytes, sum.segment_bytes);
    stats->tree_bytes = max_size(stats->tree_bytes, sum.tree_bytes + top->tree_bytes);
    stats->n_objects = parts->n_objects;
    stats->n_triangles = n_triangles;
    stats->n_spheres = n_spheres;
    stats->n_blocks++;
    stats_add(&stats->accel, &sum);
}

// ---- The world

static World *world_new(const Scene *scene, const RenderOptions *options,
                        const Reporter *reporter) {
    Arena arena = {0};
    World *world = ARENA_NEW(&arena, World);
    world->arena = arena;
    world->scene = scene;
    world->fps = scene->film.fps;
    world->parts = assemble(&world->arena, scene, options, reporter);
    return world;
}

void world_destroy(World *world) {
    if (!world) {
        return;
    }
    assembly_destroy(&world->parts);
    if (world->top) {
        boxtree_destroy(world->top);
    }
    Arena arena = world->arena;
    arena_free(&arena);
}

static bool sample_world(World *world, const RenderOptions *options, const int64_t *frames,
                         uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken) {
    *n_taken = plan_frames(world, options, frames, n_frames);
    if (*n_taken == 0) {
        world_error(reporter, world->scene->camera.where,
                    "the shutter is open for more than a million frames while something moves");
        return false;
    }
    if (!store_forms(world, options->n_threads)) {
        world_error(reporter, world->scene->camera.where,
                    "the motion in one frame needs more than 67 million samples in time");
        return false;
    }
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        report_sampling(reporter, world->parts.forms[i]);
    }
    return true;
}

World *world_build(const Scene *scene, const RenderOptions *options, const int64_t *frames,
                   uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken,
                   RenderStats *stats) {
    double start = seconds_now();
    char why[MESSAGE] = "";
    size_t n_openings;
    World *world = world_new(scene, options, reporter);
    if (!sample_world(world, options, frames, n_frames, reporter, n_taken)) {
        world_destroy(world);
        return NULL;
    }
    stats->sample_seconds += seconds_now() - start;
    AccelStats top;
    bool is_built = build_forms(world, options, why);
    if (is_built) {
        Opening *openings = gather_openings(world, frames, *n_taken, &n_openings);
        top_build(world, options, openings, n_openings, &top);
        is_built = check_top(world, options, why);
    }
    if (!is_built) {
        world_error(reporter, scene->camera.where, why);
        world_destroy(world);
        return NULL;
    }
    count_world(world, &top, stats);
    return world;
}

static Bounds placed_bounds(const Body *body, Bounds local, double seconds) {
    Placement place = body_place(body, seconds);
    Bounds b = bounds_empty();
    if (!place.is_present || bounds_are_empty(local)) {
        return b;
    }
    for (int k = 0; k < 8; k++) {
        b = bounds_add(b, affine_point(&place.map, bounds_corner(local, k)));
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
        if (body->form != form) { // instances of one form follow each other
            form = body->form;
            local = mover_bounds(&form->sampler.all, seconds);
        }
        b = bounds_join(b, placed_bounds(body, local, seconds));
    }
    world_destroy(world);
    *lo = b.lo;
    *hi = b.hi;
    return !bounds_are_empty(b);
}
