// SPDX-License-Identifier: Apache-2.0
// Closed moving meshes for the stability tests, with points that are inside at all times.
#ifndef TESTS_STABILITY_SOLIDS_H
#define TESTS_STABILITY_SOLIDS_H

#include "accel/vec.h"
#include "tests/stability/stability.h"

typedef enum { SOLID_SPHERE, SOLID_TORUS, SOLID_BOX, SOLIDS } SolidShape;

extern const char *const solid_names[SOLIDS];

typedef struct {
    TestScene scene;
    uint32_t n_inside;
    float *inside; // [n_keys][n_inside][3]: they move with the mesh
    char label[100];
} Solid;

// A rest pose of about 8 n^2 triangles, its extent below 1, every key a copy of it.
Solid solid_new(SolidShape shape, uint32_t n, uint32_t n_keys);
void solid_free(Solid *solid);

// Maps everything of one key: a linear map keeps what is inside inside, between keys too.
void solid_map(Solid *solid, uint32_t key, const Affine *map);
// Turns, stretches and shifts each key differently; vertices tremble by `tremble` besides.
void solid_move(Solid *solid, double angle, double tremble, uint64_t seed);

// Any point inside at the ray's time becomes its origin; time and interval are filled in.
AccelRay solid_ray(const Solid *solid, uint64_t *random);
// Where a vertex is at the ray's time, with the rounding of the kernels.
void vertex_at(const Geometry *geometry, const AccelRay *ray, uint32_t vertex, float p[3]);
void random_direction(uint64_t *random, float d[3]);

#endif
