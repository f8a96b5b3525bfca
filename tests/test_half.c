// SPDX-License-Identifier: Apache-2.0
// 16-bit floating point against the standard's formula, in double.
#include "render/half.h"
#include "tests/suite.h"

#include <math.h>

// An oracle of its own: the value of a half by the formula of the standard, in double.
static double half_value(unsigned h) {
    double sign = h & 0x8000 ? -1 : 1;
    int exponent = h >> 10 & 31, mantissa = h & 1023;
    if (exponent == 31) {
        return mantissa ? NAN : sign * INFINITY;
    }
    return sign * (exponent ? ldexp(1024 + mantissa, exponent - 25) : ldexp(mantissa, -24));
}

static void half_round_trips(void **state) {
    (void)state;
    for (unsigned h = 0; h < 65536; h++) {
        float v = half_to_float((uint16_t)h);
        double expected = half_value(h);
        assert_true(isnan(expected) ? isnan(v) : (double)v == expected);
        assert_int_equal(half_from_float(v), h);
    }
}

// Every half's neighbourhood: just below, at and just above the middle to the next one.
static void half_rounds_to_nearest_even(void **state) {
    (void)state;
    for (unsigned h = 0; h < 0x7bff; h++) {
        float middle = (float)((half_value(h) + half_value(h + 1)) / 2);
        assert_int_equal(half_from_float(nextafterf(middle, 0)), h);
        assert_int_equal(half_from_float(middle), h + (h & 1));
        assert_int_equal(half_from_float(nextafterf(middle, INFINITY)), h + 1);
        assert_int_equal(half_from_float(-middle), 0x8000 | (h + (h & 1)));
    }
    assert_int_equal(half_from_float(65519.99f), 0x7bff);
    assert_int_equal(half_from_float(65520.0f), 0x7c00);
    assert_int_equal(half_from_float(1e-30f), 0);
    assert_int_equal(half_from_float(-0.0f), 0x8000);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(half_round_trips),
    cmocka_unit_test(half_rounds_to_nearest_even),
};

SUITE(half, tests)
