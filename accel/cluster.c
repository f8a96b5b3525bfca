// SPDX-License-Identifier: Apache-2.0
// Clusters from geometry: welding, boxes, and the keys in the layout of the kernels.
#include "accel/cluster_parts.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static inline float least(float a, float b) {
    return a < b ? a : b;
}

static inline float most(float a, float b) {
    return a > b ? a : b;
}

// -- welding --------------------------------------------------------------------------------------

static uint64_t hash_vertex(const Geometry *g, uint32_t vertex) {
    uint64_t h = 0x9e3779b97f4a7c15u;
    for (uint32_t key = 0; key < g->n_keys; key++) {
        uint32_t bits[3];
        memcpy(bits, g->position + ((size_t)key * g->n_vertices + vertex) * 3, sizeof bits);
        for (int a = 0; a < 3; a++) {
            h = (h ^ bits[a]) * 0xbf58476d1ce4e5b9u;
            h ^= h >> 29;
        }
    }
    return h;
}

static bool same_vertex(const Geometry *g, uint32_t a, uint32_t b) {
    for (uint32_t key = 0; key < g->n_keys; key++) {
        const float *base = g->position + (size_t)key * g->n_vertices * 3;
        if (memcmp(base + (size_t)a * 3, base + (size_t)b * 3, 3 * sizeof *base) != 0) {
            return false;
        }
    }
    return true;
}

// Hashes by all threads, the table by one, so that the first of equal vertices stands for them.
static bool weld(ClusterBuilder *b) {
    const Geometry *g = b->geometry;
    size_t size = 16;
    while (size < (size_t)g->n_vertices * 2) {
        size *= 2;
    }
    uint32_t *table = malloc(size * sizeof *table);
    b->welded = malloc((g->n_vertices ? g->n_vertices : 1) * sizeof *b->welded);
    if (!table || !b->welded) {
        free(table);
        return false;
    }
    memset(table, 0xff, size * sizeof *table);
#pragma omp parallel for schedule(static) num_threads(b->n_threads)
    for (uint32_t v = 0; v < g->n_vertices; v++) {
        b->welded[v] = (uint32_t)hash_vertex(g, v);
    }
    for (uint32_t v = 0; v < g->n_vertices; v++) {
        size_t at = b->welded[v] & (size - 1);
        while (table[at] != UINT32_MAX && !same_vertex(g, table[at], v)) {
            at = (at + 1) & (size - 1);
        }
        if (table[at] == UINT32_MAX) {
            table[at] = v;
        }
        b->welded[v] = table[at];
    }
    free(table);
    return true;
}

// -- primitives -----------------------------------------------------------------------------------

// What is not finite bounds nothing: such a primitive is never hit there.
static void grow(float lo[3], float hi[3], const float *p, float radius) {
    for (int a = 0; a < 3; a++) {
        float low = p[a] - radius, high = p[a] + radius;
        if (isfinite(low) && isfinite(high)) {
            lo[a] = least(lo[a], low);
            hi[a] = most(hi[a], high);
        }
    }
}

ProbeBox cluster_bound_finite(const Geometry *g, const uint32_t *vertex, int n, uint32_t key) {
    float lo[4] = {INFINITY, INFINITY, INFINITY, 0};
    float hi[4] = {-INFINITY, -INFINITY, -INFINITY, 0};
    for (int c = 0; c < n; c++) {
        const float *p = g->position + ((size_t)key * g->n_vertices + vertex[c]) * 3;
        grow(lo, hi, p, cluster_radius(g, key, vertex[c]));
    }
    for (int a = 0; a < 3; a++) {
        if (!(lo[a] <= hi[a])) {
            lo[a] = hi[a] = 0;
        }
    }
    return (ProbeBox){_mm_loadu_ps(lo), _mm_loadu_ps(hi)};
}

// vertex[lane]: of the geometry; unused lanes are as lane 0.
static void fill_cluster(const ClusterBuilder *b, Cluster *cluster, const uint32_t *prims,
                         uint32_t n, uint32_t vertex[CLUSTER_LANES]) {
    memset(cluster, 0, sizeof *cluster);
    memset(cluster->prim, 0xff, sizeof cluster->prim);
    cluster->used = (1u << n) - 1;
    uint32_t n_vertices = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t corner[3];
        int n_corners = cluster_corners(b->geometry, prims[i], corner);
        cluster->prim[i] = (int32_t)prims[i];
        for (int c = 0; c < n_corners; c++) {
            uint32_t v = cluster_welded(b, corner[c]), lane = 0;
            while (lane < n_vertices && vertex[lane] != v) {
                lane++;
            }
            if (lane == n_vertices) {
                vertex[n_vertices++] = v;
            }
            cluster->corner[c][i] = (uint8_t)lane;
        }
    }
    for (uint32_t lane = n_vertices; lane < CLUSTER_LANES; lane++) {
        vertex[lane] = vertex[0];
    }
}

static float largest_of(const float *x, size_t n) {
    float largest = 0;
    for (size_t i = 0; i < n; i++) {
        float size = fabsf(x[i]);
        largest = size > largest && size <= FLT_MAX ? size : largest;
    }
    return largest;
}

