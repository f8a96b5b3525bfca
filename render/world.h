// SPDX-License-Identifier: Apache-2.0
// The world of a block of frames: motion sampled into vertex arrays, structures built over them,
// objects under their transforms, ready for rays at any instant at which a shutter is open.
//
// Two levels. An object is one instance of a shape: vertex arrays in its own frame (shared between
// instances where loops do not move vertices) under a transform that is evaluated at the ray's own
// time, exactly. A kd-tree over the objects' boxes in space and time finds the objects; planes lie
// beside it. What is asked for at a ray's time does not depend on the block: the same frame gives
// the same hits in any block.
#ifndef RENDER_WORLD_H
#define RENDER_WORLD_H

#include "accel/vec.h"
#include "render/render.h"
#include "render/timeline.h"

typedef struct World World;

// Samples for as many of the frames as options->memory holds (at least one), in order; *n_taken
// gets how many. Structures are built as rays come to them. NULL after an error was reported. Adds
// what was sampled to stats.
World *world_build(const Scene *scene, const RenderOptions *options, const int64_t *frames,
                   uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken,
                   RenderStats *stats);
void world_destroy(World *world);

// Adds the structures that rays have built; called when no more of them come.
void world_count(const World *world, RenderStats *stats);
// Seconds that all threads together spent on building since rays began, and on waiting for it.
double world_waited(const World *world);
// False after an error was reported: a structure could not be built, pictures are worth nothing.
bool world_is_sound(const World *world, const Reporter *reporter);

// Bounds of all that is finite at one instant, sampled there alone. False: nothing.
bool world_bounds_at(const Scene *scene, Instant at, Vec3 *lo, Vec3 *hi);

// Gives a scene whose camera is automatic one that sees everything at the film's first frame, in
// the middle of its shutter. The program lives in the arena.
void world_place_camera(Arena *arena, Scene *scene);

// One thread's view of the world at one instant: transforms evaluated so far are kept, so the rays
// of a path pay for them once.
typedef struct WorldView WorldView;
WorldView *world_view_new(const World *world);
void world_view_destroy(WorldView *view, AccelCounters *add); // adds its counts
void world_view_time(WorldView *view, Instant at);

typedef struct {
    double t;        // in units of the ray's direction
    uint32_t object; // index, the same in every block
    int32_t prim;    // of the object's own
    float u, v;      // as AccelHit
    uint32_t body;   // for world_surface: where it was found
    uint32_t at;     // which primitive there
} WorldHit;

// The nearest hit in (tmin, tmax); at equal distances the lowest object. dir needs not be unit.
bool world_closest(WorldView *view, Vec3 origin, Vec3 dir, double tmin, double tmax, WorldHit *hit);
bool world_occluded(WorldView *view, Vec3 origin, Vec3 dir, double tmin, double tmax);

// The same of those shapes alone that such rays meet.
bool world_closest_of(WorldView *view, RayKind kind, Vec3 origin, Vec3 dir, double tmin,
                      double tmax, WorldHit *hit);
bool world_occluded_of(WorldView *view, RayKind kind, Vec3 origin, Vec3 dir, double tmin,
                       double tmax);

typedef struct {
    Vec3 P;        // world position, from the vertices (not along the ray)
    double error;  // metres: bound on P's rounding; start new rays so far off the surface
    Vec3 Ng, N;    // unit; geometric and shading normal, both turned to the outside (not to
                   // the ray); N is on the ray's side of the surface wherever Ng is
    Vec3 p, n;     // rest position and normal, in the shape's block
    double u, v;   // texture coordinates
    Vec3 velocity; // metres per second at this instant, of the point of the surface
    const Shape *shape;
    const double *loops; // this instance's loop variables, shape->n_loops
    uint32_t material;
    uint32_t instance;
} SurfacePoint;

void world_surface(WorldView *view, Vec3 origin, Vec3 dir, const WorldHit *hit,
                   SurfacePoint *point);

// How a point's coordinates change along two directions of its surface, to first order: u and w of
// a triangle, the parameters u and v of spheres and planes (a sphere's in radians, a plane's in
// metres of its block).
typedef struct {
    Vec3 P[2], p[2], n[2];
    double u[2], v[2];
} SurfaceSlope;

// point: of this hit, in this view at the same instant.
void world_surface_slope(WorldView *view, const WorldHit *hit, const SurfacePoint *point,
                         SurfaceSlope *slope);

#endif
