// SPDX-License-Identifier: Apache-2.0
// A mesh read by a child process, so that a reader which crashes, loops or takes all memory takes
// nothing with it but itself. The child sends what render/mesh_assimp.h describes.
#ifndef RENDER_MESH_CHILD_H
#define RENDER_MESH_CHILD_H

#include "render/mesh.h"

typedef struct {
    size_t memory;    // bytes of address space beyond what the parent has
    unsigned seconds; // of processor time
    double wait;      // seconds that the parent waits for the whole
} MeshChildLimits;

// Runs in the child: sends the mesh to fd. Its return value does not matter.
typedef void MeshChildBody(const void *argument, int fd);

// Believes nothing that the child sends: sizes and indices are checked. The address-space limit is
// not set in builds with the address sanitizer, which reserves terabytes.
MeshStatus mesh_child_read(Arena *arena, MeshChildBody *body, const void *argument,
                           const MeshChildLimits *limits, Mesh *mesh, char *message, size_t n);

// The body that reads the file `path` (the argument, a string) by Assimp.
void mesh_child_assimp(const void *path, int fd);

#endif
