// SPDX-License-Identifier: Apache-2.0
// Clusters by a surface area heuristic, from the top down.
//
// A set is cut until it fits a cluster. The cost of a side is its area times the clusters that it
// will need; counting distinct vertices as well as triangles matters: by triangles alone a
// structured grid ends at 7.8 triangles a cluster, with vertices at 11.9.
#include "accel/cluster.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    N_PROBES = 3, // keys at which triangles are bounded for the heuristic: first, middle, last
    N_BINS = 32,
    SWEEP_BELOW = 128, // sets up to this size are sorted and swept, larger ones binned
    VERTEX_ROOM = 13   // distinct vertices that a cluster is expected to hold, of 16
};

typedef struct {
    float lo[N_PROBES][3], hi[N_PROBES][3];
} ProbeBox;

typedef struct {
    const Geometry *geometry;
    uint32_t *welded; // [n_vertices], the first vertex equal to it
    ProbeBox *boxes;  // [n_prims]
    uint32_t *order;  // primitives, permuted in place
    uint32_t *stamp;  // [n_vertices], the last query that saw the vertex
    uint32_t query;
    ClusterSet *set;
    size_t capacity;
    uint32_t *spare;   // [n_prims], for partitions
    float *area_right; // [SWEEP_BELOW]
    bool is_out_of_memory;
} Builder;

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

