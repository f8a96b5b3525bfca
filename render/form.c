// SPDX-License-Identifier: Apache-2.0
// Forms: keys from spans, vertex arrays from keys, structures over them.
#include "render/form.h"

#include <stdlib.h>
#include <string.h>

enum {
    SEEN_SEARCHED = 256,  // openings of earlier frames in which a cell is looked for
    TREE_BYTES = 48,      // per primitive and span: a guess at segments, references and nodes
    TREE_BYTES_STILL = 96 // per primitive, of any tree
};

// Of numbers: fmin and fmax are calls, for the sake of NaN.
static double smaller(double a, double b) {
    return a < b ? a : b;
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

Bounds bounds_add(Bounds b, Vec3 p) {
    if (!vec3_is_finite(p)) {
        return b;
    }
    return (Bounds){{smaller(b.lo.x, p.x), smaller(b.lo.y, p.y), smaller(b.lo.z, p.z)},
                    {larger(b.hi.x, p.x), larger(b.hi.y, p.y), larger(b.hi.z, p.z)}};
}

Bounds bounds_join(Bounds a, Bounds b) {
    return (Bounds){{smaller(a.lo.x, b.lo.x), smaller(a.lo.y, b.lo.y), smaller(a.lo.z, b.lo.z)},
                    {larger(a.hi.x, b.hi.x), larger(a.hi.y, b.hi.y), larger(a.hi.z, b.hi.z)}};
}

// So many points at once: they stay in the cache between the program and what becomes of them.
enum { POINTS = 2048 };

typedef struct {
    double at[4][POINTS];
} Points;

// From `first` on; returns how many.
static size_t points_run(Points *points, const Mover *mover, size_t first, double seconds) {
    Arena scratch = {0};
    size_t n = mover->n - first < POINTS ? mover->n - first : POINTS;
    double *const out[4] = {points->at[0], points->at[1], points->at[2], points->at[3]};
    mover_run_some(mover, first, n, seconds, &scratch, out);
    arena_free(&scratch);
    return n;
}

Bounds mover_bounds(const Mover *mover, double seconds) {
    Points points;
    Bounds b = bounds_empty();
    for (size_t first = 0; first < mover->n; first += POINTS) {
        size_t n = points_run(&points, mover, first, seconds);
        for (size_t i = 0; i < n; i++) {
            double r = mover->width == 4 ? points.at[3][i] : 0;
            Vec3 p = vec3(points.at[0][i], points.at[1][i], points.at[2][i]);
            if (r >= 0) {
                b = bounds_add(b, vec3(p.x - r, p.y - r, p.z - r));
                b = bounds_add(b, vec3(p.x + r, p.y + r, p.z + r));
            }
        }
    }
    return b;
}

static bool was_seen(const Form *form, const Opening *o) {
    size_t n = form->n_seen, first = n > SEEN_SEARCHED ? n - SEEN_SEARCHED : 0;
    for (size_t i = n; i-- > first;) {
        const Opening *s = &form->seen[i];
        if (s->frame == o->frame && s->lo == o->lo && s->hi == o->hi) {
            return true;
        }
    }
    return false;
}

void form_sample(Form *form, Opening open) {
    sample_cell(&form->sampler, open, &form->arena, &form->spans, &form->n_spans,
                &form->spans_capacity, &form->report);
    form->seen =
        arena_grow(&form->arena, form->seen, form->n_seen, &form->seen_capacity, sizeof open);
    form->seen[form->n_seen++] = open;
}

void form_plan(Form *form, const ShutterSpan *shutter) {
    if (form->users) {
        form_plan_local(form, shutter);
        return;
    }
    for (uint64_t i = 0; form->moves && i < shutter->n_cells; i++) {
        Opening open = shutter_opening(shutter, i);
        if (was_seen(form, &open)) {
            continue;
        }
        form_sample(form, open);
    }
}

size_t form_bytes(const Form *form) {
    // At most two keys a span, and one at the end of each run: mostly one.
    size_t n_keys = form->n_spans + 1 + form->n_seen;
    size_t per_key = form->sampler.all.n * 3 * sizeof(float) + sizeof(Bounds);
    per_key += form->kind == GEOMETRY_SPHERES ? form->sampler.all.n * sizeof(float) : 0;
    per_key += form->smoothing.given ? 0 : form->smoothing.n_normals * sizeof(uint32_t);
    return n_keys * per_key +
           (size_t)form->n_prims * (TREE_BYTES_STILL + form->n_spans * TREE_BYTES);
}

size_t form_array_bytes(const Form *form) {
    const Geometry *g = &form->geometry;
    size_t per_key = (size_t)g->n_vertices * (g->radius ? 4 : 3) * sizeof(float);
    per_key += form->normal ? form->smoothing.n_normals * sizeof(uint32_t) : 0;
    return per_key * g->n_keys;
}

static int compare_spans(const void *a, const void *b) {
    const Span *s = a, *t = b;
    if (s->frame != t->frame) {
        return s->frame < t->frame ? -1 : 1;
    }
    return (s->lo > t->lo) - (s->lo < t->lo);
}

// The same piece seen by two shutters is the same span: pieces depend on their cells alone.
static void sort_spans(Form *form) {
    size_t kept = 0;
    if (form->n_spans > 0) {
        qsort(form->spans, form->n_spans, sizeof *form->spans, compare_spans);
    }
    for (size_t i = 0; i < form->n_spans; i++) {
        if (kept == 0 || compare_spans(&form->spans[i], &form->spans[kept - 1]) != 0) {
            form->spans[kept++] = form->spans[i];
        }
    }
    form->n_spans = kept;
}

// A key for each span's beginning, unless the span before ended there, and one for its end.
static size_t lay_out_keys(Form *form, double *share) {
    size_t n = 0;
    double fps = form->sampler.scene->film.fps;
    for (size_t i = 0; i < form->n_spans; i++) {
        const Span *s = &form->spans[i];
        if (i == 0 || !span_continues(s - 1, s)) {
            if (n > 0) {
                share[n - 1] = 0;
            }
            form->key_seconds[n++] = instant_seconds((Instant){s->frame, s->lo}, fps);
        }
        form->span_key[i] = (uint32_t)(n - 1);
        share[n - 1] = s->hi - s->lo;
        form->key_seconds[n++] = instant_seconds((Instant){s->frame, s->hi_at}, fps);
    }
    return n;
}

bool form_store(Form *form, double first_seconds) {
    sort_spans(form);
    Arena *arena = form->home && !form->moves ? form->home : &form->arena;
    size_t most = form->n_spans > 0 ? 2 * form->n_spans : 1, n = form->sampler.all.n;
    form->key_seconds = ARENA_ARRAY(arena, most, double);
    form->span_key = ARENA_ARRAY(arena, form->n_spans, uint32_t);
    double *share = ARENA_ARRAY(arena, most, double);
    size_t n_keys = form->n_spans > 0 ? lay_out_keys(form, share) : 1;
    if (form->n_spans == 0) {
        form->key_seconds[0] = first_seconds;
    }
    if (n_keys > ACCEL_MAX_KEYS) {
        return false;
    }
    form->geometry = (Geometry){.kind = form->kind,
                                .n_prims = form->n_prims,
                                .n_vertices = (uint32_t)n,
                                .n_keys = (uint32_t)n_keys,
                                .index = form->index,
                                .position = ARENA_ARRAY(arena, n_keys * n * 3, float),
                                .span_share = n_keys > 1 ? share : NULL};
    if (form->kind == GEOMETRY_SPHERES) {
        form->geometry.radius = ARENA_ARRAY(arena, n_keys * n, float);
    }
    if (form->smoothing.index && !form->smoothing.given) {
        form->normal = ARENA_ARRAY(arena, n_keys * form->smoothing.n_normals, uint32_t);
    }
    form->bounds = ARENA_ARRAY(arena, n_keys, Bounds);
    form->n_not_finite = ARENA_ARRAY(arena, n_keys, uint32_t);
    return true;
}

// What the kernels see of a point, back in the space of the points: the bounds hold exactly that.
static Vec3 stored_point(const Frame *frame, const float p[3]) {
    return vec3(frame->center[0] + p[0] / frame->scale, frame->center[1] + p[1] / frame->scale,
                frame->center[2] + p[2] / frame->scale);
}

// What was stored of some points.
typedef struct {
    Bounds bounds; // in the space of the points
    uint32_t n_bad;
} Stored;

static void store_vertices(const Frame *frame, const Points *points, size_t n, float *position,
                           Stored *stored) {
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < n; i++) {
        float *p = &position[3 * i];
        for (int k = 0; k < 3; k++) {
            p[k] = (float)((points->at[k][i] - frame->center[k]) * frame->scale);
        }
        if (p[0] * 0 + p[1] * 0 + p[2] * 0 != 0) { // NaN where one of them is not finite
            stored->n_bad++;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            lo[k] = p[k] < lo[k] ? p[k] : lo[k];
            hi[k] = p[k] > hi[k] ? p[k] : hi[k];
        }
    }
    if (lo[0] <= hi[0]) { // the way back keeps the order
        stored->bounds = bounds_add(stored->bounds, stored_point(frame, lo));
        stored->bounds = bounds_add(stored->bounds, stored_point(frame, hi));
    }
}

