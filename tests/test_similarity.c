// SPDX-License-Identifier: Apache-2.0
// SSIM and FLIP against values from elsewhere, on ten pairs of pictures.
#include "render/flip.h"
#include "render/ssim.h"
#include "tests/suite.h"

#include <math.h>

enum { N_PAIRS = 10, MOST_WIDTH = 24 + 5 * 9, MOST_HEIGHT = 20 + 3 * 9 };

// ssim: scikit-image 0.19.3, structural_similarity(a, b, data_range=1, gaussian_weights=True,
// sigma=1.5, use_sample_covariance=False) of channel R, and the mean over the channels.
// flip: the formulas of both papers (reference a, test b, 67.02 pixels per degree) in NumPy and
// SciPy, in double precision, with two-dimensional kernels, as in the authors' Python of 2021; hdr
// of 40 times the cubes.
static const struct {
    double ssim_red, ssim, flip, hdr;
} expected[N_PAIRS] = {
    {0.982083307845, 0.981982727704, 0.217126301, 0.339098587},
    {0.991521143962, 0.992825255462, 0.030365034, 0.063834300},
    {-0.845740389389, -0.837110750998, 0.628584079, 0.823290787},
    {0.443607874652, 0.472282415703, 0.279879544, 0.388131796},
    {0.977004516093, 0.982789372750, 0.090065354, 0.135968744},
    {0.982092214792, 0.982010716597, 0.219669619, 0.352418297},
    {0.988392437191, 0.989431620918, 0.027655566, 0.060399431},
    {-0.807550848609, -0.807924229638, 0.670784435, 0.864509413},
    {0.468247261491, 0.545151957319, 0.278344339, 0.414195218},
    {0.979219545998, 0.979581682441, 0.093089012, 0.148778409},
};

typedef struct {
    float a[3][MOST_WIDTH * MOST_HEIGHT], b[3][MOST_WIDTH * MOST_HEIGHT];
    uint32_t width, height;
} Pair;

// A checkerboard of slopes and steps, in 256ths.
static int value_at(int k, int c, int x, int y) {
    int slope = (x * (7 + k) + y * (13 + 2 * c) + x * y % 17 * 3) % 256;
    int steps = (x / 4 + y / 3 + c) % 5 * 40 + (x * x + 3 * y) % 11 * 4;
    return (x / 8 + y / 8) % 2 == 0 ? slope : steps;
}

static int within_byte(int v) {
    return v < 0 ? 0 : v > 255 ? 255 : v;
}

// Darker, noisy, negative, moved by a pixel, or in few steps.
static int changed(int k, int c, int x, int y, int width) {
    int v = value_at(k, c, x, y);
    switch (k % 5) {
    case 0:
        return v * 7 / 8;
    case 1:
        return within_byte(v + (x * 29 + y * 31 + c * 17) % 23 - 11);
    case 2:
        return 255 - v;
    case 3:
        return value_at(k, c, (x + width - 1) % width, y);
    default:
        return v / 32 * 32 + 16;
    }
}

static void make_pair(int k, Pair *pair) {
    int width = 24 + 5 * k, height = 20 + 3 * k;
    pair->width = (uint32_t)width;
    pair->height = (uint32_t)height;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < width * height; i++) {
            int x = i % width, y = i / width;
            pair->a[c][i] = (float)value_at(k, c, x, y) / 256;
            pair->b[c][i] = (float)changed(k, c, x, y, width) / 256;
        }
    }
}

static void assert_within(double value, double wanted, double tolerance) {
    if (!(fabs(value - wanted) <= tolerance)) {
        fail_msg("%.12f, expected %.12f within %g", value, wanted, tolerance);
    }
}

static Pair pair;

static void ssim_agrees_with_scikit_image(void **state) {
    (void)state;
    for (int k = 0; k < N_PAIRS; k++) {
        make_pair(k, &pair);
        double sum = 0;
        for (int c = 0; c < 3; c++) {
            double one = ssim_mean(pair.a[c], pair.b[c], pair.width, pair.height, 1);
            sum += one;
            if (c == 0) {
                assert_within(one, expected[k].ssim_red, 1e-6);
            }
        }
        assert_within(sum / 3, expected[k].ssim, 1e-6);
        assert_within(ssim_mean(pair.a[0], pair.a[0], pair.width, pair.height, 1), 1, 1e-12);
    }
}

static FlipImage image_of(float planes[3][MOST_WIDTH * MOST_HEIGHT]) {
    return (FlipImage){{planes[0], planes[1], planes[2]}, pair.width, pair.height};
}

// Features count by the root of their difference, so that the floats' last bits come to 1e-4 where
// both pictures have the same edges, as a picture and its negative do.
static void flip_agrees_with_the_papers(void **state) {
    (void)state;
    for (int k = 0; k < N_PAIRS; k++) {
        make_pair(k, &pair);
        FlipImage a = image_of(pair.a), b = image_of(pair.b);
        assert_within(flip_ldr(&b, &a, FLIP_PIXELS_PER_DEGREE, NULL), expected[k].flip, 5e-5);
        assert_within(flip_ldr(&a, &a, FLIP_PIXELS_PER_DEGREE, NULL), 0, 0);
    }
}

static void hdr_flip_agrees_with_the_paper(void **state) {
    (void)state;
    for (int k = 0; k < N_PAIRS; k++) {
        make_pair(k, &pair);
        for (int c = 0; c < 3; c++) {
            for (uint32_t i = 0; i < pair.width * pair.height; i++) {
                pair.a[c][i] = 40 * pair.a[c][i] * pair.a[c][i] * pair.a[c][i];
                pair.b[c][i] = 40 * pair.b[c][i] * pair.b[c][i] * pair.b[c][i];
            }
        }
        FlipImage a = image_of(pair.a), b = image_of(pair.b);
        assert_within(flip_hdr(&b, &a, FLIP_PIXELS_PER_DEGREE, NULL), expected[k].hdr, 5e-5);
    }
}

// The paper's scale: pure green and pure blue are as different as colors can be (section 4.1).
static void flip_of_green_and_blue_is_1(void **state) {
    (void)state;
    float map[16 * 16];
    pair = (Pair){.width = 16, .height = 16};
    for (int i = 0; i < 16 * 16; i++) {
        pair.a[1][i] = pair.b[2][i] = 1;
    }
    FlipImage a = image_of(pair.a), b = image_of(pair.b);
    assert_within(flip_ldr(&b, &a, FLIP_PIXELS_PER_DEGREE, map), 1, 1e-6);
    assert_within((double)map[16 * 8 + 8], 1, 1e-6);
}

// A black reference has no exposures; what is brighter than all numbers stays within.
static void flip_survives_extremes(void **state) {
    (void)state;
    pair = (Pair){.width = 12, .height = 12};
    FlipImage a = image_of(pair.a), b = image_of(pair.b);
    assert_within(flip_hdr(&b, &a, FLIP_PIXELS_PER_DEGREE, NULL), 0, 0);
    pair.b[0][77] = 3e38f;
    pair.b[1][5] = -1;
    double error = flip_hdr(&b, &a, FLIP_PIXELS_PER_DEGREE, NULL);
    assert_true(error > 0 && error <= 1);
    error = flip_hdr(&a, &b, 1e9, NULL);
    assert_true(error > 0 && error <= 1);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(ssim_agrees_with_scikit_image),  cmocka_unit_test(flip_agrees_with_the_papers),
    cmocka_unit_test(hdr_flip_agrees_with_the_paper), cmocka_unit_test(flip_of_green_and_blue_is_1),
    cmocka_unit_test(flip_survives_extremes),
};

SUITE(similarity, tests)
