// SPDX-License-Identifier: Apache-2.0
// Loading a scene: from the text of a script to render/scene.h, the one door that commands use.
//
// Reads, parses, evaluates and lowers a script and all that it includes. Evaluating is partial
// evaluation over lang/dag.h: it is done once, whatever the number of frames. A loaded scene can be
// asked for more afterwards: values of expressions in its outermost scope, the files that it read.
#ifndef LANG_SCENE_LOAD_H
#define LANG_SCENE_LOAD_H

#include "lang/diag.h"
#include "lang/source.h"
#include "render/scene.h"

// Zeroed: nothing is overridden. Strings are borrowed for the call.
typedef struct {
    const char *const *defines; // "NAME=EXPR", one for each -D, the last of a name wins
    size_t n_defines;
    const char *const
        *include_dirs; // -I, searched in order after the folder of the file that names
    size_t n_include_dirs;
    uint32_t width, height;          // --size; 0: as the film says
    double fps;                      // --fps; 0: as the film says. Rules the unit f as well
    const char *shutter;             // --shutter: "180deg", "4f", "0", any expression; NULL
    int64_t first_frame, last_frame; // only where has_frames
    bool has_frames;
    size_t memory;      // bytes for the scene, and again for what loading it needs; where they do
                        // not suffice, the hook of accel/arena.h is called; 0: no bound
    uint64_t max_steps; // of evaluation, before the script is refused; 0: 2^26
    const struct Simulator *simulator; // lang/simulator.h: runs simulations; NULL: what reads them
                                       // is refused
} LoadOptions;

typedef struct Loading Loading; // syntax trees, graph and scopes

// What comes of it. Paths are as the user would name them: relative where the scene's path is.
typedef struct {
    const Scene *scene;       // in the caller's arena; NULL: errors were reported
    int status;               // an exit status: 0 fine, 1 errors in the script, 3 a file that it
                              // names is missing, unreadable or damaged
    const char *const *files; // every file read, in order, the script first; "-" is standard input
    size_t n_files;
    Loading *loading; // for scene_eval
} LoadedScene;

// path: the script; "-" is standard input. text: NULL, or the script's text, used instead of
// reading (path is then what messages and relative paths go by). Reports to diag; warnings leave
// status 0. An unreadable script is reported too. The scene and everything it points to is
// allocated from arena; the rest lives in *loaded until scene_load_free, which the caller may call
// at once.
void scene_load(Arena *arena, Sources *sources, Diag *diag, const char *path, const char *text,
                size_t text_size, const LoadOptions *options, LoadedScene *loaded);

// Frees syntax trees and graph; loaded->scene stays. Safe on a zeroed struct, and twice.
void scene_load_free(LoadedScene *loaded);

// An expression's value over time.
typedef struct {
    const char *type;   // "number", "angle", "bool", "color", "rotation", "transform", "string",
                        // "vec2", "vec3", "vec4", ...
    uint32_t n_columns; // scalars: 1 for a number, 12 for a transform (rows of 3x4)
    const Program *program; // n_columns out, SI units (angles in radians); reads IN_T, IN_FILM_T.
                            // NULL: not numeric, see text
    const char *text;       // strings and all else that is not numeric, as `print` shows it
} SceneMotion;

// Evaluates an expression in the outermost scope of a loaded script, also one that had errors.
// False: the errors were reported. Everything in *motion is allocated from arena.
bool scene_eval(LoadedScene *loaded, Arena *arena, const char *expr, SceneMotion *motion);

// The instants that an expression names, which must be known: a time, a range or a list of them, in
// seconds. origin names the expression in reports ("--at"). False: reported.
bool scene_eval_times(LoadedScene *loaded, Arena *arena, const char *origin, const char *expr,
                      const double **times, size_t *n);

// The place in the source that a report of the renderer is about.
static inline Span scene_span(SourceRef where) {
    return (Span){(uint32_t)where, (uint32_t)(where >> 32)};
}

static inline SourceRef scene_source_ref(Span span) {
    return span.lo | (SourceRef)span.hi << 32;
}

#endif
