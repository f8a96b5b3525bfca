// SPDX-License-Identifier: Apache-2.0
// The unit tests' program: st4-tests [PATTERN], where PATTERN filters tests by name ("kd4_*").
#include "tests/suite.h"

#include <fnmatch.h>
#include <stdio.h>

static size_t n_passed, n_failed;
static const char *pattern = "*";

void suite_run(const char *name, const struct CMUnitTest *tests, size_t n_tests) {
    size_t n = 0; // of those that the pattern names
    for (size_t i = 0; i < n_tests; i++) {
        n += fnmatch(pattern, tests[i].name, 0) == 0;
    }
    if (n == 0) {
        return;
    }
    int failed = _cmocka_run_group_tests(name, tests, n_tests, NULL, NULL);
    n_failed += failed < 0 ? n : (size_t)failed;
    n_passed += failed < 0 ? 0 : n - (size_t)failed;
}

int main(int argc, char **argv) {
    if (argc > 1) {
        pattern = argv[1];
        cmocka_set_test_filter(pattern);
    }
#undef SUITE
#define SUITE(name) suite_##name();
#include "tests/suites.def"
    printf("%zu passed, %zu failed\n", n_passed, n_failed);
    return n_failed != 0;
}
