// SPDX-License-Identifier: Apache-2.0
// The tracer against closed forms: blur of a moving disc and a moving square, the furnace, direct
// light, mirrors; what a scene does not need is not drawn.
#include "render/tiles.h"
#include "tests/near.h"
#include "tests/scenes.h"

#include <stdlib.h>

// All pictures here are orthographic: 24 by 16 units, one pixel per unit, the origin in the middle.
enum { WIDTH = 24, HEIGHT = 16 };

static double channel(const Film *film, int x, int y, int c) {
    return test_pixel(film, y * (int)film->width + x, c);
}

// Twice integrated: the length below x of a ramp from 0 at 0 to 1 at v.
static double ramp_integral(double x, double v) {
    return x <= 0 ? 0 : x < v ? x * x / (2 * v) : x - v / 2;
}

// How much of [a, b] the interval [-h, h] covers on the mean while it moves from x0 to x0 + v, v >
// 0.
static double swept(double a, double b, double x0, double v, double h) {
    return ramp_integral(b - x0 + h, v) - ramp_integral(a - x0 + h, v) -
           ramp_integral(b - x0 - h, v) + ramp_integral(a - x0 - h, v);
}

// The disc of radius r that moves from (x0, y0) along x: closed in x and time, Simpson's rule in y.
static double disc_blur(double x, double y, double r, double x0, double y0, double v) {
    double lo = fmax(y, y0 - r), hi = fmin(y + 1, y0 + r);
    if (!(lo < hi)) {
        return 0;
    }
    // y = y0 + r sin(angle) takes the root's infinite slope away.
    enum { STEPS = 200 };
    double from = asin((lo - y0) / r), to = asin((hi - y0) / r), step = (to - from) / STEPS,
           sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double angle = from + i * step, weight = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
        sum += weight * swept(x, x + 1, x0, v, r * cos(angle)) * r * cos(angle);
    }
    return sum * step / 3;
}

static double overlap(double a, double b, double c, double d) {
    return fmax(0, fmin(b, d) - fmax(a, c));
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The square of half side h whose centre moves from (x0, y0) to (x0 + vx, y0 + vy): between the
// instants at which an edge meets the pixel's, the overlap is a quadratic of time.
static double square_blur(double x, double y, double h, double x0, double y0, double vx,
                          double vy) {
    double cut[10] = {0, 1};
    int n = 2;
    for (int i = 0; i < 4; i++) {
        cut[n++] = (x + i / 2 - x0 + (i % 2 ? h : -h)) / vx;
        cut[n++] = (y + i / 2 - y0 + (i % 2 ? h : -h)) / vy;
    }
    for (int i = 0; i < n; i++) {
        cut[i] = fmin(fmax(cut[i], 0), 1);
    }
    qsort(cut, (size_t)n, sizeof *cut, by_value);
    double sum = 0;
    for (int i = 0; i + 1 < n; i++) {
        double value[3];
        for (int k = 0; k < 3; k++) {
            double t = cut[i] + 0.5 * k * (cut[i + 1] - cut[i]);
            double cx = x0 + vx * t, cy = y0 + vy * t;
            value[k] = overlap(x, x + 1, cx - h, cx + h) * overlap(y, y + 1, cy - h, cy + h);
        }
        sum += (cut[i + 1] - cut[i]) / 6 * (value[0] + 4 * value[1] + value[2]);
    }
    return sum;
}

typedef double Blur(double x, double y);

typedef struct {
    double rmse, worst;
    int n;
} BlurError;

// Over the pixels that the true picture covers in part. The picture's y points down.
static BlurError compare(const Film *film, Blur *truth) {
    BlurError error = {0};
    double sum = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            double expected = truth(x - WIDTH / 2, HEIGHT / 2 - 1 - y);
            double difference = fabs(channel(film, x, y, 3) - expected);
            if (expected < 1e-9 || expected > 1 - 1e-9) {
                assert_near(difference, 0, 1e-7);
                continue;
            }
            sum += difference * difference;
            error.worst = fmax(error.worst, difference);
            error.n++;
        }
    }
    error.rmse = sqrt(sum / error.n);
    return error;
}

