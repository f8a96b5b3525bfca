// SPDX-License-Identifier: Apache-2.0
// Textures against the pixels of their own files: at the middle of each, between them, over many.
#include "render/texture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/image.h"
#include "tests/near.h"
#include "tests/suite.h"

enum { W = 32, H = 16, PIXELS = W * H }; // halves of them have whole pixels

static float red[PIXELS], green[PIXELS], blue[PIXELS], alpha[PIXELS];

typedef struct {
    Arena arena;
    char folder[64], path[128], message[512];
} Fixture;

static void fixture_init(Fixture *f, const char *ending, bool has_alpha) {
    *f = (Fixture){.folder = "/tmp/st4-texture.XXXXXX"};
    assert_non_null(mkdtemp(f->folder));
    snprintf(f->path, sizeof f->path, "%s/a.%s", f->folder, ending);
    for (int i = 0; i < PIXELS; i++) {
        // Bytes on the sRGB curve, so that what is written is what is read.
        double c[3];
        for (int k = 0; k < 3; k++) {
            double x = (i * (7 + 4 * k) % 256) / 255.0;
            c[k] = x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
        }
        alpha[i] = (float)((1 + i % 255) / 255.0);
        float premultiplied = has_alpha ? alpha[i] : 1;
        red[i] = (float)c[0] * premultiplied;
        green[i] = (float)c[1] * premultiplied;
        blue[i] = (float)c[2] * premultiplied;
    }
    ImageChannel channels[] = {
        {"R", red, false}, {"G", green, false}, {"B", blue, false}, {"A", alpha, false}};
    Image image = {.width = W, .height = H, .n_channels = has_alpha ? 4 : 3, .channels = channels};
    if (!image_write(f->path, &image, &(FilmSettings){.transparent = has_alpha}, f->message,
                     sizeof f->message)) {
        fail_msg("%s", f->message);
    }
}

static void fixture_free(Fixture *f) {
    unlink(f->path);
    rmdir(f->folder);
    arena_free(&f->arena);
}

static const ProgramImage *open_texture(Fixture *f, bool is_raw) {
    const ProgramImage *image =
        texture_open(&f->arena, f->path, is_raw, f->message, sizeof f->message);
    if (!image) {
        fail_msg("%s", f->message);
    }
    return image;
}

static void at_pixel(const ProgramImage *image, double x, double y, float rgba[4]) {
    const double st[2] = {x / W, 1 - y / H}, none[2] = {0, 0};
    image->look_up(image, st, none, none, rgba);
}

// The middle of each pixel gives the pixel, of linear light; v grows upwards; beyond the edges it
// is the same again.
static void textures_hold_their_pixels(void **state) {
    (void)state;
    Fixture f;
    fixture_init(&f, "png", false);
    const ProgramImage *image = open_texture(&f, false);
    for (int i = 0; i < PIXELS; i++) {
        float rgba[4], again[4];
        at_pixel(image, i % W + 0.5, i / W + 0.5, rgba);
        at_pixel(image, i % W + 0.5 + 3 * W, i / W + 0.5 - 2 * H, again);
        assert_near(rgba[0], red[i], 1e-3 * red[i] + 1e-4);
        assert_near(rgba[1], green[i], 1e-3 * green[i] + 1e-4);
        assert_near(rgba[2], blue[i], 1e-3 * blue[i] + 1e-4);
        assert_near(rgba[3], 1, 0);
        assert_near(again[1], rgba[1], 2e-3);
    }
    fixture_free(&f);
}

// Raw: the bytes themselves, as 0..1.
static void raw_textures_hold_numbers(void **state) {
    (void)state;
    Fixture f;
    fixture_init(&f, "png", false);
    const ProgramImage *image = open_texture(&f, true);
    for (int i = 0; i < PIXELS; i++) {
        float rgba[4];
        at_pixel(image, i % W + 0.5, i / W + 0.5, rgba);
        assert_near(rgba[0], (i * 7 % 256) / 255.0, 6e-4);
    }
    fixture_free(&f);
}

// Opacity, and colors that are not multiplied by it, of a format that keeps them apart and of one
// that multiplies.
static void textures_hold_opacity(void **state) {
    (void)state;
    static const char *const endings[] = {"png", "exr"};
    for (int k = 0; k < 2; k++) {
        Fixture f;
        fixture_init(&f, endings[k], true);
        const ProgramImage *image = open_texture(&f, false);
        for (int i = 0; i < PIXELS; i++) {
            float rgba[4];
            at_pixel(image, i % W + 0.5, i / W + 0.5, rgba);
            assert_near(rgba[3], alpha[i], 1e-3);
            if (alpha[i] > 0.2) {
                assert_near(rgba[1], green[i] / alpha[i], 0.003);
            }
        }
        fixture_free(&f);
    }
}

// Halfway between two pixels: their mean, of light. Over the whole picture: the mean of all.
static void textures_filter_light(void **state) {
    (void)state;
    Fixture f;
    fixture_init(&f, "png", false);
    const ProgramImage *image = open_texture(&f, false);
    double mean = 0;
    for (int i = 0; i + 1 < W; i++) {
        float rgba[4];
        at_pixel(image, i + 1, 4.5, rgba);
        assert_near(rgba[0], 0.5 * (red[4 * W + i] + red[4 * W + i + 1]), 2e-3);
    }
    for (int i = 0; i < PIXELS; i++) {
        mean += green[i] / PIXELS;
    }
    float rgba[4];
    const double st[2] = {0.3, 0.6}, dx[2] = {1, 0}, dy[2] = {0, 1};
    image->look_up(image, st, dx, dy, rgba);
    assert_near(rgba[1], mean, 0.015);
    fixture_free(&f);
}

static void textures_say_what_is_wrong(void **state) {
    (void)state;
    Fixture f;
    fixture_init(&f, "png", false);
    assert_int_equal(truncate(f.path, 100), 0);
    assert_null(texture_open(&f.arena, f.path, false, f.message, sizeof f.message));
    assert_true(strlen(f.message) > 5);
    fixture_free(&f);
    assert_null(texture_open(&f.arena, "/nowhere/a.png", false, f.message, sizeof f.message));
    assert_true(strlen(f.message) > 5);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(textures_hold_their_pixels), cmocka_unit_test(raw_textures_hold_numbers),
    cmocka_unit_test(textures_hold_opacity),      cmocka_unit_test(textures_filter_light),
    cmocka_unit_test(textures_say_what_is_wrong),
};

SUITE(texture, tests)
