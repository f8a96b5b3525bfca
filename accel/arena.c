// SPDX-License-Identifier: Apache-2.0
// Arenas: chunked bump allocation.
#include "accel/arena.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct ArenaChunk {
    ArenaChunk *next;
    size_t size, used;
};

// Chunks grow with the arena from the first size to the last, so that a small arena stays small
// and a large one makes few system calls.
enum { CHUNK_FIRST = 16 << 10, CHUNK_LAST = 4 << 20, HEADER = 64 };

static void exhausted_default(size_t wanted, size_t limit) {
    fprintf(stderr, "error: out of memory: %zu bytes wanted", wanted);
    if (limit) {
        fprintf(stderr, ", limit %zu", limit);
    }
    fputc('\n', stderr);
    exit(3);
}

static ArenaExhausted *exhausted = exhausted_default;
static unsigned long fail_after;

void arena_on_exhausted(ArenaExhausted *hook) {
    exhausted = hook ? hook : exhausted_default;
}

void arena_fail_after(unsigned long n) {
    fail_after = n;
}

static void *system_alloc(size_t size) {
    if (fail_after && --fail_after == 0) {
        return NULL;
    }
    // calloc gives fresh pages without touching them; alignment of 64 is made by hand, since
    // aligned_alloc would have to clear the memory.
    return calloc(1, size);
}

static void add_chunk(Arena *arena, size_t size) {
    size_t chunk = arena->reserved < CHUNK_FIRST ? CHUNK_FIRST : arena->reserved;
    chunk = chunk > CHUNK_LAST ? CHUNK_LAST : chunk;
    if (size + 2 * HEADER > chunk) {
        chunk = size + 2 * HEADER;
    }
    if (arena->limit && arena->reserved + chunk > arena->limit) {
        exhausted(size, arena->limit);
        abort();
    }
    ArenaChunk *c = system_alloc(chunk);
    if (!c) {
        exhausted(size, 0);
        abort();
    }
    c->size = chunk;
    c->used = sizeof *c;
    c->next = arena->chunk;
    arena->chunk = c;
    arena->reserved += chunk;
}

static void *take(ArenaChunk *c, size_t size, size_t align) {
    uintptr_t base = (uintptr_t)c;
    uintptr_t at = (base + c->used + align - 1) & ~(uintptr_t)(align - 1);
    if (at - base + size > c->size) {
        return NULL;
    }
    c->used = at - base + size;
    return (void *)at;
}

void *arena_alloc(Arena *arena, size_t size) {
    size_t align = size >= 64 ? 64 : 16;
    if (size > SIZE_MAX / 2) {
        exhausted(size, arena->limit);
        abort();
    }
    void *p = arena->chunk ? take(arena->chunk, size, align) : NULL;
    if (!p) {
        add_chunk(arena, size);
        p = take(arena->chunk, size, align);
    }
    arena->used += size;
    return p;
}

void arena_free(Arena *arena) {
    for (ArenaChunk *c = arena->chunk, *next; c; c = next) {
        next = c->next;
        free(c);
    }
    size_t limit = arena->limit;
    *arena = (Arena){.limit = limit};
}