static void assert_converges(TestScene *test, Blur *truth) {
    static const uint32_t spp[] = {64, 256, 1024, 4096};
    BlurError errors[4];
    for (int i = 0; i < 4; i++) {
        RenderStats stats = {0};
        errors[i] = compare(test_film(test, spp[i], &stats), truth);
        assert_true(errors[i].n > 30);
        assert_int_equal(stats.time_samples, spp[i] * WIDTH * HEIGHT);
    }
    double order = -log(errors[3].rmse / errors[0].rmse) / log(64);
    print_message("rmse %.5f %.5f %.5f %.5f, worst at 1024 %.5f, order %.3f\n", errors[0].rmse,
                  errors[1].rmse, errors[2].rmse, errors[3].rmse, errors[2].worst, order);
    assert_true(errors[2].rmse <= 0.004);
    assert_true(errors[2].worst <= 0.015);
    assert_true(order > 0.65);
}

static double true_disc(double x, double y) {
    return disc_blur(x, y, 3.1, -5.3, 0.4, 9.7);
}

static double true_square(double x, double y) {
    return square_blur(x, y, 2.3, -4.9, -2.2, 8.3, 3.7);
}

static void test_orthographic(TestScene *test) {
    test_scene_init(test, WIDTH, HEIGHT);
    test_camera(test, CAMERA_ORTHOGRAPHIC, 10, 2 * atan(0.5 * HEIGHT / 10));
    test->scene.film.transparent = true;
    test->scene.film.filter = FILTER_BOX;
}

static void trace_blurs_a_sphere(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    test.scene.shutter = (ShutterSettings){.length = 0.5, .open = 0.25};
    uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    // 24 frames a second: the shutter is open for 1/48 s from 1/96 s on.
    const double speed = 9.7 * 48;
    test_moving_sphere(&test, glow, vec3(-5.3 - speed / 96, 0.4, 0), vec3(speed, 0, 0), 3.1);
    assert_converges(&test, true_disc);
    test_scene_free(&test);
}

static void trace_blurs_a_square(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    uint32_t matte = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
    test_moving_square(&test, matte, vec3(-4.9, -2.2, 0), vec3(8.3 * 24, 3.7 * 24, 0), 2.3);
    assert_converges(&test, true_square);
    test_scene_free(&test);
}

// Under a sky of 1 a white sphere of matte is 1 everywhere, seen or not.
static void trace_furnace(void **state) {
    (void)state;
    static const struct {
        MaterialKind kind;
        double out[6];
        uint32_t n;
        double below, above; // what may be lost and gained
    } cases[] = {
        {MATERIAL_MATTE, {1, 1, 1}, 3, 1e-6, 1e-9},
        {MATERIAL_METAL, {1, 1, 1, 0}, 4, 1e-6, 1e-9},
        {MATERIAL_METAL, {1, 1, 1, 0.5}, 4, 0.03, 0.03},
        {MATERIAL_GLOSS, {1, 1, 1, 0, 1.5}, 5, 0.03, 0.03},
        {MATERIAL_GLOSS, {1, 1, 1, 0.4, 1.5}, 5, 0.03, 0.03},
        {MATERIAL_GLASS, {1, 1, 1, 1.5, 0, 0}, 6, 1e-6, 1e-9},
        {MATERIAL_GLASS, {1, 1, 1, 1.5, 0.3, 0}, 6, 0.2, 0.2},
        {MATERIAL_GLASS, {1, 1, 1, 1.5, 0.3, 0.1}, 6, 0.2, 0.2},
        {MATERIAL_GLASS, {1, 1, 1, 2.4, 1, 0}, 6, 0.6, 0.6},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.film.transparent = false;
        test.scene.render.bounces = 64; // within glass
        test_light(&test, LIGHT_SKY, (double[]){1, 1, 1, 1}, 4);
        uint32_t white = test_material(&test, cases[i].kind, cases[i].out, cases[i].n);
        test_moving_sphere(&test, white, vec3(0, 0, 0), vec3(0, 0, 0), 6);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 64, &stats);
        double mean = 0;
        for (int k = 0; k < WIDTH * HEIGHT; k++) {
            double value = channel(film, k % WIDTH, k / WIDTH, 0);
            assert_true(cases[i].below > 1e-3 || value >= 1 - cases[i].below);
            assert_true(cases[i].above > 1e-3 || value <= 1 + cases[i].above);
            mean += value / (WIDTH * HEIGHT);
            assert_near(channel(film, k % WIDTH, k / WIDTH, 3), 1, 0);
        }
        assert_near(mean, 1, 0.005);
        assert_int_equal(stats.time_samples, 0);
        assert_int_equal(stats.light_samples, 0);
        assert_int_equal(stats.lens_samples, 0);
        assert_int_equal(stats.shadow_rays, 0);
        test_scene_free(&test);
    }
}

