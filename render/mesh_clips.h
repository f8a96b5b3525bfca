// SPDX-License-Identifier: Apache-2.0
// Clips: animations by name within mesh files, as the places of the vertices of the very mesh that
// mesh_read gives. Read by a child process as render/mesh_child.h has it.
#ifndef RENDER_MESH_CLIPS_H
#define RENDER_MESH_CLIPS_H

#include "render/mesh.h"
#include "render/point_cache.h"

typedef struct {
    const char *name; // cut off after 119 bytes
    double seconds;   // how long it lasts
} MeshClip;

typedef struct {
    uint32_t n;       // those of the file; in a file of no kind that has clips: 0
    uint32_t missing; // of MESH_NO_CLIP: which of the names
    MeshClip *clip;   // [n]
} MeshClips;

// The clips that are named, n_names >= 1, one after another from 0 seconds on, and in *clips all
// that the file has. Straight lines between the samples are within 1e-4 of the diagonal of the box
// of the mesh (render/mesh_keys.h). Everything is allocated from the arena. On failure: message[n]
// gets one sentence without the file's name; *clips is what the file has still, as far as it could
// be read.
MeshStatus mesh_clips_read(Arena *arena, const char *path, const char *const *names,
                           uint32_t n_names, PointCache *places, MeshClips *clips, char *message,
                           size_t n);

// What the file has alone.
MeshStatus mesh_clips_list(Arena *arena, const char *path, MeshClips *clips, char *message,
                           size_t n);

#endif
