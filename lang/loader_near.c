// SPDX-License-Identifier: Apache-2.0
// Files whose names are nearly one that a script asks for.
#include "lang/loader_parts.h"
#include "lang/utf8.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_NAMES = 1024 };

static int by_name(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

// What a script, which is UTF-8, cannot name is no help to it; nor would it be fit to print.
static bool is_nameable(const char *name) {
    const char *end = name + strlen(name);
    for (unsigned size; name < end; name += size) {
        uint32_t c = utf8_decode(name, end, &size);
        if (c == UTF8_BAD || utf8_steers(c)) {
            return false;
        }
    }
    return true;
}

// The names in a folder, behind n others; returns how many there are then.
static size_t add_names(Eval *ev, const char *folder, const char **names, size_t n) {
    DIR *open_folder = opendir(folder);
    for (struct dirent *entry; open_folder && n < MAX_NAMES && (entry = readdir(open_folder));) {
        if (entry->d_name[0] != '.' && is_nameable(entry->d_name)) {
            names[n++] = arena_string(ev->arena, entry->d_name, strlen(entry->d_name));
        }
    }
    if (open_folder) {
        closedir(open_folder);
    }
    return n;
}

const char *loader_near_file(Eval *ev, const Env *env, const Value *name) {
    const char *text = symbol_text(ev->symbols, name->symbol), *folder;
    const char **names = ARENA_ARRAY(ev->arena, MAX_NAMES, const char *);
    size_t n = 0;
    if (strchr(text, '/')) { // folders within those of the scene are not looked through
        return NULL;
    }
    for (size_t i = 0; (folder = loader_folder(ev, env, name, i)); i++) {
        n = add_names(ev, folder, names, n);
    }
    qsort(names, n, sizeof *names, by_name); // folders list their files in no order
    return diag_nearest(text, names, n);
}
