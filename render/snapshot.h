// SPDX-License-Identifier: Apache-2.0
// A snapshot: the triangles of a scene at one instant, in the world.
#ifndef RENDER_SNAPSHOT_H
#define RENDER_SNAPSHOT_H

#include <stddef.h>

#include "render/scene.h"

typedef struct {
    uint64_t n_objects; // in the mesh
    uint64_t n_absent;  // invisible at that instant, or their transform is not finite
    uint64_t n_planes;  // left out
} Snapshot;

// All shapes, or with a label those that have it ("Wheel", "Car/Wheel", "Wheel[2]") or stand within
// what has it ("Car"). Spheres become meshes of some hundred triangles. *mesh is allocated from the
// arena: with uv where any shape has them (0 elsewhere), without normals, counter-clockwise from
// outside also under mirroring transforms. False: more than 2^31 vertices or triangles.
bool snapshot_take(Arena *arena, const Scene *scene, const char *label, double seconds, Mesh *mesh,
                   Snapshot *snapshot);

// What an instance is called: "Wheel", "Wheel[2]", "Wheel12".
void shape_name(const Shape *shape, uint32_t instance, char *name, size_t size);

#endif
