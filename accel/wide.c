// SPDX-License-Identifier: Apache-2.0
// The wide tree as a structure: building, queries, the validator.
#include "accel/wide.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel/clock.h"
#include "accel/cpu.h"
#include "accel/kd4_accel.h"
#include "accel/trace.h"

// Prefix sums of the ticks' lengths.
static double *share_of_ticks(const Geometry *g, uint32_t last_tick) {
    double *share = malloc(((size_t)last_tick + 1) * sizeof *share);
    if (share) {
        share[0] = 0;
        for (uint32_t tick = 0; tick < last_tick; tick++) {
            double span = g->span_share ? g->span_share[tick / TICKS_PER_SPAN] : 1;
            share[tick + 1] = share[tick] + span / TICKS_PER_SPAN;
        }
    }
    return share;
}

// Down through the cuts in time at ticks that the table can tell apart.
static uint32_t root_at(const WideTree *wide, uint32_t tick) {
    uint32_t child = wide->root;
    while (child_kind(child) == CHILD_TIME) {
        const TimeNode *time = &wide->times[child_index(child)];
        if (time->tick >> wide->root_shift << wide->root_shift != time->tick) {
            break;
        }
        child = time->child[tick >= time->tick];
    }
    return child;
}

// Entries of a tick, or of several where that would be more than MOST.
static bool make_roots(WideTree *wide, uint32_t last_tick) {
    enum { MOST = 4096 };
    wide->root_shift = last_tick ? 0 : 31; // where nothing moves, rays still have times
    while (last_tick >> wide->root_shift >= MOST) {
        wide->root_shift++;
    }
    wide->n_roots = (last_tick >> wide->root_shift) + 1;
    wide->roots = malloc(wide->n_roots * sizeof *wide->roots);
    for (uint32_t i = 0; wide->roots && i < wide->n_roots; i++) {
        wide->roots[i] = root_at(wide, i << wide->root_shift);
    }
    return wide->roots != NULL;
}

static size_t tree_bytes(const WideTree *wide) {
    size_t node = wide->is_moving ? sizeof(WideNode) : sizeof(WideBoxes);
    return sizeof *wide + wide->n_nodes * node + wide->n_times * sizeof *wide->times +
           wide->n_roots * sizeof *wide->roots;
}

static bool build_tree(WideTree *wide, AccelStats *stats) {
    const Geometry *g = wide->geometry;
    uint32_t last_tick = g->n_keys > 1 ? (g->n_keys - 1) * TICKS_PER_SPAN : 0;
    double *share = share_of_ticks(g, last_tick);
    BinaryTree binary = {0};
    if (share) {
        binary_build(&binary, wide->set, share, last_tick);
    }
    bool is_built = share && !binary.is_out_of_memory && wide_collapse(wide, &binary) &&
                    make_roots(wide, last_tick);
    stats->n_time_splits = binary.n_time_splits;
    stats->n_depth = binary.depth;
    stats->n_references = (binary.n + 1) / 2;
    stats->peak_bytes = binary.capacity * sizeof *binary.nodes;
    free(binary.nodes);
    free(share);
    return is_built;
}

void wide_destroy(Accel *accel) {
    WideTree *wide = (WideTree *)accel;
    cluster_destroy(wide->set);
    free(wide->nodes);
    free(wide->times);
    free(wide->roots);
    free(wide);
}

// What a build is expected to take at its peak, on the large side: half-full clusters, each in
// COPIES references where cuts in time can multiply them. What was really taken is checked later.
static size_t expected_bytes(const Geometry *g) {
    enum { FILL = CLUSTER_LANES / 2, COPIES = 6 };
    size_t clusters = (size_t)g->n_prims / FILL + 2;
    size_t keys = g->n_keys * (4 * CLUSTER_LANES + 6) * sizeof(float);
    size_t reference = 2 * sizeof(BinaryNode) + 200 + sizeof(WideNode) / 4;
    size_t work = cluster_work_bytes(g) + BINARY_FIRST * sizeof(BinaryNode);
    size_t tree = (g->n_keys > 1 ? COPIES : 1) * reference;
    return work + clusters * (sizeof(Cluster) + keys + tree) + sizeof(WideTree);
}

