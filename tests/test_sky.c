// SPDX-License-Identifier: Apache-2.0
// Skies that are pictures: where their pixels are, their density, their light by quadrature.
#include "render/sky_image.h"
#include "tests/hand_scene.h"
#include "tests/near.h"
#include "tests/scenes.h"

static const double pi = 3.141592653589793;

enum { W = 16, H = 8 };

// A dim sky with a bright spot and one of colour.
static float *picture(Arena *arena, double spot) {
    float *rgb = ARENA_ARRAY(arena, 3 * W * H, float);
    uint64_t random = 5;
    for (int i = 0; i < W * H; i++) {
        for (int c = 0; c < 3; c++) {
            rgb[3 * i + c] = (float)(0.2 + 0.3 * hand_random(&random));
        }
    }
    for (int c = 0; c < 3; c++) {
        rgb[3 * (2 * W + 11) + c] = (float)spot;
    }
    rgb[3 * (3 * W + 4) + 2] = (float)spot / 4;
    return rgb;
}

// Where the direction with these coordinates is, by definition: u to the right, v down.
static Vec3 direction(double u, double v) {
    double around = 2 * pi * (u - 0.5), down = pi * v;
    return vec3(sin(down) * sin(around), cos(down), -sin(down) * cos(around));
}

// Linear between the middles of pixels, from the definition.
static double look_up(const float *rgb, double u, double v, int c) {
    double sum = 0;
    for (int y = 0; y < H; y++) {
        // Above the first row and below the last all is as they are.
        double down = fmin(fmax(v * H - 0.5, 0), H - 1), wy = fmax(1 - fabs(down - y), 0);
        for (int x = 0; x < W; x++) {
            double off = fabs(u * W - 0.5 - x), wx = fmax(1 - fmin(off, W - off), 0);
            sum += wx * wy * rgb[3 * (y * W + x) + c];
        }
    }
    return sum;
}

static void sky_image_is_looked_up(void **state) {
    (void)state;
    Arena arena = {0};
    float *rgb = picture(&arena, 50);
    SkyImage image = sky_image_from(&arena, rgb, W, H);
    uint64_t random = 1;
    for (int i = 0; i < 10000; i++) {
        double u = hand_random(&random), v = hand_random(&random), found[3];
        sky_image_radiance(&image, direction(u, v), found);
        for (int c = 0; c < 3; c++) {
            assert_near(found[c], look_up(rgb, u, v, c), 1e-6 * 50);
        }
    }
    // What is no radiance is none.
    rgb[0] = -1;
    rgb[1] = NAN;
    rgb[2] = INFINITY;
    sky_image_from(&arena, rgb, W, H);
    assert_true(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    arena_free(&arena);
}

static void sky_image_density_is_that_of_samples(void **state) {
    (void)state;
    Arena arena = {0};
    SkyImage image = sky_image_from(&arena, picture(&arena, 50), W, H);
    assert_non_null(image.rows);
    enum { STEPS = 400 };
    double sum = 0;
    for (int i = 0; i < STEPS * 2 * STEPS; i++) {
        double u = (i % (2 * STEPS) + 0.5) / (2 * STEPS), v = (i / (2 * STEPS) + 0.5) / STEPS;
        double solid = 2 * pi * pi * sin(pi * v) / (2 * STEPS * STEPS);
        sum += sky_image_density(&image, direction(u, v)) * solid;
    }
    assert_near(sum, 1, 0.001);
    uint64_t random = 3;
    for (int i = 0; i < 10000; i++) {
        double density;
        Vec3 dir = sky_image_sample(&image, hand_random(&random), hand_random(&random), &density);
        assert_near(vec3_length(dir), 1, 1e-12);
        assert_true(density > 0);
        assert_near(sky_image_density(&image, dir) / density, 1, 1e-6);
    }
    arena_free(&arena);
}

static Program *numbers(Arena *arena, const double *values, uint32_t n) {
    Code c = {.n = 0};
    uint32_t out[8];
    for (uint32_t i = 0; i < n; i++) {
        out[i] = code_number(&c, values[i]);
    }
    return code_done(&c, arena, out, n);
}

static void sky_of(TestScene *test, const SkyImage *image, double power, double turned) {
    test->lights[test->scene.n_lights++] =
        (Light){.kind = LIGHT_SKY,
                .program = numbers(&test->arena, (double[]){1, 1, 1, power, turned}, 5),
                .image = image};
}

// A square that faces +z: the sum over directions in front of it, in fine steps, for two turns of
// the picture.
static void sky_image_lights_a_square(void **state) {
    (void)state;
    static const double turns[] = {0, 2.2};
    for (int i = 0; i < 2; i++) {
        TestScene test;
        test_scene_init(&test, 8, 8);
        test_camera(&test, CAMERA_ORTHOGRAPHIC, 10, 2 * atan(0.4));
        float *rgb = picture(&test.arena, 500);
        SkyImage image = sky_image_from(&test.arena, rgb, W, H);
        sky_of(&test, &image, 2, turns[i]);
        uint32_t grey = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
        test_moving_square(&test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 9);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 256, &stats);
        enum { STEPS = 800 };
        for (int c = 0; c < 3; c++) {
            double expected = 0, mean = 0;
            for (int k = 0; k < STEPS * STEPS; k++) {
                double u = (k % STEPS + 0.5) / STEPS, v = (k / STEPS + 0.5) / STEPS;
                Vec3 d = direction(u, v);
                // Turned around y, counter-clockwise from above.
                double z = d.z * cos(turns[i]) - d.x * sin(turns[i]);
                double solid = 2 * pi * pi * sin(pi * v) / (STEPS * STEPS);
                expected += 2 * look_up(rgb, u, v, c) * fmax(z, 0) * solid * 0.5 / pi;
            }
            for (int k = 0; k < 64; k++) {
                mean += test_channel(film, k % 8, k / 8, c) / 64;
            }
            assert_near(mean, expected, 0.01 * expected);
        }
        assert_int_equal(stats.light_samples, 256 * 64);
        test_scene_free(&test);
    }
}

// In a sky of one colour all that is white is as bright, to the last bit of a float; a picture of
// one colour is such a sky, and is not sampled.
static void sky_image_furnace(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        TestScene test;
        test_scene_init(&test, 8, 8);
        test_camera(&test, CAMERA_ORTHOGRAPHIC, 10, 2 * atan(0.4));
        test.scene.render.bounces = 4;
        float *rgb = ARENA_ARRAY(&test.arena, 3 * W * H, float);
        for (int k = 0; k < 3 * W * H; k++) {
            rgb[k] = 0.7f;
        }
        SkyImage image = sky_image_from(&test.arena, rgb, W, H);
        assert_null(image.rows);
        if (i) {
            sky_of(&test, &image, 1, 0.3);
        } else {
            test_light(&test, LIGHT_SKY, (double[]){0.7f, 0.7f, 0.7f, 1}, 4);
        }
        uint32_t white = test_material(&test, MATERIAL_MATTE, (double[]){1, 1, 1}, 3);
        test_moving_sphere(&test, white, vec3(0, 0, 0), vec3(0, 0, 0), 3);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 64, &stats);
        for (int k = 0; k < 64; k++) {
            assert_near(test_channel(film, k % 8, k / 8, 1), 0.7, 1e-6);
        }
        assert_int_equal(stats.light_samples + stats.shadow_rays, 0);
        test_scene_free(&test);
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(sky_image_is_looked_up),
    cmocka_unit_test(sky_image_density_is_that_of_samples),
    cmocka_unit_test(sky_image_lights_a_square),
    cmocka_unit_test(sky_image_furnace),
};

SUITE(sky, tests)
