// SPDX-License-Identifier: Apache-2.0
// The language's functions and colours: closed forms, statistics, the spectrum of black bodies.
#include "lang/functions.h"
#include "lang/color.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

static double value(Dag *dag, Ref ref) {
    double x;
    assert_true(dag_is_const(dag, ref, &x));
    return x;
}

static void values3(Dag *dag, Ref3 v, double out[3]) {
    out[0] = value(dag, v.x);
    out[1] = value(dag, v.y);
    out[2] = value(dag, v.z);
}

static void functions_interpolate(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
#define C(x) dag_const(dag, x)
    assert_true(value(dag, functions_clamp(dag, C(5), C(-1), C(2))) == 2);
    assert_true(value(dag, functions_clamp(dag, C(-5), C(-1), C(2))) == -1);
    assert_true(value(dag, functions_mix(dag, C(0.1), C(0.7), C(0))) == 0.1);
    assert_true(value(dag, functions_mix(dag, C(0.1), C(0.7), C(1))) == 0.7);
    assert_near(value(dag, functions_mix(dag, C(2), C(4), C(0.25))), 2.5, 0);
    assert_true(value(dag, functions_step(dag, C(1), C(1))) == 1);
    assert_true(value(dag, functions_step(dag, C(1), C(0.999))) == 0);
    assert_near(value(dag, functions_smoothstep(dag, C(-1.3), C(1.3), C(0))), 0.5, 1e-16);
    assert_true(value(dag, functions_smoothstep(dag, C(2), C(4), C(1))) == 0);
    assert_true(value(dag, functions_smoothstep(dag, C(2), C(4), C(9))) == 1);
    assert_near(value(dag, functions_smoothstep(dag, C(2), C(4), C(2.5))), 0.15625, 1e-16);
    assert_near(value(dag, functions_smoothstep(dag, C(4), C(2), C(2.5))), 0.84375, 1e-16);
    assert_true(value(dag, functions_smoothstep(dag, C(2), C(2), C(3))) == 1);
    assert_true(value(dag, functions_smoothstep(dag, C(2), C(2), C(2))) == 0);
    arena_free(&arena);
}

enum { N = 20000 };

static void functions_are_random(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    double sum = 0, square = 0, next = 0, before = 0, normal[4] = {0}, mean[3] = {0}, zz = 0;
    int count[16] = {0};
    for (int i = 0; i < N; i++) {
        Ref k[2] = {C(1), C(i)};
        double x = value(dag, functions_rand(dag, k, 2)),
               g = value(dag, functions_randn(dag, k, 2));
        double v[3];
        assert_true(x >= 0 && x < 1);
        sum += x;
        square += x * x;
        next += x * before;
        before = x;
        count[(int)(x * 16)]++;
        for (int p = 0; p < 4; p++) {
            normal[p] += pow(g, p + 1);
        }
        values3(dag, functions_randdir(dag, k, 2), v);
        assert_near(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 1, 1e-15);
        mean[0] += v[0];
        mean[1] += v[1];
        mean[2] += v[2];
        zz += v[2] * v[2];
    }
    // Bounds are five standard deviations.
    assert_near(sum / N, 0.5, 5 * sqrt(1.0 / 12 / N));
    assert_near(square / N, 1.0 / 3, 5 * sqrt(4.0 / 45 / N));
    assert_near(next / N, 0.25, 5 * sqrt(7.0 / 144 / N));
    for (int i = 0; i < 16; i++) {
        assert_near(count[i], N / 16.0, 5 * sqrt(N / 16.0));
    }
    assert_near(normal[0] / N, 0, 5 * sqrt(1.0 / N));
    assert_near(normal[1] / N, 1, 5 * sqrt(2.0 / N));
    assert_near(normal[2] / N, 0, 5 * sqrt(15.0 / N));
    assert_near(normal[3] / N, 3, 5 * sqrt(96.0 / N));
    for (int k = 0; k < 3; k++) {
        assert_near(mean[k] / N, 0, 5 * sqrt(1.0 / 3 / N));
    }
    assert_near(zz / N, 1.0 / 3, 5 * sqrt(4.0 / 45 / N));
    // Other arguments, another number; the same ones, the same.
    Ref k[3] = {C(1), C(0), C(0)}, swapped[2] = {C(0), C(1)};
    assert_int_not_equal(functions_rand(dag, k, 1), functions_rand(dag, k, 2));
    assert_int_not_equal(functions_rand(dag, k, 2), functions_rand(dag, k, 3));
    assert_int_not_equal(functions_rand(dag, k, 2), functions_rand(dag, swapped, 2));
    assert_int_equal(functions_rand(dag, k, 2), functions_rand(dag, k, 2));
    arena_free(&arena);
}

