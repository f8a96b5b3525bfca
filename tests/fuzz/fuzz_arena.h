// SPDX-License-Identifier: Apache-2.0
// What the fuzzer's arenas (fuzz_arena.c) can do besides those of accel/arena.h.
#ifndef TESTS_FUZZ_FUZZ_ARENA_H
#define TESTS_FUZZ_FUZZ_ARENA_H

#include <stddef.h>

// Frees what all arenas hold, in blocks of which it returns how many there were: none, unless an
// arena was forgotten.
size_t fuzz_arena_reclaim(void);

#endif
