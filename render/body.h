// SPDX-License-Identifier: Apache-2.0
// Bodies: what the upper level of a world holds. Mostly one object (an instance of a shape) under
// its transform; but all spheres of a loop that only stand somewhere are one body, and so is all
// that is baked. Planes are bodies without a form.
#ifndef RENDER_BODY_H
#define RENDER_BODY_H

#include "render/form.h"

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

// One object's share of a body that holds many.
typedef struct {
    const Shape *shape;
    uint32_t instance, object;
    uint32_t first_prim, first_vertex; // in the common form
    Smoothing smoothing;
} BodyPart;

typedef struct {
    const Shape *shape; // NULL: baked
    const double *loops;
    uint32_t instance;
    uint32_t object;           // the first; ids are the same in every block
    Form *form;                // NULL: a plane
    bool is_in_world;          // its points are: no transform is applied at the ray's time
    bool moves;                // transform or visible read the time
    Placement fixed;           // where it does not move
    const uint32_t *instances; // spheres in one body: which instance each primitive is; NULL: 1:1
    const BodyPart *parts;     // baked
    uint32_t n_parts;
} Body;

// From the body's programs at the film's seconds.
Placement body_place(const Body *body, double seconds);

// Whether all instances stand still as similarities, so that they can be one body.
bool shape_is_sphere_set(const Shape *shape);

// Bounds in the world over part of a cell, from the transform at probed instants; wide enough for
// the motion between them.
Bounds body_bounds(const Body *body, double fps, int64_t frame, double lo, double hi);

#endif
