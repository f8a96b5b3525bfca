// SPDX-License-Identifier: Apache-2.0
// A form: vertex arrays at the sampled instants of a block of frames, the structure over them, and
// the way from an instant to a place between two keys. Instances share a form where nothing of
// their own moves its points.
//
// Where instances have clocks of their own, all that is said of time here is by those: keys lie in
// the cells that any of them reaches, each cell whole, so that what it holds depends on it alone.
//
// In this order: form_plan for each shutter of the block; form_store; form_store_key for each key,
// from any threads; form_build.
#ifndef RENDER_FORM_H
#define RENDER_FORM_H

#include <stdatomic.h>

#include "render/render.h"
#include "render/sample.h"
#include "render/smooth.h"

typedef struct {
    Vec3 lo, hi; // lo > hi: empty
} Bounds;

static inline Bounds bounds_empty(void) {
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline bool bounds_are_empty(Bounds b) {
    return !(b.lo.x <= b.hi.x && b.lo.y <= b.hi.y && b.lo.z <= b.hi.z);
}

// Points that are not finite do not count.
Bounds bounds_add(Bounds b, Vec3 p);
Bounds bounds_join(Bounds a, Bounds b);
static inline Vec3 bounds_corner(Bounds b, int i) {
    return vec3(i & 1 ? b.hi.x : b.lo.x, i & 2 ? b.hi.y : b.lo.y, i & 4 ? b.hi.z : b.lo.z);
}

// Bounds of a mover's points (with their radii) at one instant.
Bounds mover_bounds(const Mover *mover, double seconds);

typedef struct InstanceSet InstanceSet; // render/instance_set.h

// Instances of a shape, or the members of a set.
typedef struct {
    const Shape *shape;
    uint32_t n;
    const uint32_t *which;  // [n]; NULL: the first n
    const InstanceSet *set; // NULL: none
} FormUser;

static inline uint32_t user_instance(const FormUser *user, uint32_t i) {
    return user->which ? user->which[i] : i;
}

typedef struct {
    // What it is; set by its maker.
    const Shape *shape; // the first that stands in it; NULL: baked, of many
    GeometryKind kind;
    uint32_t number; // among those of the world
    uint32_t n_prims;
    const uint32_t *index; // [n_prims][3]; spheres: NULL
    Smoothing smoothing;
    Sampler sampler;
    bool moves;
    // Whose clocks say when it is sampled, cell by cell of their own time; NULL: the film's does.
    FormUser *users;
    size_t n_users, users_capacity;
    bool is_too_fast; // they reach more than LOCAL_MAX_CELLS of them

    // When it is sampled.
    Span *spans; // of all shutters so far; ascending and unique after form_store
    size_t n_spans, spans_capacity;
    Opening *seen; // openings that were sampled already
    size_t n_seen, seen_capacity;
    uint32_t *span_key;  // [n_spans]: the key with which each span begins
    double *key_seconds; // [n_keys]
    SampleReport report;

    // What is stored.
    Geometry geometry;
    uint32_t *normal;       // [n_keys][smoothing.n_normals]; NULL: none, or smoothing.given
    Bounds *bounds;         // [n_keys], in the space of the points
    uint32_t *n_not_finite; // [n_keys], points
    Bounds reach;           // over all keys
    atomic_bool is_built;   // what follows is final
    Accel *accel;           // NULL: no memory
    AccelStats stats;
    Arena arena;
    Arena *home; // of the arrays where nothing moves: of such forms there may be many; NULL: arena
} Form;

void form_plan(Form *form, const ShutterSpan *shutter);

// Of the arrays and, roughly, of the tree over them, as planned so far.
size_t form_bytes(const Form *form);

// Of the arrays as stored.
size_t form_array_bytes(const Form *form);

// Allocates and lays out. False: more than ACCEL_MAX_KEYS.
bool form_store(Form *form, double first_seconds);
void form_store_key(Form *form, uint32_t key);

// False: no memory, or (with validate) a broken structure, with a sentence in why[n].
bool form_build(Form *form, const AccelType *type, const AccelOptions *options, bool validate,
                char *why, size_t n);
void form_destroy(Form *form);

// The place of an instant among the keys; between two stored spans, the nearer end.
void form_time(const Form *form, Instant at, uint32_t *key, float *f);

// Bounds between two instants, in the space of the points.
Bounds form_bounds(const Form *form, Instant from, Instant to);

// Adds the spans of an opening that was not sampled yet (for form_plan).
void form_sample(Form *form, Opening open);
// form_plan for forms with users (render/form_local.c).
enum { LOCAL_MAX_CELLS = 1 << 20 };
void form_plan_local(Form *form, const ShutterSpan *shutter);

// Length in seconds of the span that begins with a key; 0: no span does.
double form_span_seconds(const Form *form, uint32_t key);

#endif
