// SPDX-License-Identifier: Apache-2.0
// The loops that run the kernels, one set per instruction set, and the choice among them.
#ifndef ACCEL_TRACE_H
#define ACCEL_TRACE_H

#include "accel/intersect.h"

struct Kd4Accel;

typedef struct {
    bool (*brute_closest)(const Geometry *geometry, const AccelRay *ray, AccelHit *hit,
                          AccelCounters *count);
    bool (*brute_occluded)(const Geometry *geometry, const AccelRay *ray, AccelCounters *count);
    bool (*kd4_closest)(const struct Kd4Accel *accel, const AccelRay *ray, AccelHit *hit,
                        AccelCounters *count);
    bool (*kd4_occluded)(const struct Kd4Accel *accel, const AccelRay *ray, AccelCounters *count);
} TraceKernels;

extern const TraceKernels trace_scalar, trace_avx2, trace_avx512;

// Those of cpu_now(). Structures keep them from their build on.
const TraceKernels *trace_kernels(void);

// What every kernel ends with. count may be NULL.
static inline void count_ray(AccelCounters *count, uint64_t n_nodes, uint64_t n_tests) {
    if (count) {
        count->rays++;
        count->nodes += n_nodes;
        count->prim_tests += n_tests;
    }
}

static inline bool report_hit(const RayState *state, const Nearest *nearest, AccelHit *hit) {
    bool is_hit = nearest->prim != INT32_MAX;
    if (is_hit) {
        *hit = (AccelHit){nearest->t * state->unscale, nearest->prim, nearest->u, nearest->v};
    } else {
        hit->prim = ACCEL_NO_PRIM;
    }
    return is_hit;
}

#endif
