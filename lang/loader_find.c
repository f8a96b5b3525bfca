// SPDX-License-Identifier: Apache-2.0
// Finding the files that scripts name: beside the script, in the folders given with -I and in the
// standard library, and nowhere else, links resolved.
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "lang/loader_parts.h"

static const char *join(Arena *arena, const char *folder, const char *name) {
    if (*name == '/' || strcmp(folder, ".") == 0) {
        return name;
    }
    bool has_slash = folder[strlen(folder) - 1] == '/';
    return arena_printf(arena, "%s%s%s", folder, has_slash ? "" : "/", name);
}

const char *loader_real_path(Arena *arena, const char *path) {
    char *real = realpath(path, NULL);
    const char *copy = real ? arena_string(arena, real, strlen(real)) : NULL;
    free(real);
    return copy;
}

static const char *base_of(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool lies_in(const char *real, const char *real_folder) {
    size_t n = strlen(real_folder);
    return strcmp(real_folder, "/") == 0 || (strncmp(real, real_folder, n) == 0 && real[n] == '/');
}

// What is named by the way up: whether it exists is not for the script to know.
static bool steps_out(const char *name) {
    int depth = 0;
    while (*name && *name != '/' && depth >= 0) {
        size_t size = strcspn(name, "/");
        bool is_up = size == 2 && strncmp(name, "..", 2) == 0;
        bool is_here = size == 1 && *name == '.';
        depth += is_up ? -1 : is_here ? 0 : 1;
        name += size;
        name += strspn(name, "/");
    }
    return *name == '/' || depth < 0;
}

static void report_outside(Eval *ev, Span where, const char *name) {
    eval_error_at(ev, where, "add its folder with -I",
                  "'%s' lies outside of the folders that this script may read", name);
    ev->has_failed_file = true;
}

Listing loader_may_list(Eval *ev, const Env *env, NodeId node, const Value *name,
                        const char *folder, const char *path) {
    const char *text = symbol_text(ev->symbols, name->symbol);
    const char *real_folder = loader_real_path(ev->arena, folder),
               *real = loader_real_path(ev->arena, path);
    bool is_inside =
        real && real_folder && (strcmp(real, real_folder) == 0 || lies_in(real, real_folder));
    if (is_inside || name->n == STRING_FROM_COMMAND_LINE) {
        return LISTING_ALLOWED;
    }
    if (!real && !steps_out(text)) {
        return LISTING_ABSENT;
    }
    report_outside(ev, syntax_span(env->module->syntax, node), text);
    return LISTING_REFUSED;
}

// A script names files; a pipe would hold the program until somebody writes to it.
static bool is_regular(Eval *ev, Span where, const char *path) {
    struct stat about;
    if (stat(path, &about) == 0 && S_ISREG(about.st_mode)) {
        return true;
    }
    eval_error_at(ev, where, NULL, "cannot read '%s': it is not a regular file", path);
    ev->has_failed_file = true;
    return false;
}

const char *loader_find(Eval *ev, const Env *env, NodeId node, const Value *name,
                        const char **real) {
    const char *text = symbol_text(ev->symbols, name->symbol), *folder;
    Span where = syntax_span(env->module->syntax, node);
    if (name->n == STRING_FROM_COMMAND_LINE) {
        *real = loader_real_path(ev->arena, text);
        if (!*real) {
            eval_error_at(ev, where, NULL, "cannot read '%s': %s", text, strerror(errno));
            ev->has_failed_file = true;
        }
        return *real ? text : NULL;
    }
    bool is_outside = steps_out(text);
    const char *script = env->module->syntax->file->path;
    const char *own = strcmp(base_of(text), base_of(script)) == 0
                          ? loader_real_path(ev->arena, script)
                          : NULL; // of a script that names itself: it means another
    const char *own_path = NULL;  // as it was found
    for (size_t i = 0; (folder = loader_folder(ev, env, name, i)); i++) {
        const char *path = join(ev->arena, folder, text);
        const char *real_folder = loader_real_path(ev->arena, folder);
        *real = *text && real_folder ? loader_real_path(ev->arena, path) : NULL;
        if (*real && own && strcmp(*real, own) == 0) {
            own_path = own_path ? own_path : path;
        } else if (*real && lies_in(*real, real_folder)) {
            return is_regular(ev, where, path) ? path : NULL;
        }
        is_outside = is_outside || *real;
    }
    if (own_path) {
        *real = own;
        return own_path;
    }
    ev->has_failed_file = true;
    if (is_outside) {
        report_outside(ev, where, text);
    } else {
        const char *near = loader_near_file(ev, env, name);
        eval_error_at(ev, where,
                      near ? arena_printf(ev->arena, "did you mean '%s'?", near)
                           : "it is looked for beside this file, in each folder given with -I, and "
                             "in the standard library",
                      "there is no file '%s'", text);
    }
    return NULL;
}
