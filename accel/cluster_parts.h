// SPDX-License-Identifier: Apache-2.0
// What building clusters (accel/cluster.c) and cutting sets (accel/cluster_cut.c) share.
#ifndef ACCEL_CLUSTER_PARTS_H
#define ACCEL_CLUSTER_PARTS_H

#include <string.h>
#include <xmmintrin.h>

#include "accel/cluster.h"

enum {
    MOST_PROBES = 3, // keys at which primitives are bounded: first, middle, last
    GRID_BITS = 6,   // of a coordinate in the grid that groups primitives
    GRID_CELLS = 1 << 3 * GRID_BITS,
    GROUP = 4096,            // primitives that are cut together, at least; by one thread
    GROUPED_FROM = 2 * GROUP // fewer are one group, without a grid
};

// Of the four floats three count.
typedef struct {
    __m128 lo, hi;
} ProbeBox;

// Primitives and their boxes are permuted together. Where a cluster begins its size is written
// down: which thread cut it leaves no trace.
typedef struct {
    const Geometry *geometry;
    uint32_t *welded;  // [n_vertices], the first vertex equal to it; spheres: NULL
    uint32_t n_probes; // 1 or MOST_PROBES
    uint32_t probe_key[MOST_PROBES];
    int n_threads;
    ProbeBox *boxes;  // [n_prims][n_probes]
    uint32_t *order;  // [n_prims], primitives
    uint8_t *size_at; // [n_prims], of the cluster that begins there, else 0
} ClusterBuilder;

static inline uint32_t cluster_welded(const ClusterBuilder *b, uint32_t vertex) {
    return b->welded ? b->welded[vertex] : vertex;
}

// 1 for a sphere, 3 for a triangle.
static inline int cluster_corners(const Geometry *g, uint32_t prim, uint32_t corner[3]) {
    if (g->kind == GEOMETRY_SPHERES) {
        corner[0] = prim;
        return 1;
    }
    memcpy(corner, g->index + (size_t)prim * 3, 3 * sizeof *corner);
    return 3;
}

static inline float cluster_radius(const Geometry *g, uint32_t key, uint32_t vertex) {
    float r = g->radius ? g->radius[(size_t)key * g->n_vertices + vertex] : 0;
    return r > 0 || r != r ? r : 0;
}

// The box at a key of those of n vertices that are finite; the origin where none is.
ProbeBox cluster_bound_finite(const Geometry *g, const uint32_t *vertex, int n, uint32_t key);

// The same, quicker where all are.
static inline ProbeBox cluster_bound_vertices(const Geometry *g, const uint32_t *vertex, int n,
                                              uint32_t key) {
    __m128 lo = _mm_set1_ps(INFINITY), hi = _mm_set1_ps(-INFINITY), sum = _mm_setzero_ps();
    for (int c = 0; c < n; c++) {
        const float *p = g->position + ((size_t)key * g->n_vertices + vertex[c]) * 3;
        __m128 at = _mm_setr_ps(p[0], p[1], p[2], 0);
        __m128 radius = _mm_set1_ps(cluster_radius(g, key, vertex[c]));
        __m128 low = _mm_sub_ps(at, radius), high = _mm_add_ps(at, radius);
        lo = _mm_min_ps(lo, low);
        hi = _mm_max_ps(hi, high);
        sum = _mm_add_ps(sum, _mm_mul_ps(_mm_sub_ps(high, low), _mm_setzero_ps()));
    }
    // 0 times what is not finite is NaN.
    bool is_finite = _mm_movemask_ps(_mm_cmpunord_ps(sum, sum)) == 0;
    return is_finite ? (ProbeBox){lo, hi} : cluster_bound_finite(g, vertex, n, key);
}

// The box of a primitive at one of the probes.
static inline ProbeBox cluster_probe(const ClusterBuilder *b, uint32_t prim, uint32_t probe) {
    uint32_t corner[3];
    int n = cluster_corners(b->geometry, prim, corner);
    return cluster_bound_vertices(b->geometry, corner, n, b->probe_key[probe]);
}

// Fills order, boxes and size_at. False: no memory.
bool cluster_cut(ClusterBuilder *b);

#endif
