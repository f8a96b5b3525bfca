// SPDX-License-Identifier: Apache-2.0
// Inside of the loader, shared by its files (lang/loader*.c).
#ifndef LANG_LOADER_PARTS_H
#define LANG_LOADER_PARTS_H

#include "lang/loader.h"

// The i-th folder in which a name that stands in a script is looked for; NULL: there are no more.
const char *loader_folder(Eval *ev, const Env *env, const Value *name, size_t i);

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
