// SPDX-License-Identifier: Apache-2.0
// Arenas for fuzzing, in place of accel/arena.c: the same promises, but each allocation stands
// between poisoned bytes, so that the address sanitizer sees what goes beyond it, or comes back to
// an arena that was freed. Memory is used again, the longest free first, so that executions cost no
// system calls.
#include "tests/fuzz/fuzz_arena.h"

#include <sanitizer/asan_interface.h>
#include <sanitizer/lsan_interface.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "accel/arena.h"

struct ArenaChunk {
    ArenaChunk *next;     // of its arena, or of the free ones
    ArenaChunk *previous; // of all that are in use
    ArenaChunk *following;
    size_t size, used;
};

enum { CHUNK = 64 << 10, GAP = 16, HEADER = 64, FREE_MIN = 8 };

static ArenaExhausted *exhausted;
static ArenaChunk *in_use, *free_first, *free_last;
static size_t n_free;

void arena_on_exhausted(ArenaExhausted *hook) {
    exhausted = hook;
}

void arena_fail_after(unsigned long n) {
    (void)n;
}

static void refuse(size_t wanted, size_t limit) {
    if (exhausted) {
        exhausted(wanted, limit);
    }
    abort();
}

// One that was given back; NULL: too few are free for one to have rested.
static ArenaChunk *take_free(void) {
    if (n_free < FREE_MIN) {
        return NULL;
    }
    ArenaChunk *chunk = free_first;
    ASAN_UNPOISON_MEMORY_REGION(chunk, sizeof *chunk); // all else stays poisoned
    free_first = chunk->next;
    n_free--;
    return chunk;
}

static ArenaChunk *new_chunk(size_t size) {
    ArenaChunk *chunk = size == CHUNK ? take_free() : NULL;
    if (!chunk) {
        chunk = aligned_alloc(HEADER, size);
        if (!chunk) {
            refuse(size, 0);
        }
        __lsan_ignore_object(chunk); // the list of free ones lies in poisoned memory
        ASAN_POISON_MEMORY_REGION(chunk + 1, size - sizeof *chunk);
    }
    *chunk = (ArenaChunk){.size = size, .used = HEADER, .following = in_use};
    if (in_use) {
        in_use->previous = chunk;
    }
    in_use = chunk;
    return chunk;
}

static void give_back(ArenaChunk *chunk) {
    *(chunk->previous ? &chunk->previous->following : &in_use) = chunk->following;
    if (chunk->following) {
        chunk->following->previous = chunk->previous;
    }
    if (chunk->size != CHUNK) {
        ASAN_UNPOISON_MEMORY_REGION(chunk, chunk->size);
        free(chunk);
        return;
    }
    chunk->next = NULL;
    if (n_free) {
        ASAN_UNPOISON_MEMORY_REGION(free_last, sizeof *free_last);
        free_last->next = chunk;
        ASAN_POISON_MEMORY_REGION(free_last, sizeof *free_last);
    } else {
        free_first = chunk;
    }
    free_last = chunk;
    n_free++;
    ASAN_POISON_MEMORY_REGION(chunk, chunk->used);
}

void *arena_alloc(Arena *arena, size_t size) {
    size_t align = size >= 64 ? 64 : 16;
    if (size > SIZE_MAX / 4) {
        refuse(size, arena->limit);
    }
    ArenaChunk *chunk = arena->chunk;
    size_t at = chunk ? (chunk->used + align - 1) & ~(align - 1) : 0;
    if (!chunk || at + size + GAP > chunk->size) {
        size_t needed = (HEADER + size + GAP + 63) & ~(size_t)63;
        size_t larger = needed > CHUNK ? needed : CHUNK;
        if (arena->limit && arena->reserved + larger > arena->limit) {
            refuse(size, arena->limit);
        }
        chunk = new_chunk(larger);
        chunk->next = arena->chunk;
        arena->chunk = chunk;
        arena->reserved += larger;
        at = HEADER;
    }
    char *memory = (char *)chunk + at;
    ASAN_UNPOISON_MEMORY_REGION(memory, size);
    memset(memory, 0, size);
    chunk->used = at + size + GAP;
    arena->used += size;
    return memory;
}

void arena_free(Arena *arena) {
    for (ArenaChunk *chunk = arena->chunk, *next; chunk; chunk = next) {
        next = chunk->next;
        give_back(chunk);
    }
    size_t limit = arena->limit;
    *arena = (Arena){.limit = limit};
}

size_t fuzz_arena_reclaim(void) {
    size_t n = 0;
    for (; in_use; n++) {
        give_back(in_use);
    }
    return n;
}
