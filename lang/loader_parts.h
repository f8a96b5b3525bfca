// SPDX-License-Identifier: Apache-2.0
// Inside of the loader, shared by its files (lang/loader*.c).
#ifndef LANG_LOADER_PARTS_H
#define LANG_LOADER_PARTS_H

#include "lang/loader.h"

// The i-th folder in which a name that stands in a script is looked for; NULL: there are no more.
const char *loader_folder(Eval *ev, const Env *env, const Value *name, size_t i);

// The path of a file that a script names; *real gets it with links resolved. NULL: reported.
const char *loader_find(Eval *ev, const Env *env, NodeId node, const Value *name,
                        const char **real);

// A path with its links resolved; NULL: there is no such file.
const char *loader_real_path(Arena *arena, const char *path);

typedef enum {
    LISTING_ALLOWED,
    LISTING_ABSENT,  // it is not there
    LISTING_REFUSED, // it lies outside, which was reported
} Listing;

// Whether the folder `path` may be listed for a name that is looked for in `folder`.
Listing loader_may_list(Eval *ev, const Env *env, NodeId node, const Value *name,
                        const char *folder, const char *path);

// The nearest name of a file in those folders; NULL: none is near enough.
const char *loader_near_file(Eval *ev, const Env *env, const Value *name);

// A file that stands for a picture; image NULL: it can not be read, which was reported.
typedef struct Picture {
    struct Picture *next;
    const Module *module; // the file's name counts from there
    Symbol name;
    bool is_raw;
    const ProgramImage *image;
} Picture;

// The pictures opened so far.
Picture **loader_pictures(Eval *ev);

// The tables read so far.
Table **loader_tables(Eval *ev);

#endif
