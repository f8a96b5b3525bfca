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
#include <xmmintrin.h>

enum {
    MOST_PROBES = 3, // keys at which primitives are bounded for the heuristic: first, middle, last
    MOST_BINS = 32,
    SWEEP_BELOW = 128, // sets up to this size are sorted and swept, larger ones binned
    TASK_ABOVE = 4096, // sets from this size on are cut by whichever thread is free
    VERTEX_ROOM = 13   // distinct vertices that a cluster is expected to hold, of 16
};

// The number of probes is a constant of each use.
#define SPECIALISED static inline __attribute__((always_inline))

// Of the four floats three count.
typedef struct {
    __m128 lo, hi;
} ProbeBox;

// Primitives and their boxes are permuted together, in place. Where a cluster begins its size is
// written down: which thread cut it leaves no trace.
typedef struct {
    const Geometry *geometry;
    uint32_t *welded; // [n_vertices], the first vertex equal to it; spheres: NULL
    uint32_t n_probes;
    ProbeBox *boxes;  // [n_prims][n_probes]
    uint32_t *order;  // [n_prims], primitives
    uint8_t *size_at; // [n_prims], of the cluster that begins there, else 0
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

// Hashes by all threads, the table by one, so that the first of equal vertices stands for them.
static bool weld(Builder *b) {
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
#pragma omp parallel for schedule(static)
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

static uint32_t welded(const Builder *b, uint32_t vertex) {
    return b->welded ? b->welded[vertex] : vertex;
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
    for (uint32_t k = 0; k < b->n_probes; k++) {
        uint32_t last = b->n_probes > 1 ? b->n_probes - 1 : 1;
        uint32_t key = (uint32_t)((uint64_t)(g->n_keys - 1) * k / last);
        float lo[4] = {INFINITY, INFINITY, INFINITY, 0};
        float hi[4] = {-INFINITY, -INFINITY, -INFINITY, 0};
        for (int c = 0; c < n; c++) {
            const float *p = g->position + ((size_t)key * g->n_vertices + corner[c]) * 3;
            grow(lo, hi, p, radius_at(g, key, corner[c]));
        }
        for (int a = 0; a < 3; a++) {
            if (!(lo[a] <= hi[a])) {
                lo[a] = hi[a] = 0;
            }
        }
        ProbeBox *box = &b->boxes[(size_t)prim * b->n_probes + k];
        box->lo = _mm_loadu_ps(lo);
        box->hi = _mm_loadu_ps(hi);
    }
}

SPECIALISED void probe_join(ProbeBox *box, const ProbeBox *other, uint32_t n) {
    for (uint32_t k = 0; k < n; k++) {
        box[k].lo = _mm_min_ps(box[k].lo, other[k].lo);
        box[k].hi = _mm_max_ps(box[k].hi, other[k].hi);
    }
}

SPECIALISED void probe_clear(ProbeBox *box, uint32_t n) {
    for (uint32_t k = 0; k < n; k++) {
        box[k].lo = _mm_set1_ps(INFINITY);
        box[k].hi = _mm_set1_ps(-INFINITY);
    }
}

SPECIALISED float probe_area(const ProbeBox *box, uint32_t n) {
    float area = 0;
    for (uint32_t k = 0; k < n; k++) {
        float e[4];
        _mm_storeu_ps(e, _mm_sub_ps(box[k].hi, box[k].lo));
        area += e[0] >= 0 ? e[0] * e[1] + e[1] * e[2] + e[2] * e[0] : 0;
    }
    return area;
}

// Twice the centre at the middle key.
SPECIALISED __m128 center_of(const ProbeBox *box, uint32_t n) {
    return _mm_add_ps(box[n / 2].lo, box[n / 2].hi);
}

// -- small sets -----------------------------------------------------------------------------------

// Up to SWEEP_BELOW triangles, with vertices numbered anew from 0.
typedef struct {
    const ProbeBox *boxes;
    uint32_t n_probes;
    uint16_t corner[SWEEP_BELOW][3];
    float center[3][SWEEP_BELOW];
    uint32_t seen[3 * SWEEP_BELOW], query; // the last query that saw a vertex
    uint8_t order[SWEEP_BELOW];
} Small;

static uint32_t count_new_vertices(Small *s, uint32_t prim) {
    uint32_t count = 0;
    for (int c = 0; c < 3; c++) {
        uint32_t v = s->corner[prim][c];
        count += s->seen[v] != s->query;
        s->seen[v] = s->query;
    }
    return count;
}

static bool small_fits(Small *s, const uint8_t *prims, uint32_t n) {
    uint32_t n_vertices = 0;
    s->query++;
    for (uint32_t i = 0; i < n && n_vertices <= CLUSTER_LANES; i++) {
        n_vertices += count_new_vertices(s, prims[i]);
    }
    return n <= CLUSTER_LANES && n_vertices <= CLUSTER_LANES;
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
} Cut;

// The sides' costs from the back first, then every cut from the front.
static void sweep_axis(Small *s, const uint8_t *prims, uint32_t n, int axis, Cut *best) {
    float right[SWEEP_BELOW + 1];
    ProbeBox box[MOST_PROBES];
    probe_clear(box, s->n_probes);
    uint32_t n_vertices = 0;
    s->query++;
    for (uint32_t i = n; i-- > 1;) {
        n_vertices += count_new_vertices(s, prims[i]);
        probe_join(box, s->boxes + (size_t)prims[i] * s->n_probes, s->n_probes);
        right[i] = probe_area(box, s->n_probes) * (float)need_of(n - i, n_vertices);
    }
    probe_clear(box, s->n_probes);
    n_vertices = 0;
    s->query++;
    for (uint32_t i = 0; i + 1 < n; i++) {
        n_vertices += count_new_vertices(s, prims[i]);
        probe_join(box, s->boxes + (size_t)prims[i] * s->n_probes, s->n_probes);
        float cost =
            probe_area(box, s->n_probes) * (float)need_of(i + 1, n_vertices) + right[i + 1];
        if (cost < best->cost) {
            *best = (Cut){cost, axis, i + 1};
        }
    }
}

// Insertion sort by centre, ties by number: n is small and the order is almost kept from the
// parent.
static void sort_by_center(const float *center, uint8_t *prims, uint32_t n) {
    for (uint32_t i = 1; i < n; i++) {
        uint8_t prim = prims[i];
        uint32_t j = i;
        for (; j > 0; j--) {
            float other = center[prims[j - 1]];
            if (other < center[prim] || (other == center[prim] && prims[j - 1] < prim)) {
                break;
            }
            prims[j] = prims[j - 1];
        }
        prims[j] = prim;
    }
}

static void small_cut(Small *s, uint8_t *prims, uint32_t n, uint8_t *size_at) {
    while (!small_fits(s, prims, n)) {
        Cut best = {INFINITY, 0, n / 2};
        for (int axis = 0; axis < 3; axis++) {
            sort_by_center(s->center[axis], prims, n);
            sweep_axis(s, prims, n, axis, &best);
        }
        if (best.axis != 2) {
            sort_by_center(s->center[best.axis], prims, n);
        }
        small_cut(s, prims, best.n_left, size_at);
        prims += best.n_left;
        size_at += best.n_left;
        n -= best.n_left;
    }
    *size_at = (uint8_t)n;
}

// Vertices by an open hash table, in the order in which they are met.
static void number_vertices(const Builder *b, Small *s, const uint32_t *prims, uint32_t n) {
    enum { SIZE = 1024 };
    uint32_t vertex[SIZE], n_vertices = 0;
    uint16_t number[SIZE];
    memset(vertex, 0xff, sizeof vertex);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t *corner = b->geometry->index + 3 * (size_t)prims[i];
        for (int c = 0; c < 3; c++) {
            uint32_t v = welded(b, corner[c]), at = v * 0x9e3779b1u >> 22;
            while (vertex[at] != UINT32_MAX && vertex[at] != v) {
                at = (at + 1) % SIZE;
            }
            if (vertex[at] == UINT32_MAX) {
                vertex[at] = v;
                number[at] = (uint16_t)n_vertices++;
            }
            s->corner[i][c] = number[at];
        }
    }
    memset(s->seen, 0, sizeof s->seen);
    s->query = 0;
}

static void cut_small(const Builder *b, uint32_t first, uint32_t n) {
    Small s = {.boxes = b->boxes + (size_t)first * b->n_probes, .n_probes = b->n_probes};
    uint32_t *order = b->order + first, sorted[SWEEP_BELOW];
    number_vertices(b, &s, order, n);
    for (uint32_t i = 0; i < n; i++) {
        float center[4];
        _mm_storeu_ps(center, center_of(s.boxes + (size_t)i * s.n_probes, s.n_probes));
        for (int axis = 0; axis < 3; axis++) {
            s.center[axis][i] = center[axis];
        }
        s.order[i] = (uint8_t)i;
    }
    small_cut(&s, s.order, n, b->size_at + first);
    for (uint32_t i = 0; i < n; i++) {
        sorted[i] = order[s.order[i]];
    }
    memcpy(order, sorted, n * sizeof *order);
}

// -- large sets -----------------------------------------------------------------------------------

typedef struct {
    ProbeBox box[MOST_BINS][MOST_PROBES];
    uint32_t count[MOST_BINS];
} Bins;

typedef struct {
    float cost;
    int axis, bin;
} BinCut;

// Of the three axes at once; lanes of an axis without extent give bin 0.
SPECIALISED __m128i bins_of(const ProbeBox *box, uint32_t n_probes, __m128 lo, __m128 scale,
                            __m128 last) {
    __m128 at = _mm_mul_ps(_mm_sub_ps(center_of(box, n_probes), lo), scale);
    return _mm_cvttps_epi32(_mm_max_ps(_mm_min_ps(at, last), _mm_setzero_ps()));
}

SPECIALISED void best_of_axis(const Bins *bins, int n_bins, uint32_t n, uint32_t n_probes, int axis,
                              BinCut *best) {
    float right[MOST_BINS];
    ProbeBox sum[MOST_PROBES];
    probe_clear(sum, n_probes);
    for (int i = n_bins - 1; i > 0; i--) {
        probe_join(sum, bins->box[i], n_probes);
        right[i] = probe_area(sum, n_probes);
    }
    probe_clear(sum, n_probes);
    uint32_t n_left = 0;
    for (int i = 0; i + 1 < n_bins; i++) {
        probe_join(sum, bins->box[i], n_probes);
        n_left += bins->count[i];
        if (n_left == 0 || n_left == n) {
            continue;
        }
        float cost = probe_area(sum, n_probes) * (float)((n_left + 15) / 16) +
                     right[i + 1] * (float)((n - n_left + 15) / 16);
        if (cost < best->cost) {
            *best = (BinCut){cost, axis, i + 1};
        }
    }
}

SPECIALISED void swap_prims(const Builder *b, uint32_t i, uint32_t j, uint32_t n_probes) {
    uint32_t prim = b->order[i];
    b->order[i] = b->order[j];
    b->order[j] = prim;
    ProbeBox *x = b->boxes + (size_t)i * n_probes, *y = b->boxes + (size_t)j * n_probes;
    for (uint32_t k = 0; k < n_probes; k++) {
        ProbeBox box = x[k];
        x[k] = y[k];
        y[k] = box;
    }
}

SPECIALISED uint32_t cut_by_probes(const Builder *b, uint32_t first, uint32_t n,
                                   uint32_t n_probes) {
    const ProbeBox *boxes = b->boxes + (size_t)first * n_probes;
    __m128 lo = _mm_set1_ps(INFINITY), hi = _mm_set1_ps(-INFINITY);
    for (uint32_t i = 0; i < n; i++) {
        __m128 c = center_of(boxes + (size_t)i * n_probes, n_probes);
        lo = _mm_min_ps(lo, c);
        hi = _mm_max_ps(hi, c);
    }
    int n_bins = n < 2 * MOST_BINS ? MOST_BINS / 2 : MOST_BINS;
    __m128 extent = _mm_sub_ps(hi, lo), last = _mm_set1_ps((float)(n_bins - 1));
    __m128 scale = _mm_div_ps(_mm_set1_ps((float)n_bins), extent);
    // An extent of 0, and one whose inverse is no number.
    __m128 is_wide = _mm_and_ps(_mm_cmpgt_ps(extent, _mm_setzero_ps()),
                                _mm_cmplt_ps(scale, _mm_set1_ps(INFINITY)));
    scale = _mm_and_ps(scale, is_wide);
    Bins bins[3];
    for (int axis = 0; axis < 3; axis++) {
        memset(bins[axis].count, 0, sizeof bins[axis].count);
        for (int i = 0; i < n_bins; i++) {
            probe_clear(bins[axis].box[i], n_probes);
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        const ProbeBox *box = boxes + (size_t)i * n_probes;
        int at[4];
        _mm_storeu_si128((__m128i *)(void *)at, bins_of(box, n_probes, lo, scale, last));
        for (int axis = 0; axis < 3; axis++) {
            bins[axis].count[at[axis]]++;
            probe_join(bins[axis].box[at[axis]], box, n_probes);
        }
    }
    BinCut best = {INFINITY, -1, 0};
    for (int axis = 0; axis < 3; axis++) {
        best_of_axis(&bins[axis], n_bins, n, n_probes, axis, &best);
    }
    if (best.axis < 0) {
        return 0;
    }
    uint32_t left = 0, right = n;
    while (left < right) {
        int at[4];
        _mm_storeu_si128((__m128i *)(void *)at,
                         bins_of(boxes + (size_t)left * n_probes, n_probes, lo, scale, last));
        if (at[best.axis] < best.bin) {
            left++;
        } else {
            swap_prims(b, first + left, first + --right, n_probes);
        }
    }
    return left;
}

// How many come to the left; 0: all centres fall together.
static uint32_t cut_by_bins(const Builder *b, uint32_t first, uint32_t n) {
    return b->n_probes == 1 ? cut_by_probes(b, first, n, 1)
                            : cut_by_probes(b, first, n, MOST_PROBES);
}

static void cut(const Builder *b, uint32_t first, uint32_t n) {
    bool is_sphere = b->geometry->kind == GEOMETRY_SPHERES;
    while (n > (is_sphere ? CLUSTER_LANES : SWEEP_BELOW)) {
        uint32_t n_left = cut_by_bins(b, first, n);
        if (n_left == 0 || n_left == n) {
            n_left = n / 2;
        }
        // The smaller side by recursion, so the depth is bounded by the logarithm of n.
        uint32_t middle = first + n_left, n_right = n - n_left;
        bool is_left = n_left <= n_right;
        uint32_t aside = is_left ? first : middle, n_aside = is_left ? n_left : n_right;
        if (n_aside >= TASK_ABOVE) {
#pragma omp task
            cut(b, aside, n_aside);
        } else {
            cut(b, aside, n_aside);
        }
        first = is_left ? middle : first;
        n -= n_aside;
    }
    if (is_sphere) {
        b->size_at[first] = (uint8_t)n;
    } else {
        cut_small(b, first, n);
    }
}

static void fill_cluster(const Builder *b, Cluster *cluster, const uint32_t *prims, uint32_t n) {
    memset(cluster, 0, sizeof *cluster);
    memset(cluster->prim, 0xff, sizeof cluster->prim);
    uint32_t n_vertices = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t corner[3];
        int n_corners = corners_of(b->geometry, prims[i], corner);
        cluster->prim[i] = (int32_t)prims[i];
        for (int c = 0; c < n_corners; c++) {
            uint32_t v = welded(b, corner[c]), lane = 0;
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

static bool fill_clusters(const Builder *b, ClusterSet *set) {
    uint32_t n_prims = b->geometry->n_prims;
    for (uint32_t i = 0; i < n_prims; i += b->size_at[i]) {
        set->n_clusters++;
    }
    uint32_t *first = malloc((set->n_clusters + (size_t)1) * sizeof *first);
    set->clusters = malloc((set->n_clusters + (size_t)1) * sizeof *set->clusters);
    if (first && set->clusters) {
        for (uint32_t i = 0, c = 0; i < n_prims; i += b->size_at[i]) {
            first[c++] = i;
        }
#pragma omp parallel for schedule(static)
        for (uint32_t c = 0; c < set->n_clusters; c++) {
            fill_cluster(b, &set->clusters[c], b->order + first[c], b->size_at[first[c]]);
        }
    }
    bool is_filled = first && set->clusters;
    free(first);
    return is_filled;
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
    free(b->size_at);
}

static bool build(Builder *b, ClusterSet *set) {
    const Geometry *g = b->geometry;
    size_t n = g->n_prims ? g->n_prims : 1;
    b->n_probes = g->n_keys > 1 ? MOST_PROBES : 1;
    b->boxes = aligned_alloc(16, n * b->n_probes * sizeof *b->boxes);
    b->order = malloc(n * sizeof *b->order);
    b->size_at = calloc(n, 1);
    if (!b->boxes || !b->order || !b->size_at || (g->kind == GEOMETRY_TRIANGLES && !weld(b))) {
        return false;
    }
#pragma omp parallel for schedule(static)
    for (uint32_t i = 0; i < g->n_prims; i++) {
        b->order[i] = i;
        probe(b, i);
    }
    if (g->n_prims) {
#pragma omp parallel
#pragma omp single
        cut(b, 0, g->n_prims);
    }
    return fill_clusters(b, set) && fill_keys(set);
}

ClusterSet *cluster_build(const Geometry *g) {
    ClusterSet *set = calloc(1, sizeof *set);
    if (!set) {
        return NULL;
    }
    set->geometry = g;
    Builder b = {.geometry = g};
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
