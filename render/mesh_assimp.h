// SPDX-License-Identifier: Apache-2.0
// What the child process that runs Assimp sends through its pipe. Both ends are the same program on
// the same machine, so the layout is the machine's.
//
// A mesh: a MeshStream, then the arrays position, normal, uv, index as in render/mesh.h, of the
// sizes that it states. Clips: a ClipStream, n_clips ClipNames in any case, then the arrays
// seconds[n_keys] and position[n_keys][n_points][3] as in render/point_cache.h.
#ifndef RENDER_MESH_ASSIMP_H
#define RENDER_MESH_ASSIMP_H

#include <stdint.h>

enum { MESH_STREAM_MAGIC = 0x4d347374, CLIP_STREAM_MAGIC = 0x43347374, MESH_STREAM_MESSAGE = 216 };
enum { CLIP_STREAM_NAMES = 4096, CLIP_STREAM_NAME = 120 };
// More is refused: of keys, and of bytes of positions.
enum { CLIP_STREAM_KEYS = 1 << 16, CLIP_STREAM_BYTES = 1 << 30 };

typedef struct {
    uint32_t magic;
    uint32_t status; // a MeshStatus
    uint64_t n_vertices, n_triangles;
    uint32_t has_normal, has_uv;
    char message[MESH_STREAM_MESSAGE]; // when the status is not MESH_OK
} MeshStream;

typedef struct {
    uint32_t magic, status;
    uint64_t n_points;
    uint32_t n_clips, n_keys; // n_keys: 0 unless places were asked for and the status is MESH_OK
    uint32_t missing;         // of MESH_NO_CLIP: which of the names asked for
    char message[MESH_STREAM_MESSAGE];
} ClipStream;

typedef struct {
    double seconds;
    char name[CLIP_STREAM_NAME]; // cut off there
} ClipName;

// What is asked for: clips of a file one after another; none of them: their names alone.
typedef struct {
    const char *path;
    const char *const *names;
    uint32_t n_names;
} ClipQuery;

// What st4-assimp.so exports. Only to be called in a child process with limits: Assimp on a hostile
// file may crash, loop or take all memory. They return whether everything could be written to fd.
int mesh_assimp_send(const char *path, int fd);
int mesh_assimp_send_clips(const ClipQuery *query, int fd);

#endif
