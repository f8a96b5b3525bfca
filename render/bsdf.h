// SPDX-License-Identifier: Apache-2.0
// How a surface scatters light, in a frame of its own: +z is the shading normal on the viewer's
// side, wo points to the viewer, wi to where light comes from; both of unit length, wo.z > 0.
//
// matte: Lambert. metal: microfacets with the GGX distribution, alpha = rough^2 (Walter et al.
// 2007), Schlick's Fresnel, scaled by what single scattering loses (Turquin, "Practical multiple
// scattering compensation for microfacet models", 2019). gloss: such a coat, of a dielectric, over
// Lambert; the base gets what the coat lets through on the way in and out (Kelemen and
// Szirmay-Kalos 2001), so that with a white base all light comes back. Below BSDF_MIRROR_ROUGH
// coats and metals are mirrors.
#ifndef RENDER_BSDF_H
#define RENDER_BSDF_H

#include "accel/arena.h"
#include "accel/vec.h"
#include "render/scene.h"

#define BSDF_MIRROR_ROUGH 0.02

enum { BSDF_TABLE = 32, BSDF_MAX_OUT = 5 };

// What a rough mirror sends back, by roughness and cosine: for a Fresnel term F0 + (1 - F0) s it is
// F0 * plain + (1 - F0) * grazing, with s = (1 - cos)^5; and the cosine-weighted means.
typedef struct {
    double plain[BSDF_TABLE][BSDF_TABLE], grazing[BSDF_TABLE][BSDF_TABLE];
    double mean_plain[BSDF_TABLE], mean_grazing[BSDF_TABLE];
} BsdfTable;

// A few milliseconds: only for scenes whose materials are rough.
const BsdfTable *bsdf_table_new(Arena *arena);

typedef struct {
    MaterialKind kind;
    bool is_mirror;     // what is specular in it is a mirror
    double color[3];    // albedo, or reflectance at normal incidence
    double emission[3]; // glow: radiance
    double alpha, f0;   // metal, gloss
    double returned;    // gloss: share that the coat returns towards wo
    double mean_returned;
    double boost[3]; // metal: the compensation
    double choose;   // probability of the specular lobe
    const BsdfTable *table;
    double rough;
} Bsdf;

// out: the material program's outputs; cosine: wo.z. What is specular is at least so rough as
// least_rough (0 leaves it). table may be NULL where nothing is rough.
// Colours are brought into [0, 1], roughness too, what glows to >= 0. False: an output is not
// finite.
bool bsdf_init(Bsdf *bsdf, MaterialKind kind, const double *out, double least_rough, double cosine,
               const BsdfTable *table);

int bsdf_n_out(MaterialKind kind);

// Light from wi to wo times wi.z, in two parts: what is sampled by lights alone (diffuse) and what
// reflected rays look for as well (specular). density: of bsdf_sample for wi. Mirrors are not in
// it.
void bsdf_eval(const Bsdf *bsdf, Vec3 wo, Vec3 wi, double diffuse[3], double specular[3],
               double *density);

typedef struct {
    Vec3 wi;
    double weight[3];   // all of it times wi.z, over the density
    double specular[3]; // its specular part
    double density;     // 0: a mirror
} BsdfSample;

// u[0..2] in [0, 1): direction and lobe. False: absorbed.
bool bsdf_sample(const Bsdf *bsdf, Vec3 wo, const double u[3], BsdfSample *sample);

static inline bool bsdf_has_diffuse(const Bsdf *b) {
    return b->kind == MATERIAL_MATTE || b->kind == MATERIAL_GLOSS;
}

static inline bool bsdf_has_specular(const Bsdf *b) {
    return b->kind == MATERIAL_METAL || b->kind == MATERIAL_GLOSS;
}

#endif
