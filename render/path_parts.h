// SPDX-License-Identifier: Apache-2.0
// The inside of path tracing, for the files that follow paths (render/path.c) and find what their
// rays meet (render/path_surface.c).
#ifndef RENDER_PATH_PARTS_H
#define RENDER_PATH_PARTS_H

#include "render/path.h"

// What is known of a path at its present end.
typedef struct {
    const Sampler *sampler;
    uint32_t index;
    uint32_t depth;     // bounces so far
    Vec3 origin, dir;   // of the ray that is followed; unit
    double weight[3];   // of what it brings
    double specular[3]; // of what it brings from lights with an area
    double density;     // with which its direction was drawn; 0: a mirror
    double color[3];    // collected
    bool has_scattered; // by what is no mirror
    double clear;       // share of what is behind catchers
    bool is_within;     // glass that absorbs
    double absorbs[3];  // of it, per metre
    // Of the bundle of rays that a pixel is: metres across at the origin, and how many more for
    // each metre on; only where a material looks around.
    double width, spread;
    uint32_t n_chances; // random numbers drawn for what surfaces are
} Path;

// A place on a surface, seen from the viewer's side.
typedef struct {
    SurfacePoint point, beside[2];
    SurfaceSlope slope; // where the material looks around
    bool has_beside;
    Vec3 x, y, N, Ng;  // the shading frame; both normals on the viewer's side
    Vec3 wo;           // towards the viewer, in the frame
    Vec3 start;        // where rays leave
    Vec3 through;      // where rays leave that go through the surface
    bool is_inside;    // the viewer is behind the surface
    uint32_t material; // of it, no mix
    double values[BSDF_MAX_OUT];
    Bsdf bsdf;
} Vertex;

// Normals towards the viewer, and a start for rays beyond the error of the point.
void path_orient(Vertex *vertex, Vec3 dir);

// As whom to ask the world: only where it makes a difference.
RayKind path_ask_as(const PathTracer *tracer, RayKind kind);

// Whether rays may go through surfaces.
bool path_goes_through(const PathTracer *tracer);

// The share of the light from there, up to tmax, that nothing stops.
double path_unhindered(PathTracer *tracer, Vec3 origin, Vec3 dir, double tmax);

// The next surface that the path's ray does not go through, and vertex->material, what it is there.
// distance: from the path's origin; INFINITY: there is none.
bool path_next_surface(PathTracer *tracer, Path *path, Vertex *vertex, double *distance);

// How it scatters. False: an output of its program is not finite (noted).
bool path_set_material(PathTracer *tracer, const Path *path, Vertex *vertex);

#endif
