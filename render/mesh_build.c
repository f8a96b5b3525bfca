// SPDX-License-Identifier: Apache-2.0
// What the readers of mesh files share: welding, normals.
#include "render/mesh_build.h"

#include <math.h>
#include <string.h>

static size_t hash(const uint64_t key[3]) {
    uint64_t h = 0;
    for (int i = 0; i < 3; i++) {
        // The finalizer of splitmix64 (Sebastiano Vigna, 2015).
        h += key[i] + UINT64_C(0x9e3779b97f4a7c15);
        h = (h ^ h >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
        h = (h ^ h >> 27) * UINT64_C(0x94d049bb133111eb);
        h ^= h >> 31;
    }
    return (size_t)h;
}

static size_t find_slot(const MeshWeld *weld, const uint64_t key[3]) {
    size_t mask = weld->n_slots - 1, at = hash(key) & mask;
    while (weld->slots[at] && memcmp(weld->keys[weld->slots[at] - 1], key, sizeof *weld->keys)) {
        at = (at + 1) & mask;
    }
    return at;
}

// Kept at most half full.
static void grow_slots(MeshWeld *weld) {
    weld->n_slots = weld->n_slots ? weld->n_slots * 2 : 1024;
    weld->slots = ARENA_ARRAY(weld->arena, weld->n_slots, uint32_t);
    for (size_t i = 0; i < weld->n; i++) {
        weld->slots[find_slot(weld, weld->keys[i])] = (uint32_t)i + 1;
    }
}

uint32_t mesh_weld_add(MeshWeld *weld, const uint64_t key[3]) {
    if (weld->n * 2 >= weld->n_slots) {
        grow_slots(weld);
    }
    size_t at = find_slot(weld, key);
    if (!weld->slots[at]) {
        weld->keys =
            arena_grow(weld->arena, weld->keys, weld->n, &weld->capacity, sizeof *weld->keys);
        memcpy(weld->keys[weld->n], key, sizeof *weld->keys);
        weld->slots[at] = (uint32_t)++weld->n;
    }
    return weld->slots[at] - 1;
}

// False where there is no direction.
static bool normalize(float n[3]) {
    double x = (double)n[0], y = (double)n[1], z = (double)n[2];
    double length = sqrt(x * x + y * y + z * z);
    if (!(length > 0 && length < INFINITY)) {
        return false;
    }
    n[0] = (float)(x / length);
    n[1] = (float)(y / length);
    n[2] = (float)(z / length);
    return true;
}

// Adds the face's normal, twice its area long, to those of its corners that lack one.
static void add_face(const Mesh *mesh, const uint32_t t[3], const bool *is_missing) {
    if (!is_missing[t[0]] && !is_missing[t[1]] && !is_missing[t[2]]) {
        return;
    }
    const double *p = mesh->position + 3 * (size_t)t[0], *q = mesh->position + 3 * (size_t)t[1],
                 *r = mesh->position + 3 * (size_t)t[2];
    double e[3], f[3];
    for (int k = 0; k < 3; k++) {
        e[k] = q[k] - p[k];
        f[k] = r[k] - p[k];
    }
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double c = e[i] * f[j] - e[j] * f[i];
        for (int corner = 0; corner < 3; corner++) {
            if (is_missing[t[corner]]) {
                mesh->normal[3 * (size_t)t[corner] + (size_t)k] += (float)c;
            }
        }
    }
}

void mesh_normals_finish(Mesh *mesh) {
    Arena scratch = {0};
    bool *is_missing = ARENA_ARRAY(&scratch, mesh->n_vertices, bool), any = false;
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        is_missing[i] = !normalize(mesh->normal + 3 * i);
        if (is_missing[i]) {
            memset(mesh->normal + 3 * i, 0, 3 * sizeof(float));
            any = true;
        }
    }
    for (size_t i = 0; any && i < mesh->n_triangles; i++) {
        add_face(mesh, mesh->index + 3 * i, is_missing);
    }
    for (size_t i = 0; any && i < mesh->n_vertices; i++) {
        if (is_missing[i] && !normalize(mesh->normal + 3 * i)) {
            memcpy(mesh->normal + 3 * i, (float[3]){0, 0, 1}, 3 * sizeof(float));
        }
    }
    arena_free(&scratch);
}
