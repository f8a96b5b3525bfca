// SPDX-License-Identifier: Apache-2.0
// Shared objects loaded at first use. The dynamic linker itself remembers what is loaded, so that
// no state is kept here.
#include "render/plugin.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char *const folders[] = {"", "../lib/st4/"};
enum { N_FOLDERS = sizeof folders / sizeof folders[0] };

// The i-th place where the file may lie; false when the name gets too long.
static bool candidate(char path[PATH_MAX], size_t i, const char *file) {
    char program[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length <= 0) {
        return false;
    }
    program[length] = '\0';
    char *slash = strrchr(program, '/');
    int folder = slash ? (int)(slash + 1 - program) : 0;
    int n = snprintf(path, PATH_MAX, "%.*s%s%s", folder, program, folders[i], file);
    return n > 0 && n < PATH_MAX;
}

void *plugin_symbol(const char *file, const char *symbol, char *message, size_t n) {
    char path[PATH_MAX];
    snprintf(message, n, "%s is missing beside the program", file);
    for (size_t i = 0; i < N_FOLDERS; i++) {
        if (!candidate(path, i, file) || access(path, R_OK) != 0) {
            continue;
        }
        void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
        void *found = library ? dlsym(library, symbol) : NULL;
        if (found) {
            return found;
        }
        const char *why = dlerror();
        snprintf(message, n, "cannot load %s: %s", file, why ? why : "unknown reason");
        return NULL;
    }
    return NULL;
}

bool plugin_is_loaded(const char *file) {
    char path[PATH_MAX];
    for (size_t i = 0; i < N_FOLDERS; i++) {
        void *library = candidate(path, i, file) ? dlopen(path, RTLD_LAZY | RTLD_NOLOAD) : NULL;
        if (library) {
            dlclose(library);
            return true;
        }
    }
    return false;
}
