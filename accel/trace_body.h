// SPDX-License-Identifier: Apache-2.0
// The text of one set of kernels: included once by each file that is compiled for an instruction
// set, which defines TRACE_KERNELS, the set's name.
#include "accel/trace_kd4_body.h"

// ---- No structure

static bool brute_closest(const Geometry *geometry, const AccelRay *ray, AccelHit *hit,
                          AccelCounters *count) {
    RayState state;
    Nearest nearest = {0, INT32_MAX, 0, 0};
    if (ray_prepare(geometry, ray, &state)) {
        nearest.t = state.tf;
        for (uint32_t i = 0; i < geometry->n_prims; i++) {
            intersect_prim(geometry, &state, (int32_t)i, &nearest);
        }
    }
    count_ray(count, 0, geometry->n_prims);
    return report_hit(&state, &nearest, hit);
}

static bool brute_occluded(const Geometry *geometry, const AccelRay *ray, AccelCounters *count) {
    RayState state;
    Nearest nearest = {0, INT32_MAX, 0, 0};
    uint32_t n = 0;
    if (ray_prepare(geometry, ray, &state)) {
        nearest.t = state.tf;
        while (n < geometry->n_prims && nearest.prim == INT32_MAX) {
            intersect_prim(geometry, &state, (int32_t)n++, &nearest);
        }
    }
    count_ray(count, 0, n);
    return nearest.prim != INT32_MAX;
}

const TraceKernels TRACE_KERNELS = {
    brute_closest,
    brute_occluded,
    kd4_closest,
    kd4_occluded,
};
