// SPDX-License-Identifier: Apache-2.0
// kd4-thesis and kd3: the kd-tree over the temporal segments of one geometry's primitives.
// The functions are those of AccelType.
#ifndef ACCEL_KD4_ACCEL_H
#define ACCEL_KD4_ACCEL_H

#include "accel/kd4.h"
#include "accel/trace.h"

// A subprimitive: it exists in the ticks [tick0, tick1).
typedef struct {
    uint32_t tick0, tick1, prim;
} Subprimitive;

struct Kd4Accel {
    Accel accel;
    const Geometry *geometry;
    const TraceKernels *kernels;
    Kd4Tree tree; // over the segments; without nodes where not even one leaf fitted the memory
    Subprimitive *segments;
    uint32_t n_segments;
    float reach; // the largest coordinate of the tree's bounds
};

Accel *kd4_accel_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats);
Accel *kd3_accel_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats);
bool kd4_accel_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit,
                       AccelCounters *count);
bool kd4_accel_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count);
bool kd4_accel_validate(const Accel *accel, char *why, size_t n);
void kd4_accel_destroy(Accel *accel);

#endif
