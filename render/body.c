// SPDX-License-Identifier: Apache-2.0
// Bodies: placement at an instant, bounds over a span of time.
#include "render/body.h"

#include "render/local_time.h"

enum {
    PROBES = 8,    // instants within a span whose bounds are asked for
    DEPTH = 12,    // halvings of such a span
    PIECES = 1024, // of one; what breaks that often is not followed any further
};

// Corners may be so far from a straight line, relative to the box, before a span is halved.
static const double STRAIGHT = 0.05;

// Lerped floats may lie beyond their ends by a rounding; relative to the box and to its place.
static const double ROUNDING = 0x1p-20, ROUNDING_PLACE = 0x1p-48;

const BodyPart *body_part(const BodyOfMany *many, uint32_t prim) {
    uint32_t lo = 0, hi = many->n;
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        *(many->parts[mid].first_prim <= prim ? &lo : &hi) = mid;
    }
    return &many->parts[lo];
}

void sphere_at(const Shape *shape, const double *loops, double seconds, double out[4]) {
    double in[IN_COUNT];
    shape_inputs(shape, loops, seconds, in);
    program_run1(shape->geometry, in, out);
}

// To where the sphere of radius 1 around the origin becomes the shape's.
static void affine_ball(Affine *map, const double sphere[4]) {
    Vec3 center = affine_point(map, vec3(sphere[0], sphere[1], sphere[2]));
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            map->m[i][k] *= sphere[3];
        }
    }
    map->m[0][3] = center.x;
    map->m[1][3] = center.y;
    map->m[2][3] = center.z;
}

static void run(ProgramMemo *memo, const Program *program, const double in[IN_COUNT], double *out) {
    if (memo) {
        memo_run(memo, program, in, out);
    } else {
        program_run1(program, in, out);
    }
}

bool body_map(const Body *body, ProgramMemo *memo, double seconds, Affine *map) {
    double in[IN_COUNT], rows[12], sphere[4];
    *map = affine_identity();
    shape_inputs(body->shape, body_loops(body), seconds, in);
    if (body->shape->transform) {
        run(memo, body->shape->transform, in, rows);
        if (!affine_from_rows(rows, map)) {
            return false;
        }
    }
    if (body->is_ball) {
        run(memo, body->shape->geometry, in, sphere);
        affine_ball(map, sphere);
        return isfinite(sphere[0] + sphere[1] + sphere[2] + sphere[3]);
    }
    return true;
}

bool placement_invert(Placement *p) {
    Affine linear = p->map;
    linear.m[0][3] = linear.m[1][3] = linear.m[2][3] = 0;
    return affine_invert(&linear, &p->inverse);
}

static bool is_visible(const Body *body, ProgramMemo *memo, double seconds) {
    double in[IN_COUNT], seen = 1;
    if (body->shape->visible) {
        shape_inputs(body->shape, body_loops(body), seconds, in);
        run(memo, body->shape->visible, in, &seen);
    }
    return program_is_true(seen);
}

Placement body_place(const Body *body, ProgramMemo *memo, double seconds) {
    Placement p = {.map = affine_identity(), .inverse = affine_identity(), .is_present = true};
    if (body->many) {
        return p;
    }
    p.is_present = is_visible(body, memo, seconds) && body_map(body, memo, seconds, &p.map);
    if (p.is_present && (body->is_ball || body->shape->transform)) {
        p.is_present = placement_invert(&p);
    }
    return p;
}

double body_seconds(const Body *body, ProgramMemo *memo, double seconds) {
    double in[IN_COUNT], shown = seconds;
    if (body->shape->clock) {
        shape_inputs(body->shape, body_loops(body), seconds, in);
        run(memo, body->shape->clock, in, &shown);
    }
    return shown;
}

