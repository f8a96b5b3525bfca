// SPDX-License-Identifier: Apache-2.0
// Rest meshes, and the files they come from.
//
// OBJ, PLY and STL are read here, strictly and in the file's own order (point caches and `deform`
// by index depend on it); every other format goes through Assimp in a child process with limits on
// memory and time, so that a hostile file cannot take the program with it.
#ifndef RENDER_MESH_H
#define RENDER_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"

typedef struct {
    uint32_t n_vertices, n_triangles;
    double *position; // [n_vertices][3], metres, finite or not as the file has it
    float *normal;    // [n_vertices][3], of unit length, or NULL
    float *uv;        // [n_vertices][2], or NULL
    uint32_t *index;  // [n_triangles][3], counter-clockwise seen from outside, each < n_vertices
    bool faceted;     // normals are those of the faces, not to be smoothed (STL)
    // Where vertices were split (OBJ): the file's own vertex that each one is of, and how many
    // there are of these. NULL: each is its own.
    uint32_t *point;
    uint32_t n_points;
} Mesh;

// The places of a mesh's vertices over time: straight lines between the keys; before the first and
// after the last key they stay. Place k at key i is center[k] + offset[i][k].
typedef struct {
    uint32_t n_keys, n_vertices;
    const double *seconds; // [n_keys], ascending
    double center[3];
    const float *offset; // [n_keys][n_vertices][3]
} VertexTrack;

typedef enum {
    MESH_OK,
    MESH_NO_FILE,    // missing, not a file, not readable
    MESH_BAD_FORMAT, // damaged or of no known kind
    MESH_TOO_LARGE,  // over 2^31 vertices or triangles, or over the limits of the child
    MESH_NO_CLIP,    // none of the file's clips has that name (render/mesh_clips.h)
} MeshStatus;

// Everything in *mesh is allocated from the arena. Polygons are cut into fans. An OBJ whose faces
// name normals or uvs by indices of their own gets one vertex for each distinct (v, vt, vn), in
// order of v first: vertex i < (number of v lines) is the i-th v line.
// On failure: message[n] gets one sentence without the file's name ("line 12: face index 9 is
// beyond the 8 vertices so far").
MeshStatus mesh_read(Arena *arena, const char *path, Mesh *mesh, char *message, size_t n);

// Normals of length 1. Those that have no direction (zero, or not finite, or of vertices that the
// file gives none) become the area-weighted mean of the faces around, or (0, 0, 1) without any.
void mesh_normals_finish(Mesh *mesh);

// Binary little-endian PLY; normal and uv where the mesh has them. Written under a temporary name
// and renamed.
bool mesh_write_ply(const char *path, const Mesh *mesh, char *message, size_t n);

#endif
