// SPDX-License-Identifier: Apache-2.0
// A script with a deformer, loaded.
#include "tests/bench/deform_scene.h"

#include <string.h>

#include "lang/scene_load.h"

static const char text[] = "mesh { points = [<0, 0, 0>, <1, 0, 0>, <0, 1, 0>] faces = [[0, 1, 2]]\n"
                           "    fn deform(p) = turned(p, y, 1turn / (2 * pi) * t * p.y) }\n";

const Scene *deform_scene(Arena *arena) {
    LoadedScene loaded;
    Sources sources = {.arena = arena, .end = 1};
    Diag *diag = diag_new(arena, &sources, stderr, false, false);
    scene_load(arena, &sources, diag, "bench.st4", text, strlen(text), NULL, &loaded);
    scene_load_free(&loaded);
    return loaded.scene;
}
