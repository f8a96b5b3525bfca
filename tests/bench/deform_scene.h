// SPDX-License-Identifier: Apache-2.0
// The scene whose deformer is measured, loaded as st4 does.
#ifndef TESTS_BENCH_DEFORM_SCENE_H
#define TESTS_BENCH_DEFORM_SCENE_H

#include "render/scene.h"

// One mesh that is turned about y, by 1 rad per second and metre of height. NULL: reported.
const Scene *deform_scene(Arena *arena);

#endif