static bool is_similarity(const Affine *a) {
    Vec3 c[3];
    for (int k = 0; k < 3; k++) {
        c[k] = vec3(a->m[0][k], a->m[1][k], a->m[2][k]);
    }
    double size = vec3_dot(c[0], c[0]), bound = 1e-9 * size;
    return size > 0 && isfinite(size) && fabs(vec3_dot(c[1], c[1]) - size) <= bound &&
           fabs(vec3_dot(c[2], c[2]) - size) <= bound && fabs(vec3_dot(c[0], c[1])) <= bound &&
           fabs(vec3_dot(c[1], c[2])) <= bound && fabs(vec3_dot(c[2], c[0])) <= bound;
}

bool shape_stands(const Shape *shape) {
    if (shape->kind != SHAPE_SPHERE || program_reads_time(shape->transform) ||
        program_reads_time(shape->visible) || program_reads_loops(shape->breaks)) {
        return false;
    }
    uint32_t n = program_reads_loops(shape->transform) ? shape->n_instances : 1;
    for (uint32_t i = 0; i < n; i++) {
        double in[IN_COUNT];
        Affine map;
        shape_inputs(shape, shape_loops(shape, i), 0, in);
        if (!affine_run(shape->transform, in, &map) || !is_similarity(&map)) {
            return false;
        }
    }
    return true;
}

typedef struct {
    Vec3 p[8];
    bool is_finite;
} Corners;

typedef bool MapAt(const void *context, double seconds, Affine *map);

typedef struct {
    MapAt *map_at;
    const void *context;
    Bounds box; // in the space of the points
    double fps;
    int64_t frame;
    Bounds sum;
    uint32_t n_pieces;
} Sweep;

static Corners corners_at(const Sweep *s, double frac) {
    Affine map;
    Corners c;
    c.is_finite = s->map_at(s->context, instant_seconds((Instant){s->frame, frac}, s->fps), &map);
    for (int k = 0; k < 8; k++) {
        c.p[k] = affine_point(&map, bounds_corner(s->box, k));
    }
    return c;
}

static Bounds corners_bounds(const Corners *c) {
    Bounds b = bounds_empty();
    for (int k = 0; k < 8 && c->is_finite; k++) {
        b = bounds_add(b, c->p[k]);
    }
    return b;
}

static double deviation(const Corners *a, const Corners *b, const Corners *x, double s) {
    double most = 0;
    for (int k = 0; k < 8; k++) {
        Vec3 straight = vec3_add(vec3_scale(a->p[k], 1 - s), vec3_scale(b->p[k], s));
        most = fmax(most, vec3_length(vec3_sub(x->p[k], straight)));
    }
    return most;
}

static Bounds pad(Bounds b, double by) {
    Vec3 d = vec3(by, by, by);
    return (Bounds){vec3_sub(b.lo, d), vec3_add(b.hi, d)};
}

// Between two instants a corner's path is taken for an arc: how far it bulges from the chord is
// measured in the middle and at PROBES uneven places, and where it is little the boxes at all of
// these are joined and padded by twice the most that was measured. A path that bulges more between
// neighbouring probes than twice what it does at any of them would have to turn several times
// between them, while none of ten instants shows it. Where a transform jumps, halving ends at
// 1/4096 of the span, and the padding is twice the jump.
static void sweep(Sweep *s, double lo, double hi, const Corners *a, const Corners *b, int depth) {
    static const double uneven[PROBES] = {0.0711, 0.1873, 0.3127, 0.4119,
                                          0.5000, 0.6271, 0.7433, 0.9083};
    Bounds seen = bounds_join(corners_bounds(a), corners_bounds(b));
    double off = 0;
    bool is_whole = a->is_finite && b->is_finite;
    Corners middle = *a;
    for (int k = 0; k < PROBES; k++) {
        Corners x = corners_at(s, lo + uneven[k] * (hi - lo));
        is_whole &= x.is_finite;
        seen = bounds_join(seen, corners_bounds(&x));
        off = is_whole ? fmax(off, deviation(a, b, &x, uneven[k])) : off;
        middle = uneven[k] == 0.5 ? x : middle;
    }
    double size = vec3_length(vec3_sub(bounds_corner(s->box, 7), bounds_corner(s->box, 0)));
    double shown = is_whole ? vec3_length(vec3_sub(a->p[7], a->p[0])) : size;
    if (depth == DEPTH || ++s->n_pieces > PIECES || (is_whole && off <= STRAIGHT * shown)) {
        s->sum = bounds_join(s->sum, bounds_are_empty(seen) ? seen : pad(seen, 2 * off));
        return;
    }
    double mid = lo + 0.5 * (hi - lo);
    sweep(s, lo, mid, a, &middle, depth + 1);
    sweep(s, mid, hi, &middle, b, depth + 1);
}

