// SPDX-License-Identifier: Apache-2.0
// What the readers of mesh files share while they collect a mesh.
#ifndef RENDER_MESH_BUILD_H
#define RENDER_MESH_BUILD_H

#include "render/mesh.h"
#include "render/mesh_text.h"

enum { MESH_COUNT_LIMIT = INT32_MAX }; // of vertices, of triangles

// The readers. The text is the whole file, from its first byte; its arrays come from the arena.
MeshStatus mesh_obj_read(Arena *arena, MeshText *text, Mesh *mesh);
MeshStatus mesh_ply_read(Arena *arena, MeshText *text, Mesh *mesh);
MeshStatus mesh_stl_read(Arena *arena, MeshText *text, Mesh *mesh);

// Whether one of them reads the file that begins like this, instead of Assimp.
bool mesh_is_read_here(const char *path, const char *start, size_t n_start);

// By content: a binary STL states its own length, an ASCII one begins with "solid".
bool mesh_stl_is_binary(const char *bytes, size_t n);

// Exact duplicates by a hash table: numbers keys of three words in order of their first appearance.
typedef struct {
    Arena *arena;
    uint64_t (*keys)[3]; // [n]
    uint32_t *slots;     // ordinal + 1, 0: empty
    size_t n, n_slots, capacity;
} MeshWeld;

uint32_t mesh_weld_add(MeshWeld *weld, const uint64_t key[3]);

#endif
