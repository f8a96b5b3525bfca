// SPDX-License-Identifier: Apache-2.0
// How a test file becomes part of the one test program: it defines suite_NAME() with SUITE, and
// tests/suites.def names it.
#ifndef TESTS_SUITE_H
#define TESTS_SUITE_H

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
// clang-format on

#define SUITE(name) void suite_##name(void);
#include "tests/suites.def"
#undef SUITE

// Runs the group and adds to the totals that the program ends with.
void suite_run(const char *name, const struct CMUnitTest *tests, size_t n);

#define SUITE(name, tests)                                                                         \
    void suite_##name(void) {                                                                      \
        suite_run(#name, (tests), sizeof(tests) / sizeof(tests)[0]);                               \
    }

#endif
