// SPDX-License-Identifier: Apache-2.0
// Lights with a shape against closed forms: the energy of spots, Lambert's formula for polygons.
#include "render/light.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "tests/near.h"
#include "tests/scenes.h"

static const double pi = 3.141592653589793;

// One light of constants.
static bool light_of(Arena *arena, LightKind kind, const double *values, uint32_t n, LightAt *at) {
    Instr code[16] = {{0}};
    uint32_t out[16];
    for (uint32_t i = 0; i < n; i++) {
        code[i] = (Instr){.op = OP_CONST, .value = values[i]};
        out[i] = i;
    }
    Light light = {.kind = kind, .program = program_new(arena, code, n, out, n, NULL, 0)};
    bool bad = false;
    return light_at(&light, 0, at, &bad) && !bad;
}

// The irradiance of a surface at `from` with that normal, by light_sample.
static double irradiance(const LightAt *light, Vec3 from, Vec3 normal) {
    enum { N = 1 << 14 };
    Sampler sampler = sampler_pixel(3, false, 1, 0, 0);
    double sum = 0;
    for (uint32_t i = 0; i < N; i++) {
        double u[SAMPLE_DIMENSIONS];
        LightHit hit;
        LightSample s;
        sampler_draw(&sampler, i, 1, u);
        if (!light_sample(light, from, u[0], u[1], &s)) {
            continue;
        }
        sum += fmax(vec3_dot(s.dir, normal), 0) * s.weight[0];
        if (light->has_area && u[0] > 0.001 && u[0] < 0.999 && u[1] > 0.001 && u[1] < 0.999) {
            assert_true(light_hit(light, from, s.dir, INFINITY, &hit));
            assert_near(hit.density / s.density, 1, 1e-6);
        }
    }
    return sum / N;
}

// What falls on a great sphere around a spot, over what its lamp would give: the integral of the
// falloff over the sphere, by another rule and from the angle itself.
static void light_spots_take_away(void **state) {
    (void)state;
    static const double cases[][3] = {// cone, edge, radius; degrees, metres
                                      {60, 0, 0},   {60, 10, 0},  {60, 30, 0}, {60, 90, 0},
                                      {170, 20, 0}, {300, 60, 0}, {360, 0, 0}, {60, 10, 0.5}};
    Arena arena = {0};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double outer = cases[i][0] * pi / 360, edge = cases[i][1] * pi / 180;
        double radius = cases[i][2];
        const double values[13] = {0, 0, 0, 100, 1, 1, 1, radius, 0, 0, -2, 2 * outer, edge};
        LightAt light;
        assert_true(light_of(&arena, LIGHT_SPOT, values, 13, &light));
        enum { STEPS = 1500 };
        double got = 0, expected = 0, inner = fmax(outer - edge, 0);
        const double far = 1000;
        for (int k = 0; k < STEPS; k++) {
            double angle = pi * (k + 0.5) / STEPS, step = pi / STEPS;
            double x = angle <= inner ? 1 : angle >= outer ? 0 : (outer - angle) / (outer - inner);
            double ring = 2 * pi * sin(angle) * step;
            expected += ring * x * x * (3 - 2 * x) * 100 / (4 * pi);
            Vec3 at = vec3(far * sin(angle), 0, -far * cos(angle));
            LightSample s;
            assert_true(light_sample(&light, at, 0.3, 0.7, &s));
            got += ring * far * far * s.weight[0];
        }
        assert_near(got, expected, 0.002 * expected);
    }
    arena_free(&arena);
}

// Lambert's formula: the irradiance of a polygon of radiance 1 is the sum over its edges of the
// angle under which they appear times the cosine between the normal and the edge's plane, over 2.
// The polygon lies above the horizon.
static double polygon_irradiance(const Vec3 *corner, int n, Vec3 from, Vec3 normal) {
    double sum = 0;
    for (int i = 0; i < n; i++) {
        Vec3 a = vec3_normalize(vec3_sub(corner[i], from));
        Vec3 b = vec3_normalize(vec3_sub(corner[(i + 1) % n], from));
        Vec3 across = vec3_normalize(vec3_cross(a, b));
        sum += acos(vec3_dot(a, b)) * vec3_dot(across, normal);
    }
    return fabs(sum) / 2;
}

