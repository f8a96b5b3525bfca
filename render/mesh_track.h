// SPDX-License-Identifier: Apache-2.0
// Meshes cut finer, and the places of their vertices over time.
#ifndef RENDER_MESH_TRACK_H
#define RENDER_MESH_TRACK_H

#include "render/mesh.h"

// The places of the vertices which[0..n) (NULL: of n from `first` on) at an instant: out[c][0..n).
void track_run(const VertexTrack *track, double seconds, const uint32_t *which, size_t first,
               size_t n, double *const out[3]);

// Each triangle as four, cut at the middles of its edges, which neighbours share. The vertices keep
// their numbers, those of the middles follow; normals and texture coordinates are halfway between
// those of the ends. parents: of new vertex k, of all n_vertices + k, the two ends; from the arena.
// False: over MESH_MAX_SUBDIVIDED vertices or triangles.
enum { MESH_MAX_SUBDIVIDED = 1 << 24 };
bool mesh_subdivide(Arena *arena, const Mesh *mesh, Mesh *finer, uint32_t (**parents)[2]);

// The track of the finer mesh: middles stay in the middle.
VertexTrack *track_subdivide(Arena *arena, const VertexTrack *track, const Mesh *finer,
                             const uint32_t (*parents)[2]);

#endif