static bool weld(Builder *b) {
    const Geometry *g = b->geometry;
    size_t size = 16;
    while (size < (size_t)g->n_vertices * 2) {
        size *= 2;
    }
    uint32_t *table = malloc(size * sizeof *table);
    if (!table) {
        return false;
    }
    memset(table, 0xff, size * sizeof *table);
    for (uint32_t v = 0; v < g->n_vertices; v++) {
        size_t at = hash_vertex(g, v) & (size - 1);
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

static int corners_of(const Geometry *g, uint32_t prim, uint32_t corner[3]) {
    if (g->kind == GEOMETRY_SPHERES) {
        corner[0] = prim;
        return 1;
    }
    memcpy(corner, g->index + (size_t)prim * 3, 3 * sizeof *corner);
    return 3;
}

// What is not finite bounds nothing: such a primitive is never hit there.
static bool grow(float lo[3], float hi[3], const float *p, float radius) {
    bool is_finite = true;
    for (int a = 0; a < 3; a++) {
        float low = p[a] - radius, high = p[a] + radius;
        if (isfinite(low) && isfinite(high)) {
            lo[a] = least(lo[a], low);
            hi[a] = most(hi[a], high);
        } else {
            is_finite = false;
        }
    }
    return is_finite;
}

static float radius_at(const Geometry *g, uint32_t key, uint32_t vertex) {
    float r = g->radius ? g->radius[(size_t)key * g->n_vertices + vertex] : 0;
    return r > 0 || r != r ? r : 0;
}

static void probe(Builder *b, uint32_t prim) {
    const Geometry *g = b->geometry;
    uint32_t corner[3];
    int n = corners_of(g, prim, corner);
    for (int k = 0; k < N_PROBES; k++) {
        uint32_t key = (uint32_t)((uint64_t)(g->n_keys - 1) * (uint64_t)k / (N_PROBES - 1));
        float *lo = b->boxes[prim].lo[k], *hi = b->boxes[prim].hi[k];
        lo[0] = lo[1] = lo[2] = INFINITY;
        hi[0] = hi[1] = hi[2] = -INFINITY;
        for (int c = 0; c < n; c++) {
            const float *p = g->position + ((size_t)key * g->n_vertices + corner[c]) * 3;
            grow(lo, hi, p, radius_at(g, key, corner[c]));
        }
        for (int a = 0; a < 3; a++) {
            if (!(lo[a] <= hi[a])) {
                lo[a] = hi[a] = 0;
            }
        }
    }
}

static void probe_join(ProbeBox *box, const ProbeBox *other) {
    for (int k = 0; k < N_PROBES; k++) {
        for (int a = 0; a < 3; a++) {
            box->lo[k][a] = least(box->lo[k][a], other->lo[k][a]);
            box->hi[k][a] = most(box->hi[k][a], other->hi[k][a]);
        }
    }
}

static ProbeBox probe_empty(void) {
    ProbeBox box;
    for (int k = 0; k < N_PROBES; k++) {
        for (int a = 0; a < 3; a++) {
            box.lo[k][a] = INFINITY;
            box.hi[k][a] = -INFINITY;
        }
    }
    return box;
}

static float probe_area(const ProbeBox *box) {
    float area = 0;
    for (int k = 0; k < N_PROBES; k++) {
        float e[3];
        for (int a = 0; a < 3; a++) {
            e[a] = box->hi[k][a] - box->lo[k][a];
        }
        area += e[0] >= 0 ? e[0] * e[1] + e[1] * e[2] + e[2] * e[0] : 0;
    }
    return area;
}

static float center_of(const Builder *b, uint32_t prim, int axis) {
    const ProbeBox *box = &b->boxes[prim];
    return 0.5f * (box->lo[N_PROBES / 2][axis] + box->hi[N_PROBES / 2][axis]);
}

// -- cutting --------------------------------------------------------------------------------------

// How many of a primitive's vertices this query had not seen.
static uint32_t count_new_vertices(Builder *b, uint32_t prim) {
    uint32_t corner[3], count = 0;
    int n_corners = corners_of(b->geometry, prim, corner);
    for (int c = 0; c < n_corners; c++) {
        uint32_t v = b->welded[corner[c]];
        count += b->stamp[v] != b->query;
        b->stamp[v] = b->query;
    }
    return count;
}

static uint32_t count_vertices(Builder *b, const uint32_t *prims, uint32_t n) {
    uint32_t count = 0;
    b->query++;
    for (uint32_t i = 0; i < n; i++) {
        count += count_new_vertices(b, prims[i]);
    }
    return count;
}

static bool fits(Builder *b, const uint32_t *prims, uint32_t n) {
    return n <= CLUSTER_LANES &&
           (n * 3 <= CLUSTER_LANES || count_vertices(b, prims, n) <= CLUSTER_LANES);
}

static uint32_t need_of(uint32_t n, uint32_t n_vertices) {
    if (n <= CLUSTER_LANES && n_vertices <= CLUSTER_LANES) {
        return 1;
    }
    uint32_t by_prims = (n + CLUSTER_LANES - 1) / CLUSTER_LANES;
    uint32_t by_vertices = (n_vertices + VERTEX_ROOM - 1) / VERTEX_ROOM;
    uint32_t need = by_prims > by_vertices ? by_prims : by_vertices;
    return need > 2 ? need : 2;
}

typedef struct {
    float cost;
    int axis;
    uint32_t n_left; // after sorting
    float plane;     // where binned
} Cut;

// The sides' needs and areas from the back first, then every cut from the front.
static void sweep_axis(Builder *b, uint32_t *prims, uint32_t n, int axis, Cut *best) {
    uint32_t need_right[SWEEP_BELOW + 1];
    ProbeBox box = probe_empty();
    uint32_t n_vertices = 0;
    b->query++;
    for (uint32_t i = n; i-- > 1;) {
        n_vertices += count_new_vertices(b, prims[i]);
        probe_join(&box, &b->boxes[prims[i]]);
        b->area_right[i] = probe_area(&box);
        need_right[i] = need_of(n - i, n_vertices);
    }
    box = probe_empty();
    n_vertices = 0;
    b->query++;
    for (uint32_t i = 0; i + 1 < n; i++) {
        n_vertices += count_new_vertices(b, prims[i]);
        probe_join(&box, &b->boxes[prims[i]]);
        float cost = probe_area(&box) * (float)need_of(i + 1, n_vertices) +
                     b->area_right[i + 1] * (float)need_right[i + 1];
        if (cost < best->cost) {
            *best = (Cut){cost, axis, i + 1, 0};
        }
    }
}

// Insertion sort by centre, ties by number: n is small and the order is almost kept from the
// parent.
static void sort_by_center(const Builder *b, uint32_t *prims, uint32_t n, int axis) {
    for (uint32_t i = 1; i < n; i++) {
        uint32_t prim = prims[i], j = i;
        float center = center_of(b, prim, axis);
        while (j > 0) {
            float other = center_of(b, prims[j - 1], axis);
            if (other < center || (other == center && prims[j - 1] < prim)) {
                break;
            }
            prims[j] = prims[j - 1];
            j--;
        }
        prims[j] = prim;
    }
}

static uint32_t cut_by_sweep(Builder *b, uint32_t *prims, uint32_t n) {
    Cut best = {INFINITY, 0, n / 2, 0};
    for (int axis = 0; axis < 3; axis++) {
        sort_by_center(b, prims, n, axis);
        sweep_axis(b, prims, n, axis, &best);
    }
    sort_by_center(b, prims, n, best.axis);
    return best.n_left;
}

static int bin_of(float center, float lo, float scale) {
    float at = (center - lo) * scale;
    return at >= N_BINS - 1 ? N_BINS - 1 : at > 0 ? (int)at : 0;
}

static void bin_axis(const Builder *b, const uint32_t *prims, uint32_t n, int axis, float lo,
                     float scale, Cut *best) {
    ProbeBox box[N_BINS];
    uint32_t count[N_BINS] = {0};
    for (int i = 0; i < N_BINS; i++) {
        box[i] = probe_empty();
    }
    for (uint32_t i = 0; i < n; i++) {
        int k = bin_of(center_of(b, prims[i], axis), lo, scale);
        probe_join(&box[k], &b->boxes[prims[i]]);
        count[k]++;
    }
    float right[N_BINS];
    ProbeBox sum = probe_empty();
    for (int i = N_BINS - 1; i > 0; i--) {
        probe_join(&sum, &box[i]);
        right[i] = probe_area(&sum);
    }
    sum = probe_empty();
    uint32_t n_left = 0;
    for (int i = 0; i + 1 < N_BINS; i++) {
        probe_join(&sum, &box[i]);
        n_left += count[i];
        if (n_left == 0 || n_left == n) {
            continue;
        }
        float cost = probe_area(&sum) * (float)((n_left + 15) / 16) +
                     right[i + 1] * (float)((n - n_left + 15) / 16);
        if (cost < best->cost) {
            *best = (Cut){cost, axis, n_left, (float)(i + 1)};
        }
    }
}

// 0: all centres fall together.
static uint32_t cut_by_bins(Builder *b, uint32_t *prims, uint32_t n) {
    float lo[3], scale[3];
    Cut best = {INFINITY, -1, 0, 0};
    for (int axis = 0; axis < 3; axis++) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < n; i++) {
            float c = center_of(b, prims[i], axis);
            low = least(low, c);
            high = most(high, c);
        }
        lo[axis] = low;
        scale[axis] = N_BINS / (high - low);
        if (high > low && isfinite(scale[axis])) {
            bin_axis(b, prims, n, axis, low, scale[axis], &best);
        }
    }
    if (best.axis < 0) {
        return 0;
    }
    // Stable partition, so that the result depends on nothing but the geometry.
    uint32_t *spare = b->spare, n_left = 0, n_right = 0;
    for (uint32_t i = 0; i < n; i++) {
        float c = center_of(b, prims[i], best.axis);
        if (bin_of(c, lo[best.axis], scale[best.axis]) < (int)best.plane) {
            prims[n_left++] = prims[i];
        } else {
            spare[n_right++] = prims[i];
        }
    }
    memcpy(prims + n_left, spare, n_right * sizeof *spare);
    return n_left;
}

