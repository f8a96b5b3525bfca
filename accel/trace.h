// SPDX-License-Identifier: Apache-2.0
// The loops that run the kernels, one set per instruction set, and the choice among them.
#ifndef ACCEL_TRACE_H
#define ACCEL_TRACE_H

#include "accel/intersect.h"

struct Kd4Accel;

typedef struct {
    const char *name; // as accel_set_cpu() takes it
    bool (*brute_closest)(const Geometry *geometry, const AccelRay *ray, AccelHit *hit,
                          AccelCounters *count);
    bool (*brute_occluded)(const Geometry *geometry, const AccelRay *ray, AccelCounters *count);
    bool (*kd4_closest)(const struct Kd4Accel *accel, const AccelRay *ray, AccelHit *hit,
                        AccelCounters *count);
    bool (*kd4_occluded)(const struct Kd4Accel *accel, const AccelRay *ray, AccelCounters *count);
} TraceKernels;

extern const TraceKernels trace_scalar, trace_avx2;

// What accel_set_cpu() chose. Structures keep it from their build on.
const TraceKernels *trace_kernels(void);

#endif