static void light_areas_follow_lamberts_formula(void **state) {
    (void)state;
    // Middle, half edges (one of them sheared), two-sided; the surface lies at the origin.
    static const struct {
        Vec3 at, u, v, normal;
        bool two_sided;
    } cases[] = {
        {{0, 2, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}, false},
        {{0, 0.2, 0}, {1, 0, 0}, {0, 0, 0.5}, {0, 1, 0}, false},
        {{3, 4, 1}, {0, 0.5, 0}, {1, 0, 1}, {0.6, 0.8, 0}, true},
        {{1, 3, -2}, {1, 0.2, 0}, {0.5, 0, 0.7}, {0, 1, 0}, true},
        {{0, 2, 0}, {1e-4, 0, 0}, {0, 0, 1e-4}, {0, 1, 0}, false},
    };
    Arena arena = {0};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Vec3 u = cases[i].u, v = cases[i].v, at = cases[i].at;
        const double values[14] = {at.x, at.y, at.z, 50,  1,   1,  1, cases[i].two_sided,
                                   u.x,  u.y,  u.z,  v.x, v.y, v.z};
        LightAt light;
        assert_true(light_of(&arena, LIGHT_AREA, values, 14, &light));
        Vec3 corner[4];
        for (int k = 0; k < 4; k++) {
            double su = k == 1 || k == 2 ? 1 : -1, sv = k >= 2 ? 1 : -1;
            corner[k] = vec3_madd(vec3_madd(at, su, u), sv, v);
        }
        double size = 4 * vec3_length(vec3_cross(u, v));
        double radiance = 50 / (pi * size * (cases[i].two_sided ? 2 : 1));
        double expected = radiance * polygon_irradiance(corner, 4, vec3(0, 0, 0), cases[i].normal);
        bool faces = vec3_dot(vec3_cross(u, v), at) < 0 || cases[i].two_sided;
        double got = irradiance(&light, vec3(0, 0, 0), cases[i].normal);
        assert_near(got, faces ? expected : 0, 0.002 * expected);
    }
    arena_free(&arena);
}

// A matte square under an area that almost touches it, with and without bounces: by both ways of
// finding the light.
static void light_areas_light_what_is_near(void **state) {
    (void)state;
    for (int bounces = 0; bounces < 2; bounces++) {
        TestScene test;
        test_scene_init(&test, 8, 8);
        test_camera(&test, CAMERA_ORTHOGRAPHIC, 10, 2 * atan(0.4));
        test.scene.film.filter = FILTER_BOX;
        test.scene.render.bounces = (uint32_t)bounces;
        const double height = 0.25; // pixels are 1 m wide
        test_light(&test, LIGHT_AREA, (double[]){0, 0, height, 10, 1, 1, 1, 0, 0, 2, 0, 2, 0, 0},
                   14);
        uint32_t grey = test_material(&test, MATERIAL_MATTE, (double[]){0.5, 0.5, 0.5}, 3);
        test_moving_square(&test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 9);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 1024, &stats);
        const Vec3 corner[4] = {{-2, -2, height}, {2, -2, height}, {2, 2, height}, {-2, 2, height}};
        double sum = 0, all = 0;
        for (int k = 0; k < 64; k++) {
            enum { STEPS = 16 };
            double expected = 0;
            for (int s = 0; s < STEPS * STEPS; s++) {
                double x = k % 8 - 4 + (s % STEPS + 0.5) / STEPS;
                double y = k / 8 - 4 + (s / STEPS + 0.5) / STEPS;
                double e = polygon_irradiance(corner, 4, vec3(x, y, 0), vec3(0, 0, 1));
                expected += 10 / (pi * 16) * e * 0.5 / pi / (STEPS * STEPS);
            }
            double value = test_channel(film, k % 8, k / 8, 0);
            assert_near(value, expected, 0.15 * expected + 0.001);
            sum += value;
            all += expected;
        }
        assert_int_equal(stats.light_samples, 1024 * 64);
        test_scene_free(&test);
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(light_spots_take_away),
    cmocka_unit_test(light_areas_follow_lamberts_formula),
    cmocka_unit_test(light_areas_light_what_is_near),
};

SUITE(light, tests)