static void emit(Builder *b, const uint32_t *prims, uint32_t n) {
    ClusterSet *set = b->set;
    if (set->n_clusters == b->capacity) {
        size_t larger = b->capacity * 2;
        Cluster *copy = realloc(set->clusters, larger * sizeof *copy);
        if (!copy) {
            b->is_out_of_memory = true;
            return;
        }
        set->clusters = copy;
        b->capacity = larger;
    }
    Cluster *cluster = &set->clusters[set->n_clusters++];
    memset(cluster, 0, sizeof *cluster);
    memset(cluster->prim, 0xff, sizeof cluster->prim);
    uint32_t n_vertices = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t corner[3];
        int n_corners = corners_of(b->geometry, prims[i], corner);
        cluster->prim[i] = (int32_t)prims[i];
        for (int c = 0; c < n_corners; c++) {
            uint32_t v = b->welded[corner[c]], lane = 0;
            while (lane < n_vertices && cluster->vertex[lane] != v) {
                lane++;
            }
            if (lane == n_vertices) {
                cluster->vertex[n_vertices++] = v;
            }
            cluster->corner[c][i] = (uint8_t)lane;
        }
    }
    for (uint32_t lane = n_vertices; lane < CLUSTER_LANES; lane++) {
        cluster->vertex[lane] = cluster->vertex[0];
    }
}

static void cut(Builder *b, uint32_t *prims, uint32_t n) {
    while (!fits(b, prims, n)) {
        uint32_t n_left = n <= SWEEP_BELOW ? cut_by_sweep(b, prims, n) : cut_by_bins(b, prims, n);
        if (n_left == 0 || n_left == n) {
            n_left = n / 2;
        }
        // The smaller side by recursion, so the depth is bounded by the logarithm of n; the order
        // of clusters does not matter to the tree.
        if (n_left <= n - n_left) {
            cut(b, prims, n_left);
            prims += n_left;
            n -= n_left;
        } else {
            cut(b, prims + n_left, n - n_left);
            n = n_left;
        }
    }
    emit(b, prims, n);
}

// -- keys -----------------------------------------------------------------------------------------

