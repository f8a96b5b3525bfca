// SPDX-License-Identifier: Apache-2.0
// Numbers in mesh files against strtod: bits, strictness, locale.
#include "render/mesh_text.h"
#include "tests/suite.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double parse(const char *s, bool *is_number) {
    MeshText text = {.at = s, .end = s + strlen(s), .line = 1};
    double value = 0;
    *is_number = mesh_text_number(&text, &value) && text.at == text.end;
    return value;
}

static void assert_like_strtod(const char *s) {
    bool is_number;
    double value = parse(s, &is_number), expected = strtod(s, NULL);
    if (!is_number || memcmp(&value, &expected, sizeof value) != 0) {
        fail_msg("%s gives %.17g, strtod %.17g", s, value, expected);
    }
}

static void numbers_round_to_nearest(void **state) {
    (void)state;
    static const char *const hard[] = {"0",
                                       "-0",
                                       "+1",
                                       "1.",
                                       ".5",
                                       "-.5e1",
                                       "1e22",
                                       "1e23",
                                       "9007199254740993",
                                       "1e-400",
                                       "1e400",
                                       "2.2250738585072011e-308",
                                       "4.9e-324",
                                       "2.4703282292062327e-324",
                                       "0e999",
                                       "123456789e-30",
                                       "179769313486231580793728971405301e276",
                                       "0.000000000000000000000000000000000001",
                                       "8.5899345920000001e9",
                                       "00000000000000000000000000001.5",
                                       "1.00000000000000000000000000001",
                                       "9999999999999999999999999999",
                                       "0.30000000000000004",
                                       "6.1e-5",
                                       "1E+5"};
    for (size_t i = 0; i < sizeof hard / sizeof hard[0]; i++) {
        assert_like_strtod(hard[i]);
    }
    uint64_t seed = 1;
    for (int i = 0; i < 20000; i++) {
        seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
        char s[64];
        double unit = (double)(seed >> 11) * 0x1p-53;
        snprintf(s, sizeof s, "%.*g", 1 + i % 19, (unit - 0.5) * pow(10, i % 60 - 30));
        assert_like_strtod(s);
    }
}

static void numbers_are_strict(void **state) {
    (void)state;
    static const char *const bad[] = {"",     "-",       ".",    "e5",    "1e",
                                      "1e+",  "1,5",     "0x10", "1.2.3", "1f",
                                      "nano", "infinit", "--1",  "1e5.0", "- 1"};
    bool is_number;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        parse(bad[i], &is_number);
        if (is_number) {
            fail_msg("%s is taken for a number", bad[i]);
        }
    }
    assert_true(isnan(parse("NaN", &is_number)) && is_number);
    assert_true(parse("-inf", &is_number) == -INFINITY && is_number);
    assert_true(parse("Infinity", &is_number) == INFINITY && is_number);
}

// Where a locale with a comma is installed, it must not matter.
static void numbers_do_not_know_the_locale(void **state) {
    (void)state;
    static const char *const locales[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "sv_SE.UTF-8", "C"};
    for (size_t i = 0; i < sizeof locales / sizeof locales[0]; i++) {
        if (setlocale(LC_NUMERIC, locales[i])) {
            bool is_number;
            double value = parse("1.2345678901234567890123", &is_number);
            setlocale(LC_NUMERIC, "C");
            assert_true(is_number && value == 1.2345678901234567890123);
        }
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(numbers_round_to_nearest),
    cmocka_unit_test(numbers_are_strict),
    cmocka_unit_test(numbers_do_not_know_the_locale),
};

SUITE(mesh_text, tests)
