// SPDX-License-Identifier: Apache-2.0
// Arenas: alignment, zeroing, limits, failure.
#include "accel/arena.h"
#include "tests/suite.h"

#include <stdlib.h>
#include <string.h>

static void arena_aligns_and_zeroes(void **state) {
    (void)state;
    Arena arena = {0};
    for (size_t size = 0; size < 5000; size = size * 3 + 1) {
        unsigned char *p = arena_alloc(&arena, size);
        assert_int_equal((uintptr_t)p % (size >= 64 ? 64 : 16), 0);
        for (size_t i = 0; i < size; i++) {
            assert_int_equal(p[i], 0);
        }
        memset(p, 0xff, size);
    }
    arena_free(&arena);
    assert_int_equal(arena.reserved, 0);
}

static void arena_grows_arrays(void **state) {
    (void)state;
    Arena arena = {0};
    int *array = NULL;
    size_t capacity = 0;
    for (int i = 0; i < 1000; i++) {
        array = arena_grow(&arena, array, (size_t)i, &capacity, sizeof *array);
        array[i] = i;
    }
    for (int i = 0; i < 1000; i++) {
        assert_int_equal(array[i], i);
    }
    arena_free(&arena);
}

static jmp_buf caught;
static size_t caught_limit;

static void catch_exhausted(size_t wanted, size_t limit) {
    (void)wanted;
    caught_limit = limit;
    longjmp(caught, 1);
}

static void arena_reports_exhaustion(void **state) {
    (void)state;
    Arena arena = {.limit = 100000};
    arena_on_exhausted(catch_exhausted);
    if (setjmp(caught) == 0) {
        arena_alloc(&arena, 200000);
        fail();
    }
    assert_int_equal(caught_limit, 100000);
    if (setjmp(caught) == 0) {
        arena_array(&arena, SIZE_MAX / 2, 3);
        fail();
    }
    arena_fail_after(1);
    if (setjmp(caught) == 0) {
        arena_alloc(&arena, 10);
        fail();
    }
    assert_int_equal(caught_limit, 0);
    arena_on_exhausted(NULL);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(arena_aligns_and_zeroes),
    cmocka_unit_test(arena_grows_arrays),
    cmocka_unit_test(arena_reports_exhaustion),
};

SUITE(arena, tests)