// Every sample of a mix shows one of its materials: on the mean the picture is the mean of both, at
// each pixel.
static void trace_mixes_pictures(void **state) {
    (void)state;
    static double picture[4][WIDTH * HEIGHT];
    for (int i = 0; i < 4; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.render.bounces = 6;
        test_light(&test, LIGHT_SKY, (double[]){0.7, 1, 1, 1}, 4);
        test_light(&test, LIGHT_SUN, (double[]){1, 1, 2, 3, 1, 1, 1, 0.2}, 8);
        uint32_t ids[3] = {test_material(&test, MATERIAL_GLOSS, (double[]){0.3, 1, 1, 0.1, 1.5}, 5),
                           test_material(&test, MATERIAL_METAL, (double[]){0.5, 1, 1, 0.4}, 4),
                           test_material(&test, MATERIAL_MATTE, (double[]){0.9, 1, 1}, 3)};
        uint32_t inner = test_material(&test, MATERIAL_MIX, (double[]){0.25}, 1);
        uint32_t outer = test_material(&test, MATERIAL_MIX, (double[]){0.4}, 1);
        test.materials[inner].parts[0] = ids[0];
        test.materials[inner].parts[1] = ids[1];
        test.materials[outer].parts[0] = inner;
        test.materials[outer].parts[1] = ids[2];
        test_moving_sphere(&test, i < 3 ? ids[i] : outer, vec3(0, 0, 0), vec3(0, 0, 0), 6);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 1024, &stats);
        for (int k = 0; k < WIDTH * HEIGHT; k++) {
            picture[i][k] = channel(film, k % WIDTH, k / WIDTH, 0);
        }
        test_scene_free(&test);
    }
    double sum = 0, most = 0;
    for (int k = 0; k < WIDTH * HEIGHT; k++) {
        double mean = 0.6 * (0.75 * picture[0][k] + 0.25 * picture[1][k]) + 0.4 * picture[2][k];
        sum += picture[3][k] - mean;
        most = fmax(most, fabs(picture[3][k] - mean));
    }
    assert_near(sum / (WIDTH * HEIGHT), 0, 1e-3);
    assert_near(most, 0, 0.06);
}

// A slab of glass of 2 metres whose color is what one metre leaves: white light through it loses
// what two surfaces reflect, in all their turns, and what the way within takes.
static void trace_glass_absorbs_by_distance(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.film.transparent = false;
        test.scene.render.bounces = 32;
        const double color[3] = {1, 0.6, 0.1}, depth = i == 2 ? 0 : 1;
        test_light(&test, LIGHT_SKY, (double[]){1, 1, 1, 1}, 4);
        uint32_t glass =
            test_material(&test, MATERIAL_GLASS,
                          (double[]){color[0], color[1], color[2], i ? 1.5 : 1, 0, depth}, 6);
        test_moving_square(&test, glass, vec3(0, 0, 1), vec3(0, 0, 0), 40);
        test_turned_square(&test, glass, -1, 40);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 256, &stats);
        for (int c = 0; c < 3; c++) {
            double mean = 0, r = i ? 0.04 : 0, a = i < 2 ? color[c] * color[c] : color[c];
            for (int k = 0; k < WIDTH * HEIGHT; k++) {
                mean += channel(film, k % WIDTH, k / WIDTH, c) / (WIDTH * HEIGHT);
            }
            // Of what enters, (1 - r): through after an even, back after an odd number of turns.
            // With a tint by surfaces each passage takes its root.
            double passes = i < 2 ? a * (1 - r) * (1 - r) / (1 - a * a * r * r)
                                  : a * (1 - r) * (1 - r) / (1 - r * r);
            double returns = i < 2 ? r + r * a * a * (1 - r) * (1 - r) / (1 - a * a * r * r)
                                   : r + r * a * (1 - r) * (1 - r) / (1 - r * r);
            assert_near(mean, passes + returns, 0.002);
        }
        test_scene_free(&test);
    }
}

