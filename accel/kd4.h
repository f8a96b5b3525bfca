// SPDX-License-Identifier: Apache-2.0
// The 4D kd-tree of Olsson, "Efficient use of 4D kd-trees for ray tracing" (thesis, 2007): boxes in
// (x, y, z, time) are parted by planes in any of the four axes, chosen by one cost (equations 3
// and 5), into nodes of 8 bytes.
//
// Invariant: a box that overlaps a leaf's cell, open against open, is in the leaf's list. A box
// that only touches a plane is on its own side alone; the padding of the boxes makes up for the
// rounding of the traversal.
#ifndef ACCEL_KD4_H
#define ACCEL_KD4_H

#include "accel/boxtree.h"
#include "accel/budget.h"

enum { KD4_TIME = 3, KD4_LEAF = 4, KD4_TAG_BITS = 3, KD4_STACK = 64, KD4_MAX_DEPTH = 60 };

// word:  31 ................. 3 | 2 1 0
//        children's pair, or    | 0-2: split in x, y, z; 3: in time; 4: leaf
//        first of a leaf's list |
typedef struct {
    union {
        float split;   // left is below
        uint32_t tick; // left is before
        uint32_t n;    // length of a leaf's list
    };
    uint32_t word;
} Kd4Node;

static inline uint32_t kd4_tag(Kd4Node node) {
    return node.word & ((1u << KD4_TAG_BITS) - 1);
}

static inline uint32_t kd4_index(Kd4Node node) {
    return node.word >> KD4_TAG_BITS;
}

// nodes[0] is unused, nodes[1] the root; the children of a split are nodes[index] and
// nodes[index + 1], index even.
enum { KD4_ROOT = 1 };

typedef struct {
    Kd4Node *nodes;
    uint32_t *list; // indices of boxes, ascending within a leaf
    uint32_t n_nodes, n_list;
    float lo[3], hi[3]; // of all boxes
    uint32_t n_ticks;
} Kd4Tree;

// The relative length of the ticks [0, tick): prefix[i] for every unit-th tick, linear between.
typedef struct {
    uint32_t n_ticks, unit;
    const double *prefix; // [n_ticks / unit + 1]
} TimeAxis;

// Boxes are padded already: lo < hi on each axis, tick0 < tick1, nothing NaN; n < 2^30.
// Adds to stats all that concerns nodes and leaves. False: not even one leaf fits the budget, and
// nothing is taken. O(n log n).
bool kd4_build(const BoxSegment *boxes, uint32_t n, const TimeAxis *axis,
               const AccelOptions *options, Budget *budget, Kd4Tree *tree, AccelStats *stats);

// Every box is where the invariant wants it, children lie inside their parents, every node and
// every list entry is reached once, nothing loops.
bool kd4_validate(const Kd4Tree *tree, const BoxSegment *boxes, uint32_t n, char *why, size_t size);

size_t kd4_bytes(const Kd4Tree *tree);

// Rounds a double box outward to float and pads it (per axis) against the rounding of kernels and
// traversal: 16u of the largest coordinate, 8u of the largest extent, and 1e-36, u = 2^-24.
// largest[i]: at least max(|lo|, |hi|); of all the keys that the box was made from.
void kd4_pad_box(const double lo[3], const double hi[3], const double largest[3], float out_lo[3],
                 float out_hi[3]);

#endif
