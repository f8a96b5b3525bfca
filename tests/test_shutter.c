// SPDX-License-Identifier: Apache-2.0
// Shutters against closed forms: curves as inverse integrals, the profile of a moving edge, the
// shear of a rolling shutter, slit-scan; instants never leave what is sampled.
#include "render/tiles.h"
#include "render/shutter.h"
#include "tests/near.h"
#include "tests/scenes.h"

// Pictures are orthographic: 24 by 16 units, one pixel per unit, the origin in the middle.
enum { WIDTH = 24, HEIGHT = 16, FPS = 24 };

static const double PI = 3.141592653589793;

// ---- Curves

// min(1, min(x / 0.3, (1 - x) / 0.45)).
static const Program *trapezoid(Arena *arena) {
    Instr code[] = {{.op = OP_INPUT, .table = IN_X}, {.op = OP_CONST, .value = 0.3},
                    {.op = OP_DIV, .a = 0, .b = 1},  {.op = OP_CONST, .value = 1},
                    {.op = OP_SUB, .a = 3, .b = 0},  {.op = OP_CONST, .value = 0.45},
                    {.op = OP_DIV, .a = 4, .b = 5},  {.op = OP_MIN, .a = 2, .b = 6},
                    {.op = OP_MIN, .a = 7, .b = 3}};
    const uint32_t out = 8;
    return program_new(arena, code, 9, &out, 1, NULL, 0);
}

static double trapezoid_integral(double x) {
    double area = x < 0.3    ? x * x / 0.6
                  : x < 0.55 ? 0.15 + (x - 0.3)
                             : 0.625 - (1 - x) * (1 - x) / 0.9;
    return area / 0.625;
}

static const Program *cosine(Arena *arena) {
    Instr code[] = {{.op = OP_INPUT, .table = IN_X},
                    {.op = OP_CONST, .value = PI},
                    {.op = OP_MUL, .a = 0, .b = 1},
                    {.op = OP_SIN, .a = 2}};
    const uint32_t out = 3;
    return program_new(arena, code, 4, &out, 1, NULL, 0);
}

static double cosine_integral(double x) {
    return (1 - cos(PI * x)) / 2;
}

// scale * (x < where ? below : 1).
static const Program *jump(Arena *arena, double where, double below, double scale) {
    Instr code[] = {{.op = OP_INPUT, .table = IN_X},  {.op = OP_CONST, .value = where},
                    {.op = OP_LT, .a = 0, .b = 1},    {.op = OP_CONST, .value = scale * below},
                    {.op = OP_CONST, .value = scale}, {.op = OP_SELECT, .a = 2, .b = 3, .c = 4}};
    const uint32_t out = 5;
    return program_new(arena, code, 6, &out, 1, NULL, 0);
}

static double jump_integral(double x) {
    return x < 0.3 ? 0 : (x - 0.3) / 0.7;
}

static double jump_up_integral(double x) {
    return (x < 0.37 ? 4 * x : 4 * 0.37 + (x - 0.37)) / (4 * 0.37 + 0.63);
}

typedef double Integral(double x);

static void curves_are_inverse_integrals(void **state) {
    (void)state;
    Arena arena = {0};
    const struct {
        const Program *program;
        Integral *integral;
    } cases[] = {{trapezoid(&arena), trapezoid_integral},
                 {cosine(&arena), cosine_integral},
                 {jump(&arena, 0.3, 0, 1e-30), jump_integral},
                 {jump(&arena, 0.37, 4, 1e200), jump_up_integral}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        CurveReport report;
        ShutterSettings shutter = {.length = 1};
        shutter.curve = shutter_curve_new(&arena, cases[i].program, &report);
        assert_non_null(shutter.curve);
        double worst = 0, before = 0;
        for (int k = 0; k <= 100000; k++) {
            double u = k / 100000.0, x = shutter_fraction(&shutter, u);
            assert_true(x >= before && x <= 1);
            worst = fmax(worst, fabs(cases[i].integral(x) - u));
            before = x;
        }
        print_message("%u points, error %.2e at most, %.2e measured\n", shutter.curve->n,
                      shutter.curve->error, worst);
        assert_true(worst <= 1e-6);
        assert_true(worst <= shutter.curve->error + 1e-9);
        assert_true(shutter.curve->n < 3000);
    }
    ShutterSettings box = {.length = 1};
    assert_near(shutter_fraction(&box, 0.3), 0.3, 0);
    arena_free(&arena);
}