static double mean_of(const Film *film, int c) {
    double sum = 0;
    for (int k = 0; k < WIDTH * HEIGHT; k++) {
        sum += channel(film, k % WIDTH, k / WIDTH, c);
    }
    return sum / (WIDTH * HEIGHT);
}

// Layers that are not opaque: what is seen through them and their shadows, in closed form.
static void trace_through_layers(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    test_light(&test, LIGHT_SKY, (double[]){1, 1, 1, 1}, 4);
    uint32_t third = test_material(&test, MATERIAL_GLOW, (double[]){2, 2, 2, 1}, 4);
    uint32_t half = test_material(&test, MATERIAL_GLOW, (double[]){5, 5, 5, 1}, 4);
    test.materials[third].opacity = test_numbers(&test, (double[]){0.3}, 1);
    test.materials[half].opacity = test_numbers(&test, (double[]){0.5}, 1);
    test_moving_square(&test, third, vec3(0, 0, 3), vec3(0, 0, 0), 40);
    test_moving_square(&test, half, vec3(0, 0, 2), vec3(0, 0, 0), 40);
    for (int i = 0; i < 2; i++) {
        test.scene.film.transparent = i;
        RenderStats stats = {0};
        const Film *film = test_film(&test, 256, &stats);
        assert_near(mean_of(film, 0), 0.3 * 2 + 0.7 * 0.5 * 5 + (i ? 0 : 0.35), 0.01);
        assert_near(mean_of(film, 3), i ? 0.65 : 1, 0.005);
    }
    test_scene_free(&test);

    test_orthographic(&test); // the same between the sun and a floor that the camera sees alone
    test_light(&test, LIGHT_SUN, (double[]){0, 0.6, 0.8, 2, 1, 1, 1, 0}, 8);
    uint32_t grey = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
    const double opacities[2] = {0.3, 0.5};
    test_moving_square(&test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 40);
    for (int i = 0; i < 2; i++) {
        uint32_t layer = test_material(&test, MATERIAL_MATTE, (double[]){1, 1, 1}, 3);
        test.materials[layer].opacity = test_numbers(&test, &opacities[i], 1);
        test_moving_square(&test, layer, vec3(0, 0, 1 + i), vec3(0, 0, 0), 40);
        test.shapes[1 + i].seen[RAY_CAMERA] = test_numbers(&test, (double[]){0}, 1);
    }
    RenderStats stats = {0};
    const Film *film = test_film(&test, 4, &stats);
    double expected = 0.35 * 2 * 0.8 * 0.5 / 3.141592653589793;
    assert_near(channel(film, 3, 3, 0), expected, 1e-7);
    assert_near(mean_of(film, 0), expected, 1e-7);
    test_scene_free(&test);
}

// A square that the camera, shadow rays or a mirror meet in the first half of the shutter's time
// alone, and the others never: 1 of a glow, half of a sun, half of what a mirror shows of a glow.
static void trace_asks_who_sees(void **state) {
    (void)state;
    static const double white[4] = {1, 1, 1, 0}, no = 0;
    for (int kind = 0; kind < RAY_KINDS; kind++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
        test.scene.render.bounces = kind == RAY_BOUNCE;
        test_light(&test, LIGHT_SUN, (double[]){0, 0, 1, 1, 1, 1, 1, 0}, 8);
        uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 2}, 4);
        uint32_t floor = kind == RAY_BOUNCE ? test_material(&test, MATERIAL_METAL, white, 4)
                                            : test_material(&test, MATERIAL_MATTE,
                                                            kind ? white : (double[]){0, 0, 0}, 3);
        test_moving_square(&test, glow, vec3(0, 0, 2), vec3(0, 0, 0), 3);
        test_moving_square(&test, floor, vec3(0, 0, 0), vec3(0, 0, 0), 40);
        Instr code[] = {{.op = OP_INPUT, .table = IN_T},
                        {.op = OP_CONST, .value = 0.5 / 24},
                        {.op = OP_LT, .a = 0, .b = 1}};
        const uint32_t out = 2;
        for (int k = 0; k < RAY_KINDS; k++) {
            test.shapes[0].seen[k] = k == kind ? program_new(&test.arena, code, 3, &out, 1, NULL, 0)
                                               : test_numbers(&test, &no, 1);
        }
        RenderStats stats = {0};
        const Film *film = test_film(&test, 256, &stats);
        double middle = channel(film, WIDTH / 2, HEIGHT / 2, 0), pi = 3.141592653589793;
        assert_near(middle, kind == RAY_SHADOW ? 0.5 / pi : 1, kind == RAY_SHADOW ? 0.002 : 0.01);
        assert_near(channel(film, 0, 0, 0), kind == RAY_SHADOW ? 1 / pi : 0, 1e-8);
        test_scene_free(&test);
    }
}

