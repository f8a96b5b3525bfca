// SPDX-License-Identifier: Apache-2.0
// Scenes from scripts.
#include "tests/script_scene.h"

#include <stdlib.h>
#include <string.h>

#include "lang/scene_load.h"
#include "lang/sim_cache.h"

struct ScriptScene {
    Arena arena;
    Sources sources;
    LoadedScene loaded;
};

ScriptScene *script_scene_new(const char *text, const char *folder) {
    ScriptScene *scene = calloc(1, sizeof *scene);
    scene->sources = (Sources){.end = 1, .arena = &scene->arena};
    Diag *diag = diag_new(&scene->arena, &scene->sources, stderr, false, false);
    SimCache kept_nowhere = {.reports = stderr};
    const Simulator simulator = sim_cache_simulator(&kept_nowhere, false);
    LoadOptions load = {.max_steps = 1 << 20,
                        .include_dirs = &folder,
                        .n_include_dirs = folder ? 1 : 0,
                        .simulator = &simulator};
    scene_load(&scene->arena, &scene->sources, diag, "test.st4", text, strlen(text), &load,
               &scene->loaded);
    if (!scene->loaded.scene) {
        abort();
    }
    scene_load_free(&scene->loaded); // the scene stays
    return scene;
}

const Scene *script_scene(const ScriptScene *scene) {
    return scene->loaded.scene;
}

void script_scene_free(ScriptScene *scene) {
    arena_free(&scene->arena);
    free(scene);
}