static void functions_make_patterns(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    double least = 0, most = 0;
    for (int i = 0; i < 2000; i++) {
        Ref3 p = spatial_const(dag, 0.137 * i, 0.071 * i + 3, -0.093 * i);
        double x = value(dag, functions_fbm(dag, p, 5, 2, 0.5));
        double first = value(dag, functions_fbm(dag, p, 1, 2, 0.5));
        assert_true(first == value(dag, functions_noise(dag, p)));
        least = fmin(least, x);
        most = fmax(most, x);
    }
    assert_true(least < -0.5 && least > -2 && most > 0.5 && most < 2);
    Ref size = C(0.5);
    for (int i = -5; i < 5; i++) {
        Ref3 p = spatial_const(dag, 0.5 * i + 0.25, 0.1, 0.1);
        assert_true(value(dag, functions_checker(dag, p, size)) == (i & 1));
        // On a plane of the lattice, give or take a rounding error.
        Ref3 above = spatial_const(dag, 0.5 * i + 0.25, 0.1, -1.5 + 1e-12);
        Ref3 below = spatial_const(dag, 0.5 * i + 0.25, 0.1, -1.5 - 1e-12);
        assert_int_equal(functions_checker(dag, above, size), functions_checker(dag, below, size));
    }
    arena_free(&arena);
}

// --- Colours ---

static void color_parses(void **state) {
    (void)state;
    double rgb[3], other[3];
    assert_true(color_parse("#c83", rgb));
    assert_true(color_parse("cC8833", other));
    assert_memory_equal(rgb, other, sizeof rgb);
    assert_near(rgb[0], 204.0 / 255, 0);
    assert_near(rgb[1], 136.0 / 255, 0);
    assert_near(rgb[2], 51.0 / 255, 0);
    static const char *const wrong[] = {"", "#", "#c8", "#c83f", "#c8g", "cc88331", "#-12", "red"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_false(color_parse(wrong[i], rgb));
    }
}

