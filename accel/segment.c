// SPDX-License-Identifier: Apache-2.0
// Temporal segmentation.
#include "accel/segment.h"

#include "accel/kd4.h"

#include <float.h>
#include <math.h>
#include <string.h>

// Unlike fmin() and fmax() these are inlined; nothing here is NaN.
static double min_d(double a, double b) {
    return a < b ? a : b;
}

static double max_d(double a, double b) {
    return a > b ? a : b;
}

// What a primitive sweeps, and the largest coordinates of the keys that were involved.
typedef struct {
    double lo[3], hi[3], largest[3];
} Sweep;

// Kappas are counted by their logarithm; the median is read from the counts.
enum { KAPPA_BINS = 4096, KAPPA_BINS_PER_OCTAVE = 128 };

typedef struct {
    const Geometry *geometry;
    Budget *budget;
    SegmentList *list;
    double kappa;
    size_t max_segments;
    uint64_t kappas[KAPPA_BINS];
} Segmenter;

double segment_share(const Geometry *geometry, uint32_t span) {
    double share = 1;
    if (geometry->n_keys > 1 && geometry->span_share) {
        share = geometry->span_share[span];
    }
    return share > 0 ? share : 0;
}

static uint32_t corners(const Geometry *geometry) {
    return geometry->kind == GEOMETRY_TRIANGLES ? 3 : 1;
}

static size_t vertex_of(const Geometry *geometry, uint32_t prim, uint32_t corner) {
    return geometry->kind == GEOMETRY_TRIANGLES ? geometry->index[3 * (size_t)prim + corner] : prim;
}

static bool is_finite_at(const Geometry *geometry, uint32_t prim, uint32_t key) {
    size_t n = geometry->n_vertices;
    bool finite = true;
    for (uint32_t i = 0; i < corners(geometry); i++) {
        const float *p = geometry->position + 3 * (n * key + vertex_of(geometry, prim, i));
        finite = finite && isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
    }
    return finite && (!geometry->radius || isfinite(geometry->radius[n * key + prim]));
}

static uint32_t next_key(const Geometry *geometry, uint32_t span) {
    return geometry->n_keys > 1 ? span + 1 : span;
}

bool segment_is_present(const Geometry *geometry, uint32_t prim, uint32_t span) {
    return segment_share(geometry, span) > 0 && is_finite_at(geometry, prim, span) &&
           is_finite_at(geometry, prim, next_key(geometry, span));
}

// ---- Sweeps

static Sweep sweep_nothing(void) {
    Sweep s;
    for (int i = 0; i < 3; i++) {
        s.lo[i] = INFINITY;
        s.hi[i] = -INFINITY;
        s.largest[i] = 0;
    }
    return s;
}

// The instant `tick` ticks into a span, 0 and TICKS_PER_SPAN included.
static void sweep_instant(Sweep *s, const Geometry *geometry, uint32_t prim, uint32_t span,
                          uint32_t tick) {
    double f = tick / (double)TICKS_PER_SPAN;
    size_t n = geometry->n_vertices, first = n * span, second = n * next_key(geometry, span);
    for (uint32_t i = 0; i < corners(geometry); i++) {
        size_t v = vertex_of(geometry, prim, i);
        double r0 = geometry->radius ? max_d(geometry->radius[first + v], 0) : 0;
        double r1 = geometry->radius ? max_d(geometry->radius[second + v], 0) : 0;
        double r = r0 + f * (r1 - r0); // at least the radius, where one of them is negative
        for (int k = 0; k < 3; k++) {
            double a = geometry->position[3 * (first + v) + k];
            double b = geometry->position[3 * (second + v) + k];
            double p = a + f * (b - a);
            s->lo[k] = min_d(s->lo[k], p - r);
            s->hi[k] = max_d(s->hi[k], p + r);
            s->largest[k] = max_d(s->largest[k], max_d(fabs(a) + r0, fabs(b) + r1));
        }
    }
}

static double half_area(const Sweep *s) {
    double w = s->hi[0] - s->lo[0], h = s->hi[1] - s->lo[1], d = s->hi[2] - s->lo[2];
    return w * h + h * d + d * w;
}

static double diagonal(const Sweep *s) {
    double w = s->hi[0] - s->lo[0], h = s->hi[1] - s->lo[1], d = s->hi[2] - s->lo[2];
    return sqrt(w * w + h * h + d * d);
}

void segment_box(const Geometry *geometry, uint32_t prim, uint32_t tick0, uint32_t tick1,
                 float lo[3], float hi[3]) {
    Sweep s = sweep_nothing();
    uint32_t last = (tick1 - 1) / TICKS_PER_SPAN;
    sweep_instant(&s, geometry, prim, tick0 / TICKS_PER_SPAN, tick0 % TICKS_PER_SPAN);
    for (uint32_t span = tick0 / TICKS_PER_SPAN; span < last; span++) {
        sweep_instant(&s, geometry, prim, span, TICKS_PER_SPAN);
    }
    sweep_instant(&s, geometry, prim, last, tick1 - last * TICKS_PER_SPAN);
    kd4_pad_box(s.lo, s.hi, s.largest, lo, hi);
}

// ---- Equation 4

static void count_kappa(Segmenter *m, double kappa) {
    SegmentList *list = m->list;
    double bin = log2(fmax(kappa, 1)) * KAPPA_BINS_PER_OCTAVE;
    m->kappas[bin < KAPPA_BINS ? (size_t)bin : KAPPA_BINS - 1]++;
    list->kappa_min = list->n ? fmin(list->kappa_min, kappa) : kappa;
    list->kappa_max = list->n ? fmax(list->kappa_max, kappa) : kappa;
}

