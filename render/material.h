// SPDX-License-Identifier: Apache-2.0
// Materials at points of surfaces: their programs run, mixes decided.
//
// What a mix is at a point is one of its parts, chosen with its share by a random number: on the
// mean over samples that is the mean of both, and each sample costs as much as one material.
#ifndef RENDER_MATERIAL_H
#define RENDER_MATERIAL_H

#include "render/bsdf.h"
#include "render/world.h"

// What all threads share while a scene is rendered: what need not be asked at each ray.
typedef struct {
    const Material *all; // [n]
    uint32_t n;
    double (*values)[BSDF_MAX_OUT]; // outputs of constant programs
    bool *is_constant;
    const BsdfTable *table;   // NULL: nothing is rough
    bool has_glow, has_holes; // somewhere
    bool *glows;              // [n]: it, or a part of it, gives light somewhere at some time
    bool *is_even;            // [n]: the same light everywhere and always
    double (*glow)[3];        // [n]: where it is even
    bool *looks_around;       // [n]: a program of it, or of its parts, needs neighbours
    bool needs_neighbours;    // any does
} Materials;

// A place on a surface, and two beside it in the directions of a pixel's sides: how programs change
// from one to the other tells of the slopes of bumps and how much of a picture falls into a pixel.
typedef struct {
    const SurfacePoint *point;
    const SurfacePoint *beside; // [2]; NULL: the place alone
    double seconds;
} MaterialPlace;

// width: of the bundle of rays that a pixel is, in metres, where it meets the surface along dir.
void material_beside(const SurfacePoint *point, const SurfaceSlope *slope, Vec3 dir, double width,
                     SurfacePoint beside[2]);

// The point's shading normal, bent by bump and normal map of a material that looks around; turned
// to the outside, and in sight of the viewer as the surface is.
Vec3 material_normal(const Materials *materials, uint32_t material, const MaterialPlace *place,
                     const SurfaceSlope *slope, Vec3 dir);

void materials_init(Materials *materials, Arena *arena, const Scene *scene);

// The part that stands for a material there; it is no mix. *u, in [0, 1), decides, and gets what of
// it the decision leaves uniform. A material that is no mix reads and changes nothing.
uint32_t material_choose(const Materials *materials, uint32_t material, const MaterialPlace *place,
                         double *u);

// The outputs of a material's program; those that it leaves out are 1.
void material_values(const Materials *materials, uint32_t material, const MaterialPlace *place,
                     double out[BSDF_MAX_OUT]);

// The light of its own there, radiance on the mean of its parts, as far as it is opaque; where it
// is even the place is not looked at. False: not finite; bad, of the part, is set (may be NULL).
bool material_glow(const Materials *materials, uint32_t material, const MaterialPlace *place,
                   bool *bad, double radiance[3]);

// The share of light that meets a surface of it there, in [0, 1]; of a mix, on the mean.
double material_opacity(const Materials *materials, uint32_t material, const MaterialPlace *place);

#endif
