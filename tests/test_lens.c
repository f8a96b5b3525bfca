// SPDX-License-Identifier: Apache-2.0
// Depth of field against the thin lens: the circle of confusion of a small thing that glows, the
// shape of the aperture, a focus that moves; a pinhole draws no samples for it.
#include "render/tiles.h"
#include "tests/near.h"
#include "tests/scenes.h"

// A picture of 65 by 65 pixels, 100 of them to the slope 1; the camera is 10 m from the origin.
enum { SIZE = 65 };
static const double AWAY = 10, PER_SLOPE = 100;

static void test_perspective(TestScene *test) {
    test_scene_init(test, SIZE, SIZE);
    test_camera(test, CAMERA_PERSPECTIVE, AWAY, 2 * atan(0.5 * SIZE / PER_SLOPE));
    test->scene.film.transparent = true;
    test->scene.film.filter = FILTER_BOX;
}

// A ball that glows, on the line of sight.
static void add_ball(TestScene *test, double depth, double radius) {
    uint32_t glow = test_material(test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    test_moving_sphere(test, glow, vec3(0, 0, AWAY - depth), vec3(0, 0, 0), radius);
}

typedef struct {
    double sum, variance, reach; // of coverage, around the middle; reach: of what has any, pixels
} Spot;

static Spot measure(const Film *film) {
    Spot spot = {0};
    for (int i = 0; i < SIZE * SIZE; i++) {
        double x = i % SIZE - SIZE / 2, y = i / SIZE - SIZE / 2, alpha = test_pixel(film, i, 3);
        spot.sum += alpha;
        spot.variance += alpha * (x * x + y * y) / 2;
        spot.reach = fmax(spot.reach, alpha > 0 ? hypot(x, y) : 0);
    }
    spot.variance /= spot.sum;
    return spot;
}

// A point at the depth z spreads evenly over a disc of the diameter A |z - f| / z at the depth f.
// The variance of a disc along an axis is a sixteenth of its diameter's square; a ball's own and
// the pixel's add to it.
static double spot_variance(double diameter, double ball) {
    return diameter * diameter / 16 + ball * ball / 4 + 1.0 / 12;
}

static void lens_blurs_as_a_thin_lens(void **state) {
    (void)state;
    static const struct {
        CameraKind kind;
        double aperture, focus, depth;
    } cases[] = {
        {CAMERA_PERSPECTIVE, 1, 5, 10},  {CAMERA_PERSPECTIVE, 2, 5, 8},
        {CAMERA_PERSPECTIVE, 1, 8, 5},   {CAMERA_PERSPECTIVE, 1.2, 1e9, 5},
        {CAMERA_ORTHOGRAPHIC, 1, 5, 14},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TestScene test;
        test_perspective(&test);
        test.scene.camera.kind = cases[i].kind;
        test_lens(&test, (double[]){cases[i].aperture, cases[i].focus, 0, 0}, (double[4]){0}, 0);
        // Pixels per metre at the ball.
        double depth = cases[i].kind == CAMERA_ORTHOGRAPHIC ? AWAY : cases[i].depth;
        double scale = PER_SLOPE / depth, ball = 1.5;
        add_ball(&test, cases[i].depth, ball / scale);
        RenderStats stats = {0};
        Spot spot = measure(test_film(&test, 1024, &stats));
        double away = fabs(cases[i].depth - cases[i].focus);
        double diameter = cases[i].aperture * away / cases[i].focus * scale;
        double measured = 4 * sqrt(spot.variance - spot_variance(0, ball));
        print_message("diameter %.3f pixels, %.3f measured\n", diameter, measured);
        assert_near(measured, diameter, 0.015 * diameter);
        assert_near(spot.sum, 3.141592653589793 * ball * ball, 0.02 * spot.sum);
        assert_near(spot.reach, diameter / 2 + ball, 1);
        assert_int_equal(stats.lens_samples, 1024 * SIZE * SIZE);
        assert_int_equal(stats.time_samples, 0);
        test_scene_free(&test);
    }
}

// The spherical camera's lens faces where it looks: the spot is as large to the side as ahead.
static void lens_of_a_spherical_camera(void **state) {
    (void)state;
    enum { WIDTH = 400, HEIGHT = 200 };
    const double aperture = 1.6, focus = 5, depth = 10, ball = 1.5;
    const double scale = WIDTH / 6.283185307179586 / depth;
    for (int side = 0; side < 2; side++) {
        TestScene test;
        test_scene_init(&test, WIDTH, HEIGHT);
        test_camera(&test, CAMERA_SPHERICAL, AWAY, 1);
        test.scene.film.transparent = true;
        test.scene.film.filter = FILTER_BOX;
        test_lens(&test, (double[]){aperture, focus, 0, 0}, (double[4]){0}, 0);
        uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
        Vec3 at = side ? vec3(depth, 0, AWAY) : vec3(0, 0, AWAY - depth);
        test_moving_sphere(&test, glow, at, vec3(0, 0, 0), ball / scale);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 256, &stats);
        double sum = 0, variance = 0, middle = side ? 0.75 * WIDTH : 0.5 * WIDTH;
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            double x = i % WIDTH + 0.5 - middle, y = i / WIDTH + 0.5 - HEIGHT / 2;
            sum += test_pixel(film, i, 3);
            variance += test_pixel(film, i, 3) * (x * x + y * y) / 2;
        }
        variance /= sum;
        double diameter = aperture * fabs(depth - focus) / focus * scale;
        double measured = 4 * sqrt(variance - spot_variance(0, ball));
        print_message("diameter %.3f pixels, %.3f measured\n", diameter, measured);
        assert_near(measured, diameter, 0.03 * diameter);
        assert_int_equal(stats.lens_samples, 256 * WIDTH * HEIGHT);
        test_scene_free(&test);
    }
}