static Bounds pad_rounding(Bounds b) {
    if (bounds_are_empty(b)) {
        return b;
    }
    Vec3 extent = vec3_sub(b.hi, b.lo);
    double size = fmax(extent.x, fmax(extent.y, extent.z)), place = 0;
    for (int k = 0; k < 8; k += 7) {
        Vec3 c = bounds_corner(b, k);
        place = fmax(place, fmax(fabs(c.x), fmax(fabs(c.y), fabs(c.z))));
    }
    return pad(b, ROUNDING * size + ROUNDING_PLACE * place);
}

typedef struct {
    const Form *form;
    double fps;
    Bounds sum;
} LocalBounds;

static void add_local(void *context, double lo, double hi) {
    LocalBounds *local = context;
    Instant from = instant_of_seconds(lo, local->fps), to = instant_of_seconds(hi, local->fps);
    local->sum = bounds_join(local->sum, form_bounds(local->form, from, to));
}

// Of the points, in their own space, over part of a cell of the film.
static Bounds points_bounds(const Body *body, double fps, int64_t frame, double lo, double hi) {
    if (!body->form->users) {
        return form_bounds(body->form, (Instant){frame, lo}, (Instant){frame, hi});
    }
    LocalBounds local = {body->form, fps, bounds_empty()};
    local_times(body->shape, body_loops(body), fps, frame, lo, hi, add_local, &local);
    return local.sum;
}

static Bounds sweep_between(Sweep *s, double lo, double hi, bool moves) {
    if (bounds_are_empty(s->box)) {
        return s->box;
    }
    Corners a = corners_at(s, lo);
    if (!moves) {
        return pad_rounding(corners_bounds(&a));
    }
    Corners b = corners_at(s, hi);
    sweep(s, lo, hi, &a, &b, 0);
    return pad_rounding(s->sum);
}

typedef struct {
    const Body *body;
    ProgramMemo *memo;
} MemoBody;

static bool map_of_body(const void *context, double seconds, Affine *map) {
    const MemoBody *m = context;
    return body_map(m->body, m->memo, seconds, map);
}

Bounds body_bounds(const Body *body, double fps, int64_t frame, double lo, double hi) {
    Bounds points = points_bounds(body, fps, frame, lo, hi);
    if (body->many) {
        return pad_rounding(points);
    }
    Arena scratch = {0};
    bool moves = program_reads_time(body->shape->transform);
    MemoBody m = {body, moves ? memo_new(&scratch, 2) : NULL};
    Sweep s = {map_of_body, &m, points, fps, frame, bounds_empty(), 0};
    Bounds b = sweep_between(&s, lo, hi, moves);
    arena_free(&scratch);
    return b;
}

static bool map_of_program(const void *context, double seconds, Affine *map) {
    return affine_run_at(context, seconds, map);
}

Bounds map_bounds(const Program *map, Bounds box, double first, double last) {
    Sweep s = {map_of_program, map, box, 1, 0, bounds_empty(), 0};
    return map ? sweep_between(&s, first, last, program_reads_time(map)) : box;
}
