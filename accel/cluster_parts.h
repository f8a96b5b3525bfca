// SPDX-License-Identifier: Apache-2.0
// What building clusters (accel/cluster.c) and cutting sets (accel/cluster_cut.c) share.
#ifndef ACCEL_CLUSTER_PARTS_H
#define ACCEL_CLUSTER_PARTS_H

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
    int n_threads;
    ProbeBox *boxes;  // [n_prims][n_probes]
    uint32_t *order;  // [n_prims], primitives
    uint8_t *size_at; // [n_prims], of the cluster that begins there, else 0
} ClusterBuilder;

static inline uint32_t cluster_welded(const ClusterBuilder *b, uint32_t vertex) {
    return b->welded ? b->welded[vertex] : vertex;
}

// The box of a primitive at one of the probes.
ProbeBox cluster_probe(const ClusterBuilder *b, uint32_t prim, uint32_t probe);

// Fills order, boxes and size_at. False: no memory.
bool cluster_cut(ClusterBuilder *b);

#endif
