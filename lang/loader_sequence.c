// SPDX-License-Identifier: Apache-2.0
// Sequences of files: "walk.%04d.ply" is every file whose name is that with a number.
#include "lang/loader_parts.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A pattern taken apart: folder/ prefix NUMBER suffix; numbers have at least `width` digits.
typedef struct {
    const char *folder, *prefix, *suffix;
    int width;
} Pattern;

static bool read_pattern(Arena *arena, const char *text, Pattern *pattern) {
    const char *slash = strrchr(text, '/'), *name = slash ? slash + 1 : text;
    const char *percent = strchr(name, '%'), *at = percent ? percent + 1 : NULL;
    if (!percent || strchr(at, '%') || memchr(text, '%', (size_t)(name - text))) {
        return false;
    }
    int width = 0;
    bool has_zero = *at == '0';
    for (at += has_zero; has_zero && *at >= '1' && *at <= '9' && width == 0; at++) {
        width = *at - '0';
    }
    if (*at != 'd' || (has_zero && width == 0)) {
        return false;
    }
    *pattern = (Pattern){arena_string(arena, text, (size_t)(name - text)),
                         arena_string(arena, name, (size_t)(percent - name)), at + 1, width};
    return true;
}

static const char *name_of(Arena *arena, const Pattern *pattern, long number) {
    return arena_printf(arena, "%s%s%0*ld%s", pattern->folder, pattern->prefix, pattern->width,
                        number, pattern->suffix);
}

// The number in a file's name; -1: it is not of the pattern.
static long number_of(Arena *arena, const Pattern *pattern, const char *name) {
    size_t n = strlen(pattern->prefix), digits;
    if (strncmp(name, pattern->prefix, n) != 0) {
        return -1;
    }
    digits = strspn(name + n, "0123456789");
    if (digits == 0 || digits > 9 || strcmp(name + n + digits, pattern->suffix) != 0) {
        return -1;
    }
    long number = strtol(name + n, NULL, 10);
    const char *same = name_of(arena, pattern, number) + strlen(pattern->folder);
    return strcmp(same, name) == 0 ? number : -1;
}

static int compare_numbers(const void *a, const void *b) {
    long x = *(const long *)a, y = *(const long *)b;
    return (x > y) - (x < y);
}

// The numbers there are in a folder, ascending.
static size_t list_folder(Eval *ev, const Pattern *pattern, const char *folder, long **numbers) {
    DIR *dir = opendir(folder);
    size_t n = 0, capacity = 0;
    struct dirent *entry;
    Arena scratch = {0};
    while (dir && (entry = readdir(dir))) {
        long number = number_of(&scratch, pattern, entry->d_name);
        if (number >= 0) {
            *numbers = arena_grow(ev->arena, *numbers, n, &capacity, sizeof **numbers);
            (*numbers)[n++] = number;
        }
    }
    if (dir) {
        closedir(dir);
    }
    arena_free(&scratch);
    if (n > 0) {
        qsort(*numbers, n, sizeof **numbers, compare_numbers);
    }
    return n;
}

// In the first folder that has any.
static size_t list_numbers(Eval *ev, const Given *given, const Pattern *pattern, long **numbers,
                           bool *is_refused) {
    size_t n = 0;
    for (size_t i = 0;; i++) {
        const char *folder = loader_folder(ev, &given->env, &given->value, i);
        if (!folder || n > 0 || *is_refused) {
            return n;
        }
        const char *path = *pattern->folder == '/'
                               ? pattern->folder
                               : arena_printf(ev->arena, "%s/%s", folder, pattern->folder);
        Listing listing =
            loader_may_list(ev, &given->env, given->node, &given->value, folder, path);
        *is_refused = listing == LISTING_REFUSED;
        n = listing == LISTING_ALLOWED ? list_folder(ev, pattern, path, numbers) : 0;
    }
}

const Value *loader_sequence(Eval *ev, const Given *given, uint32_t *n) {
    const char *text = symbol_text(ev->symbols, given->value.symbol);
    Pattern pattern;
    long *numbers = NULL;
    if (!read_pattern(ev->arena, text, &pattern)) {
        eval_error(ev, &given->env, given->node, "write \"walk.%04d.ply\"",
                   "'%s' holds no place for the number", text);
        return NULL;
    }
    bool is_refused = false;
    size_t found = list_numbers(ev, given, &pattern, &numbers, &is_refused);
    if (found == 0 && !is_refused) {
        eval_error(ev, &given->env, given->node,
                   "it is looked for beside this file, then in each folder given with -I",
                   "there is no file '%s' with any number", text);
        ev->has_failed_file = true;
    }
    if (found == 0) {
        return NULL;
    }
    Value *names = ARENA_ARRAY(ev->arena, found, Value);
    for (size_t i = 0; i < found; i++) {
        if (numbers[i] != numbers[0] + (long)i) {
            eval_error(ev, &given->env, given->node, NULL,
                       "the sequence has '%s' and '%s', but no '%s'",
                       name_of(ev->arena, &pattern, numbers[0]),
                       name_of(ev->arena, &pattern, numbers[found - 1]),
                       name_of(ev->arena, &pattern, numbers[0] + (long)i));
            ev->has_failed_file = true;
            return NULL;
        }
        const char *name = name_of(ev->arena, &pattern, numbers[i]);
        names[i] = given->value;
        names[i].symbol = symbol_of(ev->symbols, name, strlen(name));
    }
    *n = (uint32_t)found;
    return names;
}