// A ball over a catcher that the camera does not see: under a sky it takes the light of its solid
// angle, weighed by the cosine, r^2 / d^2; with a sun in its zenith the sun's share too. What lies
// behind is darkened, or, on a transparent film, the shadow is the picture's alpha.
static void trace_catches_shadows(void **state) {
    (void)state;
    for (int i = 0; i < 4; i++) {
        TestScene test;
        bool has_sun = i & 1;
        test_orthographic(&test);
        test.scene.film.transparent = i & 2;
        test_light(&test, LIGHT_SKY, (double[]){0.5, 0.5, 0.5, 1}, 4);
        if (has_sun) {
            test_light(&test, LIGHT_SUN, (double[]){0, 0, 1, 3, 1, 1, 1, 0}, 8);
        }
        uint32_t grey = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
        test_moving_square(&test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 40);
        test_moving_sphere(&test, grey, vec3(0.5, 0.5, 4), vec3(0, 0, 0), 2);
        test.shapes[0].is_catcher = true;
        test.shapes[1].seen[RAY_CAMERA] = test_numbers(&test, (double[]){0}, 1);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 4096, &stats);
        double sky = 0.5 * 3.141592653589793, sun = has_sun ? 3 : 0;
        double shadow = (0.25 * sky + sun) / (sky + sun);
        if (i & 2) {
            assert_near(channel(film, WIDTH / 2, HEIGHT / 2 - 1, 3), shadow, 0.01);
            assert_near(channel(film, WIDTH / 2, HEIGHT / 2 - 1, 0), 0, 0);
        } else {
            assert_near(channel(film, WIDTH / 2, HEIGHT / 2 - 1, 0), 0.5 * (1 - shadow), 0.01);
            assert_near(channel(film, 0, 0, 3), 1, 0);
        }
        test_scene_free(&test);
    }
}

// A square facing the camera under one light: Lambert's law, and nothing but shadow rays.
static void trace_direct_light(void **state) {
    (void)state;
    static const double pi = 3.141592653589793;
    static const struct {
        LightKind kind;
        double out[8];
        double expected; // at the middle, albedo 0.5
        bool has_area;
    } cases[] = {
        {LIGHT_SUN, {0, 3, 4, 2, 1, 1, 1, 0}, 2 * 0.8 * 0.5 / 3.141592653589793, false},
        {LIGHT_SUN, {0, 3, 4, 2, 1, 1, 1, 0.1}, 2 * 0.8 * 0.5 / 3.141592653589793, true},
        {LIGHT_LAMP, {0, 0, 50, 1e5, 1, 1, 1, 0}, 0, false},
        {LIGHT_LAMP, {0, 0, 50, 1e5, 1, 1, 1, 5}, 0, true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.render.bounces = 2;
        test_light(&test, cases[i].kind, cases[i].out, 8);
        uint32_t grey = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
        test_moving_square(&test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 9);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 16, &stats);
        double x = 0.5, y = 0.5, d2 = x * x + y * y + 2500;
        double expected = cases[i].kind == LIGHT_SUN
                              ? cases[i].expected
                              : 1e5 / (4 * pi) / d2 * (50 / sqrt(d2)) * 0.5 / pi;
        assert_near(channel(film, WIDTH / 2, HEIGHT / 2, 1), expected, 0.003 * expected);
        assert_int_equal(stats.camera_rays, 16 * WIDTH * HEIGHT);
        assert_true(stats.shadow_rays > 16 * 200 && stats.shadow_rays <= 16 * WIDTH * HEIGHT);
        assert_true((stats.light_samples > 0) == cases[i].has_area);
        assert_int_equal(stats.time_samples, 0);
        test_scene_free(&test);
    }
}