static double decode(double x) {
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

static void color_is_linear(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    for (int i = 0; i <= 300; i++) {
        double x = i / 255.0;
        assert_near(value(dag, color_linear(dag, C(x))), decode(x), 1e-15);
        assert_near(value(dag, color_linear(dag, C(-x))), -decode(x), 1e-15);
    }
    arena_free(&arena);
}

// The hexcone by its definition: six ramps.
static void hsv_by_sectors(double h, double s, double v, double rgb[3]) {
    h = (h - floor(h)) * 6;
    int sector = (int)h;
    double f = h - sector, p = v * (1 - s), q = v * (1 - s * f), r = v * (1 - s * (1 - f));
    const double all[6][3] = {{v, r, p}, {q, v, p}, {p, v, r}, {p, q, v}, {r, p, v}, {v, p, q}};
    for (int k = 0; k < 3; k++) {
        rgb[k] = decode(all[sector % 6][k]);
    }
}

static void color_has_hues(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    for (int i = -40; i < 80; i++) {
        double h = i / 24.0 + 0.01, s = (i & 3) / 3.0, v = 0.3 + 0.2 * (i & 1), got[3], expected[3];
        values3(dag, color_hsv(dag, C(h), C(s), C(v)), got);
        hsv_by_sectors(h, s, v, expected);
        for (int k = 0; k < 3; k++) {
            assert_near(got[k], expected[k], 1e-14);
        }
    }
    arena_free(&arena);
}

// Black bodies by integrating Planck's law over the CIE 1931 matching functions, in the analytic
// form of Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching
// Functions", JCGT 2(2), 2013 (about 1 % of the peak).
static double lobe(double x, double mean, double below, double above) {
    double d = (x - mean) / (x < mean ? below : above);
    return exp(-0.5 * d * d);
}

static void chromaticity_of_black_body(double kelvin, double *x, double *y) {
    double sum[3] = {0};
    for (double l = 360; l <= 830; l += 1) {
        double power = 1 / (pow(l, 5) * (exp(1.438776877e7 / (l * kelvin)) - 1));
        sum[0] += power * (1.056 * lobe(l, 599.8, 37.9, 31.0) + 0.362 * lobe(l, 442.0, 16.0, 26.7) -
                           0.065 * lobe(l, 501.1, 20.4, 26.2));
        sum[1] += power * (0.821 * lobe(l, 568.8, 46.9, 40.5) + 0.286 * lobe(l, 530.9, 16.3, 31.1));
        sum[2] += power * (1.217 * lobe(l, 437.0, 11.8, 36.0) + 0.681 * lobe(l, 459.0, 26.0, 13.8));
    }
    *x = sum[0] / (sum[0] + sum[1] + sum[2]);
    *y = sum[1] / (sum[0] + sum[1] + sum[2]);
}

static void chromaticity_of_rgb(const double rgb[3], double *x, double *y) {
    double X = 0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2];
    double Y = 0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2];
    double Z = 0.0193339 * rgb[0] + 0.1191920 * rgb[1] + 0.9503041 * rgb[2];
    *x = X / (X + Y + Z);
    *y = Y / (X + Y + Z);
}

static void color_of_black_bodies(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    // CIE 15: the Planckian locus; 2855.5 K is illuminant A.
    static const double locus[][3] = {{2000, 0.52669, 0.41331}, {2855.5, 0.44758, 0.40745},
                                      {4000, 0.38045, 0.37675}, {5000, 0.34510, 0.35162},
                                      {6500, 0.31352, 0.32363}, {10000, 0.28063, 0.28828}};
    for (size_t i = 0; i < sizeof locus / sizeof *locus; i++) {
        double rgb[3], x, y;
        values3(dag, color_kelvin(dag, C(locus[i][0])), rgb);
        assert_near(fmax(rgb[0], fmax(rgb[1], rgb[2])), 1, 0);
        chromaticity_of_rgb(rgb, &x, &y);
        assert_near(x, locus[i][1], 0.001);
        assert_near(y, locus[i][2], 0.001);
    }
    for (double kelvin = 2000; kelvin < 25000; kelvin *= 1.02) {
        double rgb[3], x, y, expected_x, expected_y;
        values3(dag, color_kelvin(dag, C(kelvin)), rgb);
        assert_true(rgb[0] >= 0 && rgb[1] > 0 && rgb[2] >= 0);
        chromaticity_of_rgb(rgb, &x, &y);
        chromaticity_of_black_body(kelvin, &expected_x, &expected_y);
        assert_near(x, expected_x, 0.006);
        assert_near(y, expected_y, 0.006);
    }
    assert_int_equal(color_kelvin(dag, C(100)).y, color_kelvin(dag, C(1667)).y);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(functions_interpolate),   cmocka_unit_test(functions_are_random),
    cmocka_unit_test(functions_make_patterns), cmocka_unit_test(color_parses),
    cmocka_unit_test(color_is_linear),         cmocka_unit_test(color_has_hues),
    cmocka_unit_test(color_of_black_bodies),
};

SUITE(functions, tests)
