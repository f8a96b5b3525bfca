// SPDX-License-Identifier: Apache-2.0
// The upper level: boxes of bodies over ticks of time, for the kd-tree above the objects.
//
// Ticks divide every cell in the same way whatever the block. A body's box over some ticks is
// halved in time until it is little larger than the body itself, or one tick long.
#include "render/world_parts.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum {
    FEW = 4,           // so many bodies are simply asked one after the other
    TICKS_MOVING = 16, // per cell, where something moves
};

// A box that motion makes this many times larger (half area) than the body is split in time.
static const double SWEPT = 1.6;

// Shutters are widened to this grid (frame periods), so that a box hardly depends on the block.
static const double OPEN_GRID = 1.0 / 1024;

typedef struct {
    World *world;
    BoxSegment *segments;
    size_t n, capacity;
    Arena arena;
} Top;

uint32_t tick_of(const TickAxis *axis, Instant at) {
    uint32_t lo = 0, hi = axis->n_cells;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (axis->cells[mid] <= at.frame) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    if (lo == 0) {
        return 0;
    }
    if (axis->cells[lo - 1] < at.frame) {
        return lo * axis->per_cell - 1;
    }
    return (lo - 1) * axis->per_cell + (uint32_t)(at.frac * axis->per_cell);
}

static double half_area(Bounds b) {
    Vec3 e = vec3_sub(b.hi, b.lo);
    return bounds_are_empty(b) ? 0 : e.x * e.y + e.y * e.z + e.z * e.x;
}

// Outwards.
static float float_below(double x) {
    return nextafterf((float)fmax(fmin(x, FLT_MAX), -FLT_MAX), -INFINITY);
}

static float float_above(double x) {
    return nextafterf((float)fmax(fmin(x, FLT_MAX), -FLT_MAX), INFINITY);
}

static void add_segment(Top *top, uint32_t id, Bounds b, uint32_t tick0, uint32_t tick1) {
    if (bounds_are_empty(b)) {
        return;
    }
    BoxSegment s = {{fmaxf(float_below(b.lo.x), -FLT_MAX), fmaxf(float_below(b.lo.y), -FLT_MAX),
                     fmaxf(float_below(b.lo.z), -FLT_MAX)},
                    {fminf(float_above(b.hi.x), FLT_MAX), fminf(float_above(b.hi.y), FLT_MAX),
                     fminf(float_above(b.hi.z), FLT_MAX)},
                    tick0,
                    tick1,
                    id};
    top->segments = arena_grow(&top->arena, top->segments, top->n, &top->capacity, sizeof s);
    top->segments[top->n++] = s;
}

// The part of [lo, hi] of a cell that shutters see, on a coarse grid; false: none.
static bool clip_open(const Opening *open, double *lo, double *hi) {
    // The very end belongs to the next tick, but rays may be there by rounding.
    *lo = fmax(*lo, floor(open->lo / OPEN_GRID) * OPEN_GRID);
    *hi = fmin(*hi, ceil(open->hi / OPEN_GRID) * OPEN_GRID);
    return *lo <= *hi;
}

static Bounds bounds_of(const World *world, uint32_t id, int64_t frame, double lo, double hi) {
    uint32_t first, last;
    const InstanceSet *set = assembly_group(&world->parts, id, &first, &last);
    if (!set) {
        return body_bounds(&world->parts.bodies[id], world->fps, frame, lo, hi);
    }
    Bounds b = bounds_empty();
    for (uint32_t k = first; k < last; k++) {
        b = bounds_join(b, instance_bounds(set, k, world->fps, frame, lo, hi));
    }
    return b;
}

static void add_span(Top *top, uint32_t id, const Opening *open, uint32_t cell, uint32_t tick0,
                     uint32_t tick1) {
    const World *world = top->world;
    const TickAxis *axis = &world->ticks;
    double lo = (double)tick0 / axis->per_cell, hi = (double)tick1 / axis->per_cell;
    int64_t frame = axis->cells[cell];
    if (!clip_open(open, &lo, &hi)) {
        return;
    }
    Bounds swept = bounds_of(world, id, frame, lo, hi);
    if (tick1 - tick0 > 1) {
        double still = 0;
        int n = id < world->parts.n_bodies ? 3 : 1; // of a group members differ already
        for (int k = 0; k < n; k++) {
            double at = lo + (hi - lo) * (0.5 + 0.33 * (k - n / 2));
            still += half_area(bounds_of(world, id, frame, at, at)) / n;
        }
        if (half_area(swept) > SWEPT * still) {
            uint32_t mid = (tick0 + tick1) / 2;
            add_span(top, id, open, cell, tick0, mid);
            add_span(top, id, open, cell, mid, tick1);
            return;
        }
    }
    add_segment(top, id, swept, cell * axis->per_cell + tick0, cell * axis->per_cell + tick1);
}

