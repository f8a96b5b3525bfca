// SPDX-License-Identifier: Apache-2.0
// Comparison of doubles within a bound; a NaN is never near anything.
#ifndef TESTS_NEAR_H
#define TESTS_NEAR_H

#include <math.h>

#include "tests/suite.h"

#define assert_near(value, expected, bound)                                                        \
    assert_near_at((value), (expected), (bound), __FILE__, __LINE__)

static inline void assert_near_at(double value, double expected, double bound, const char *file,
                                  int line) {
    if (!(fabs(value - expected) <= bound)) {
        print_error("%.17g is not within %g of %.17g\n", value, bound, expected);
        _assert_true(0, "value is near", file, line);
    }
}

#endif
