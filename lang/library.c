// SPDX-License-Identifier: Apache-2.0
// Finds the standard library from where the program lies, so that nothing is configured.
#include "lang/library.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const places[] = {"../../stdlib", "../share/st4/stdlib"};

const char *library_folder(Arena *arena) {
    char program[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program);
    if (length <= 0 || length >= PATH_MAX) {
        return NULL;
    }
    program[length] = '\0';
    *(strrchr(program, '/') + 1) = '\0'; // the link names an absolute path
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        char *real = realpath(arena_printf(arena, "%s%s", program, places[i]), NULL);
        if (real) {
            const char *folder = arena_string(arena, real, strlen(real));
            free(real);
            return folder;
        }
    }
    return NULL;
}
