// SPDX-License-Identifier: Apache-2.0
// What the child process that runs Assimp sends through its pipe: a MeshStream, then the arrays
// position, normal, uv, index as in render/mesh.h, of the sizes that it states. Both ends are the
// same program on the same machine, so the layout is the machine's.
#ifndef RENDER_MESH_ASSIMP_H
#define RENDER_MESH_ASSIMP_H

#include <stdint.h>

enum { MESH_STREAM_MAGIC = 0x4d347374, MESH_STREAM_MESSAGE = 216 };

typedef struct {
    uint32_t magic;
    uint32_t status; // a MeshStatus
    uint64_t n_vertices, n_triangles;
    uint32_t has_normal, has_uv;
    char message[MESH_STREAM_MESSAGE]; // when the status is not MESH_OK
} MeshStream;

// What st4-assimp.so exports. Only to be called in a child process with limits: Assimp on a hostile
// file may crash, loop or take all memory. Returns whether everything could be written to fd.
int mesh_assimp_send(const char *path, int fd);

#endif
