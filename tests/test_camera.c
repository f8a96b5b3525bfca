// SPDX-License-Identifier: Apache-2.0
// Cameras: known rays, projection as the inverse of rays, the automatic camera, bad input.
#include "render/camera.h"
#include "tests/near.h"

#include <string.h>

static const double ACROSS = 1e-9;

static const Program *constants(Arena *arena, const double *values, uint32_t n) {
    Instr code[16] = {{0}};
    uint32_t out[16];
    for (uint32_t i = 0; i < n; i++) {
        code[i] = (Instr){.op = OP_CONST, .value = values[i]};
        out[i] = i;
    }
    return program_new(arena, code, n, out, n, NULL, 0);
}

static Scene scene_with(Arena *arena, CameraKind kind, const double values[10]) {
    Scene scene = {.film = {.width = 200, .height = 100, .fps = 24}};
    scene.camera.kind = kind;
    scene.camera.program = constants(arena, values, 10);
    return scene;
}

static void assert_vec(Vec3 a, double x, double y, double z) {
    assert_near(a.x, x, ACROSS);
    assert_near(a.y, y, ACROSS);
    assert_near(a.z, z, ACROSS);
}

// At (0, 0, 10), looking along -z with 90 degrees: the picture's top edge is 45 degrees up.
static const double FRONT[10] = {0, 0, 10, 0, 0, 0, 0, 1, 0, 1.5707963267948966};

static void camera_perspective_rays(void **state) {
    (void)state;
    Arena arena = {0};
    Scene scene = scene_with(&arena, CAMERA_PERSPECTIVE, FRONT);
    Camera camera = camera_at(&scene, 0);
    assert_true(camera.is_valid);
    Vec3 o, d;
    camera_ray(&camera, 100, 50, &o, &d);
    assert_vec(o, 0, 0, 10);
    assert_vec(d, 0, 0, -1);
    camera_ray(&camera, 100, 0, &o, &d);
    assert_vec(d, 0, sqrt(0.5), -sqrt(0.5));
    camera_ray(&camera, 200, 50, &o, &d); // twice as wide as high
    assert_vec(d, 2 / sqrt(5), 0, -1 / sqrt(5));
    arena_free(&arena);
}

static void camera_orthographic_agrees_at_the_target(void **state) {
    (void)state;
    Arena arena = {0};
    Scene scene = scene_with(&arena, CAMERA_ORTHOGRAPHIC, FRONT);
    Camera flat = camera_at(&scene, 0);
    Vec3 o, d;
    camera_ray(&flat, 150, 0, &o, &d);
    assert_vec(o, 10, 10, 10);
    assert_vec(d, 0, 0, -1);
    scene.camera.kind = CAMERA_PERSPECTIVE;
    Camera deep = camera_at(&scene, 0);
    double x, y, scale, x2, y2, scale2;
    assert_true(camera_project(&flat, vec3(3, -4, 0), &x, &y, &scale));
    assert_true(camera_project(&deep, vec3(3, -4, 0), &x2, &y2, &scale2));
    assert_near(x, 115, ACROSS);
    assert_near(y, 70, ACROSS);
    assert_near(scale, 5, ACROSS);
    assert_near(x, x2, ACROSS);
    assert_near(y, y2, ACROSS);
    assert_near(scale, scale2, ACROSS);
    assert_false(camera_project(&deep, vec3(0, 0, 11), &x, &y, &scale));
    arena_free(&arena);
}

static void camera_projects_what_its_rays_meet(void **state) {
    (void)state;
    Arena arena = {0};
    for (int kind = 0; kind < 2; kind++) {
        const double skew[10] = {3, -2, 7, -1, 4, 0.5, 0.2, 1, -0.3, 0.7};
        Scene scene = scene_with(&arena, (CameraKind)kind, skew);
        Camera camera = camera_at(&scene, 0);
        for (int i = 0; i < 100; i++) {
            double px = 7.3 * i - 200, py = 91.7 - 3.1 * i, x, y, scale;
            Vec3 o, d;
            camera_ray(&camera, px, py, &o, &d);
            assert_near(vec3_length(d), 1, 1e-14);
            assert_true(camera_project(&camera, vec3_madd(o, 5 + i, d), &x, &y, &scale));
            assert_near(x, px, ACROSS);
            assert_near(y, py, ACROSS);
        }
    }
    arena_free(&arena);
}

