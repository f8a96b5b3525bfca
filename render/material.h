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
    const BsdfTable *table; // NULL: nothing is rough
    bool has_glow, has_holes;
} Materials;

void materials_init(Materials *materials, Arena *arena, const Scene *scene);

// The part that stands for a material there; it is no mix. *u, in [0, 1), decides, and gets what of
// it the decision leaves uniform. A material that is no mix reads and changes nothing.
uint32_t material_choose(const Materials *materials, uint32_t material, const SurfacePoint *point,
                         double seconds, double *u);

// The outputs of a material's program; those that it leaves out are 1.
void material_values(const Materials *materials, uint32_t material, const SurfacePoint *point,
                     double seconds, double out[BSDF_MAX_OUT]);

// The share of light that meets a surface of it there, in [0, 1]; of a mix, on the mean.
double material_opacity(const Materials *materials, uint32_t material, const SurfacePoint *point,
                        double seconds);

#endif