Accel *wide_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats) {
    // The kd-tree gets coarser within any bound; this one has a size and either fits or does not.
    size_t reserved = expected_bytes(geometry);
    if (options->memory && reserved > options->memory) {
        return kd4_accel_build(geometry, options, stats);
    }
    *stats = (AccelStats){.n_prims = geometry->n_prims};
    WideTree *wide = calloc(1, sizeof *wide);
    if (!wide) {
        return NULL;
    }
    wide->base.type = accel_find("bvh16");
    wide->geometry = geometry;
    wide->is_moving = geometry->n_keys > 1;
    wide->n_spans = wide->is_moving ? geometry->n_keys - 1 : 1;
    static const WideKernels(*const kernels[CPU_COUNT])[2] = {
        [CPU_SCALAR] = wide_kernels_scalar,
        [CPU_AVX2] = wide_kernels_avx2,
        [CPU_AVX512] = wide_kernels_avx512,
    };
    wide->trace = kernels[cpu_now()][geometry->kind == GEOMETRY_SPHERES][wide->is_moving];
    double start = clock_seconds();
    wide->set = cluster_build(geometry, options->n_threads);
    double middle = clock_seconds();
    if (!wide->set || !build_tree(wide, stats)) {
        wide_destroy(&wide->base);
        return NULL;
    }
    size_t kept = wide->set->bytes + tree_bytes(wide), taken = stats->peak_bytes + kept;
    if ((options->memory && taken > options->memory) || (options->kept && kept > options->kept)) {
        wide_destroy(&wide->base);
        return kd4_accel_build(geometry, options, stats);
    }
    cluster_drop_boxes(wide->set);
    stats->segment_seconds = middle - start;
    stats->build_seconds = clock_seconds() - middle;
    stats->segment_bytes = wide->set->bytes;
    stats->tree_bytes = tree_bytes(wide);
    stats->peak_bytes = taken > reserved ? taken : reserved;
    stats->n_segments = wide->set->n_clusters;
    stats->n_nodes = wide->n_nodes;
    return &wide->base;
}

bool wide_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit, AccelCounters *count) {
    const WideTree *wide = (const WideTree *)accel;
    return wide->trace.closest(wide, ray, hit, count);
}

bool wide_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count) {
    const WideTree *wide = (const WideTree *)accel;
    AccelHit hit;
    return wide->trace.occluded(wide, ray, &hit, count);
}

// -- validator ------------------------------------------------------------------------------------

typedef struct {
    const WideTree *wide;
    uint64_t *ticks; // [n_clusters], how many ticks each cluster is reached at
    char *why;
    size_t n;
} Check;

static bool fail(const Check *check, const char *what, uint32_t index) {
    snprintf(check->why, check->n, "%s %u", what, index);
    return false;
}

// Every vertex of the cluster inside the lane's box at w, evaluated in the kernel's own floats.
static bool is_inside(const Check *check, const WideBoxes *boxes, int lane, uint32_t cluster,
                      uint32_t key, float f) {
    const WideTree *wide = check->wide;
    float w = (float)key + f;
    const WideNode *node = (const WideNode *)(const void *)boxes;
    const float *a = cluster_key(wide->set, cluster, key);
    const float *b = wide->is_moving ? a + wide->set->n_rows * CLUSTER_LANES : a;
    for (int axis = 0; axis < 3; axis++) {
        float lo = boxes->lo[axis][lane], hi = boxes->hi[axis][lane];
        if (wide->is_moving) {
            lo = fmaf(w, node->vlo[axis][lane], lo);
            hi = fmaf(w, node->vhi[axis][lane], hi);
        }
        for (int i = 0; i < CLUSTER_LANES; i++) {
            const float *p = a + axis * CLUSTER_LANES, *q = b + axis * CLUSTER_LANES;
            const float *r = a + 3 * CLUSTER_LANES, *s = b + 3 * CLUSTER_LANES;
            bool has_size = wide->set->n_rows == 3 || (isfinite(r[i]) && isfinite(s[i]));
            float x = fmaf(f, q[i] - p[i], p[i]);
            if (has_size && isfinite(x) && !(lo <= x && x <= hi)) {
                return false;
            }
        }
    }
    return true;
}

