// SPDX-License-Identifier: Apache-2.0
// A 4D kd-tree over things that are known by their boxes in (x, y, z, time): the level above the
// objects. The same builder and the same nodes as kd4-thesis; a leaf calls back.
#ifndef ACCEL_BOXTREE_H
#define ACCEL_BOXTREE_H

#include <math.h>

#include "accel/accel.h"

// One thing's bound over ticks [tick0, tick1). A thing may have many, one after another; where it
// has none it does not exist.
typedef struct {
    float lo[3], hi[3];
    uint32_t tick0, tick1;
    uint32_t id;
} BoxSegment;

typedef struct BoxTree BoxTree;

// n_ticks: the length of the time axis; tick_share[n_ticks]: its ticks' relative lengths (NULL: all
// equal). Boxes are padded outwards by the builder against the rounding of the traversal.
BoxTree *boxtree_build(const BoxSegment *segments, size_t n, uint32_t n_ticks,
                       const double *tick_share, const AccelOptions *options, AccelStats *stats);

// Distances of hits come from the objects' own float frames, and may be wrong by so much of an
// object's size. Boxes enlarged by it make sure that no hit lies before its box, so that the order
// of visits, which depends on the tree, cannot change which hit is the nearest.
static const double BOX_HIT_ERROR = 0x1p-16;

// A ray as boxes are asked with: its origin, and the reciprocals of its direction.
typedef struct {
    double o[3], r[3];
} BoxRay;

typedef struct {
    double near, far;
} BoxInterval;

// Distances to planes are moved by so much of themselves, far above the rounding of double.
static inline double box_lower(double t) {
    return t - fabs(t) * 0x1p-48;
}

static inline double box_upper(double t) {
    return t + fabs(t) * 0x1p-48;
}

// What of an interval of a ray lies in a box; near > far: nothing.
static inline BoxInterval box_clip(const BoxRay *ray, const float lo[3], const float hi[3],
                                   BoxInterval in) {
    for (int i = 0; i < 3; i++) {
        double a = (lo[i] - ray->o[i]) * ray->r[i], b = (hi[i] - ray->o[i]) * ray->r[i];
        double near = box_lower(a < b ? a : b), far = box_upper(a < b ? b : a);
        in.near = near > in.near ? near : in.near;
        in.far = far < in.far ? far : in.far;
    }
    return in;
}

// Called for each thing whose box the ray may meet before tmax, nearer cells first, each thing at
// most a few times (twice only where it lies in several cells and others came between). Returns
// the new tmax: the old one, or the distance of a hit found; -INFINITY ends the search.
typedef double BoxVisit(void *context, uint32_t id, const BoxRay *ray, double tmax);

void boxtree_trace(const BoxTree *tree, const double origin[3], const double dir[3], double tmin,
                   double tmax, uint32_t tick, BoxVisit *visit, void *context,
                   AccelCounters *count);

bool boxtree_validate(const BoxTree *tree, char *why, size_t n);
size_t boxtree_bytes(const BoxTree *tree);
void boxtree_destroy(BoxTree *tree);

#endif