static void store_spheres(const Frame *frame, const Points *points, size_t n, float *position,
                          float *radius, Stored *stored) {
    for (size_t i = 0; i < n; i++) {
        float *p = &position[3 * i], r = (float)(points->at[3][i] * frame->scale);
        for (int k = 0; k < 3; k++) {
            p[k] = (float)((points->at[k][i] - frame->center[k]) * frame->scale);
        }
        radius[i] = r;
        stored->n_bad += !(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(r));
        if (r >= 0 && isfinite(r)) {
            Vec3 at = stored_point(frame, p);
            double reach = (double)r / frame->scale;
            Vec3 by = vec3(reach, reach, reach);
            stored->bounds = bounds_add(stored->bounds, vec3_sub(at, by));
            stored->bounds = bounds_add(stored->bounds, vec3_add(at, by));
        }
    }
}

void form_store_key(Form *form, uint32_t key) {
    const Sampler *sampler = &form->sampler;
    size_t total = sampler->all.n, base = (size_t)key * total;
    // The arrays are this form's own; the geometry shows them as const to those who trace.
    float *position = (float *)form->geometry.position + base * 3;
    float *radius = (float *)form->geometry.radius;
    Stored stored = {bounds_empty(), 0};
    Points points;
    for (size_t first = 0; first < total; first += POINTS) {
        size_t n = points_run(&points, &sampler->all, first, form->key_seconds[key]);
        if (radius) {
            store_spheres(&sampler->frame, &points, n, position + 3 * first, radius + base + first,
                          &stored);
        } else {
            store_vertices(&sampler->frame, &points, n, position + 3 * first, &stored);
        }
    }
    form->bounds[key] = stored.bounds;
    form->n_not_finite[key] = stored.n_bad;
    if (form->normal) {
        Mesh faces = {.n_triangles = form->n_prims, .index = (uint32_t *)form->index};
        smoothing_run(&form->smoothing, &faces, position,
                      form->normal + (size_t)key * form->smoothing.n_normals);
    }
}

