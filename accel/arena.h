// SPDX-License-Identifier: Apache-2.0
// Arenas: memory by lifetime. Whatever is allocated from an arena lives until the arena is freed.
//
// Allocation never returns NULL. When the system has no more memory, or an arena passes its limit,
// the hook set by arena_on_exhausted() is called; it must not return (the command reports the
// bound and exits with status 3; output files are written under temporary names, so nothing is
// left half-written). Not thread-safe: one arena belongs to one thread at a time.
#ifndef ACCEL_ARENA_H
#define ACCEL_ARENA_H

#include <stddef.h>

typedef struct ArenaChunk ArenaChunk;

typedef struct {
    ArenaChunk *chunk; // newest first
    size_t used;       // bytes handed out, padding included
    size_t reserved;   // bytes taken from the system
    size_t limit;      // 0: none
} Arena;

// A zeroed Arena is an empty arena without a limit.
void arena_free(Arena *arena);

// Zeroed memory, aligned to 64 bytes from 64 bytes up, to 16 below. size 0 gives a valid pointer.
void *arena_alloc(Arena *arena, size_t size);

// n * size bytes; an overflow of the product counts as exhausted.
void *arena_array(Arena *arena, size_t n, size_t size);

// Copies n bytes and appends a NUL.
char *arena_string(Arena *arena, const char *s, size_t n);
char *arena_printf(Arena *arena, const char *format, ...) __attribute__((format(printf, 2, 3)));

#define ARENA_NEW(arena, T)      ((T *)arena_alloc((arena), sizeof(T)))
#define ARENA_ARRAY(arena, n, T) ((T *)arena_array((arena), (n), sizeof(T)))

// Grows an array that lives in an arena: when n == *capacity, a larger copy is made (the old one
// stays until the arena is freed, so the waste is at most the final size). Returns the array.
void *arena_grow(Arena *arena, void *array, size_t n, size_t *capacity, size_t size);

// Process-wide. wanted: the size that could not be had; limit: the arena's limit, 0 for the
// system's.
typedef void ArenaExhausted(size_t wanted, size_t limit);
void arena_on_exhausted(ArenaExhausted *hook);

// For tests: the n-th system allocation from now on fails (0: never).
void arena_fail_after(unsigned long n);

#endif