static bool grow(Segmenter *m) {
    SegmentList *list = m->list;
    if (list->n >= m->max_segments) {
        return false;
    }
    if (list->n < list->capacity) {
        return true;
    }
    size_t wanted[2] = {list->capacity * 2, list->capacity + 64};
    for (int i = list->capacity == 0; i < 2; i++) {
        BoxSegment *boxes = budget_resize(m->budget, list->boxes, list->capacity * sizeof *boxes,
                                          wanted[i] * sizeof *boxes);
        if (boxes) {
            list->boxes = boxes;
            list->capacity = wanted[i];
            return true;
        }
    }
    return false;
}

static bool add_segment(Segmenter *m, uint32_t prim, uint32_t tick0, uint32_t tick1,
                        const Sweep *sweep, double first_area) {
    if (!grow(m)) {
        return false;
    }
    count_kappa(m, half_area(sweep) / first_area);
    BoxSegment *box = &m->list->boxes[m->list->n++];
    *box = (BoxSegment){.tick0 = tick0, .tick1 = tick1, .id = prim};
    kd4_pad_box(sweep->lo, sweep->hi, sweep->largest, box->lo, box->hi);
    return true;
}

// Adds [from, tick] of one span to what was swept before `from`, if the area stays in bounds.
static bool extend(const Segmenter *m, uint32_t prim, uint32_t span, uint32_t tick, double most,
                   Sweep *sweep) {
    Sweep larger = *sweep;
    sweep_instant(&larger, m->geometry, prim, span, tick);
    bool fits = half_area(&larger) <= most;
    if (fits) {
        *sweep = larger;
    }
    return fits;
}

// The largest end in (tick, end]. What is swept only grows, so keys are taken as long as they fit,
// and then the ticks of the span that does not are bisected.
static uint32_t find_end(const Segmenter *m, uint32_t prim, uint32_t tick, uint32_t end,
                         double most, Sweep *sweep) {
    uint32_t at = tick, span = tick / TICKS_PER_SPAN;
    while (at < end && extend(m, prim, span, TICKS_PER_SPAN, most, sweep)) {
        at = ++span * TICKS_PER_SPAN;
    }
    uint32_t first = span * TICKS_PER_SPAN, fails = first + TICKS_PER_SPAN;
    while (at < end && fails - at > 1) {
        uint32_t middle = at + (fails - at) / 2;
        if (extend(m, prim, span, middle - first, most, sweep)) {
            at = middle;
        } else {
            fails = middle;
        }
    }
    if (at == tick) {
        at = tick + 1;
        sweep_instant(sweep, m->geometry, prim, span, at - first);
    }
    return at;
}

static double largest_diagonal(const Geometry *geometry, uint32_t prim, uint32_t span0,
                               uint32_t span1) {
    double largest = 0;
    for (uint32_t span = span0; span <= span1; span++) {
        Sweep s = sweep_nothing();
        bool last = span == span1; // its beginning is not asked for: it may not be present
        sweep_instant(&s, geometry, prim, last ? span - 1 : span, last ? TICKS_PER_SPAN : 0);
        largest = fmax(largest, diagonal(&s));
    }
    return largest;
}

// A stretch of spans [span0, span1) in which the primitive is present.
static bool segment_stretch(Segmenter *m, uint32_t prim, uint32_t span0, uint32_t span1) {
    double size = largest_diagonal(m->geometry, prim, span0, span1);
    uint32_t tick = span0 * TICKS_PER_SPAN, end = span1 * TICKS_PER_SPAN;
    while (size > 0 && tick < end) {
        Sweep sweep = sweep_nothing();
        sweep_instant(&sweep, m->geometry, prim, tick / TICKS_PER_SPAN, tick % TICKS_PER_SPAN);
        double first_area = half_area(&sweep) + 1e-6 * size * size;
        uint32_t next = find_end(m, prim, tick, end, m->kappa * first_area, &sweep);
        if (!add_segment(m, prim, tick, next, &sweep, first_area)) {
            return false;
        }
        tick = next;
    }
    return true;
}

static bool segment_prim(Segmenter *m, uint32_t prim) {
    uint32_t n_spans = geometry_spans(m->geometry);
    bool is_dropped = false;
    for (uint32_t span = 0; span < n_spans;) {
        uint32_t first = span;
        while (span < n_spans && segment_is_present(m->geometry, prim, span)) {
            span++;
        }
        if (first < span && !segment_stretch(m, prim, first, span)) {
            return false;
        }
        if (span < n_spans) {
            is_dropped = is_dropped || segment_share(m->geometry, span) > 0;
            span++;
        }
    }
    m->list->n_dropped += is_dropped;
    return true;
}

static double median_kappa(const Segmenter *m) {
    uint64_t below = 0;
    size_t bin = 0;
    while (bin + 1 < KAPPA_BINS && 2 * (below + m->kappas[bin]) < m->list->n) {
        below += m->kappas[bin++];
    }
    double kappa = exp2((bin + 0.5) / KAPPA_BINS_PER_OCTAVE);
    return fmin(fmax(kappa, m->list->kappa_min), m->list->kappa_max);
}

bool segment_all(const Geometry *geometry, double kappa, size_t max_segments, Budget *budget,
                 SegmentList *list) {
    Segmenter m = {geometry, budget, list, kappa, max_segments, {0}};
    *list = (SegmentList){0};
    for (uint32_t prim = 0; prim < geometry->n_prims; prim++) {
        if (!segment_prim(&m, prim)) {
            segment_free(list, budget);
            return false;
        }
    }
    list->kappa_median = list->n ? median_kappa(&m) : 0;
    return true;
}

void segment_free(SegmentList *list, Budget *budget) {
    budget_resize(budget, list->boxes, list->capacity * sizeof *list->boxes, 0);
    *list = (SegmentList){0};
}
