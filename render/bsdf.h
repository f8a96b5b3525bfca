// SPDX-License-Identifier: Apache-2.0
// How a surface scatters light, in a frame of its own: +z is the shading normal on the viewer's
// side, wo points to the viewer, wi to where light comes from; both of unit length, wo.z > 0. Light
// that comes through the surface has wi.z < 0.
//
// matte: Lambert. metal: microfacets with the GGX distribution, alpha = rough^2 (Walter et al.
// 2007), Fresnel's equations for a conductor (render/fresnel.h), scaled by what single scattering
// loses (Turquin, "Practical multiple scattering compensation for microfacet models", 2019). gloss:
// such a coat, of a dielectric with Schlick's Fresnel, over Lambert; the base gets what the coat
// lets through on the way in and out (Kelemen and Szirmay-Kalos 2001), so that with a white base
// all light comes back. glass: facets that reflect and refract by Fresnel's equations for
// dielectrics (Walter et al. 2007), scaled by what single facets lose. Below BSDF_MIRROR_ROUGH
// coats, metals and glass are smooth.
//
// Radiance is counted divided by the square of the index of refraction where it is ("basic
// radiance", Nicodemus 1963), which refraction keeps: no factor stands at the surface of glass.
#ifndef RENDER_BSDF_H
#define RENDER_BSDF_H

#include "accel/vec.h"
#include "render/bsdf_table.h"
#include "render/fresnel.h"
#include "render/scene.h"

enum { BSDF_MAX_OUT = 7 };

typedef struct {
    MaterialKind kind;
    bool is_mirror;     // what is specular in it is a mirror
    double color[3];    // albedo, or reflectance at normal incidence
    double emission[3]; // glow: radiance
    double alpha, f0;   // metal, gloss
    double returned;    // gloss: share that the coat returns towards wo
    double mean_returned;
    double boost[3]; // metal, glass: the compensation
    FresnelMetal metal[3];
    double eta;     // glass: index of refraction beyond the surface over that before it
    double tint[3]; // glass: share of what comes through
    double choose;  // probability of the specular lobe
    const BsdfTable *table;
    double rough;
} Bsdf;

// out: the material program's outputs; of those that a program may leave out: 1. is_inside: the
// viewer is behind the surface, which matters to glass. cosine: wo.z. What is specular is at least
// so rough as least_rough (0 leaves it). table may be NULL where nothing is rough.
// Colours are brought into [0, 1], roughness too, what glows to >= 0, indices of refraction to >=
// 1. False: an output is not finite.
bool bsdf_init(Bsdf *bsdf, MaterialKind kind, const double out[BSDF_MAX_OUT], bool is_inside,
               double least_rough, double cosine, const BsdfTable *table);

// Outputs of a material's program, without those that it may leave out. Mixes scatter nothing.
int bsdf_n_out(MaterialKind kind);

// Light from wi to wo times |wi.z|, in two parts: what is sampled by lights alone (diffuse) and
// what reflected rays look for as well (specular). density: of bsdf_sample for wi. Mirrors are not
// in it.
void bsdf_eval(const Bsdf *bsdf, Vec3 wo, Vec3 wi, double diffuse[3], double specular[3],
               double *density);

typedef struct {
    Vec3 wi;
    double weight[3];   // all of it times |wi.z|, over the density
    double specular[3]; // its specular part
    double density;     // 0: a mirror
} BsdfSample;

// u[0..2] in [0, 1): direction and lobe. False: absorbed.
bool bsdf_sample(const Bsdf *bsdf, Vec3 wo, const double u[3], BsdfSample *sample);

// Glass whose color is what distance leaves of the light within: how much of it one metre takes
// away, as a power of e. False: the glass absorbs nothing within.
bool bsdf_absorption(const double out[BSDF_MAX_OUT], double per_metre[3]);

static inline bool bsdf_has_diffuse(const Bsdf *b) {
    return b->kind == MATERIAL_MATTE || b->kind == MATERIAL_GLOSS;
}

static inline bool bsdf_has_specular(const Bsdf *b) {
    return b->kind == MATERIAL_METAL || b->kind == MATERIAL_GLOSS || b->kind == MATERIAL_GLASS;
}

#endif
