// SPDX-License-Identifier: Apache-2.0
// Triangles as solids for simulations of rigid bodies: whether they close a volume, what that
// weighs, and their convex hull.
//
// The hull grows by the point that is farthest outside of it (Barber, Dobkin and Huhdanpaa, "The
// Quickhull Algorithm for Convex Hulls", ACM TOMS 22(4), 1996). Mass, centre and moments are sums
// over tetrahedra from the origin (Tonon, "Explicit Exact Formulas for the 3-D Tetrahedron Inertia
// Tensor", Journal of Mathematics and Statistics 1(1), 2005).
#ifndef RENDER_SIM_SOLID_H
#define RENDER_SIM_SOLID_H

#include "render/mesh.h"

typedef struct {
    uint32_t n_points, n_faces;
    double *point;  // [n_points][3], metres
    uint32_t *face; // [n_faces][3], counter-clockwise seen from outside
} SimSolid;

// Vertices at the very same place become one; faces that are left with fewer than three go, and
// vertices of no face with them. False: a vertex is not finite.
bool sim_solid_weld(Arena *arena, const Mesh *mesh, SimSolid *solid);

// How many edges have not one face on each side, turned the same way: 0 where nothing is open.
uint32_t sim_solid_n_open(const SimSolid *solid);

// Cubic metres that are enclosed; below 0 where the faces are inside out.
double sim_solid_volume(const SimSolid *solid);

void sim_solid_turn_over(SimSolid *solid);

// The hull of the points. False: they lie in a plane.
bool sim_solid_hull(Arena *arena, const SimSolid *solid, SimSolid *hull);

// By a density of 1 kg/m3: mass, centre, and moments about the centre: xx yy zz xy xz yz of the
// tensor of inertia. The solid is closed.
typedef struct {
    double mass, center[3], moment[6];
} SimSolidMass;
SimSolidMass sim_solid_mass(const SimSolid *solid);

#endif
