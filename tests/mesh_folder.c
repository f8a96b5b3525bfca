// SPDX-License-Identifier: Apache-2.0
// Folders for mesh files.
#include "tests/mesh_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "tests/suite.h"

int mesh_folder_set_up(void **state) {
    MeshFolder *f = calloc(1, sizeof *f);
    snprintf(f->folder, sizeof f->folder, "/tmp/st4-mesh-XXXXXX");
    *state = f;
    return mkdtemp(f->folder) == NULL;
}

int mesh_folder_tear_down(void **state) {
    MeshFolder *f = *state;
    unlink(f->path);
    int left = rmdir(f->folder);
    arena_free(&f->arena);
    free(f);
    return left;
}

void mesh_folder_put(MeshFolder *f, const char *base, const void *bytes, size_t n) {
    if (f->path[0]) {
        unlink(f->path);
    }
    snprintf(f->path, sizeof f->path, "%s/%s", f->folder, base);
    FILE *file = fopen(f->path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, n, file), n);
    fclose(file);
}
