// SPDX-License-Identifier: Apache-2.0
// Scenes from scripts, for tests that look into the renderer.
#ifndef TESTS_SCRIPT_SCENE_H
#define TESTS_SCRIPT_SCENE_H

#include "render/scene.h"

typedef struct ScriptScene ScriptScene;

// The script must load without an error. folder: where else its files are looked for; NULL:
// nowhere.
ScriptScene *script_scene_new(const char *text, const char *folder);
const Scene *script_scene(const ScriptScene *scene);
void script_scene_free(ScriptScene *scene);

#endif