// A camera whose x is its time.
static void camera_moves(void **state) {
    (void)state;
    Arena arena = {0};
    Scene scene = {.film = {.width = 2, .height = 2, .fps = 24}};
    Instr code[] = {{.op = OP_INPUT, .table = IN_T},
                    {.op = OP_CONST, .value = 0},
                    {.op = OP_CONST, .value = 1},
                    {.op = OP_CONST, .value = 5}};
    const uint32_t out[10] = {0, 1, 3, 0, 1, 1, 1, 2, 1, 2};
    scene.camera.program = program_new(&arena, code, 4, out, 10, NULL, 0);
    assert_vec(camera_at(&scene, 0.25).from, 0.25, 0, 5);
    assert_vec(camera_at(&scene, -3).from, -3, 0, 5);
    arena_free(&arena);
}

static void camera_automatic_sees_the_box(void **state) {
    (void)state;
    Arena arena = {0};
    const double sizes[] = {1e-6, 1, 1e6};
    for (int i = 0; i < 12; i++) {
        double size = sizes[i % 3];
        Vec3 lo = vec3(size * 3, -size, 0), hi = vec3(size * 4, size * (i / 3), size / 7);
        Scene scene = {.film = {.width = i & 1 ? 90 : 640, .height = 480, .fps = 24}};
        scene.camera.kind = i & 2 ? CAMERA_ORTHOGRAPHIC : CAMERA_PERSPECTIVE;
        scene.camera.program = camera_automatic(&arena, &scene, lo, hi);
        Camera camera = camera_at(&scene, 0);
        assert_true(camera.is_valid);
        for (int corner = 0; corner < 8; corner++) {
            Vec3 p =
                vec3(corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z);
            double x, y, scale;
            assert_true(camera_project(&camera, p, &x, &y, &scale));
            assert_true(x > 0 && x < scene.film.width && y > 0 && y < scene.film.height);
        }
    }
    arena_free(&arena);
}

static void camera_survives_bad_input(void **state) {
    (void)state;
    Arena arena = {0};
    double at[10];
    memcpy(at, FRONT, sizeof at);
    at[2] = 0; // from == to
    Scene scene = scene_with(&arena, CAMERA_PERSPECTIVE, at);
    assert_false(camera_at(&scene, 0).is_valid);
    memcpy(at, FRONT, sizeof at);
    at[9] = NAN;
    scene = scene_with(&arena, CAMERA_PERSPECTIVE, at);
    assert_false(camera_at(&scene, 0).is_valid);
    scene.camera.program = NULL;
    assert_false(camera_at(&scene, 0).is_valid);
    // Looking straight down, with the default `up`.
    const double above[10] = {0, 9, 0, 0, 0, 0, 0, 1, 0, 0.5};
    scene = scene_with(&arena, CAMERA_PERSPECTIVE, above);
    Camera camera = camera_at(&scene, 0);
    assert_true(camera.is_valid);
    assert_near(vec3_dot(camera.right, camera.forward), 0, ACROSS);
    assert_near(vec3_length(camera.right), 1, ACROSS);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(camera_perspective_rays),
    cmocka_unit_test(camera_orthographic_agrees_at_the_target),
    cmocka_unit_test(camera_projects_what_its_rays_meet),
    cmocka_unit_test(camera_moves),
    cmocka_unit_test(camera_automatic_sees_the_box),
    cmocka_unit_test(camera_survives_bad_input),
};

SUITE(camera, tests)
