// SPDX-License-Identifier: Apache-2.0
// Curves for the eye: the sRGB curve, the neutral tone curve against its published properties, raw.
#include "render/display.h"
#include "tests/near.h"

static double srgb(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

static uint8_t shown(ViewKind view, double exposure, double v) {
    Display display;
    const double color[3] = {v, v, v};
    uint8_t bytes[3];
    display_init(&display, view, exposure);
    display_color(&display, color, bytes);
    assert_int_equal(bytes[0], bytes[1]);
    assert_int_equal(bytes[0], bytes[2]);
    return bytes[0];
}

static void display_follows_the_curves(void **state) {
    (void)state;
    for (int i = 0; i <= 1000; i++) {
        double v = i / 1000.0;
        assert_near(shown(VIEW_SRGB, 0, v), 255 * srgb(v), 0.5001);
        assert_near(shown(VIEW_RAW, 0, v), 255 * v, 0.5001);
        assert_near(shown(VIEW_SRGB, -1, 2 * v), 255 * srgb(v), 0.5001);
    }
    const double odd[] = {2, 1e300, INFINITY, -1, -INFINITY, NAN};
    for (int view = VIEW_SRGB; view <= VIEW_RAW; view++) {
        for (int i = 0; i < 6; i++) {
            uint8_t byte = shown((ViewKind)view, 0, odd[i]);
            assert_in_range(byte, i < 3 ? 250 : 0, i < 3 ? 255 : 0);
        }
    }
}

// Below 0.8 all but 0.04 stays, hue too; it rises throughout and never reaches beyond 1; it is
// continuous where it begins to compress.
static void display_neutral_is_neutral(void **state) {
    (void)state;
    double out[3], last = -1;
    for (int i = 0; i < 100; i++) {
        const double color[3] = {0.1 + 0.007 * i, 0.1 + 0.003 * i, 0.1};
        display_neutral(color, out);
        for (int c = 0; c < 3 && color[0] < 0.8; c++) {
            assert_near(out[c], color[c] - 0.04, 1e-15);
        }
    }
    for (int i = 0; i < 4000; i++) {
        double v = 0.0005 * i * (1 + i / 40);
        const double color[3] = {v, v, v};
        display_neutral(color, out);
        assert_true(out[0] >= last && out[0] <= 1);
        assert_true(out[0] >= 0);
        last = out[0];
    }
    assert_near(last, 1, 0.001);
    const double below[3] = {0.8 - 1e-9, 0.5, 0.2}, above[3] = {0.8 + 1e-9, 0.5, 0.2};
    double a[3], b[3];
    display_neutral(below, a);
    display_neutral(above, b);
    for (int c = 0; c < 3; c++) {
        assert_near(a[c], b[c], 1e-8);
    }
    // Very bright red goes to white.
    const double bright[3] = {1000, 1, 1};
    display_neutral(bright, out);
    assert_true(out[1] > 0.9 && out[0] > 0.99);
    // Worked by hand from the published text: peak 1.96 gives 1 - 0.24^2/1.44 = 0.96, of which
    // 1 - 1/(0.15 * 1.00 + 1) are mixed in.
    const double color[3] = {2, 1.04, 0.54};
    display_neutral(color, out);
    assert_near(out[0], 0.96, 1e-12);
    assert_near(out[1], 0.96 * (1 / 1.96) / 1.15 + 0.96 * (1 - 1 / 1.15), 1e-12);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(display_follows_the_curves),
    cmocka_unit_test(display_neutral_is_neutral),
};

SUITE(display, tests)
