// SPDX-License-Identifier: Apache-2.0
// Arrays and strings in arenas, whatever gives the memory: the fuzzer has an arena of its own.
#include "accel/arena.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

void *arena_array(Arena *arena, size_t n, size_t size) {
    bool is_too_much = size && n > SIZE_MAX / size;
    return arena_alloc(arena, is_too_much ? SIZE_MAX : n * size);
}

char *arena_string(Arena *arena, const char *s, size_t n) {
    char *copy = arena_alloc(arena, n + 1);
    memcpy(copy, s, n);
    return copy;
}

char *arena_printf(Arena *arena, const char *format, ...) {
    va_list args;
    va_start(args, format);
    int n = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *s = arena_alloc(arena, (size_t)(n < 0 ? 0 : n) + 1);
    va_start(args, format);
    vsnprintf(s, (size_t)(n < 0 ? 0 : n) + 1, format, args);
    va_end(args);
    return s;
}

void *arena_grow(Arena *arena, void *array, size_t n, size_t *capacity, size_t size) {
    if (n < *capacity) {
        return array;
    }
    size_t larger = *capacity ? *capacity * 2 : 8;
    void *copy = arena_array(arena, larger, size);
    if (n) {
        memcpy(copy, array, n * size);
    }
    *capacity = larger;
    return copy;
}
