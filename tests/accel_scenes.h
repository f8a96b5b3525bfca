// SPDX-License-Identifier: Apache-2.0
// Moving geometry and rays for the tests of accel/, made by formulas.
#ifndef TESTS_ACCEL_SCENES_H
#define TESTS_ACCEL_SCENES_H

#include "accel/accel.h"

typedef struct {
    Geometry geometry;
    uint32_t *index;
    float *position;
    float *radius;
    double *share;
} TestScene;

// SplitMix64, Steele, Lea, Flood (2014).
uint64_t test_random(uint64_t *seed);
double test_uniform(uint64_t *seed); // [0, 1)

TestScene scene_new(GeometryKind kind, uint32_t n_prims, uint32_t n_vertices, uint32_t n_keys);
void scene_free(TestScene *scene);

// Blades on a hub that turn `turns` times over the keys.
TestScene scene_propeller(uint32_t n_keys, double turns);
// A closed sphere of 4 n^2 - 4 n triangles (rings of 2 n), bumpy by `bump`, twisted about y with an
// ease, by `twist` radians at the top.
TestScene scene_head(uint32_t n, uint32_t n_keys, double bump, double twist);
// Triangles of the given size anywhere in the unit cube, each with vertices that wander.
TestScene scene_soup(uint32_t n_prims, uint32_t n_keys, double size, double wander, uint64_t seed);
TestScene scene_spheres(uint32_t n_prims, uint32_t n_keys, double size, double wander,
                        uint64_t seed);

// From a sphere around the scene towards a point in it; a third of them start inside.
AccelRay ray_random(const Geometry *geometry, uint64_t *seed);

#endif
