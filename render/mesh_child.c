// SPDX-License-Identifier: Apache-2.0
// Meshes from a child process with limits on memory and time.
#include "render/mesh_child.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/child.h"
#include "render/mesh_assimp.h"
#include "render/mesh_build.h"
#include "render/plugin.h"

// ---- in the child

void *mesh_child_symbol(const char *name, int fd, void *refusal, size_t size, char *message,
                        size_t n) {
    void *symbol = plugin_symbol("st4-assimp.so", name, message, n);
    if (!symbol) {
        ssize_t put = write(fd, refusal, size);
        (void)put;
    }
    return symbol;
}

void mesh_child_assimp(const void *path, int fd) {
    MeshStream refusal = {.magic = MESH_STREAM_MAGIC, .status = MESH_BAD_FORMAT};
    void *symbol = mesh_child_symbol("mesh_assimp_send", fd, &refusal, sizeof refusal,
                                     refusal.message, sizeof refusal.message);
    if (symbol) { // POSIX: a pointer from dlsym may be copied into one to a function.
        int (*assimp_send)(const char *, int);
        memcpy(&assimp_send, &symbol, sizeof symbol);
        assimp_send(path, fd);
    }
}

// ---- in the parent

MeshStatus mesh_child_explain(const Child *child, int status, char *message, size_t n) {
    int by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (child->is_late || by == SIGXCPU) {
        snprintf(message, n, "the reader in its own process took too long and was stopped");
        return MESH_TOO_LARGE;
    }
    if (by == SIGKILL) {
        snprintf(message, n, "the reader in its own process was killed, perhaps out of memory");
        return MESH_TOO_LARGE;
    }
    if (by) {
        snprintf(message, n, "the reader in its own process crashed (%s)", strsignal(by));
    } else {
        snprintf(message, n, "the reader in its own process crashed (it ended early)");
    }
    return MESH_BAD_FORMAT;
}

static bool is_plausible(const MeshStream *header) {
    return header->magic == MESH_STREAM_MAGIC && header->status <= MESH_TOO_LARGE &&
           header->n_vertices <= MESH_COUNT_LIMIT && header->n_triangles <= MESH_COUNT_LIMIT;
}

static bool receive_arrays(Child *child, Arena *arena, const MeshStream *header, Mesh *mesh) {
    size_t n = header->n_vertices, m = header->n_triangles;
    *mesh = (Mesh){.n_vertices = (uint32_t)n, .n_triangles = (uint32_t)m};
    mesh->position = ARENA_ARRAY(arena, 3 * n, double);
    mesh->normal = header->has_normal ? ARENA_ARRAY(arena, 3 * n, float) : NULL;
    mesh->uv = header->has_uv ? ARENA_ARRAY(arena, 2 * n, float) : NULL;
    mesh->index = ARENA_ARRAY(arena, 3 * m, uint32_t);
    return child_receive(child, mesh->position, 3 * n * sizeof(double)) &&
           (!mesh->normal || child_receive(child, mesh->normal, 3 * n * sizeof(float))) &&
           (!mesh->uv || child_receive(child, mesh->uv, 2 * n * sizeof(float))) &&
           child_receive(child, mesh->index, 3 * m * sizeof(uint32_t));
}

static MeshStatus check(Mesh *mesh, char *message, size_t n) {
    for (size_t i = 0; i < 3 * (size_t)mesh->n_triangles; i++) {
        if (mesh->index[i] >= mesh->n_vertices) {
            snprintf(message, n, "face %zu: index %u is beyond the %u vertices", i / 3,
                     mesh->index[i], mesh->n_vertices);
            return MESH_BAD_FORMAT;
        }
    }
    if (mesh->normal) {
        mesh_normals_finish(mesh);
    }
    return MESH_OK;
}

void mesh_child_text(const char *from, size_t size, char *message, size_t n) {
    size_t length = 0;
    while (length < size && length + 1 < n && from[length]) {
        unsigned char c = (unsigned char)from[length];
        message[length++] = c < 0x20 || c == 0x7f ? ' ' : (char)c;
    }
    message[length] = '\0';
}

MeshStatus mesh_child_read(Arena *arena, ChildBody *body, const void *argument,
                           const ChildLimits *limits, Mesh *mesh, char *message, size_t n) {
    Child child;
    MeshStream header;
    if (!child_start(&child, body, argument, limits)) {
        snprintf(message, n, "cannot start the reader: %s", strerror(errno));
        return MESH_BAD_FORMAT;
    }
    bool is_whole = child_receive(&child, &header, sizeof header);
    bool is_refused = is_whole && is_plausible(&header) && header.status != MESH_OK;
    if (is_whole && !is_plausible(&header)) {
        child_stop(&child, false);
        snprintf(message, n, "the reader in its own process sent nonsense");
        return MESH_BAD_FORMAT;
    }
    is_whole = is_refused || (is_whole && receive_arrays(&child, arena, &header, mesh));
    int status = child_stop(&child, !is_whole);
    if (!is_whole) {
        return mesh_child_explain(&child, status, message, n);
    }
    if (is_refused) {
        mesh_child_text(header.message, sizeof header.message, message, n);
        return (MeshStatus)header.status;
    }
    return check(mesh, message, n);
}
