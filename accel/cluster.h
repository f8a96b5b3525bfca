// SPDX-License-Identifier: Apache-2.0
// Clusters: the units of the wide trees. A cluster is up to 16 triangles over up to 16 distinct
// vertices, or up to 16 spheres, so that one wide register holds one coordinate of all of it.
//
// Vertices that are equal in every key are one (welded), so meshes whose triangles do not share
// vertices cluster as well as those that do. Unused lanes name one vertex three times: a triangle
// of area 0, which is never hit, so no kernel needs a count.
#ifndef ACCEL_CLUSTER_H
#define ACCEL_CLUSTER_H

#include "accel/accel.h"

enum { CLUSTER_LANES = 16 };

typedef struct {
    uint8_t corner[3][CLUSTER_LANES]; // triangle lane -> vertex lane
    int32_t prim[CLUSTER_LANES];      // -1: the lane is unused
    uint32_t vertex[CLUSTER_LANES];   // vertex lane -> vertex of the geometry; unused: as lane 0
} Cluster;

// A box whose faces move linearly from one instant to another.
typedef struct {
    float lo0[3], hi0[3], lo1[3], hi1[3];
} MovingBox;

typedef struct {
    const Geometry *geometry;
    uint32_t n_clusters;
    uint32_t n_rows; // per key: x y z, for spheres also the radius
    Cluster *clusters;
    float *keys;  // [n_clusters][n_keys][n_rows][16], 64-byte aligned
    float *boxes; // [n_clusters][n_keys][6] lo, hi of each key, padded; needed by the build only
    size_t bytes; // of clusters and keys
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

// Its mean half area over the interval: exact, since the half area is quadratic in time (Simpson).
double moving_box_area(const MovingBox *box);
void moving_box_join(MovingBox *box, const MovingBox *other);
MovingBox moving_box_empty(void);

#endif
