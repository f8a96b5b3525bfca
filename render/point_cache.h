// SPDX-License-Identifier: Apache-2.0
// Point caches: the places of a mesh's vertices at many instants, as other programs write them.
//
// PC2 (3ds Max, Blender): "POINTCACHE2\0", version 1, points, start, step, samples; little-endian.
// Sample k stands at (start + k step) frames. MDD (LightWave): samples, points, the samples' times
// in seconds; big-endian. Both go on with 32-bit x y z for each point of each sample.
#ifndef RENDER_POINT_CACHE_H
#define RENDER_POINT_CACHE_H

#include "render/mesh.h"

typedef struct {
    uint32_t n_samples, n_points; // each >= 1
    double *seconds;              // [n_samples], ascending
    float *position;              // [n_samples][n_points][3]
} PointCache;

// By content: PC2 where it says so, else MDD. fps: of PC2's frames. The file must be exactly as
// long as its head says. Everything is allocated from the arena. On failure: message[n] gets one
// sentence without the file's name.
MeshStatus point_cache_read(Arena *arena, const char *path, double fps, PointCache *cache,
                            char *message, size_t n);

#endif