// A mirror tilted by 45 degrees shows a glowing square beside it, at the ray's own time: the square
// is lit in the second half of the shutter only.
static void trace_mirrors_at_the_rays_time(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    test.scene.render.bounces = 1;
    uint32_t mirror = test_material(&test, MATERIAL_METAL, (double[]){1, 1, 1, 0}, 4);
    uint32_t strobe = test_strobe(&test, 0.5 / 24, 3);
    test_tilted_square(&test, mirror, 6);
    test_facing_square(&test, strobe, 30, 7);
    RenderStats stats = {0};
    const Film *film = test_film(&test, 256, &stats);
    assert_near(channel(film, WIDTH / 2, HEIGHT / 2, 0), 3 * 0.5, 0.01);
    assert_near(channel(film, 0, 0, 0), 0, 0);
    assert_true(stats.bounce_rays > 0);
    test_scene_free(&test);
}

// A sun's disc seen in a mirror, and the camera that does not see it.
static void trace_mirrors_show_the_sun(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    const double angle = 0.2;
    test_light(&test, LIGHT_SUN, (double[]){0, 0, 1, 2, 1, 1, 1, angle}, 8);
    test_light(&test, LIGHT_SUN, (double[]){0, 0, -1, 2, 1, 1, 1, angle}, 8);
    uint32_t mirror = test_material(&test, MATERIAL_METAL, (double[]){1, 1, 1, 0}, 4);
    test_moving_square(&test, mirror, vec3(0, 0, 0), vec3(0, 0, 0), 4);
    test.scene.film.transparent = false;
    RenderStats stats = {0};
    const Film *film = test_film(&test, 16, &stats);
    double radiance = 2 / (3.141592653589793 * pow(sin(angle / 2), 2));
    assert_near(channel(film, WIDTH / 2, HEIGHT / 2, 0), radiance, 1e-6 * radiance);
    assert_near(channel(film, 1, 1, 0), 0, 0);
    test_scene_free(&test);
}

// The same light by shadow rays and by reflected rays: a rough metal, whose lobe is both narrower
// and wider than the light, sends back what quadrature over the disc finds.
static void trace_weighs_both_ways(void **state) {
    (void)state;
    static const double roughs[] = {0.1, 0.3, 0.8};
    for (int i = 0; i < 3; i++) {
        TestScene test;
        test_orthographic(&test);
        const double angle = 0.3;
        test_light(&test, LIGHT_SUN, (double[]){0.1, 0, 1, 1, 1, 1, 1, angle}, 8);
        double out[BSDF_MAX_OUT] = {0.8, 0.8, 0.8, roughs[i], 1, 1, 1};
        uint32_t metal = test_material(&test, MATERIAL_METAL, out, 4);
        test_moving_square(&test, metal, vec3(0, 0, 0), vec3(0, 0, 0), 9);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 512, &stats);
        // The viewer, the normal and the square's z axis are one.
        PathScene paths;
        path_scene_init(&paths, &test.arena, &test.scene);
        Bsdf bsdf;
        bsdf_init(&bsdf, MATERIAL_METAL, out, false, 0, 1, paths.materials.table);
        enum { STEPS = 300 };
        double tilt = atan(0.1), spread = 1 - cos(angle / 2), sum = 0;
        for (int k = 0; k < STEPS * STEPS; k++) {
            double z = 1 - spread * (k / STEPS + 0.5) / STEPS, r = sqrt(1 - z * z);
            double phi = 6.283185307179586 * (k % STEPS + 0.5) / STEPS;
            double x = r * cos(phi), y = r * sin(phi);
            Vec3 wi = vec3(x * cos(tilt) + z * sin(tilt), y, z * cos(tilt) - x * sin(tilt));
            double diffuse[3], specular[3], density;
            bsdf_eval(&bsdf, vec3(0, 0, 1), wi, diffuse, specular, &density);
            sum += specular[0] / (STEPS * STEPS);
        }
        double radiance = 1 / (3.141592653589793 * pow(sin(angle / 2), 2));
        double expected = sum * radiance * 6.283185307179586 * spread, mean = 0;
        for (int k = 0; k < 64; k++) {
            mean += channel(film, WIDTH / 2 - 4 + k % 8, HEIGHT / 2 - 4 + k / 8, 0) / 64;
        }
        assert_near(mean, expected, 0.005 * expected);
        test_scene_free(&test);
    }
}