static bool changes(const World *world, uint32_t id) {
    uint32_t first, last;
    const InstanceSet *set = assembly_group(&world->parts, id, &first, &last);
    const Body *body = &world->parts.bodies[id];
    return set ? set->moves : body->moves || body->form->n_spans > 0;
}

// Where one opening's ticks end and those of the next one in its cell begin.
static uint32_t tick_between(const TickAxis *axis, const Opening *open) {
    return (uint32_t)(axis->per_cell * 0.5 * (open[0].hi + open[1].lo) + 0.5);
}

static void add_body(Top *top, uint32_t id) {
    const World *world = top->world;
    const TickAxis *axis = &world->ticks;
    if (!changes(world, id)) {
        add_segment(top, id, bounds_of(world, id, axis->cells[0], 0, 0), 0,
                    axis->n_cells * axis->per_cell);
        return;
    }
    const Opening *open = world->openings, *end = open + world->n_openings;
    for (uint32_t cell = 0, tick = 0; open < end; open++) {
        bool is_last = open + 1 == end || open[1].frame != open->frame;
        uint32_t until = is_last ? axis->per_cell : tick_between(axis, open);
        add_span(top, id, open, cell, tick, until);
        tick = is_last ? 0 : until;
        cell += is_last;
    }
}

static void lay_out_ticks(World *world, const Opening *openings, size_t n) {
    TickAxis *axis = &world->ticks;
    axis->per_cell = 1;
    for (uint32_t i = 0; i < assembly_n_things(&world->parts); i++) {
        if (changes(world, i)) {
            axis->per_cell = TICKS_MOVING;
        }
    }
    if (axis->per_cell == 1) {
        n = 1; // time plays no part
    }
    axis->cells = ARENA_ARRAY(&world->arena, n, int64_t);
    axis->n_cells = 0;
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || openings[i].frame != openings[i - 1].frame) {
            axis->cells[axis->n_cells++] = openings[i].frame;
        }
    }
}

void top_build(World *world, const RenderOptions *options, AccelStats *stats) {
    *stats = (AccelStats){0};
    lay_out_ticks(world, world->openings, world->n_openings);
    if (world->parts.n_sets == 0 && world->parts.n_bodies <= FEW) {
        return;
    }
    // Chunks by any thread, joined in their order.
    enum { CHUNK = 1024 };
    uint32_t n_things = assembly_n_things(&world->parts), n_chunks = (n_things - 1) / CHUNK + 1;
    Arena scratch = {0};
    Top *tops = ARENA_ARRAY(&scratch, n_chunks, Top);
#pragma omp parallel for schedule(dynamic) num_threads(options->n_threads)
    for (uint32_t c = 0; c < n_chunks; c++) {
        tops[c].world = world;
        for (uint32_t i = c * CHUNK; i < n_things && i < (c + 1) * CHUNK; i++) {
            add_body(&tops[c], i);
        }
    }
    size_t n = 0;
    for (uint32_t c = 0; c < n_chunks; c++) {
        n += tops[c].n;
    }
    BoxSegment *segments = ARENA_ARRAY(&scratch, n, BoxSegment);
    n = 0;
    for (uint32_t c = 0; c < n_chunks; c++) {
        memcpy(segments + n, tops[c].segments, tops[c].n * sizeof *segments);
        n += tops[c].n;
        arena_free(&tops[c].arena);
    }
    AccelOptions accel = options->accel_options;
    accel.n_threads = options->n_threads;
    accel.memory = 0;
    world->top = boxtree_build(segments, n, world->ticks.n_cells * world->ticks.per_cell, NULL,
                               &accel, stats);
    arena_free(&scratch);
}
