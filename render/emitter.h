// SPDX-License-Identifier: Apache-2.0
// Emitters: the triangles and spheres of a world that glow, as lights: one by one, at the instant
// of a ray, where they are then. What glows does so on both sides.
//
// A sphere that is seen from outside is drawn by the solid angle that it fills; from inside, and
// where a transform makes it an ellipsoid, evenly over the sphere that it was; a triangle evenly
// over its area. The densities are those of the very geometry that rays meet at that instant, so
// what is estimated does not depend on how emitters are chosen. What bounces do not meet is not
// there; the far side of a sphere with holes is not drawn from outside. Planes that
// glow have no end: they are found by rays alone.
#ifndef RENDER_EMITTER_H
#define RENDER_EMITTER_H

#include "render/light_tree.h"
#include "render/world.h"

typedef struct {
    uint32_t body, prim; // of the world; prim as WorldHit's `at`
} Emitter;

typedef struct {
    const Emitter *list;
    uint32_t n, n_bodies;
    // Where a body's primitives begin in `index`, [n_bodies]; UINT32_MAX: none of them glows.
    const uint32_t *first;
    const uint32_t *index; // of a primitive in list; UINT32_MAX: it does not glow
} EmitterSet;

// glows[n_materials]. All that may be there at some instant; catchers never are.
EmitterSet emitters_find(Arena *arena, const World *world, const bool *glows);

// Which emitter was hit; UINT32_MAX: none.
uint32_t emitter_of(const EmitterSet *set, const WorldHit *hit);
uint32_t emitter_material(const WorldView *view, const Emitter *emitter);

typedef struct {
    Vec3 dir;        // unit, from where it was asked to the point
    double distance; // metres
    double density;  // per steradian
    WorldHit hit;    // the point, for world_surface along `dir`
} EmitterSample;

// At the view's instant; u, v in [0, 1). False: it is not there, or can not be seen from there.
bool emitter_sample(WorldView *view, const Emitter *emitter, Vec3 from, double u, double v,
                    EmitterSample *sample);
// The density of emitter_sample for a hit along dir (unit) from there, so many metres away.
double emitter_density(WorldView *view, const Emitter *emitter, Vec3 from, Vec3 dir,
                       double distance);

// What bounds it at the view's instant, power being its area; a point of it, the k-th of
// EMITTER_POINTS, for asking how it glows there. False: it is not there.
enum { EMITTER_POINTS = 6 };
bool emitter_bounds(WorldView *view, const Emitter *emitter, LightBounds *bounds);
void emitter_point(WorldView *view, const Emitter *emitter, uint32_t k, SurfacePoint *point);

#endif
