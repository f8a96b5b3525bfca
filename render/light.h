// SPDX-License-Identifier: Apache-2.0
// Lights at one instant.
//
// A sun of angle 0 and a lamp of radius 0 are found by shadow rays alone and cost no light samples.
// A sun with an angle is a disc of equal radiance, a lamp with a radius a ball that shines outwards
// (inside it there is no light from it). They are sampled by the solid angle they fill, and met by
// reflected rays as well, both ways weighted by the balance heuristic (Veach and Guibas 1995):
// mirrors show them. The camera does not see them, nor do they cast shadows. The sky is met by rays
// alone.
//
// A spot is a lamp whose radiance is scaled by the angle between the ray and the axis: 1 within the
// inner cone, 0 outside the outer one, 3x^2 - 2x^3 of the angle between them. An area is a
// parallelogram of equal radiance (Lambert); its points are drawn evenly, so next to it matte
// surfaces too look for it by reflected rays, by the same heuristic.
#ifndef RENDER_LIGHT_H
#define RENDER_LIGHT_H

#include "accel/vec.h"
#include "render/scene.h"

typedef struct {
    LightKind kind;      // SUN, LAMP, SPOT, AREA
    Vec3 at;             // sun: unit vector towards it; else its centre
    double color[3];     // with an area: radiance; else sun: irradiance, lamp: intensity
    double radius;       // lamp, spot
    double spread;       // sun: 1 - cos of half its angle
    Vec3 axis;           // spot: where it points; area: what it faces; unit
    double inner, outer; // spot: half angles, radians
    double cos_inner, cos_outer;
    Vec3 half_u, half_v; // area: half edges
    double size;         // area: square metres
    bool two_sided;      // area
    bool has_area;
} LightAt;

typedef struct {
    uint32_t n;
    LightAt *lights; // room for all of the scene's
    double sky[3];   // radiance, of all skies together; with a gradient or an image, its factor
    const Light *painted;          // the sky that has a gradient or an image; NULL: none
    double turn_cosine, turn_sine; // of its image
    bool has_area;                 // one of them has
    bool is_near;  // one of them is looked for by matte surfaces too (light_is_near)
    bool only_far; // set by the caller: lamps, spots and areas are left out
} LightSet;

// What is visible at that instant. bad[scene->n_lights]: set where a light is not finite (it counts
// as dark then), else left alone; may be NULL.
void light_set_at(const Scene *scene, double seconds, LightSet *set, bool *bad);

typedef struct {
    Vec3 dir;         // unit
    double distance;  // INFINITY for suns
    double weight[3]; // what arrives at a surface facing it, over the density
    double density;   // per steradian; 0: the only direction
} LightSample;

// The sky's radiance in a direction (unit); not finite: 0, and *bad is set.
void light_sky(const LightSet *set, double seconds, Vec3 dir, double rgb[3], bool *bad);

// The same of light_sample and light_hit for the sky's image, where it is sampled; density 0: it
// is not, there.
bool light_sky_is_sampled(const LightSet *set);
bool light_sky_sample(const LightSet *set, double u, double v, LightSample *sample);
double light_sky_density(const LightSet *set, Vec3 dir);

bool light_is_moving(const Light *light); // reads the time

// One light at an instant. False: it gives no light; *bad, left alone else, is set where it is not
// finite. Skies are not lights in this sense.
bool light_at(const Light *light, double seconds, LightAt *at, bool *bad);

// Whether the diffuse part of reflections shares it with shadow rays as the specular part does.
static inline bool light_is_near(const LightAt *light) {
    return light->kind == LIGHT_AREA;
}

// u, v in [0, 1), unused without an area. False: nothing arrives there.
bool light_sample(const LightAt *light, Vec3 from, double u, double v, LightSample *sample);

typedef struct {
    double distance; // INFINITY for suns
    double density;  // of light_sample for this direction
} LightHit;

// Whether a ray (dir of unit length) meets a light with an area before tmax. The radiance is
// light->color, scaled by light_share.
bool light_hit(const LightAt *light, Vec3 from, Vec3 dir, double tmax, LightHit *hit);

// The share of its color that a light sends along dir (unit, away from it): 1 but for spots, and 0
// behind an area.
double light_share(const LightAt *light, Vec3 dir);

#endif
