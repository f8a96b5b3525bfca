// SPDX-License-Identifier: Apache-2.0
// The numbers of a comparison against values worked out by hand, and what is refused.
#include "render/compare.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

static float a_values[3][4], b_values[3][4];
static ImageChannel a_channels[] = {
    {"B", a_values[2], false}, {"G", a_values[1], false}, {"R", a_values[0], false}};
static ImageChannel b_channels[] = {
    {"R", b_values[0], false}, {"G", b_values[1], false}, {"B", b_values[2], false}};
static Image a, b;

static int set_up(void **state) {
    (void)state;
    a = (Image){2, 2, 3, .channels = a_channels};
    b = (Image){2, 2, 3, .channels = b_channels};
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 4; i++) {
            a_values[c][i] = b_values[c][i] = 0.5f;
        }
    }
    return 0;
}

static void assert_near(double value, double expected) {
    if (!(fabs(value - expected) <= 1e-12 * fabs(expected))) {
        fail_msg("%.17g, expected %.17g", value, expected);
    }
}

static void compare_finds_no_difference(void **state) {
    (void)state;
    Comparison r;
    char message[256];
    assert_true(compare_images(&a, &b, NULL, &r, message, sizeof message));
    assert_int_equal(r.n_values, 12);
    assert_int_equal(r.n_different, 0);
    assert_true(r.mse == 0 && r.rmse == 0 && r.relative_mse == 0 && r.relative_rmse == 0);
    assert_true(r.psnr == INFINITY && r.maximum == 0);
    assert_null(r.maximum_channel);
}

// One of twelve values is off by 0.25, another by -0.125; the mean of b stays 0.5.
static void compare_measures(void **state) {
    (void)state;
    Comparison r;
    char message[256];
    a_values[1][2] = 0.75f;
    a_values[0][1] = 0.375f;
    assert_true(compare_images(&a, &b, NULL, &r, message, sizeof message));
    double mse = (0.0625 + 0.015625) / 12;
    assert_near(r.mse, mse);
    assert_near(r.rmse, sqrt(mse));
    assert_near(r.relative_mse, mse / (0.25 + 0.01 * 0.25));
    assert_near(r.relative_rmse, sqrt(mse) / 0.5);
    assert_near(r.psnr, 10 * log10(1 / mse));
    assert_near(r.mean_a, 0.5 + 0.125 / 12);
    assert_near(r.mean_b, 0.5);
    assert_int_equal(r.n_different, 2);
    assert_true(r.maximum == 0.25);
    assert_int_equal(r.maximum_x, 0);
    assert_int_equal(r.maximum_y, 1);
    assert_string_equal(r.maximum_channel, "G");
}

static void compare_takes_one_channel(void **state) {
    (void)state;
    Comparison r;
    char message[256];
    a_values[1][2] = 1.5f;
    assert_true(compare_images(&a, &b, "R", &r, message, sizeof message));
    assert_int_equal(r.n_values, 4);
    assert_true(r.mse == 0);
    assert_true(compare_images(&a, &b, "G", &r, message, sizeof message));
    assert_near(r.mse, 0.25);
}

static void compare_counts_what_is_not_finite(void **state) {
    (void)state;
    Comparison r;
    char message[256];
    a_values[0][0] = NAN;
    a_values[0][1] = INFINITY;
    b_values[0][1] = INFINITY;
    b_values[2][3] = -INFINITY;
    a_values[1][0] = 1.5f;
    assert_true(compare_images(&a, &b, NULL, &r, message, sizeof message));
    assert_int_equal(r.n_values, 9);
    assert_int_equal(r.n_not_finite_a, 2);
    assert_int_equal(r.n_not_finite_b, 2);
    assert_near(r.mse, 1.0 / 9);
}

static void compare_survives_black(void **state) {
    (void)state;
    Comparison r;
    char message[256];
    memset(b_values, 0, sizeof b_values);
    memset(a_values, 0, sizeof a_values);
    assert_true(compare_images(&a, &b, NULL, &r, message, sizeof message));
    assert_true(r.relative_mse == 0 && r.relative_rmse == 0);
    a_values[0][0] = 1;
    assert_true(compare_images(&a, &b, NULL, &r, message, sizeof message));
    assert_true(r.relative_mse == INFINITY && r.relative_rmse == INFINITY);
    assert_near(r.mse, 1.0 / 12);
}

static void assert_refused(const char *channel, const char *expected) {
    Comparison r;
    char message[256];
    assert_false(compare_images(&a, &b, channel, &r, message, sizeof message));
    assert_string_equal(message, expected);
}

static void compare_refuses(void **state) {
    (void)state;
    assert_refused("Z", "the first image has no channel Z; it has B, G, R");
    b.n_channels = 2;
    assert_refused(NULL, "the second image has no channel B; it has R, G");
    b.n_channels = 3;
    b.width = 4;
    b.height = 1;
    assert_refused(NULL, "the sizes differ: 2x2 pixels and 4x1");
    b.width = b.height = 2;
    for (int i = 0; i < 4; i++) {
        a_values[0][i] = NAN;
    }
    assert_refused("R", "no value is finite in both images");
}

// Noise of +-1/4 in every value and 1/8 too much, in half of all values, of which the means are
// known: the bias comes out although it is less than the noise, and nothing where there is none.
static void compare_splits_errors(void **state) {
    (void)state;
    enum { N = 96, RENDERINGS = 5 };
    static float values[RENDERINGS][3][N * N];
    static ImageChannel channels[RENDERINGS][3];
    Image images[RENDERINGS];
    uint32_t random = 1;
    for (int i = 0; i < RENDERINGS; i++) {
        for (int c = 0; c < 3; c++) {
            channels[i][c] = (ImageChannel){b_channels[c].name, values[i][c], false};
            for (int k = 0; k < N * N; k++) {
                random = random * 1664525u + 1013904223u;
                values[i][c][k] = random >> 31 ? 0.75f : 0.25f;
            }
        }
        images[i] = (Image){N, N, 3, .channels = channels[i]};
    }
    ErrorParts parts;
    char message[256];
    for (int is_biased = 0; is_biased < 2; is_biased++) {
        for (int i = 0; i < 3 && is_biased; i++) {
            for (int k = 0; k < 3 * N * N; k += 2) {
                values[i][k / (N * N)][k % (N * N)] += 0.125f;
            }
        }
        assert_true(compare_parts(images, 3, images + 3, 2, NULL, &parts, message, sizeof message));
        double bias = is_biased ? 0.125 * 0.125 / 2 : 0;
        assert_true(fabs(parts.bias_square - bias) <= 4 * parts.bias_error);
        assert_true(parts.bias_error > 0 && parts.bias_error <= 0.0015);
        assert_true(fabs(parts.noise - 0.25) <= 0.003);
        assert_true(fabs(parts.noise_of_ref - 0.25 / sqrt(2)) <= 0.003);
        assert_true(fabs(parts.mean - 0.5) <= 0.005);
    }
    assert_true(compare_parts(images, 3, images + 3, 1, NULL, &parts, message, sizeof message));
    assert_true(isnan(parts.noise_of_ref));
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test_setup(compare_finds_no_difference, set_up),
    cmocka_unit_test_setup(compare_measures, set_up),
    cmocka_unit_test_setup(compare_takes_one_channel, set_up),
    cmocka_unit_test_setup(compare_counts_what_is_not_finite, set_up),
    cmocka_unit_test_setup(compare_survives_black, set_up),
    cmocka_unit_test_setup(compare_refuses, set_up),
    cmocka_unit_test(compare_splits_errors),
};

SUITE(compare, tests)
