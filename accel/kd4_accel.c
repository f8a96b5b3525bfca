// SPDX-License-Identifier: Apache-2.0
// kd4-thesis and kd3: segmentation, tree and their checks, put together.
#include "accel/kd4_accel.h"

#include "accel/clock.h"
#include "accel/segment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

// What the build of a tree that deserves the name takes for each segment: its box, its record, its
// edges on four axes (twice, for the first sort) and some list entries.
enum { BYTES_PER_SEGMENT = 36 + 12 + 128 + 1 + 40 };

// ---- Building

// With less memory segments get coarser first: a tree over coarse segments beats a list of fine
// ones. The last try takes whatever holds one segment for each stretch of time.
static bool segment_within(const Geometry *geometry, const AccelOptions *options, Budget *budget,
                           SegmentList *list) {
    size_t most = 1u << 30, room = most;
    if (budget->limit) {
        size_t left = budget->limit > budget->used ? budget->limit - budget->used : 0;
        most = left / BYTES_PER_SEGMENT < most ? left / BYTES_PER_SEGMENT : most;
        room = left / (sizeof(BoxSegment) + sizeof(Subprimitive) + sizeof(uint32_t));
    }
    for (double kappa = options->kappa > 0 ? options->kappa : 2; kappa < 1e4; kappa *= 2) {
        if (segment_all(geometry, kappa, most, budget, list)) {
            return true;
        }
    }
    return segment_all(geometry, INFINITY, most, budget, list) ||
           segment_all(geometry, INFINITY, room, budget, list);
}

static size_t prefix_size(const Geometry *geometry) {
    return ((size_t)geometry_spans(geometry) + 1) * sizeof(double);
}

static bool build_tree(struct Kd4Accel *a, const SegmentList *list, const AccelOptions *options,
                       Budget *budget, AccelStats *stats) {
    size_t size = prefix_size(a->geometry), n_spans = geometry_spans(a->geometry);
    double *prefix = budget_resize(budget, NULL, 0, size);
    if (!prefix) {
        return false;
    }
    prefix[0] = 0;
    for (uint32_t i = 0; i < n_spans; i++) {
        prefix[i + 1] = prefix[i] + segment_share(a->geometry, i);
    }
    TimeAxis axis = {(uint32_t)n_spans * TICKS_PER_SPAN, TICKS_PER_SPAN, prefix};
    bool ok = kd4_build(list->boxes, list->n, &axis, options, budget, &a->tree, stats);
    budget_resize(budget, prefix, size, 0);
    for (int i = 0; i < 3; i++) {
        a->reach = fmaxf(a->reach, fmaxf(fabsf(a->tree.lo[i]), fabsf(a->tree.hi[i])));
    }
    return ok;
}

static bool keep_segments(struct Kd4Accel *a, const SegmentList *list, Budget *budget) {
    size_t n = list->n ? list->n : 1;
    a->segments = budget_resize(budget, NULL, 0, n * sizeof *a->segments);
    for (uint32_t i = 0; a->segments && i < list->n; i++) {
        const BoxSegment *box = &list->boxes[i];
        a->segments[i] = (Subprimitive){box->tick0, box->tick1, box->id};
    }
    a->n_segments = list->n;
    return a->segments;
}

// No memory for anything: the one leaf that holds all primitives is not even written down.
static void make_whole(struct Kd4Accel *a, Budget *budget, AccelStats *stats) {
    if (a->segments) {
        size_t n = a->n_segments ? a->n_segments : 1;
        a->segments = budget_resize(budget, a->segments, n * sizeof *a->segments, 0);
    }
    a->n_segments = 0;
    stats->n_segments = 0;
    stats->n_leaves = stats->leaves_by[LEAF_BY_MEMORY] = 1;
    stats->n_references = a->geometry->n_prims;
}

static void fill_stats(const struct Kd4Accel *a, const SegmentList *list, AccelStats *stats) {
    stats->n_prims = a->geometry->n_prims;
    stats->n_segments = list->n;
    stats->n_dropped = list->n_dropped;
    stats->kappa_min = list->kappa_min;
    stats->kappa_median = list->kappa_median;
    stats->kappa_max = list->kappa_max;
}

static Accel *build(const char *name, const Geometry *geometry, const AccelOptions *options,
                    AccelStats *stats) {
    AccelStats own = {0};
    struct Kd4Accel *a = calloc(1, sizeof *a);
    if (!a) {
        return NULL;
    }
    *a = (struct Kd4Accel){{accel_find(name)}, geometry, trace_kernels()};
    size_t most = options->kept ? options->kept : options->memory;
    Budget budget = {most, sizeof *a, sizeof *a};
    SegmentList list;
    double start = clock_seconds();
    bool ok = segment_within(geometry, options, &budget, &list);
    fill_stats(a, &list, &own);
    own.segment_seconds = clock_seconds() - start;
    start = clock_seconds();
    ok = ok && keep_segments(a, &list, &budget) && build_tree(a, &list, options, &budget, &own);
    if (!ok) {
        make_whole(a, &budget, &own);
    }
    segment_free(&list, &budget);
    own.build_seconds = clock_seconds() - start;
    own.segment_bytes = (a->segments ? a->n_segments + !a->n_segments : 0) * sizeof *a->segments;
    own.tree_bytes = budget.used - own.segment_bytes;
    own.peak_bytes = budget.peak;
    if (stats) {
        *stats = own;
    }
    return &a->accel;
}

