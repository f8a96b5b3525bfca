// SPDX-License-Identifier: Apache-2.0
// Every primitive with the float kernels.
#include "accel/brute.h"

#include "accel/trace.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct {
    Accel accel;
    const Geometry *geometry;
    const TraceKernels *kernels;
} Brute;

Accel *brute_build(const Geometry *geometry, const AccelOptions *options, AccelStats *stats) {
    (void)options;
    *stats = (AccelStats){.n_prims = geometry->n_prims, .tree_bytes = sizeof(Brute)};
    stats->peak_bytes = stats->tree_bytes;
    Brute *brute = malloc(sizeof *brute);
    if (brute) {
        *brute = (Brute){{accel_find("brute")}, geometry, trace_kernels()};
    }
    return brute ? &brute->accel : NULL;
}

bool brute_closest(const Accel *accel, const AccelRay *ray, AccelHit *hit, AccelCounters *count) {
    const Brute *brute = (const Brute *)accel;
    return brute->kernels->brute_closest(brute->geometry, ray, hit, count);
}

bool brute_occluded(const Accel *accel, const AccelRay *ray, AccelCounters *count) {
    const Brute *brute = (const Brute *)accel;
    return brute->kernels->brute_occluded(brute->geometry, ray, count);
}

bool brute_validate(const Accel *accel, char *why, size_t n) {
    const Geometry *geometry = ((const Brute *)accel)->geometry;
    bool triangles = geometry->kind == GEOMETRY_TRIANGLES;
    for (size_t i = 0; triangles && i < 3 * (size_t)geometry->n_prims; i++) {
        if (geometry->index[i] >= geometry->n_vertices) {
            snprintf(why, n, "index %zu is %u, with %u vertices", i, geometry->index[i],
                     geometry->n_vertices);
            return false;
        }
    }
    return true;
}

void brute_destroy(Accel *accel) {
    free(accel);
}