bool form_build(Form *form, const AccelType *type, const AccelOptions *options, bool validate,
                char *why, size_t n) {
    form->accel = type->build(&form->geometry, options, &form->stats);
    atomic_store_explicit(&form->is_built, true, memory_order_release);
    if (!form->accel) {
        snprintf(why, n, "no memory for a structure over %u primitives", form->n_prims);
        return false;
    }
    return !validate || form->accel->type->validate(form->accel, why, n);
}

void form_destroy(Form *form) {
    if (form->accel) {
        form->accel->type->destroy(form->accel);
    }
    arena_free(&form->arena);
}

// The last span that begins at or before a place; n_spans: none.
static size_t find_span(const Form *form, int64_t frame, double frac) {
    size_t lo = 0, hi = form->n_spans;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        const Span *s = &form->spans[mid];
        if (s->frame < frame || (s->frame == frame && s->lo <= frac)) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    return lo > 0 ? lo - 1 : form->n_spans;
}

static double distance_to(const Span *s, double place, Instant at) {
    return fabs((double)(at.frame - s->frame) + (at.frac - place));
}

void form_time(const Form *form, Instant at, uint32_t *key, float *f) {
    *key = 0;
    *f = 0;
    if (form->n_spans == 0) {
        return;
    }
    size_t i = find_span(form, at.frame, at.frac);
    if (i == form->n_spans) {
        return;
    }
    const Span *s = &form->spans[i];
    *key = form->span_key[i];
    if (s->frame == at.frame && at.frac < s->hi) {
        *f = (float)((at.frac - s->lo) / (s->hi - s->lo));
    } else if (i + 1 < form->n_spans &&
               distance_to(s + 1, s[1].lo, at) < distance_to(s, s->hi, at)) {
        *key = form->span_key[i + 1];
    } else {
        *f = 1;
    }
}

static bool is_within(const Span *span, Instant at) {
    return span->frame == at.frame && span->lo <= at.frac && at.frac < span->hi;
}

Bounds form_bounds(const Form *form, Instant from, Instant to) {
    if (form->n_spans == 0) {
        return form->bounds[0];
    }
    size_t first = find_span(form, from.frame, from.frac),
           last = find_span(form, to.frame, to.frac);
    first = first == form->n_spans ? 0 : first;
    last = last == form->n_spans ? 0 : last;
    // One more on either side: an instant between two spans is taken for the nearer end.
    uint32_t k0 = form->span_key[first > 0 ? first - 1 : 0];
    uint32_t k1 = form->span_key[last + 1 < form->n_spans ? last + 1 : last] + 1;
    k0 = is_within(&form->spans[first], from) ? form->span_key[first] : k0;
    k1 = is_within(&form->spans[last], to) ? form->span_key[last] + 1 : k1;
    Bounds b = bounds_empty();
    for (uint32_t k = k0; k <= k1; k++) {
        b = bounds_join(b, form->bounds[k]);
    }
    return b;
}

double form_span_seconds(const Form *form, uint32_t key) {
    size_t lo = 0, hi = form->n_spans;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        if (form->span_key[mid] < key) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    if (lo == form->n_spans || form->span_key[lo] != key) {
        return 0;
    }
    return (form->spans[lo].hi - form->spans[lo].lo) / form->sampler.scene->film.fps;
}
