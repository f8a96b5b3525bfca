// SPDX-License-Identifier: Apache-2.0
// Lights at one instant.
//
// A sun of angle 0 and a lamp of radius 0 are found by shadow rays alone and cost no light samples.
// A sun with an angle is a disc of equal radiance, a lamp with a radius a ball that shines outwards
// (inside it there is no light from it). They are sampled by the solid angle they fill, and met by
// reflected rays as well, both ways weighted by the balance heuristic (Veach and Guibas 1995):
// mirrors show them. The camera does not see them, nor do they cast shadows. The sky is met by rays
// alone.
#ifndef RENDER_LIGHT_H
#define RENDER_LIGHT_H

#include "accel/vec.h"
#include "render/scene.h"

typedef struct {
    Vec3 at;         // sun: unit vector towards it; lamp: its centre
    double color[3]; // with an area: radiance; else sun: irradiance, lamp: intensity
    double radius;   // lamp
    double spread;   // sun: 1 - cos of half its angle
    bool is_sun, has_area;
} LightAt;

typedef struct {
    uint32_t n;
    LightAt *lights; // room for all of the scene's
    double sky[3];   // radiance, of all skies together
} LightSet;

// What is visible at that instant. bad[scene->n_lights]: set where a light is not finite (it counts
// as dark then), else left alone; may be NULL.
void light_set_at(const Scene *scene, double seconds, LightSet *set, bool *bad);

bool light_is_moving(const Light *light); // reads the time

typedef struct {
    Vec3 dir;         // unit
    double distance;  // INFINITY for suns
    double weight[3]; // what arrives at a surface facing it, over the density
    double density;   // per steradian; 0: the only direction
} LightSample;

// u, v in [0, 1), unused without an area. False: nothing arrives there.
bool light_sample(const LightAt *light, Vec3 from, double u, double v, LightSample *sample);

// Whether a ray (dir of unit length) meets a light with an area before tmax; density gets that of
// light_sample for this direction. The radiance is light->color.
bool light_hit(const LightAt *light, Vec3 from, Vec3 dir, double tmax, double *density);

#endif
