// SPDX-License-Identifier: Apache-2.0
// Clusters: the units of the wide trees. A cluster is up to 16 triangles over up to 16 distinct
// vertices, or up to 16 spheres, so that one wide register holds one coordinate of all of it.
//
// Vertices that are equal in every key are one (welded), so meshes whose triangles do not share
// vertices cluster as well as those that do. Unused lanes name one vertex three times: a triangle
// of area 0, which is never hit, but whose edge functions, all 0, say that every ray may pass it.
#ifndef ACCEL_CLUSTER_H
#define ACCEL_CLUSTER_H

#include <math.h>
#include <stddef.h>
#include <xmmintrin.h>

#include "accel/accel.h"

enum { CLUSTER_LANES = 16 };

// Two cache lines: what finds the lanes that a ray may hit, and the names of what is hit.
typedef struct {
    _Alignas(64) uint8_t corner[3][CLUSTER_LANES]; // triangle lane -> vertex lane
    uint32_t used;                                 // bit i: lane i holds a primitive
    _Alignas(64) int32_t prim[CLUSTER_LANES];      // of the geometry; -1: the lane is unused
} Cluster;

// A box whose faces move linearly from one instant to another.
typedef struct {
    float lo0[3], lo1[3], hi0[3], hi1[3];
} MovingBox;

typedef struct {
    const Geometry *geometry;
    uint32_t n_clusters;
    uint32_t n_rows; // per key: x y z, for spheres also the radius
    Cluster *clusters;
    float *keys;  // [n_clusters][n_keys][n_rows][16], 64-byte aligned
    float *boxes; // [n_clusters][n_keys][6] lo, hi of each key, padded; needed by the build only
    size_t bytes; // of clusters and keys
    float reach;  // no coordinate of anything is larger, whatever its sign
} ClusterSet;

// By surface area from the top down (accel/cluster.c). All memory is the set's own.
// NULL: no memory.
ClusterSet *cluster_build(const Geometry *geometry, uint32_t n_threads);
// What it takes beside its result while it works, at most.
size_t cluster_work_bytes(const Geometry *geometry);
void cluster_drop_boxes(ClusterSet *set);
void cluster_destroy(ClusterSet *set);

static inline const float *cluster_key(const ClusterSet *set, uint32_t cluster, uint32_t key) {
    size_t row = (size_t)cluster * set->geometry->n_keys + key;
    return set->keys + row * set->n_rows * CLUSTER_LANES;
}

// The tightest moving box of one cluster over ticks [tick0, tick1] whose faces are those of the box
// at both ends, shifted outwards by what the keys between them need.
MovingBox cluster_bound(const ClusterSet *set, uint32_t cluster, uint32_t tick0, uint32_t tick1);

static inline MovingBox moving_box_empty(void) {
    MovingBox box;
    for (int a = 0; a < 3; a++) {
        box.lo0[a] = box.lo1[a] = INFINITY;
        box.hi0[a] = box.hi1[a] = -INFINITY;
    }
    return box;
}

static inline void moving_box_join(MovingBox *box, const MovingBox *other) {
    _Static_assert(offsetof(MovingBox, hi0) == 6 * sizeof(float), "both lows, then both highs");
    float *lo = box->lo0, *hi = box->hi0;
    const float *other_lo = other->lo0, *other_hi = other->hi0;
    __m128 none = _mm_setzero_ps();
    __m128 low = _mm_min_ps(_mm_loadu_ps(lo), _mm_loadu_ps(other_lo));
    __m128 low_rest = _mm_min_ps(_mm_loadl_pi(none, (const __m64 *)(const void *)(lo + 4)),
                                 _mm_loadl_pi(none, (const __m64 *)(const void *)(other_lo + 4)));
    __m128 high = _mm_max_ps(_mm_loadu_ps(hi), _mm_loadu_ps(other_hi));
    __m128 high_rest = _mm_max_ps(_mm_loadl_pi(none, (const __m64 *)(const void *)(hi + 4)),
                                  _mm_loadl_pi(none, (const __m64 *)(const void *)(other_hi + 4)));
    _mm_storeu_ps(lo, low);
    _mm_storel_pi((__m64 *)(void *)(lo + 4), low_rest);
    _mm_storeu_ps(hi, high);
    _mm_storel_pi((__m64 *)(void *)(hi + 4), high_rest);
}

// Its mean half area over the interval: exact, since the half area is quadratic in time (Simpson).
// Of the three heights the middle one is at the mean of the edges, so the half areas of the ends
// and the products between them say all: (2 A0 + 2 A1 + M) / 6, with M the mixed products.
static inline double moving_box_area(const MovingBox *box) {
    double e0[3], e1[3];
    for (int a = 0; a < 3; a++) {
        e0[a] = (double)box->hi0[a] - box->lo0[a];
        e1[a] = (double)box->hi1[a] - box->lo1[a];
    }
    if (!(e0[0] >= 0)) {
        return 0; // an empty one
    }
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        int b = a == 2 ? 0 : a + 1;
        sum += e0[a] * (2 * e0[b] + e1[b]) + e1[a] * (2 * e1[b] + e0[b]);
    }
    return sum / 6;
}

#endif
