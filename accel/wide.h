// SPDX-License-Identifier: Apache-2.0
// The wide tree over clusters: 16-wide nodes whose boxes move linearly with time.
//
// Built as a binary tree by the surface area heuristic over clusters with moving boxes (a box's
// area is its mean over the time interval), cut in time where re-bounding the halves gains enough,
// then collapsed to nodes of 16 lanes by dynamic programming (Ylitie, Karras, Laine, "Efficient
// Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 4.1). Splits
// are of objects, not of space: it is a bounding volume hierarchy in space and time.
//
// Time in the tree is w = key + f, the geometry's own measure, in which every vertex moves linearly
// between whole numbers; cuts in time are at whole ticks (accel/accel.h), compared as integers.
#ifndef ACCEL_WIDE_H
#define ACCEL_WIDE_H

#include "accel/cluster.h"
#include "accel/intersect.h"

enum { WIDE_LANES = CLUSTER_LANES };

// What a child is: kind in the two highest bits, index within its kind below.
typedef enum { CHILD_NODE, CHILD_CLUSTER, CHILD_TIME, CHILD_NONE } ChildKind;

static inline uint32_t child_of(ChildKind kind, uint32_t index) {
    return (uint32_t)kind << 30 | index;
}

static inline ChildKind child_kind(uint32_t child) {
    return (ChildKind)(child >> 30);
}

static inline uint32_t child_index(uint32_t child) {
    return child & 0x3fffffff;
}

// Per axis lo, hi and, where anything moves, their rates per unit of w: the box at w is lo + w*vlo
// to hi + w*vhi. Empty lanes have lo = 1e30, hi = -1e30.
//
//   moving: 6 + 6 rows of 16 floats, 16 children: 832 bytes      static: 448 bytes
typedef struct {
    uint32_t child[WIDE_LANES];
    float lo[3][WIDE_LANES], hi[3][WIDE_LANES];
} WideBoxes;

typedef struct {
    WideBoxes at;
    float vlo[3][WIDE_LANES], vhi[3][WIDE_LANES];
} WideNode;

// Rays before the tick go to child[0], the others to child[1].
typedef struct {
    uint32_t tick, child[2];
} TimeNode;

typedef struct WideTree WideTree;
typedef bool WideTrace(const WideTree *tree, const AccelRay *ray, AccelHit *hit,
                       AccelCounters *count);

typedef struct {
    WideTrace *closest, *occluded;
} WideKernels;

struct WideTree {
    Accel base;
    WideKernels trace; // of the instruction set in use
    const Geometry *geometry;
    ClusterSet *set;
    bool is_moving;
    uint32_t n_spans; // at least 1
    void *nodes;      // WideNode[n_nodes], or WideBoxes[n_nodes] where nothing moves
    TimeNode *times;
    uint32_t n_nodes, n_times;
    uint32_t root; // a child; CHILD_NONE: nothing can be hit
    // The cuts in time next to the root as a table: where a ray begins, by its tick >> root_shift.
    uint32_t *roots, n_roots, root_shift;
};

static inline uint32_t wide_root(const WideTree *tree, uint32_t tick) {
    return tree->roots[tick >> tree->root_shift];
}

static inline WideBoxes *wide_boxes(const WideTree *tree, bool is_moving, uint32_t index) {
    return is_moving ? &((WideNode *)tree->nodes)[index].at : &((WideBoxes *)tree->nodes)[index];
}

// The binary tree that is collapsed (accel/wide_build.c), with room for so many nodes at first.
enum { BINARY_FIRST = 1024 };

typedef struct {
    MovingBox box; // over ticks [tick0, tick1]
    uint32_t tick0, tick1;
    uint32_t left, right; // leaves: UINT32_MAX and the cluster
    uint32_t split;       // the tick of a cut in time, else 0
    float area;
} BinaryNode;

typedef struct {
    BinaryNode *nodes;
    uint32_t n, capacity;
    uint64_t n_time_splits;
    uint32_t depth;
    bool is_out_of_memory;
} BinaryTree;

// share: prefix sums of the ticks' lengths, [last tick + 1]. Root is node 0.
void binary_build(BinaryTree *tree, const ClusterSet *set, const double *share, uint32_t last_tick);

// False: no memory.
bool wide_collapse(WideTree *wide, const BinaryTree *tree);

// The structure "bvh16" behind accel/accel.h.
Accel *wide_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats);
bool wide_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit, AccelCounters *count);
bool wide_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count);
bool wide_validate(const Accel *accel, char *why, size_t n);
void wide_destroy(Accel *accel);

// [spheres, not triangles][moving]
extern const WideKernels wide_kernels_scalar[2][2], wide_kernels_avx2[2][2],
    wide_kernels_avx512[2][2];

#endif