// Padding against the rounding of positions and of boxes in time, both relative to the largest
// coordinate there is.
static float padding(const Geometry *g) {
    float largest = 0;
    size_t n = (size_t)g->n_keys * g->n_vertices * 3;
    for (size_t i = 0; i < n; i++) {
        float size = fabsf(g->position[i]);
        largest = size > largest && size <= FLT_MAX ? size : largest;
    }
    return 0x1p-21f * largest + 1e-36f;
}

static void fill_key(ClusterSet *set, uint32_t c, uint32_t key, float pad) {
    const Geometry *g = set->geometry;
    const Cluster *cluster = &set->clusters[c];
    size_t row = (size_t)c * g->n_keys + key;
    float *to = set->keys + row * set->n_rows * CLUSTER_LANES;
    float *lo = set->boxes + row * 6, *hi = lo + 3;
    lo[0] = lo[1] = lo[2] = INFINITY;
    hi[0] = hi[1] = hi[2] = -INFINITY;
    for (int lane = 0; lane < CLUSTER_LANES; lane++) {
        uint32_t v = cluster->vertex[lane];
        const float *p = g->position + ((size_t)key * g->n_vertices + v) * 3;
        float radius = radius_at(g, key, v);
        for (int a = 0; a < 3; a++) {
            to[a * CLUSTER_LANES + lane] = p[a];
        }
        if (g->radius) {
            bool is_used = cluster->prim[lane] >= 0;
            to[3 * CLUSTER_LANES + lane] =
                is_used ? g->radius[(size_t)key * g->n_vertices + v] : -1;
        }
        grow(lo, hi, p, radius);
    }
    for (int a = 0; a < 3; a++) {
        if (!(lo[a] <= hi[a])) {
            lo[a] = hi[a] = 0;
        }
        lo[a] = most(lo[a] - pad, -FLT_MAX);
        hi[a] = least(hi[a] + pad, FLT_MAX);
    }
}

static bool fill_keys(ClusterSet *set) {
    const Geometry *g = set->geometry;
    size_t n_rows = (size_t)set->n_clusters * g->n_keys;
    set->n_rows = g->kind == GEOMETRY_SPHERES ? 4 : 3;
    size_t size = n_rows * set->n_rows * CLUSTER_LANES * sizeof *set->keys;
    set->keys = aligned_alloc(64, size ? size : 64);
    set->boxes = malloc(n_rows ? n_rows * 6 * sizeof *set->boxes : 1);
    if (!set->keys || !set->boxes) {
        return false;
    }
    float pad = padding(g);
#pragma omp parallel for schedule(static)
    for (uint32_t c = 0; c < set->n_clusters; c++) {
        for (uint32_t key = 0; key < g->n_keys; key++) {
            fill_key(set, c, key, pad);
        }
    }
    set->bytes = size + set->n_clusters * sizeof *set->clusters;
    return true;
}

// -- all ------------------------------------------------------------------------------------------

static void builder_free(Builder *b) {
    free(b->welded);
    free(b->boxes);
    free(b->order);
    free(b->stamp);
    free(b->spare);
    free(b->area_right);
}

ClusterSet *cluster_build(const Geometry *g) {
    Builder b = {.geometry = g, .capacity = g->n_prims / 8 + 1};
    size_t n = g->n_prims ? g->n_prims : 1, n_vertices = g->n_vertices ? g->n_vertices : 1;
    b.welded = malloc(n_vertices * sizeof *b.welded);
    b.boxes = malloc(n * sizeof *b.boxes);
    b.order = malloc(n * sizeof *b.order);
    b.stamp = calloc(n_vertices, sizeof *b.stamp);
    b.spare = malloc(n * sizeof *b.spare);
    b.area_right = malloc((SWEEP_BELOW + 1) * sizeof *b.area_right);
    b.set = calloc(1, sizeof *b.set);
    if (b.set) {
        b.set->geometry = g;
        b.set->clusters = malloc(b.capacity * sizeof *b.set->clusters);
    }
    if (!b.welded || !b.boxes || !b.order || !b.stamp || !b.spare || !b.area_right || !b.set ||
        !b.set->clusters || !weld(&b)) {
        builder_free(&b);
        cluster_destroy(b.set);
        return NULL;
    }
    for (uint32_t i = 0; i < g->n_prims; i++) {
        b.order[i] = i;
        probe(&b, i);
    }
    if (g->n_prims) {
        cut(&b, b.order, g->n_prims);
    }
    builder_free(&b);
    if (b.is_out_of_memory || !fill_keys(b.set)) {
        cluster_destroy(b.set);
        return NULL;
    }
    return b.set;
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
