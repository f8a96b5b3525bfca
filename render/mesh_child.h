// SPDX-License-Identifier: Apache-2.0
// A mesh read by a child process, so that a reader which crashes, loops or takes all memory takes
// nothing with it but itself. The child sends what render/mesh_assimp.h describes.
#ifndef RENDER_MESH_CHILD_H
#define RENDER_MESH_CHILD_H

#include "render/child.h"
#include "render/mesh.h"

// Believes nothing that the child sends: sizes and indices are checked.
MeshStatus mesh_child_read(Arena *arena, ChildBody *body, const void *argument,
                           const ChildLimits *limits, Mesh *mesh, char *message, size_t n);

// Memory and time of a child that reads a file by Assimp.
static const ChildLimits mesh_child_limits = {
    .memory = (size_t)4 << 30, .seconds = 60, .wait = 120};

// In the child: a function of st4-assimp.so. NULL: there is none, the refusal was sent; message[n],
// which lies in it, says why.
void *mesh_child_symbol(const char *name, int fd, void *refusal, size_t size, char *message,
                        size_t n);

// Why a child ended early, whose status is that of child_stop.
MeshStatus mesh_child_explain(const Child *child, int status, char *message, size_t n);

// The child's text from[size], to its NUL if there is one, as one line of printable text.
void mesh_child_text(const char *from, size_t size, char *message, size_t n);

// The body that reads the file `path` (the argument, a string) by Assimp.
void mesh_child_assimp(const void *path, int fd);

#endif
