// SPDX-License-Identifier: Apache-2.0
// Mesh files of tests: each test has a folder of its own with at most one file in it.
#ifndef TESTS_MESH_FOLDER_H
#define TESTS_MESH_FOLDER_H

#include "render/mesh.h"
#include "render/mesh_clips.h"

typedef struct {
    char folder[64], path[128], message[256];
    Arena arena;
    Mesh mesh;
    PointCache places;
    MeshClips clips;
} MeshFolder;

// As cmocka has them: *state is the folder. tear_down fails where something else is left in it.
int mesh_folder_set_up(void **state);
int mesh_folder_tear_down(void **state);

// In place of the file before.
void mesh_folder_put(MeshFolder *f, const char *base, const void *bytes, size_t n);

#endif
