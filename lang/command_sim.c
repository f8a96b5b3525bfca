// SPDX-License-Identifier: Apache-2.0
// st4 sim: runs the simulations of a scene, and keeps what they come to.
#include "lang/command.h"

#include "lang/session.h"

int command_sim(Arena *arena, const Options *options) {
    Session session;
    LoadedScene loaded;
    int status = session_load(&session, arena, options, &loaded); // runs them
    scene_load_free(&loaded);
    return status ? status : session_close(&session, status);
}
