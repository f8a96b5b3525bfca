// SPDX-License-Identifier: Apache-2.0
// What the commands that read a scene have in common: diagnostics, loading, the frames asked for.
#ifndef LANG_SESSION_H
#define LANG_SESSION_H

#include "lang/diag.h"
#include "lang/options.h"
#include "lang/scene_load.h"
#include "lang/sim_cache.h"
#include "render/render.h"

typedef struct {
    Arena *arena; // borrowed
    const Options *options;
    double began; // of clock_seconds
    Sources sources;
    Diag *diag;
    const Scene *scene;
    const int64_t *frames; // ascending, each once
    uint32_t n_frames;
    SimCache sims;
    Simulator simulator;
    Reporter reporter; // the renderer's reports become diagnostics
} Session;

// Sets up diagnostics. Returns an exit status; unless it is 0, all was reported. The session must
// stay where it is: the reporter points to it.
int session_begin(Session *session, Arena *arena, const Options *options);

// Begins, and loads the scene that the options name. *loaded can be asked for more until it is
// freed, which the caller has to do in any case.
int session_load(Session *session, Arena *arena, const Options *options, LoadedScene *loaded);

// The same for those who want the scene alone, and its frames. Unless the status is 0, scene is
// NULL.
int session_open(Session *session, Arena *arena, const Options *options);

// What the options and the scene say of rendering, everything but the file pattern and progress.
// False: reported, a usage error.
bool session_render_options(const Session *session, RenderOptions *render);

// Reports what is wrong with a file or an option; returns the status.
int session_refuse(const Session *session, int status, const char *path, const char *message);

// Ends the diagnostics; the exit status where `status` is what the command came to.
int session_close(Session *session, int status);

#endif
