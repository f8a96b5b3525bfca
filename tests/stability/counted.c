// SPDX-License-Identifier: Apache-2.0
// The counting allocator.
#include "tests/stability/counted.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *p, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void __real_free(void *p);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *p, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void __wrap_free(void *p);

// Blocks by address: open addressing, none is ever moved.
enum { BLOCKS = 1 << 18 };
static struct {
    uintptr_t at; // 0: never used; 1: freed
    size_t size;
} blocks[BLOCKS];
static bool is_counting;
static size_t live, peak, n_blocks;

static size_t slot_of(uintptr_t at) {
    return (size_t)(at * 0x9e3779b97f4a7c15u >> 20) % BLOCKS;
}

static void add(void *p, size_t size) {
#pragma omp critical(counted)
    if (is_counting && p) {
        size_t i = slot_of((uintptr_t)p);
        while (blocks[i].at > 1) {
            i = (i + 1) % BLOCKS;
        }
        n_blocks += blocks[i].at == 0;
        if (n_blocks > BLOCKS / 2) {
            fprintf(stderr, "the counting allocator's table is full\n");
            abort();
        }
        blocks[i].at = (uintptr_t)p;
        blocks[i].size = size;
        live += size;
        peak = live > peak ? live : peak;
    }
}

// The size that the block had; 0: it is not one of those that are counted.
static size_t take(void *p) {
    size_t size = 0;
#pragma omp critical(counted)
    if (is_counting && p) {
        size_t i = slot_of((uintptr_t)p);
        while (blocks[i].at != 0 && blocks[i].at != (uintptr_t)p) {
            i = (i + 1) % BLOCKS;
        }
        if (blocks[i].at == (uintptr_t)p) {
            size = blocks[i].size;
            blocks[i].at = 1;
            live -= size;
        }
    }
    return size;
}

void *__wrap_malloc(size_t size) {
    void *p = __real_malloc(size);
    add(p, size);
    return p;
}

void *__wrap_calloc(size_t n, size_t size) {
    void *p = __real_calloc(n, size);
    add(p, n * size);
    return p;
}

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    void *p = __real_aligned_alloc(alignment, size);
    add(p, size);
    return p;
}

void *__wrap_realloc(void *p, size_t size) {
    size_t old = take(p);
    void *q = __real_realloc(p, size);
    if (q || size == 0) {
        add(q, size);
#pragma omp critical(counted)
        if (size > old && live + old > peak) { // the system may have had both for a while
            peak = live + old;
        }
    } else {
        add(p, old);
    }
    return q;
}

void __wrap_free(void *p) {
    take(p);
    __real_free(p);
}

void counted_begin(void) {
#pragma omp critical(counted)
    {
        memset(blocks, 0, sizeof blocks);
        live = peak = n_blocks = 0;
        is_counting = true;
    }
}

Counted counted_end(void) {
    Counted c;
#pragma omp critical(counted)
    {
        c = (Counted){peak, live};
        is_counting = false;
    }
    return c;
}