// An instant shutter, or nothing that moves: no sample of time is drawn.
static void trace_draws_only_what_it_needs(void **state) {
    (void)state;
    for (int i = 0; i < 4; i++) {
        TestScene test;
        test_orthographic(&test);
        test.scene.shutter.length = i & 1 ? 0.5 : 0;
        uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
        test_moving_sphere(&test, glow, vec3(0, 0, 0), vec3(i & 2 ? 9 : 0, 0, 0), 3);
        RenderStats stats = {0};
        test_film(&test, 4, &stats);
        assert_int_equal(stats.time_samples, i == 3 ? 4 * WIDTH * HEIGHT : 0);
        assert_int_equal(stats.shadow_rays + stats.bounce_rays, 0);
        assert_int_equal(stats.lens_samples + stats.light_samples, 0);
        test_scene_free(&test);
    }
}

// Depth along the axis, the normal towards the viewer, from the sample in the shutter's middle.
static void trace_depth_and_normal(void **state) {
    (void)state;
    TestScene test;
    test_orthographic(&test);
    test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 1}, 4);
    // Moves away from the camera, from z = 0 to z = -24.
    test_moving_square(&test, glow, vec3(0, 0, 0), vec3(0, 0, -24 * 24), 5);
    RenderStats stats = {0};
    const Film *film = test_film(&test, 256, &stats);
    size_t i = HEIGHT / 2 * WIDTH + WIDTH / 2;
    assert_near(film->depth[i], 10 + 12, 24.0 / 256);
    assert_near(film->normal[i][2], 1, 1e-6);
    assert_true(isinf(film->depth[0]));
    assert_near(film->normal[0][2], 0, 0);
    test_scene_free(&test);
}

static void begin_all_layers(TestScene *test) {
    test_orthographic(test);
    test->scene.film.filter = FILTER_BLACKMAN_HARRIS;
    test->scene.film.transparent = false;
    test->scene.film.layers = (1u << LAYER_COUNT) - 1;
    test->scene.shutter = (ShutterSettings){.length = 3, .open = -1};
    test->scene.render.bounces = 8;
    test_light(test, LIGHT_SKY, (double[]){0.2, 0.3, 0.5, 1}, 4);
    test_light(test, LIGHT_SUN, (double[]){1, 2, 3, 4, 1, 1, 1, 0.1}, 8);
    uint32_t gloss = test_material(test, MATERIAL_GLOSS, (double[]){0.9, 0.5, 0.1, 0.2, 1.5}, 5);
    test_moving_sphere(test, gloss, vec3(-3, 0, 0), vec3(50, 10, 0), 3);
    test_moving_square(test, gloss, vec3(0, 0, -6), vec3(-40, 0, 0), 9);
}

static void trace_same_film_for_any_threads(void **state) {
    (void)state;
    test_any_threads(begin_all_layers, test_film);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(trace_blurs_a_sphere),
    cmocka_unit_test(trace_blurs_a_square),
    cmocka_unit_test(trace_furnace),
    cmocka_unit_test(trace_mixes_pictures),
    cmocka_unit_test(trace_glass_absorbs_by_distance),
    cmocka_unit_test(trace_through_layers),
    cmocka_unit_test(trace_asks_who_sees),
    cmocka_unit_test(trace_catches_shadows),
    cmocka_unit_test(trace_direct_light),
    cmocka_unit_test(trace_mirrors_at_the_rays_time),
    cmocka_unit_test(trace_mirrors_show_the_sun),
    cmocka_unit_test(trace_weighs_both_ways),
    cmocka_unit_test(trace_draws_only_what_it_needs),
    cmocka_unit_test(trace_depth_and_normal),
    cmocka_unit_test(trace_same_film_for_any_threads),
};

SUITE(trace, tests)