static void curves_that_are_none(void **state) {
    (void)state;
    Arena arena = {0};
    const struct {
        const Program *program;
        CurveTrouble trouble;
        double at, value;
    } cases[] = {{jump(&arena, 0.5, -1, 1), CURVE_NEGATIVE, 0, -1},
                 {jump(&arena, 2, 0, 1), CURVE_ZERO, 0, 0},
                 {jump(&arena, 2, INFINITY, 1), CURVE_NOT_FINITE, 0, INFINITY}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        CurveReport report;
        assert_null(shutter_curve_new(&arena, cases[i].program, &report));
        assert_int_equal(report.trouble, cases[i].trouble);
        assert_near(report.at, cases[i].at, 0);
        assert_true(report.value == cases[i].value);
    }
    arena_free(&arena);
}

// ---- Delays

// a * v^2 + b * u, in seconds.
static const Program *delay_program(Arena *arena, double a, double b) {
    Instr code[] = {{.op = OP_INPUT, .table = IN_U}, {.op = OP_INPUT, .table = IN_V},
                    {.op = OP_CONST, .value = a},    {.op = OP_CONST, .value = b},
                    {.op = OP_MUL, .a = 1, .b = 1},  {.op = OP_MUL, .a = 4, .b = 2},
                    {.op = OP_MUL, .a = 0, .b = 3},  {.op = OP_ADD, .a = 5, .b = 6}};
    const uint32_t out = 7;
    return program_new(arena, code, 8, &out, 1, NULL, 0);
}

static double apart(Instant a, Instant b) {
    return (double)(a.frame - b.frame) + (a.frac - b.frac);
}

// Whatever the pixel, its first and its last instant are within what the frame is said to see, and
// that is hardly more.
static void shutters_see_what_they_say(void **state) {
    (void)state;
    Arena arena = {0};
    const FilmSettings film = {.width = 31, .height = 17, .fps = 24};
    const ShutterSettings cases[] = {
        {.length = 0.5, .open = -0.25},
        {.length = 0.5, .open = -0.25, .roll = ROLL_DOWN, .readout = 0.7},
        {.length = 0, .open = 0, .roll = ROLL_UP, .readout = 3},
        {.length = 7.1, .open = 1e5, .roll = ROLL_LEFT, .readout = 1e-9},
        {.length = 1e-6, .open = 0, .roll = ROLL_RIGHT, .readout = 2e-6},
        {.length = 0.3, .open = -0.1, .delay = delay_program(&arena, 1, -2)},
        {.length = 0.3, .open = -0.1, .delay = delay_program(&arena, 4e4 / 24, 0.1)},
        {.length = 0.2,
         .open = 0,
         .roll = ROLL_UP,
         .readout = 1,
         .delay = delay_program(&arena, -3, 1.0 / 3)},
    };
    static const int64_t frames[] = {1, 1000000, -7};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        ShutterSettings shutter = cases[i];
        uint32_t bad_x, bad_y;
        assert_true(shutter_find_delays(&shutter, &film, &bad_x, &bad_y));
        for (int f = 0; f < 3; f++) {
            ShutterSpan seen = shutter_seen(&shutter, frames[f]);
            double first = INFINITY, last = -INFINITY;
            for (uint32_t k = 0; k < film.width * film.height; k++) {
                double delay = shutter_delay(&shutter, &film, k % film.width, k / film.width);
                assert_true(delay >= shutter.first_delay && delay <= shutter.last_delay);
                Instant open = shutter_instant(&shutter, frames[f], delay, 0);
                Instant close = shutter_instant(&shutter, frames[f], delay, 1);
                first = fmin(first, apart(open, seen.start));
                last = fmax(last, apart(close, seen.start));
            }
            double rounding = 1e-14 * (1 + seen.length + fabs(shutter.open));
            assert_true(first >= 0 || (i == 0 && first >= -1e-16));
            assert_true(last <= seen.length || (i == 0 && last <= seen.length + 1e-16));
            assert_near(first, 0, rounding);
            assert_near(last, seen.length, rounding);
        }
    }
    arena_free(&arena);
}

static void delays_that_are_none(void **state) {
    (void)state;
    Arena arena = {0};
    const FilmSettings film = {.width = 2000, .height = 3, .fps = 24};
    uint32_t x = 0, y = 0;
    ShutterSettings shutter = {.delay = delay_program(&arena, 0, 1e15)};
    assert_false(shutter_find_delays(&shutter, &film, &x, &y));
    assert_int_equal(x, 83); // 24e15 * (83 + 0.5) / 2000 is the first beyond the bound
    assert_int_equal(y, 0);
    shutter.delay = delay_program(&arena, NAN, 0);
    assert_false(shutter_find_delays(&shutter, &film, &x, &y));
    arena_free(&arena);
}

