// SPDX-License-Identifier: Apache-2.0
// Files that a scene is made of: scripts, includes, meshes; parameters from the command line.
//
// A file that a script names is looked for beside that script, then in each folder given with -I,
// and has to lie there once links are resolved; one that the command line names (by -D) is looked
// for from the current directory.
#ifndef LANG_LOADER_H
#define LANG_LOADER_H

#include "lang/hash.h"
#include "lang/object.h"
#include "lang/scene_load.h"

typedef struct Loader Loader;

Loader *loader_new(Arena *arena, const LoadOptions *options);

// The whole of a file, "-": of standard input; SOURCE_PADDING NULs follow. NULL: errno says why.
// Bounded by what a Sources can hold.
char *loader_read(Arena *arena, const char *path, size_t *size);

// Reads and parses the script; NULL: reported.
Module *loader_script(Eval *ev, const char *path, const char *text, size_t text_size);

// Binds a parameter: to what -D says, else to its default.
void loader_declare_param(Eval *ev, const Env *env, NodeId statement);
// Reports each -D that no param took.
void loader_check_defines(Eval *ev);

// Reads an included file and binds its names, or the one after `as`.
void loader_include(Eval *ev, const Env *env, NodeId statement);
// Gathers and places what an included file holds.
void loader_place(Eval *ev, const Env *env, const Place *place, NodeId statement);
void loader_gather(Eval *ev, const Env *env, Object *object, NodeId statement);

// Calls `visit` for the outermost block of the script and of each file included without `as`.
typedef void LoaderVisit(Eval *ev, const Env *env, NodeId block, void *context);
void loader_visit(Eval *ev, const Module *script, LoaderVisit *visit, void *context);

// The mesh of a file; the same file is read once. NULL: reported. file: the property.
const Mesh *loader_mesh(Eval *ev, const Given *file);

// The path of a file that the script names by a string; NULL: reported. It counts as read.
const char *loader_file(Eval *ev, const Env *env, NodeId node, const Value *name);

// The files of a pattern with one %d ("walk.%04d.ply"), in order of their numbers, of which none is
// missing: as strings for loader_file, from the arena. NULL: reported.
const Value *loader_sequence(Eval *ev, const Given *pattern, uint32_t *n);

// The whole of a text file, ended by a NUL; NULL: reported.
const char *loader_text(Eval *ev, const Env *env, NodeId node, const Value *name, size_t *size);

// Rows of a text file: y at x, or one column, whose x count from 0. xs ascend.
typedef struct Table {
    struct Table *next;
    const Module *module; // the file's name counts from there
    Symbol name;
    uint32_t n;
    double *xs, *ys;
} Table;

// The same file is read once; NULL: reported.
const Table *loader_table(Eval *ev, const Env *env, NodeId node, const Value *name);

// A picture to look up, opened once; is_raw: its numbers are taken as they are. NULL: reported.
const ProgramImage *loader_picture(Eval *ev, const Env *env, NodeId node, const Value *name,
                                   bool is_raw);

// More that the scene was made from.
void loader_hash_add(Eval *ev, const void *bytes, size_t n);

// Parses an expression that stands in no file: origin names it in reports ("-D n").
NodeId loader_parse_expr(Eval *ev, const char *origin, const char *text, Module **module);

// Everything read so far, in order, and its hash (of texts and -D).
const char *const *loader_files(const Loader *loader, size_t *n);
const Hash128 *loader_hash(const Loader *loader);

// Whether a string is a path that counts from the current directory.
enum { STRING_FROM_COMMAND_LINE = 1 }; // Value.n of a STRING

#endif
