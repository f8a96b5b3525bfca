// SPDX-License-Identifier: Apache-2.0
// Mesh files: which reader, by content and by the name's ending; writing PLY.
#include "render/mesh.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "render/infile.h"
#include "render/mesh_build.h"
#include "render/mesh_child.h"
#include "render/outfile.h"

typedef MeshStatus Reader(Arena *arena, MeshText *text, Mesh *mesh);

static bool ends_in(const char *path, const char *ending) {
    const char *dot = strrchr(path, '.');
    return dot && strcasecmp(dot, ending) == 0;
}

// Content that cannot be mistaken goes before the name's ending. NULL: for Assimp.
static Reader *choose(const char *path, const char *start, size_t n_start) {
    if (n_start >= 4 && (memcmp(start, "ply\n", 4) == 0 || memcmp(start, "ply\r", 4) == 0)) {
        return mesh_ply_read;
    }
    if (ends_in(path, ".obj")) {
        return mesh_obj_read;
    }
    if (ends_in(path, ".stl")) {
        return mesh_stl_read;
    }
    return ends_in(path, ".ply") ? mesh_ply_read : NULL;
}

bool mesh_is_read_here(const char *path, const char *start, size_t n_start) {
    return choose(path, start, n_start) != NULL;
}

static MeshStatus read_here(Arena *arena, int fd, size_t size, Reader *reader, Mesh *mesh,
                            char *message, size_t n) {
    char *bytes = malloc(size + 1);
    if (!bytes) {
        snprintf(message, n, "its %zu bytes do not fit into memory", size);
        return MESH_TOO_LARGE;
    }
    MeshStatus status = MESH_NO_FILE;
    size_t got = infile_read(fd, bytes, 0, size);
    if (got < size && errno) {
        snprintf(message, n, "cannot read: %s", strerror(errno));
    } else {
        bytes[got] = '\0';
        MeshText text = {.at = bytes, .end = bytes + got, .line = 1, .message = message, .n = n};
        status = reader(arena, &text, mesh);
    }
    free(bytes);
    return status;
}

MeshStatus mesh_read(Arena *arena, const char *path, Mesh *mesh, char *message, size_t n) {
    size_t size;
    char start[4];
    *mesh = (Mesh){0};
    int fd = infile_open(path, &size, message, n);
    if (fd < 0) {
        return MESH_NO_FILE;
    }
    Reader *reader = choose(path, start, infile_read(fd, start, 0, sizeof start));
    MeshStatus status = reader ? read_here(arena, fd, size, reader, mesh, message, n)
                               : mesh_child_read(arena, mesh_child_assimp, path, &mesh_child_limits,
                                                 mesh, message, n);
    close(fd);
    if (status == MESH_OK && mesh->n_triangles == 0) {
        snprintf(message, n, "there are no faces in it");
        status = MESH_BAD_FORMAT;
    }
    if (status != MESH_OK) {
        *mesh = (Mesh){0};
    }
    return status;
}

static void put(FILE *f, uint64_t bits, int size) {
    for (int i = 0; i < size; i++) {
        putc((int)(bits >> (8 * i) & 0xff), f);
    }
}

static void put_double(FILE *f, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    put(f, bits, 8);
}

static void put_float(FILE *f, float v) {
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    put(f, bits, 4);
}

static void write_header(FILE *f, const Mesh *mesh) {
    fprintf(f, "ply\nformat binary_little_endian 1.0\nelement vertex %u\n", mesh->n_vertices);
    fputs("property double x\nproperty double y\nproperty double z\n", f);
    if (mesh->normal) {
        fputs("property float nx\nproperty float ny\nproperty float nz\n", f);
    }
    if (mesh->uv) {
        fputs("property float s\nproperty float t\n", f);
    }
    fprintf(f, "element face %u\nproperty list uchar int vertex_indices\nend_header\n",
            mesh->n_triangles);
}

static void write_rows(FILE *f, const Mesh *mesh) {
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        for (size_t k = 0; k < 3; k++) {
            put_double(f, mesh->position[3 * i + k]);
        }
        for (size_t k = 0; mesh->normal && k < 3; k++) {
            put_float(f, mesh->normal[3 * i + k]);
        }
        for (size_t k = 0; mesh->uv && k < 2; k++) {
            put_float(f, mesh->uv[2 * i + k]);
        }
    }
    for (size_t i = 0; i < mesh->n_triangles; i++) {
        putc(3, f);
        for (size_t k = 0; k < 3; k++) {
            put(f, mesh->index[3 * i + k], 4);
        }
    }
}

bool mesh_write_ply(const char *path, const Mesh *mesh, char *message, size_t n) {
    OutFile file;
    if (!outfile_open(&file, path, message, n)) {
        return false;
    }
    int copy = dup(file.fd);
    FILE *f = copy < 0 ? NULL : fdopen(copy, "wb");
    bool done = f != NULL;
    if (done) {
        write_header(f, mesh);
        write_rows(f, mesh);
        done = !ferror(f);
        done = fclose(f) == 0 && done;
    } else if (copy >= 0) {
        close(copy);
    }
    if (!done) {
        snprintf(message, n, "cannot write: %s", strerror(errno));
        outfile_abandon(&file);
        return false;
    }
    return outfile_commit(&file, message, n);
}
