// SPDX-License-Identifier: Apache-2.0
// Bodies: what the upper level of a world holds. Mostly one object (an instance of a shape) under
// its transform; but all spheres of a loop that only stand somewhere are one body, and so are all
// single spheres of like size that do, and all that is baked. Planes are bodies without a form.
//
// There may be millions of them: a body is small, and what many of them do not need lies elsewhere.
#ifndef RENDER_BODY_H
#define RENDER_BODY_H

#include "render/form.h"
#include "render/memo.h"

// Where a body stands at an instant. Points are mapped back by subtracting the translation first:
// far from the origin the inverse's own translation would cost digits.
typedef struct {
    Affine map;
    Affine inverse;  // of the 3x3 part; the last column is 0
    bool is_present; // finite, invertible, visible
} Placement;

static inline Vec3 placement_point_back(const Placement *p, Vec3 world) {
    return affine_vector(&p->inverse, vec3(world.x - p->map.m[0][3], world.y - p->map.m[1][3],
                                           world.z - p->map.m[2][3]));
}

// Sets the inverse from the map; false: it has none.
bool placement_invert(Placement *placement);

// One object's share of a body that holds many.
typedef struct {
    const Shape *shape;
    uint32_t instance, object;
    uint32_t first_prim, first_vertex; // in the common form
    Smoothing smoothing;
} BodyPart;

typedef struct {
    const Shape *shape;
    uint32_t instance, object;
} SphereOf;

// What the primitives of a body of many objects belong to: one of these.
typedef struct {
    const uint32_t *instances; // [n]: spheres of one shape, the instance that each of them is
    const SphereOf *spheres;   // [n]: spheres of several shapes
    const BodyPart *parts;     // baked
    uint32_t n;
    uint32_t base; // of instances: the object that the first instance of the shape is
} BodyOfMany;

typedef struct {
    const Shape *shape;     // NULL: of several
    Form *form;             // NULL: a plane
    const Placement *fixed; // where it does not move; NULL: not worked out
    const BodyOfMany *many; // its points are in the world: no transform is applied at a ray's time
    uint32_t instance;
    uint32_t object; // the first; ids are the same in every block
    bool is_ball;    // the form is a sphere of radius 1 around the origin: geometry is in the map
    bool moves;      // transform or visible read the time
} Body;

static inline const double *body_loops(const Body *body) {
    return body->shape ? shape_loops(body->shape, body->instance) : NULL;
}

// The object that an instance of a shape is, `base` being that of its first one.
static inline uint32_t shape_object(const Shape *shape, uint32_t base, uint32_t instance) {
    return shape->objects ? shape->objects[instance] : base + instance;
}

// The part of a baked body that a primitive belongs to.
const BodyPart *body_part(const BodyOfMany *many, uint32_t prim);

// From the points of the form to the world at the film's seconds; of a body that is no set. False:
// not finite. memo: of this thread, as in the following; NULL: none.
bool body_map(const Body *body, ProgramMemo *memo, double seconds, Affine *map);

// From the body's programs.
Placement body_place(const Body *body, ProgramMemo *memo, double seconds);

// What its clock shows then.
double body_seconds(const Body *body, ProgramMemo *memo, double seconds);

// A sphere's center and radius in its own block.
void sphere_at(const Shape *shape, const double *loops, double seconds, double out[4]);

// Whether all instances of spheres stand still as similarities, so that they can be one body.
bool shape_stands(const Shape *shape);

// Bounds in the world over part of a cell, from the transform at probed instants; wide enough for
// the motion between them.
Bounds body_bounds(const Body *body, double fps, int64_t frame, double lo, double hi);

// The same of a box under a map (12 outputs, by IN_T alone; NULL: the identity) between two of its
// own seconds.
Bounds map_bounds(const Program *map, Bounds box, double first, double last);

#endif
