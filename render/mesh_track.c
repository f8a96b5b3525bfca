// SPDX-License-Identifier: Apache-2.0
// Subdivision by edge middles; interpolation of tracks.
#include "render/mesh_track.h"

#include <math.h>
#include <string.h>

// The last key at or before an instant, and how far it is to the next: 0 at the ends.
static uint32_t find_key(const VertexTrack *track, double seconds, double *f) {
    uint32_t lo = 0, hi = track->n_keys - 1;
    *f = 0;
    if (!(seconds > track->seconds[0])) {
        return 0;
    }
    if (seconds >= track->seconds[hi]) {
        return hi;
    }
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (track->seconds[mid] <= seconds) {
            lo = mid;
        } else {
            hi = mid;
        }
    }
    *f = (seconds - track->seconds[lo]) / (track->seconds[hi] - track->seconds[lo]);
    return lo;
}

void track_run(const VertexTrack *track, double seconds, const uint32_t *which, size_t first,
               size_t n, double *const out[3]) {
    double f;
    uint32_t key = find_key(track, seconds, &f);
    size_t step = 3 * (size_t)track->n_vertices;
    const float *a = track->offset + key * step, *b = f > 0 ? a + step : a;
    for (size_t i = 0; i < n; i++) {
        size_t at = 3 * (which ? which[i] : first + i);
        for (size_t c = 0; c < 3; c++) {
            double x = a[at + c], y = b[at + c];
            out[c][i] = track->center[c] + ((1 - f) * x + f * y);
        }
    }
}

// ---- Subdivision

// Middles of edges by the edge: a hash table of what stands in `parents`.
typedef struct {
    uint32_t (*parents)[2];
    uint32_t *slots; // index + 1 of parents, 0: empty
    size_t mask;
    uint32_t n, first; // first: the number of the first new vertex
} Middles;

static uint32_t middle_of(Middles *m, uint32_t a, uint32_t b) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    uint64_t hash = ((uint64_t)low << 32 | high) * 0x9e3779b97f4a7c15u;
    for (size_t slot = (hash >> 20) & m->mask;; slot = (slot + 1) & m->mask) {
        uint32_t at = m->slots[slot];
        if (at == 0) {
            m->parents[m->n][0] = low;
            m->parents[m->n][1] = high;
            m->slots[slot] = ++m->n;
            return m->first + m->n - 1;
        }
        if (m->parents[at - 1][0] == low && m->parents[at - 1][1] == high) {
            return m->first + at - 1;
        }
    }
}

static void cut_faces(const Mesh *mesh, Mesh *finer, Middles *m) {
    for (size_t f = 0; f < mesh->n_triangles; f++) {
        const uint32_t *v = &mesh->index[3 * f];
        uint32_t ab = middle_of(m, v[0], v[1]), bc = middle_of(m, v[1], v[2]),
                 ca = middle_of(m, v[2], v[0]);
        const uint32_t faces[12] = {v[0], ab, ca, ab, v[1], bc, ca, bc, v[2], ab, bc, ca};
        memcpy(&finer->index[12 * f], faces, sizeof faces);
    }
}

static float *halfway(Arena *arena, const float *values, size_t width, uint32_t n,
                      const uint32_t (*parents)[2], uint32_t n_new) {
    if (!values) {
        return NULL;
    }
    float *finer = ARENA_ARRAY(arena, width * ((size_t)n + n_new), float);
    memcpy(finer, values, width * n * sizeof *finer);
    for (size_t k = 0; k < n_new; k++) {
        const float *a = &values[width * parents[k][0]], *b = &values[width * parents[k][1]];
        for (size_t c = 0; c < width; c++) {
            finer[width * (n + k) + c] = 0.5f * a[c] + 0.5f * b[c];
        }
    }
    return finer;
}

static void make_unit(float *normals, size_t first, size_t n) {
    for (size_t i = first; i < first + n; i++) {
        float *p = &normals[3 * i];
        double size = sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]);
        for (int c = 0; c < 3; c++) {
            p[c] = size > 0 ? (float)(p[c] / size) : c == 2;
        }
    }
}

bool mesh_subdivide(Arena *arena, const Mesh *mesh, Mesh *finer, uint32_t (**parents)[2]) {
    size_t n_edges = 3 * (size_t)mesh->n_triangles, n_slots = 16;
    if (4 * (size_t)mesh->n_triangles > MESH_MAX_SUBDIVIDED ||
        mesh->n_vertices > MESH_MAX_SUBDIVIDED) {
        return false;
    }
    Arena scratch = {0};
    while (n_slots < 2 * n_edges) {
        n_slots *= 2;
    }
    uint32_t(*ends)[2] = (uint32_t(*)[2])ARENA_ARRAY(arena, 2 * n_edges, uint32_t);
    Middles m = {ends, ARENA_ARRAY(&scratch, n_slots, uint32_t), n_slots - 1, 0, mesh->n_vertices};
    *finer = (Mesh){.n_triangles = 4 * mesh->n_triangles,
                    .index = ARENA_ARRAY(arena, 4 * n_edges, uint32_t),
                    .faceted = mesh->faceted};
    cut_faces(mesh, finer, &m);
    arena_free(&scratch);
    const uint32_t n = mesh->n_vertices;
    const uint32_t(*pairs)[2] = (const uint32_t(*)[2])ends;
    finer->n_vertices = n + m.n;
    finer->position = ARENA_ARRAY(arena, 3 * (size_t)finer->n_vertices, double);
    memcpy(finer->position, mesh->position, 3 * (size_t)n * sizeof(double));
    for (size_t k = 0; k < m.n; k++) {
        for (size_t c = 0; c < 3; c++) {
            finer->position[3 * (n + k) + c] = 0.5 * mesh->position[3 * (size_t)ends[k][0] + c] +
                                               0.5 * mesh->position[3 * (size_t)ends[k][1] + c];
        }
    }
    finer->uv = halfway(arena, mesh->uv, 2, n, pairs, m.n);
    finer->normal = halfway(arena, mesh->normal, 3, n, pairs, m.n);
    if (finer->normal) {
        make_unit(finer->normal, n, m.n);
    }
    *parents = ends;
    return true;
}

VertexTrack *track_subdivide(Arena *arena, const VertexTrack *track, const Mesh *finer,
                             const uint32_t (*parents)[2]) {
    VertexTrack *out = ARENA_NEW(arena, VertexTrack);
    size_t n = track->n_vertices, n_finer = finer->n_vertices;
    float *offset = ARENA_ARRAY(arena, 3 * n_finer * track->n_keys, float);
    for (size_t key = 0; key < track->n_keys; key++) {
        float *to = offset + 3 * n_finer * key;
        memcpy(to, track->offset + 3 * n * key, 3 * n * sizeof *to);
        for (size_t k = 0; k < n_finer - n; k++) {
            for (size_t c = 0; c < 3; c++) {
                to[3 * (n + k) + c] = 0.5f * to[3 * (size_t)parents[k][0] + c] +
                                      0.5f * to[3 * (size_t)parents[k][1] + c];
            }
        }
    }
    *out = *track;
    out->n_vertices = (uint32_t)n_finer;
    out->offset = offset;
    return out;
}