// What is in focus is as sharp as a pinhole's.
static void lens_is_sharp_in_focus(void **state) {
    (void)state;
    double variance[2];
    for (int i = 0; i < 2; i++) {
        TestScene test;
        test_perspective(&test);
        test_lens(&test, (double[]){i ? 0.5 : 0, AWAY, 0, 0}, (double[4]){0}, 0);
        add_ball(&test, AWAY, 1);
        RenderStats stats = {0};
        variance[i] = measure(test_film(&test, 256, &stats)).variance;
        assert_int_equal(stats.lens_samples, i ? 256 * SIZE * SIZE : 0);
        test_scene_free(&test);
    }
    assert_near(variance[1], variance[0], 0.01 * variance[0]);
}

// How far a point of the plane is outside of the regular polygon in the circle of radius r with a
// corner at the top (y down); negative inside.
static double outside(uint32_t blades, double r, double x, double y) {
    double most = -INFINITY, half = 3.141592653589793 / blades;
    for (uint32_t k = 0; k < blades; k++) {
        double angle = (2 * k + 1) * half; // of the normal of a side
        most = fmax(most, x * sin(angle) - y * cos(angle) - r * cos(half));
    }
    return most;
}

// Behind what is in focus spots stand as the aperture does, before it upside down.
static void lens_has_blades(void **state) {
    (void)state;
    static const uint32_t blades[] = {3, 5, 8};
    for (int i = 0; i < 6; i++) {
        TestScene test;
        test_perspective(&test);
        bool is_behind = i % 2;
        double depth = 10, focus = is_behind ? 5 : 20, aperture = is_behind ? 2.5 : 5;
        test_lens(&test, (double[]){aperture, focus, 0, 0}, (double[4]){0}, blades[i / 2]);
        add_ball(&test, depth, 0.1);
        double r = aperture / 2 * fabs(depth - focus) / focus * PER_SLOPE / depth;
        RenderStats stats = {0};
        const Film *film = test_film(&test, 1024, &stats);
        int n_inside = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            double x = k % SIZE - SIZE / 2, y = k / SIZE - SIZE / 2;
            double beyond = outside(blades[i / 2], r, x, is_behind ? y : -y);
            double alpha = test_pixel(film, k, 3);
            assert_true(beyond < 1 + 1.5 || alpha == 0);
            assert_true(beyond > -(1 + 1.5) || alpha > 0);
            n_inside += alpha > 0;
        }
        double area = 0.5 * blades[i / 2] * r * r * sin(6.283185307179586 / blades[i / 2]);
        print_message("%u blades: %.0f square pixels, %d pixels lit\n", blades[i / 2], area,
                      n_inside);
        test_scene_free(&test);
    }
}

// The focus goes from 5 m to 20 m past the ball while the shutter is open, each ray with its own:
// the spot's variance is the mean of those on the way.
static void lens_focuses_at_the_rays_time(void **state) {
    (void)state;
    TestScene test;
    test_perspective(&test);
    test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    const double depth = 10, aperture = 1;
    test_lens(&test, (double[]){aperture, 5, 0, 0}, (double[]){0, 15 * 24, 0, 0}, 0);
    const double ball = 3;
    add_ball(&test, depth, ball / (PER_SLOPE / depth));
    RenderStats stats = {0};
    Spot spot = measure(test_film(&test, 1024, &stats));
    double expected = 0;
    enum { STEPS = 1000 };
    for (int i = 0; i < STEPS; i++) {
        double focus = 5 + 15 * (i + 0.5) / STEPS;
        double diameter = aperture * (depth - focus) / focus * PER_SLOPE / depth;
        expected += spot_variance(diameter, ball) / STEPS;
    }
    print_message("variance %.4f, %.4f measured\n", expected, spot.variance);
    assert_near(spot.variance, expected, 0.02 * expected);
    assert_int_equal(stats.lens_samples, 1024 * SIZE * SIZE);
    assert_int_equal(stats.time_samples, 1024 * SIZE * SIZE);
    test_scene_free(&test);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(lens_blurs_as_a_thin_lens),     cmocka_unit_test(lens_of_a_spherical_camera),
    cmocka_unit_test(lens_is_sharp_in_focus),        cmocka_unit_test(lens_has_blades),
    cmocka_unit_test(lens_focuses_at_the_rays_time),
};

SUITE(lens, tests)
