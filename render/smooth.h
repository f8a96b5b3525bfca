// SPDX-License-Identifier: Apache-2.0
// Vertex normals that follow the motion: which faces share a normal is found once, on the rest
// pose; the normals themselves are sums over these faces at every instant.
//
// Faces around a vertex share a normal where they meet in edges that are no sharper than the
// angle of `smooth`. Vertices at exactly the same place in the rest pose count as one, so that
// seams of texture coordinates do not show. Normals are kept in 32 bits (octahedral: Cigolle and
// others, A Survey of Efficient Representations for Independent Unit Vectors, 2014): off by at most
// 0.004 degrees.
#ifndef RENDER_SMOOTH_H
#define RENDER_SMOOTH_H

#include "accel/vec.h"
#include "render/mesh.h"

// In an index: this corner has no normal of its own.
#define NORMAL_NONE UINT32_MAX

typedef struct {
    uint32_t n_normals;
    const uint32_t *index; // [n_triangles][3], into the normals; NULL: faceted, no normals at all
    const uint32_t *given; // [n_normals], where they are the file's own and never change; or NULL
} Smoothing;

// deforms: the mesh's own normals do not serve. smooth: as Shape.smooth.
Smoothing smoothing_new(Arena *arena, const Mesh *mesh, double smooth, bool deforms);

// normal[n_normals] at one instant, of positions[n_vertices][3], weighted by area. Faces that are
// not finite do not count; where nothing counts the normal is 0 (see normal_unpack).
void smoothing_run(const Smoothing *smoothing, const Mesh *mesh, const float *positions,
                   uint32_t *normal);

uint32_t normal_pack(Vec3 n);      // any length; 0 or not finite: no normal
Vec3 normal_unpack(uint32_t bits); // unit; no normal: (0, 0, 0)

#endif