// ---- Pictures

static void test_orthographic(TestScene *test) {
    test_scene_init(test, WIDTH, HEIGHT);
    test_camera(test, CAMERA_ORTHOGRAPHIC, 10, 2 * atan(0.5 * HEIGHT / 10));
    test->scene.film.transparent = true;
    test->scene.film.filter = FILTER_BOX;
}

// Everything left of an edge that is at x pixels at t = 0 and moves so many per frame.
static void add_edge(TestScene *test, double x, double per_frame) {
    uint32_t glow = test_material(test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    test_moving_square(test, glow, vec3(x - WIDTH / 2.0 - 500, 0, 0), vec3(per_frame * FPS, 0, 0),
                       500);
}

static const Film *shot(TestScene *test, uint32_t spp, RenderStats *stats) {
    uint32_t x, y;
    assert_true(shutter_find_delays(&test->scene.shutter, &test->scene.film, &x, &y));
    return test_film(test, spp, stats);
}

// The blur of an edge is the curve's integral, as seen by a pixel: what is left of x is covered as
// long as the edge is right of it.
static void edges_show_the_curve(void **state) {
    (void)state;
    const double from = 3.3, way = 17.4;
    for (int i = 0; i < 3; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter = (ShutterSettings){.length = 0.5, .open = 0.25};
        CurveReport report;
        const Program *program = i == 0   ? trapezoid(&test.arena)
                                 : i == 1 ? cosine(&test.arena)
                                          : jump(&test.arena, 0.3, 0, 1);
        Integral *integral = i == 0 ? trapezoid_integral : i == 1 ? cosine_integral : jump_integral;
        test.scene.shutter.curve = shutter_curve_new(&test.arena, program, &report);
        add_edge(&test, from - 0.5 * way, 2 * way);
        RenderStats stats = {0};
        const Film *film = shot(&test, 1024, &stats);
        double worst = 0;
        for (int k = 0; k < WIDTH * HEIGHT; k++) {
            enum { STEPS = 200 };
            double expected = 0;
            for (int s = 0; s < STEPS; s++) {
                double x = (k % WIDTH + (s + 0.5) / STEPS - from) / way;
                expected += (1 - integral(fmin(fmax(x, 0), 1))) / STEPS;
            }
            worst = fmax(worst, fabs(test_pixel(film, k, 3) - expected));
        }
        print_message("curve %d: worst %.5f\n", i, worst);
        assert_true(worst <= 0.006);
        assert_int_equal(stats.time_samples, 1024 * WIDTH * HEIGHT);
        test_scene_free(&test);
    }
}

// An edge at a known place in each pixel: its coverage.
static double covered(double edge, int x) {
    return fmin(fmax(edge - x, 0), 1);
}

// With a shutter that is open for an instant a rolling shutter is sharp: an edge of constant speed
// leans by speed times readout over the lines, or is drawn out or together along them. No time is
// drawn.
static void rolling_shutters_lean(void **state) {
    (void)state;
    static const RollKind rolls[] = {ROLL_DOWN, ROLL_UP, ROLL_LEFT, ROLL_RIGHT};
    const double from = 4.2, per_frame = 6.3, readout = 2.1;
    for (int i = 0; i < 4; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter = (ShutterSettings){.roll = rolls[i], .readout = readout};
        add_edge(&test, from, per_frame);
        RenderStats stats = {0};
        const Film *film = shot(&test, 256, &stats);
        double worst = 0;
        for (int k = 0; k < WIDTH * HEIGHT; k++) {
            int x = k % WIDTH, y = k / WIDTH;
            double line = rolls[i] == ROLL_DOWN   ? y / (HEIGHT - 1.0)
                          : rolls[i] == ROLL_UP   ? 1 - y / (HEIGHT - 1.0)
                          : rolls[i] == ROLL_LEFT ? 1 - x / (WIDTH - 1.0)
                                                  : x / (WIDTH - 1.0);
            double expected = covered(from + per_frame * readout * line, x);
            worst = fmax(worst, fabs(test_pixel(film, k, 3) - expected));
        }
        print_message("roll %d: worst %.5f\n", (int)rolls[i], worst);
        assert_true(worst <= 1.0 / 256 + 1e-6); // a stratum of x
        assert_int_equal(stats.time_samples, 0);
        test_scene_free(&test);
    }
}

// The same for a delay of any form, here seconds back and forth, and with the shutter open in
// addition: the edge is drawn over speed times length.
static void slit_scans_bend(void **state) {
    (void)state;
    const double from = 20, per_frame = 0.4, a = 1.7, b = -0.8, length = 5;
    for (int i = 0; i < 2; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter = (ShutterSettings){.length = i ? length : 0};
        test.scene.shutter.delay = delay_program(&test.arena, a, b);
        add_edge(&test, from, -per_frame);
        RenderStats stats = {0};
        const Film *film = shot(&test, 256, &stats);
        double worst = 0;
        for (int k = 0; k < WIDTH * HEIGHT; k++) {
            int x = k % WIDTH;
            double u = (x + 0.5) / WIDTH, v = (k / WIDTH + 0.5) / HEIGHT, expected = 0;
            enum { STEPS = 400 };
            for (int s = 0; s < STEPS; s++) {
                double frames = (a * v * v + b * u) * FPS + (i ? (s + 0.5) / STEPS * length : 0);
                expected += covered(from - per_frame * frames, x) / STEPS;
            }
            worst = fmax(worst, fabs(test_pixel(film, k, 3) - expected));
        }
        print_message("length %g: worst %.5f\n", i * length, worst);
        assert_true(worst <= (i ? 0.02 : 1.0 / 256 + 1e-6));
        assert_int_equal(stats.time_samples, i ? 256 * WIDTH * HEIGHT : 0);
        test_scene_free(&test);
    }
}

// What stands still is the same whatever the shutter does, and costs no samples of time.
static void shutters_are_free_where_nothing_moves(void **state) {
    (void)state;
    Arena arena = {0};
    void *first = NULL;
    for (int i = 0; i < 2; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter = (ShutterSettings){.length = 0.5};
        if (i) {
            CurveReport report;
            test.scene.shutter.roll = ROLL_DOWN;
            test.scene.shutter.readout = 2;
            test.scene.shutter.delay = delay_program(&test.arena, 1, 1);
            test.scene.shutter.curve = shutter_curve_new(&test.arena, cosine(&test.arena), &report);
        }
        add_edge(&test, 7.7, 0);
        RenderStats stats = {0};
        const Film *film = shot(&test, 16, &stats);
        assert_int_equal(stats.time_samples, 0);
        size_t n;
        void *bytes = test_film_bytes(film, &arena, &n);
        first = i == 0 ? bytes : first;
        assert_memory_equal(first, bytes, n);
        test_scene_free(&test);
    }
    arena_free(&arena);
}

static void begin_everything_late(TestScene *test) {
    test_orthographic(test);
    CurveReport report;
    test->scene.shutter =
        (ShutterSettings){.length = 0.8, .open = -0.4, .roll = ROLL_UP, .readout = 1.3};
    test->scene.shutter.delay = delay_program(&test->arena, -0.2, 0.3);
    test->scene.shutter.curve = shutter_curve_new(&test->arena, trapezoid(&test->arena), &report);
    test_lens(test, (double[]){0.7, 8, 0.1, 0}, (double[]){0.2, 1, 0, 0}, 5);
    test_light(test, LIGHT_SKY, (double[]){0.2, 0.3, 0.5, 1}, 4);
    uint32_t gloss = test_material(test, MATERIAL_GLOSS, (double[]){0.9, 0.5, 0.1, 0.2, 1.5}, 5);
    test_moving_sphere(test, gloss, vec3(-3, 0, 0), vec3(50, 10, 0), 3);
    test_moving_square(test, gloss, vec3(0, 0, -6), vec3(-40, 0, 0), 9);
}

static void shutters_give_one_film_for_any_threads(void **state) {
    (void)state;
    test_any_threads(begin_everything_late, shot);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(curves_are_inverse_integrals),
    cmocka_unit_test(curves_that_are_none),
    cmocka_unit_test(shutters_see_what_they_say),
    cmocka_unit_test(delays_that_are_none),
    cmocka_unit_test(edges_show_the_curve),
    cmocka_unit_test(rolling_shutters_lean),
    cmocka_unit_test(slit_scans_bend),
    cmocka_unit_test(shutters_are_free_where_nothing_moves),
    cmocka_unit_test(shutters_give_one_film_for_any_threads),
};

SUITE(shutter, tests)