static void fill_key(ClusterSet *set, uint32_t c, const uint32_t vertex[CLUSTER_LANES],
                     uint32_t key, float pad) {
    const Geometry *g = set->geometry;
    size_t row = (size_t)c * g->n_keys + key;
    float *to = set->keys + row * set->n_rows * CLUSTER_LANES;
    for (int lane = 0; lane < CLUSTER_LANES; lane++) {
        uint32_t v = vertex[lane];
        const float *p = g->position + ((size_t)key * g->n_vertices + v) * 3;
        for (int a = 0; a < 3; a++) {
            to[a * CLUSTER_LANES + lane] = p[a];
        }
        if (g->radius) {
            bool is_used = set->clusters[c].used >> lane & 1;
            to[3 * CLUSTER_LANES + lane] =
                is_used ? g->radius[(size_t)key * g->n_vertices + v] : -1;
        }
    }
    ProbeBox box = cluster_bound_vertices(g, vertex, CLUSTER_LANES, key);
    __m128 margin = _mm_set1_ps(pad), largest = _mm_set1_ps(FLT_MAX);
    float lo[4], hi[4], *padded = set->boxes + row * 6;
    _mm_storeu_ps(lo,
                  _mm_max_ps(_mm_sub_ps(box.lo, margin), _mm_sub_ps(_mm_setzero_ps(), largest)));
    _mm_storeu_ps(hi, _mm_min_ps(_mm_add_ps(box.hi, margin), largest));
    memcpy(padded, lo, 3 * sizeof *lo);
    memcpy(padded + 3, hi, 3 * sizeof *hi);
}

static bool fill_clusters(const ClusterBuilder *b, ClusterSet *set) {
    const Geometry *g = b->geometry;
    for (uint32_t i = 0; i < g->n_prims; i += b->size_at[i]) {
        set->n_clusters++;
    }
    size_t n_clusters = set->n_clusters, n_keys = n_clusters * g->n_keys;
    set->n_rows = g->kind == GEOMETRY_SPHERES ? 4 : 3;
    size_t size = n_keys * set->n_rows * CLUSTER_LANES * sizeof *set->keys;
    uint32_t *first = malloc((n_clusters + 1) * sizeof *first);
    set->clusters = aligned_alloc(64, (n_clusters + 1) * sizeof *set->clusters);
    set->keys = aligned_alloc(64, size ? size : 64);
    set->boxes = malloc(n_keys ? n_keys * 6 * sizeof *set->boxes : 1);
    if (!first || !set->clusters || !set->keys || !set->boxes) {
        free(first);
        return false;
    }
    for (uint32_t i = 0, c = 0; i < g->n_prims; i += b->size_at[i]) {
        first[c++] = i;
    }
    // Against the rounding of positions and of boxes in time, both relative to the largest.
    size_t n_positions = (size_t)g->n_keys * g->n_vertices;
    set->reach = largest_of(g->position, 3 * n_positions) +
                 (g->radius ? largest_of(g->radius, n_positions) : 0);
    float pad = 0x1p-21f * set->reach + 1e-36f;
#pragma omp parallel for schedule(static) num_threads(b->n_threads)
    for (uint32_t c = 0; c < set->n_clusters; c++) {
        uint32_t vertex[CLUSTER_LANES];
        fill_cluster(b, &set->clusters[c], b->order + first[c], b->size_at[first[c]], vertex);
        for (uint32_t key = 0; key < g->n_keys; key++) {
            fill_key(set, c, vertex, key, pad);
        }
    }
    free(first);
    set->bytes = size + n_clusters * sizeof *set->clusters;
    return true;
}

// -- all ------------------------------------------------------------------------------------------

static void builder_free(ClusterBuilder *b) {
    free(b->welded);
    free(b->boxes);
    free(b->order);
    free(b->size_at);
}

static bool build(ClusterBuilder *b, ClusterSet *set) {
    const Geometry *g = b->geometry;
    size_t n = g->n_prims ? g->n_prims : 1;
    b->n_probes = g->n_keys > 1 ? MOST_PROBES : 1;
    for (uint32_t i = 1; i < b->n_probes; i++) {
        b->probe_key[i] = (uint32_t)((uint64_t)(g->n_keys - 1) * i / (MOST_PROBES - 1));
    }
    b->boxes = aligned_alloc(16, n * b->n_probes * sizeof *b->boxes);
    b->order = malloc(n * sizeof *b->order);
    b->size_at = calloc(n, 1);
    if (!b->boxes || !b->order || !b->size_at || (g->kind == GEOMETRY_TRIANGLES && !weld(b))) {
        return false;
    }
    return cluster_cut(b) && fill_clusters(b, set);
}

size_t cluster_work_bytes(const Geometry *g) {
    size_t n_probes = g->n_keys > 1 ? MOST_PROBES : 1;
    size_t grid = g->n_prims < GROUPED_FROM ? 0 : (GRID_CELLS + 1) * sizeof(uint32_t);
    // Beside the boxes order, codes, sizes and where groups and clusters begin; a vertex has its
    // place in the table of hashes, of which less than three quarters stay empty.
    return (size_t)g->n_prims * (n_probes * sizeof(ProbeBox) + 16) + (size_t)g->n_vertices * 20 +
           grid;
}

ClusterSet *cluster_build(const Geometry *g, uint32_t n_threads) {
    ClusterSet *set = calloc(1, sizeof *set);
    if (!set) {
        return NULL;
    }
    set->geometry = g;
    ClusterBuilder b = {.geometry = g, .n_threads = (int)n_threads};
    bool is_built = build(&b, set);
    builder_free(&b);
    if (!is_built) {
        cluster_destroy(set);
        return NULL;
    }
    return set;
}

void cluster_drop_boxes(ClusterSet *set) {
    free(set->boxes);
    set->boxes = NULL;
}

void cluster_destroy(ClusterSet *set) {
    if (set) {
        free(set->clusters);
        free(set->keys);
        free(set->boxes);
        free(set);
    }
}
