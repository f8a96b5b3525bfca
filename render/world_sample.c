// SPDX-License-Identifier: Apache-2.0
// The first half of a world: how many frames fit, when their motion is sampled, and the arrays.
#include "render/report.h"
#include "render/shutter.h"
#include "render/world_parts.h"

#include <stdlib.h>

enum {
    MAX_CELLS = 1 << 20, // of one shutter, where something moves
};

size_t world_memory(const RenderOptions *options) {
    return options->memory ? options->memory : (size_t)4 << 30;
}

World *world_new(const Scene *scene, const RenderOptions *options, const Reporter *reporter) {
    Arena arena = {0};
    World *world = ARENA_NEW(&arena, World);
    world->arena = arena;
    world->scene = scene;
    world->fps = scene->film.fps;
    world->parts = assemble(&world->arena, scene, options, reporter);
    return world;
}

// What a form had planned before a frame that turned out to be one too many.
typedef struct {
    size_t n_spans, n_seen;
    SampleReport report;
} Mark;

static ShutterSpan shutter_of(const Scene *scene, int64_t frame) {
    return shutter_seen(&scene->shutter, frame);
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
    for (uint32_t i = 0; i < parts->n_sets; i++) {
        if (parts->sets[i].moves) {
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
    size_t memory = world_memory(options);
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

// Parts of a cell that are open this near to each other, in frame periods, are taken for one.
static const double GAP = 0.25;

// What of each cell the shutters see.
static void gather_openings(World *world, const int64_t *frames, uint32_t n_frames) {
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
        bool is_near = kept > 0 && list[kept - 1].frame == list[i].frame &&
                       list[i].lo - list[kept - 1].hi < GAP;
        if (is_near) {
            list[kept - 1].hi = fmax(list[kept - 1].hi, list[i].hi);
        } else {
            list[kept++] = list[i];
        }
    }
    world->openings = list;
    world->n_openings = kept;
}

typedef struct {
    Form *form;
    uint32_t key;
} KeyJob;

// Every key of every form, in parallel; what a key holds depends on nothing else.
static bool store_forms(World *world, double first, uint32_t n_threads) {
    Assembly *parts = &world->parts;
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

// Forms that will be asked about one instant alone need one key: returns its seconds.
static double hold_still(World *world, int64_t frame) {
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        Form *form = world->parts.forms[i];
        form->moves = form->users != NULL; // whose instances are at many instants of their own
    }
    return instant_seconds(instant_at(frame - 1, world->scene->shutter.open), world->fps);
}

// False after an error was reported.
static bool sample(World *world, const RenderOptions *options, const int64_t *frames,
                   uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken) {
    double first =
        options->is_still ? hold_still(world, frames[0]) : film_first_seconds(world->scene);
    *n_taken = plan_frames(world, options, frames, n_frames);
    if (*n_taken == 0) {
        report_error(reporter, world->scene->camera.where,
                     "the shutter is open for more than a million frames, or a frame's pixels are "
                     "delayed over as many, while something moves");
        return false;
    }
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        if (world->parts.forms[i]->is_too_fast) {
            report_error(reporter, world->parts.forms[i]->shape->where,
                         "the clocks of its instances run over more than a million frame periods "
                         "of their own within a block of frames");
            return false;
        }
    }
    if (!store_forms(world, first, options->n_threads)) {
        report_error(reporter, world->scene->camera.where,
                     "the motion in one frame needs more than 67 million samples in time");
        return false;
    }
    gather_openings(world, frames, *n_taken);
    for (uint32_t i = 0; i < world->parts.n_forms; i++) {
        report_sampling(reporter, world->parts.forms[i]);
    }
    report_transforms(reporter, world->scene, world->openings, world->n_openings);
    return true;
}

World *world_sample(const Scene *scene, const RenderOptions *options, const int64_t *frames,
                    uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken) {
    World *world = world_new(scene, options, reporter);
    if (!sample(world, options, frames, n_frames, reporter, n_taken)) {
        world_destroy(world);
        return NULL;
    }
    return world;
}