Accel *kd4_accel_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats) {
    const char *names[] = {"kd3", "kd4-thesis"};
    return build(names[options->split_time], geometry, options, stats);
}

Accel *kd3_accel_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats) {
    AccelOptions no_time = *options;
    no_time.split_time = false;
    return build("kd3", geometry, &no_time, stats);
}

void kd4_accel_destroy(Accel *accel) {
    struct Kd4Accel *a = (struct Kd4Accel *)accel;
    if (a) {
        free(a->tree.nodes);
        free(a->tree.list);
        free(a->segments);
        free(a);
    }
}

// ---- Asking

bool kd4_accel_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit,
                       AccelCounters *count) {
    const struct Kd4Accel *a = (const struct Kd4Accel *)accel;
    return a->tree.nodes ? a->kernels->kd4_closest(a, ray, hit, count)
                         : a->kernels->brute_closest(a->geometry, ray, hit, count);
}

bool kd4_accel_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count) {
    const struct Kd4Accel *a = (const struct Kd4Accel *)accel;
    return a->tree.nodes ? a->kernels->kd4_occluded(a, ray, count)
                         : a->kernels->brute_occluded(a->geometry, ray, count);
}

// ---- Checking

#define FAIL(...) (snprintf(why, n, __VA_ARGS__), false)

// The segments of a primitive follow one another through all the spans where it is present.
static bool check_tiling(const struct Kd4Accel *a, char *why, size_t n) {
    uint32_t n_spans = geometry_spans(a->geometry), i = 0;
    for (uint32_t prim = 0; prim < a->geometry->n_prims; prim++) {
        for (uint32_t span = 0; span < n_spans; span++) {
            uint32_t tick = span * TICKS_PER_SPAN, end = tick + TICKS_PER_SPAN;
            bool present = segment_is_present(a->geometry, prim, span);
            while (i < a->n_segments && a->segments[i].prim == prim && a->segments[i].tick0 < end) {
                const Subprimitive *s = &a->segments[i];
                bool follows = s->tick0 == tick || s->tick0 < span * TICKS_PER_SPAN;
                if (!present || !follows || s->tick0 >= s->tick1) {
                    return FAIL("segment %u of primitive %u: ticks %u to %u, where %u is next", i,
                                prim, s->tick0, s->tick1, tick);
                }
                if (s->tick1 > end) {
                    tick = end;
                    break;
                }
                tick = s->tick1;
                i++;
            }
            // A stretch without any segment is one without extent; one that ends early is wrong.
            if (tick != end && tick != span * TICKS_PER_SPAN) {
                return FAIL("primitive %u: its segments end at tick %u of %u", prim, tick, end);
            }
        }
    }
    return i == a->n_segments || FAIL("segment %u is out of order", i);
}

// At some times of the interval, its ends among them, each vertex is in the box.
static bool check_box(const Geometry *g, const Subprimitive *s, const BoxSegment *box) {
    uint32_t n_corners = g->kind == GEOMETRY_TRIANGLES ? 3 : 1;
    bool inside = true;
    for (uint32_t i = 0; i <= 8; i++) {
        double at = s->tick0 + (double)(s->tick1 - s->tick0) * i / 8;
        uint32_t span = (uint32_t)at / TICKS_PER_SPAN;
        span = span > (s->tick1 - 1) / TICKS_PER_SPAN ? span - 1 : span;
        double f = at / TICKS_PER_SPAN - span;
        for (uint32_t c = 0; c < n_corners; c++) {
            size_t v = n_corners == 3 ? g->index[3 * (size_t)s->prim + c] : s->prim;
            size_t k0 = (size_t)g->n_vertices * span + v;
            size_t k1 = g->n_keys > 1 ? k0 + g->n_vertices : k0;
            double r = g->radius ? g->radius[k0] + f * ((double)g->radius[k1] - g->radius[k0]) : 0;
            for (int k = 0; k < 3; k++) {
                double a = g->position[3 * k0 + k], b = g->position[3 * k1 + k];
                double p = a + f * (b - a);
                inside = inside && box->lo[k] <= p - r && p + r <= box->hi[k];
            }
        }
    }
    return inside;
}

static bool check_boxes(const struct Kd4Accel *a, BoxSegment *boxes, char *why, size_t n) {
    for (uint32_t i = 0; i < a->n_segments; i++) {
        const Subprimitive *s = &a->segments[i];
        boxes[i] = (BoxSegment){.tick0 = s->tick0, .tick1 = s->tick1, .id = s->prim};
        segment_box(a->geometry, s->prim, s->tick0, s->tick1, boxes[i].lo, boxes[i].hi);
        if (!check_box(a->geometry, s, &boxes[i])) {
            return FAIL("segment %u of primitive %u leaves its box", i, s->prim);
        }
    }
    return kd4_validate(&a->tree, boxes, a->n_segments, why, n);
}

bool kd4_accel_validate(const Accel *accel, char *why, size_t n) {
    const struct Kd4Accel *a = (const struct Kd4Accel *)accel;
    if (!a->tree.nodes) {
        return a->n_segments == 0 || FAIL("segments without a tree");
    }
    BoxSegment *boxes = malloc(((size_t)a->n_segments + 1) * sizeof *boxes);
    if (!boxes) {
        return FAIL("no memory to validate in");
    }
    bool ok = check_tiling(a, why, n) && check_boxes(a, boxes, why, n);
    free(boxes);
    return ok;
}
