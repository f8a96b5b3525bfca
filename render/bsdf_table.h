// SPDX-License-Identifier: Apache-2.0
// How much light rough surfaces return when each ray meets one facet alone, by roughness and
// cosine: what is missing to 1 is what real surfaces return after several, and what render/bsdf.c
// makes up for.
#ifndef RENDER_BSDF_TABLE_H
#define RENDER_BSDF_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/arena.h"

// Rougher than this: smoother surfaces are mirrors.
#define BSDF_MIRROR_ROUGH 0.02

enum { BSDF_TABLE = 32, BSDF_IORS = 12 };

typedef double BsdfGrid[BSDF_TABLE][BSDF_TABLE]; // by roughness, by cosine

// Of a mirror with the Fresnel term F0 + (1 - F0) s it is F0 * plain + (1 - F0) * grazing, with
// s = (1 - cos)^5; and the cosine-weighted means.
typedef struct {
    BsdfGrid plain, grazing;
    double mean_plain[BSDF_TABLE], mean_grazing[BSDF_TABLE];
    // Glass, reflected and refracted together, seen from outside and from inside.
    uint32_t n_iors;
    double iors[BSDF_IORS];   // ascending
    const BsdfGrid *glass[2]; // [n_iors]
} BsdfTable;

// A few milliseconds: only for scenes whose materials are rough.
BsdfTable *bsdf_table_new(Arena *arena);

// Adds glass of n indices of refraction, in any order, n <= BSDF_IORS; for those between them it is
// interpolated. n = 0: a range of them. Some 50 ms for each.
void bsdf_table_add_glass(BsdfTable *table, Arena *arena, const double *iors, uint32_t n);

// rough in [BSDF_MIRROR_ROUGH, 1], cosine in [0, 1].
double bsdf_table_at(const BsdfGrid grid, double rough, double cosine);
double bsdf_table_mean(const double mean[BSDF_TABLE], double rough);
double bsdf_table_glass(const BsdfTable *table, double ior, bool is_inside, double rough,
                        double cosine);

#endif