// Lists of the boxes on the way down: every one of them must hold what is below it.
typedef struct Way {
    const struct Way *up;
    const WideBoxes *boxes;
    int lane;
} Way;

static bool check_cluster(const Check *check, const Way *way, uint32_t cluster, uint32_t tick0,
                          uint32_t tick1) {
    if (cluster >= check->wide->set->n_clusters) {
        return fail(check, "no such cluster:", cluster);
    }
    check->ticks[cluster] += tick1 - tick0;
    for (; way; way = way->up) {
        for (uint32_t tick = tick0; tick <= tick1; tick += tick1 > tick0 ? 1 : 2) {
            bool is_last = tick == tick1 && tick1 > tick0;
            uint32_t key = (tick - is_last) / TICKS_PER_SPAN;
            float f = (float)(tick - key * TICKS_PER_SPAN) / TICKS_PER_SPAN;
            if (!is_inside(check, way->boxes, way->lane, cluster, key, f)) {
                return fail(check, "a box on the way does not hold cluster", cluster);
            }
        }
    }
    return true;
}

static bool check_child(const Check *check, const Way *way, uint32_t child, uint32_t tick0,
                        uint32_t tick1) {
    const WideTree *wide = check->wide;
    uint32_t index = child_index(child);
    switch (child_kind(child)) {
    case CHILD_NONE:
        return true;
    case CHILD_CLUSTER:
        return check_cluster(check, way, index, tick0, tick1);
    case CHILD_TIME: {
        const TimeNode *time = &wide->times[index];
        if (index >= wide->n_times || time->tick <= tick0 || time->tick >= tick1) {
            return fail(check, "a cut in time outside its interval:", index);
        }
        return check_child(check, way, time->child[0], tick0, time->tick) &&
               check_child(check, way, time->child[1], time->tick, tick1);
    }
    case CHILD_NODE:
        break;
    }
    if (index >= wide->n_nodes) {
        return fail(check, "no such node:", index);
    }
    const WideBoxes *boxes = wide_boxes(wide, wide->is_moving, index);
    for (int lane = 0; lane < WIDE_LANES; lane++) {
        Way here = {way, boxes, lane};
        if (!check_child(check, &here, boxes->child[lane], tick0, tick1)) {
            return false;
        }
    }
    return true;
}

bool wide_validate(const Accel *accel, char *why, size_t n) {
    const WideTree *wide = (const WideTree *)accel;
    uint32_t n_keys = wide->geometry->n_keys;
    uint32_t last = n_keys > 1 ? (n_keys - 1) * TICKS_PER_SPAN : 0;
    Check check = {wide, calloc((size_t)wide->set->n_clusters + 1, sizeof(uint64_t)), why, n};
    bool is_valid = check.ticks && check_child(&check, NULL, wide->root, 0, last);
    for (uint32_t tick = 0; is_valid && tick < last; tick++) {
        uint32_t child = wide_root(wide, tick), below = wide->root;
        while (below != child && child_kind(below) == CHILD_TIME) {
            const TimeNode *time = &wide->times[child_index(below)];
            below = time->child[tick >= time->tick];
        }
        is_valid = below == child || fail(&check, "the table of roots is wrong at tick", tick);
    }
    for (uint32_t c = 0; is_valid && c < wide->set->n_clusters; c++) {
        if (check.ticks[c] != last) {
            is_valid = fail(&check, "not reached once at every tick: cluster", c);
        }
    }
    free(check.ticks);
    return is_valid;
}
