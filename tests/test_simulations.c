// SPDX-License-Identifier: Apache-2.0
// Simulations as pictures show them: the corner of a bounce, against the closed form of the path;
// and how quickly the errors of a step fall with its length.
#include "render/sim_runge.h"
#include "tests/scenes.h"
#include "tests/script_scene.h"

// Pictures are orthographic: one pixel per unit, the origin in the middle. The shutter is open for
// the whole of frame 1.
enum { WIDTH = 36, HEIGHT = 24 };

// Units and frames: the ball's radius, where it is at the opening, its speeds, its weight, how much
// of its speed a bounce leaves it, and the floor's height.
static const double RADIUS = 2, LEFT = -14, ACROSS = 28, TOP = 10, FALL = 16, WEIGHT = 12,
                    REBOUND = 0.8, FLOOR = -7;

static const char *const film =
    "film { size = <36, 24>  fps = 24  frames = 1..1  transparent = true  filter = box }\n"
    "shutter { angle = 360deg  phase = start }\n"
    "camera { kind = orthographic  from = <0, 0, 10>  fov = 2*atan(12/10) }\n"
    "sim state Ball {\n"
    "  span = 0f..2f  tolerance = 1e-6\n"
    "  at = <-14, 10>  v = 24*<28, -16>\n"
    "  at' = v  v' = <0, -12*24^2>\n"
    "  when at.y < 0 { at = <at.x, 0>  v = <v.x, -0.8*v.y> }\n"
    "}\n";

// Two arcs that meet in a corner on the floor, of frames 0..1.
static void path(double u, double *x, double *y) {
    double hit = (sqrt(FALL * FALL + 2 * WEIGHT * TOP) - FALL) / WEIGHT, since = u - hit;
    double up = REBOUND * (FALL + WEIGHT * hit);
    *x = LEFT + ACROSS * u;
    *y = FLOOR + (since < 0 ? TOP - FALL * u - WEIGHT / 2 * u * u
                            : up * since - WEIGHT / 2 * since * since);
}

// The part of the time that the pixel is covered, on average over its square.
static double coverage(int column, int row) {
    enum { INSTANTS = 500, PARTS = 8 };
    uint32_t n = 0;
    for (int i = 0; i < INSTANTS; i++) {
        double x, y;
        path((i + 0.5) / INSTANTS, &x, &y);
        double left = column - WIDTH / 2.0 - x, bottom = HEIGHT / 2.0 - 1 - row - y;
        if (fmax(fabs(left + 0.5), fabs(bottom + 0.5)) > RADIUS + 1) {
            continue;
        }
        for (int k = 0; k < PARTS * PARTS; k++) {
            n += hypot(left + (k % PARTS + 0.5) / PARTS, bottom + (k / PARTS + 0.5) / PARTS) <
                 RADIUS;
        }
    }
    return (double)n / (INSTANTS * PARTS * PARTS);
}

// The largest difference between the picture's alpha and the closed form.
static double miss(const char *place) {
    char text[2048];
    TestScene test;
    RenderStats stats = {0};
    snprintf(text, sizeof text,
             "%s let p = %s\n sphere { radius = 2  translate <p.x, p.y - 7, 0> }", film, place);
    ScriptScene *script = script_scene_new(text, NULL);
    test_scene_init(&test, WIDTH, HEIGHT);
    test.scene = *script_scene(script);
    const Film *picture = test_film(&test, 1024, &stats);
    double worst = 0;
    for (int k = 0; k < WIDTH * HEIGHT; k++) {
        double covered = coverage(k % WIDTH, k / WIDTH);
        worst = fmax(worst, fabs(test_pixel(picture, k, 3) - covered));
    }
    print_message("%s: worst %.5f\n", place, worst);
    test_scene_free(&test);
    script_scene_free(script);
    return worst;
}

// What is straight between the shutter's ends, or goes round the corner for a tenth of the frame,
// is not it.
static void bounces_keep_their_corner_in_pictures(void **state) {
    (void)state;
    assert_true(miss("Ball.at") <= 0.01);
    assert_true(miss("mix(at(Ball.at, 0s), at(Ball.at, 1f), t*24)") >= 0.1);
    assert_true(miss("t < 0.4726f or t > 0.5726f ? Ball.at : mix(at(Ball.at, 0.4726f), "
                     "at(Ball.at, 0.5726f), (t*24 - 0.4726)/0.1)") >= 0.04);
}

// One step along x' = cos(t) x, x(0) = 1: the errors of its end, of the way to there, its estimate.
static void step_errors(double step, double errors[3]) {
    double k[RUNGE_STAGES][1], *const rates[] = {k[0], k[1], k[2], k[3], k[4], k[5], k[6]};
    double start = 1, x = start, way[SIM_COEFFICIENTS];
    for (uint32_t s = 0; s < RUNGE_STAGES; s++) {
        if (s > 0) {
            runge_look(s, step, 1, &start, rates, &x);
        }
        k[s][0] = cos(runge_time[s] * step) * x;
    }
    runge_way(step, start, x, rates, 0, way);
    errors[0] = fabs(x - exp(sin(step)));
    errors[1] = 0;
    errors[2] = fabs(runge_error(step, rates, 0));
    for (int i = 1; i < 16; i++) {
        double exact = exp(sin(step * i / 16));
        errors[1] = fmax(errors[1], fabs(sim_polynomial(way, SIM_COEFFICIENTS, i / 16.0) - exact));
    }
    assert_true(fabs(sim_polynomial(way, SIM_COEFFICIENTS, 1) - x) <= 1e-15);
}

// Half the step: an error of a sixty-fourth at the end, of a thirty-second on the way.
static void steps_of_runge_kutta_are_of_order_five(void **state) {
    (void)state;
    double whole[3], half[3];
    step_errors(0.25, whole);
    step_errors(0.125, half);
    print_message("errors %.3g %.3g %.3g, of half the step %.3g %.3g %.3g\n", whole[0], whole[1],
                  whole[2], half[0], half[1], half[2]);
    assert_true(whole[0] >= 50 * half[0]);
    assert_true(whole[1] >= 25 * half[1]);
    assert_true(whole[2] >= 25 * half[2]);
    assert_true(half[0] > 0 && half[0] <= half[2] && half[1] <= 2 * half[2]);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(steps_of_runge_kutta_are_of_order_five),
    cmocka_unit_test(bounces_keep_their_corner_in_pictures),
};

SUITE(simulations, tests)
