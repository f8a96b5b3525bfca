// SPDX-License-Identifier: Apache-2.0
// Accumulated motion blur against its closed form: an edge that moves over a picture leaves one
// step for each subframe.
#include "render/accumulate.h"
#include "tests/scenes.h"

#include <stdlib.h>
#include <unistd.h>

enum { WIDTH = 64, HEIGHT = 4 };

// The picture shows x from -32 to 32. A white square of half side 100 has its right edge at -26.5 +
// 40 u while the shutter is open, u from 0 to 1: it moves over 40 pixels.
static void make_edge(TestScene *test) {
    test_scene_init(test, WIDTH, HEIGHT);
    test_camera(test, CAMERA_ORTHOGRAPHIC, 2, 2 * atan(1)); // HEIGHT / 2 / 2 is 1
    test->scene.film.filter = FILTER_BOX;
    test->scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    uint32_t white = test_material(test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    test_moving_square(test, white, vec3(-126.5, 0, 0), vec3(40 * test->scene.film.fps, 0, 0), 100);
}

static Image render(TestScene *test, uint32_t spp, uint32_t subframes, const char *path,
                    RenderStats *stats) {
    static const int64_t first[] = {1};
    RenderOptions options = test_options(test, spp);
    options.frames = first;
    options.n_frames = 1;
    options.subframes = subframes;
    options.out = path;
    options.validate = true;
    *stats = (RenderStats){0};
    assert_int_equal(render_frames(&test->scene, &options, &test->reporter, stats), 0);
    Image image;
    char message[256];
    assert_true(image_read_exr(&test->arena, path, &image, message, sizeof message));
    return image;
}

static void make_path(char path[64]) {
    snprintf(path, 64, "/tmp/st4-accumulate-%ld.exr", (long)getpid());
}

// How many of n positions of the edge, in the middles of the shutter's parts, cover the pixel's
// whole width; *is_cut: one lies within.
static double covered(int x, uint32_t n, bool *is_cut) {
    double count = 0;
    *is_cut = false;
    for (uint32_t i = 0; i < n; i++) {
        double edge = -26.5 + 40 * (i + 0.5) / n + WIDTH / 2;
        count += edge >= x + 1;
        *is_cut |= edge > x && edge < x + 1;
    }
    return count / n;
}

static void accumulate_shows_n_steps(void **state) {
    (void)state;
    static const uint32_t counts[] = {1, 2, 5, 8};
    char path[64];
    make_path(path);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        const uint32_t n = counts[k];
        TestScene test;
        RenderStats stats;
        make_edge(&test);
        Image image = render(&test, 4 * n, n, path, &stats);
        const float *red = image_channel(&image, "R")->values;
        uint32_t n_steps = 0, n_checked = 0;
        double last = 1;
        for (int x = 0; x < WIDTH; x++) {
            bool is_cut;
            double expected = covered(x, n, &is_cut);
            for (int y = 0; y < HEIGHT && !is_cut; y++) {
                assert_true(fabs((double)red[y * WIDTH + x] - expected) <= 1e-6);
                n_checked++;
            }
            n_steps += !is_cut && expected != last;
            last = is_cut ? last : expected;
        }
        assert_int_equal(n_steps, n);
        assert_true(n_checked >= (WIDTH - n) * HEIGHT);
        assert_int_equal(stats.n_blocks, n);
        assert_int_equal(stats.camera_rays, WIDTH * HEIGHT * 4 * n);
        assert_int_equal(stats.time_samples, 0);
        test_scene_free(&test);
    }
    unlink(path);
}

// The ramp that n steps go towards is what samples in time draw: never more than half a step away.
static void accumulate_converges_to_the_blur(void **state) {
    (void)state;
    char path[64];
    make_path(path);
    TestScene test;
    RenderStats stats;
    make_edge(&test);
    Image image = render(&test, 40 * 16, 40, path, &stats);
    const float *steps = image_channel(&image, "R")->values;
    Image blur = render(&test, 4096, 0, path, &stats);
    const float *ramp = image_channel(&blur, "R")->values;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        assert_true(fabs((double)steps[i] - (double)ramp[i]) <= 0.5 / 40 + 0.003);
    }
    test_scene_free(&test);
    unlink(path);
}

// Where nothing moves there is nothing to add up: one world, the same samples.
static void accumulate_leaves_what_stands_still(void **state) {
    (void)state;
    char path[64];
    make_path(path);
    TestScene test;
    RenderStats stats;
    make_edge(&test);
    test.scene.n_shapes = 0;
    test_moving_square(&test, 0, vec3(-95.5, 0, 0), vec3(0, 0, 0), 100);
    Image plain = render(&test, 8, 0, path, &stats);
    Image added = render(&test, 8, 4, path, &stats);
    assert_int_equal(stats.n_blocks, 1);
    for (uint32_t c = 0; c < plain.n_channels; c++) {
        assert_memory_equal(plain.channels[c].values, added.channels[c].values,
                            WIDTH * HEIGHT * sizeof(float));
    }
    test_scene_free(&test);
    unlink(path);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(accumulate_shows_n_steps),
    cmocka_unit_test(accumulate_converges_to_the_blur),
    cmocka_unit_test(accumulate_leaves_what_stands_still),
};

SUITE(accumulate, tests)
