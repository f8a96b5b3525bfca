// SPDX-License-Identifier: Apache-2.0
// Moving geometry for measuring, made from formulas (or from an OBJ file where one is given).
#ifndef TESTS_BENCH_SCENES_H
#define TESTS_BENCH_SCENES_H

#include "accel/accel.h"

typedef struct {
    const char *name;
    Geometry geometry; // over the two arrays below
    float *position;
    uint32_t *index;
    float eye[3]; // primary rays start here and look at the origin
    float window; // half the picture's height at distance 1
} BenchScene;

enum { BENCH_N_SCENES = 13 };

// Scene number i. obj: the path of a mesh that takes the place of the procedural figure, or NULL.
bool bench_scene(int i, const char *obj, BenchScene *scene);
void bench_scene_free(BenchScene *scene);

#endif
