// SPDX-License-Identifier: Apache-2.0
// Primitives cut into sets that fit clusters, by a surface area heuristic, from the top down.
//
// The top is a grid: which half of the scene a primitive lies in says little about its cluster, and
// a pass over everything for each of the upper levels costs more than all below them. A set is cut
// until it fits. The cost of a side is its area times the clusters that it will need; counting
// distinct vertices as well as triangles matters: by triangles alone a structured grid ends at 7.8
// triangles a cluster, with vertices at 11.9.
#include "accel/cluster_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_BINS = 32,
    SWEEP_BELOW = 128, // sets up to this size are sorted and swept, larger ones binned
    VERTEX_ROOM = 13   // distinct vertices that a cluster is expected to hold, of 16
};

// The number of probes is a constant of each use.
#define SPECIALISED static inline __attribute__((always_inline))

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
static void number_vertices(const ClusterBuilder *b, Small *s, const uint32_t *prims, uint32_t n) {
    enum { SIZE = 1024 };
    uint32_t vertex[SIZE], n_vertices = 0;
    uint16_t number[SIZE];
    memset(vertex, 0xff, sizeof vertex);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t *corner = b->geometry->index + 3 * (size_t)prims[i];
        for (int c = 0; c < 3; c++) {
            uint32_t v = cluster_welded(b, corner[c]), at = v * 0x9e3779b1u >> 22;
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

static void cut_small(const ClusterBuilder *b, uint32_t first, uint32_t n) {
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

// Bins in a unit of length; 0 along an axis of no extent, or of one whose inverse is no number.
SPECIALISED __m128 scale_of(__m128 lo, __m128 hi, __m128 n_bins) {
    __m128 extent = _mm_sub_ps(hi, lo), scale = _mm_div_ps(n_bins, extent);
    __m128 is_wide = _mm_and_ps(_mm_cmpgt_ps(extent, _mm_setzero_ps()),
                                _mm_cmplt_ps(scale, _mm_set1_ps(INFINITY)));
    return _mm_and_ps(scale, is_wide);
}

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

SPECIALISED void swap_prims(const ClusterBuilder *b, uint32_t i, uint32_t j, uint32_t n_probes) {
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

SPECIALISED uint32_t cut_by_probes(const ClusterBuilder *b, uint32_t first, uint32_t n,
                                   uint32_t n_probes) {
    const ProbeBox *boxes = b->boxes + (size_t)first * n_probes;
    __m128 lo = _mm_set1_ps(INFINITY), hi = _mm_set1_ps(-INFINITY);
    for (uint32_t i = 0; i < n; i++) {
        __m128 c = center_of(boxes + (size_t)i * n_probes, n_probes);
        lo = _mm_min_ps(lo, c);
        hi = _mm_max_ps(hi, c);
    }
    int n_bins = n < 2 * MOST_BINS ? MOST_BINS / 2 : MOST_BINS;
    __m128 last = _mm_set1_ps((float)(n_bins - 1));
    __m128 scale = scale_of(lo, hi, _mm_set1_ps((float)n_bins));
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
static uint32_t cut_by_bins(const ClusterBuilder *b, uint32_t first, uint32_t n) {
    return b->n_probes == 1 ? cut_by_probes(b, first, n, 1)
                            : cut_by_probes(b, first, n, MOST_PROBES);
}

static void cut(const ClusterBuilder *b, uint32_t first, uint32_t n) {
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
        cut(b, aside, n_aside);
        first = is_left ? middle : first;
        n -= n_aside;
    }
    if (is_sphere) {
        b->size_at[first] = (uint8_t)n;
    } else {
        cut_small(b, first, n);
    }
}

// -- groups ---------------------------------------------------------------------------------------

// Cells are numbered by the bits of x, y, z in turn (Morton order), so that those whose numbers are
// near each other mostly lie near each other. This is one coordinate's share.
static uint32_t spread_bits(uint32_t x) {
    uint32_t code = 0;
    for (int bit = 0; bit < GRID_BITS; bit++) {
        code |= (x >> bit & 1) << 3 * bit;
    }
    return code;
}

// Of the cells in which primitives have their centres, at the middle probe.
static void find_codes(const ClusterBuilder *b, uint32_t *codes) {
    uint32_t n = b->geometry->n_prims, middle = b->n_probes / 2;
    __m128 lo = _mm_set1_ps(INFINITY), hi = _mm_set1_ps(-INFINITY);
#pragma omp parallel num_threads(b->n_threads)
    {
        __m128 own_lo = _mm_set1_ps(INFINITY), own_hi = _mm_set1_ps(-INFINITY);
#pragma omp for schedule(static)
        for (uint32_t i = 0; i < n; i++) {
            ProbeBox box = cluster_probe(b, i, middle);
            __m128 c = center_of(&box, 1);
            own_lo = _mm_min_ps(own_lo, c);
            own_hi = _mm_max_ps(own_hi, c);
        }
#pragma omp critical(cluster_find_codes)
        {
            lo = _mm_min_ps(lo, own_lo);
            hi = _mm_max_ps(hi, own_hi);
        }
    }
    __m128 last = _mm_set1_ps((1 << GRID_BITS) - 1);
    __m128 scale = scale_of(lo, hi, _mm_set1_ps(1 << GRID_BITS));
    uint32_t spread[1 << GRID_BITS];
    for (uint32_t i = 0; i < 1 << GRID_BITS; i++) {
        spread[i] = spread_bits(i);
    }
#pragma omp parallel for schedule(static) num_threads(b->n_threads)
    for (uint32_t i = 0; i < n; i++) {
        int at[4];
        ProbeBox box = cluster_probe(b, i, middle);
        _mm_storeu_si128((__m128i *)(void *)at, bins_of(&box, 1, lo, scale, last));
        codes[i] = spread[at[0]] << 2 | spread[at[1]] << 1 | spread[at[2]];
    }
}

// Puts primitives in the order of the cells of a grid over the middle key and returns where groups
// of about GROUP of them begin, n_groups + 1 places. NULL: no memory.
static uint32_t *group(ClusterBuilder *b, uint32_t *n_groups) {
    uint32_t n = b->geometry->n_prims;
    uint32_t *codes = malloc(n * sizeof *codes);
    uint32_t *first = calloc(GRID_CELLS + 1, sizeof *first);
    uint32_t *groups = malloc((n / GROUP + (size_t)2) * sizeof *groups);
    bool is_there = codes && first && groups;
    if (is_there) {
        find_codes(b, codes);
        for (uint32_t i = 0; i < n; i++) {
            first[codes[i] + 1]++;
        }
        *n_groups = 0;
        groups[0] = 0;
        for (uint32_t cell = 0; cell < GRID_CELLS; cell++) {
            if (first[cell] - groups[*n_groups] >= GROUP) {
                groups[++*n_groups] = first[cell];
            }
            first[cell + 1] += first[cell];
        }
        groups[++*n_groups] = n;
        for (uint32_t i = 0; i < n; i++) {
            b->order[first[codes[i]]++] = i;
        }
    }
    free(codes);
    free(first);
    if (!is_there) {
        free(groups);
    }
    return is_there ? groups : NULL;
}

static void cut_group(const ClusterBuilder *b, uint32_t first, uint32_t n) {
    for (uint32_t i = first; i < first + n; i++) {
        for (uint32_t k = 0; k < b->n_probes; k++) {
            b->boxes[(size_t)i * b->n_probes + k] = cluster_probe(b, b->order[i], k);
        }
    }
    if (n) {
        cut(b, first, n);
    }
}

bool cluster_cut(ClusterBuilder *b) {
    uint32_t n = b->geometry->n_prims;
    if (n < GROUPED_FROM) {
        for (uint32_t i = 0; i < n; i++) {
            b->order[i] = i;
        }
        cut_group(b, 0, n);
        return true;
    }
    uint32_t n_groups, *groups = group(b, &n_groups);
    if (!groups) {
        return false;
    }
#pragma omp parallel for schedule(dynamic) num_threads(b->n_threads)
    for (uint32_t i = 0; i < n_groups; i++) {
        cut_group(b, groups[i], groups[i + 1] - groups[i]);
    }
    free(groups);
    return true;
}
