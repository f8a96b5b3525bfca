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

// As settings, so that each case says what it is about.
static void set_lens(Arena *arena, Scene *scene, double aperture, double focus, double right,
                     double up) {
    scene->camera.lens = constants(arena, (double[]){aperture, focus, right, up}, 4);
}

// A picture that is shifted shows what lies beyond the edge of the one that is not, on the same
// plane.
static void camera_shifts_its_picture(void **state) {
    (void)state;
    Arena arena = {0};
    for (int kind = 0; kind < 2; kind++) {
        Scene scene = scene_with(&arena, (CameraKind)kind, FRONT);
        Camera straight = camera_at(&scene, 0);
        set_lens(&arena, &scene, 0, 1, 0.25, 0.5);
        Camera shifted = camera_at(&scene, 0);
        assert_true(shifted.is_valid);
        assert_near(shifted.radius, 0, 0);
        for (int i = 0; i < 100; i++) {
            double x = 2 * i, y = 97 - i, px, py, scale;
            Vec3 o[2], d[2];
            camera_ray(&shifted, x, y, &o[0], &d[0]);
            camera_ray(&straight, x + 25, y - 50, &o[1], &d[1]);
            assert_vec(o[0], o[1].x, o[1].y, o[1].z);
            assert_vec(d[0], d[1].x, d[1].y, d[1].z);
            assert_true(camera_project(&shifted, vec3_madd(o[0], 7, d[0]), &px, &py, &scale));
            assert_near(px, x, ACROSS);
            assert_near(py, y, ACROSS);
        }
    }
    arena_free(&arena);
}

// Left to right: behind, left, ahead, right, behind; top to bottom: zenith, horizon, nadir.
static void camera_spherical_directions(void **state) {
    (void)state;
    static const struct {
        double x, y;
        Vec3 dir;
    } cases[] = {{100, 50, {0, 0, -1}},
                 {150, 50, {1, 0, 0}},
                 {50, 50, {-1, 0, 0}},
                 {0, 50, {0, 0, 1}},
                 {200, 50, {0, 0, 1}},
                 {33, 0, {0, 1, 0}},
                 {170, 100, {0, -1, 0}},
                 {100, 25, {0, 0.70710678118654752, -0.70710678118654752}},
                 {125, 50, {0.70710678118654752, 0, -0.70710678118654752}},
                 {250, 50, {-1, 0, 0}},
                 {100, -25, {0, 0.70710678118654752, 0.70710678118654752}}};
    Arena arena = {0};
    Scene scene = scene_with(&arena, CAMERA_SPHERICAL, FRONT);
    Camera camera = camera_at(&scene, 0);
    assert_true(camera.is_valid);
    assert_near(camera.pixel, 3.141592653589793 / 100, 1e-15);
    Vec3 o, d;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        camera_ray(&camera, cases[i].x, cases[i].y, &o, &d);
        assert_vec(o, 0, 0, 10);
        assert_vec(d, cases[i].dir.x, cases[i].dir.y, cases[i].dir.z);
    }
    for (int i = 0; i < 200; i++) {
        double x = i + 0.25, y = 99.5 * i / 200 + 0.1, px, py, scale;
        camera_ray(&camera, x, y, &o, &d);
        assert_near(vec3_length(d), 1, 1e-14);
        assert_true(camera_project(&camera, vec3_madd(o, 3, d), &px, &py, &scale));
        assert_near(px, x, ACROSS);
        assert_near(py, y, ACROSS);
        assert_near(scale, 100 / (3.141592653589793 * 3), ACROSS);
        assert_near(camera_depth(&camera, vec3_madd(o, 3, d)), 3, ACROSS);
    }
    arena_free(&arena);
}

// Through whatever point of the lens, a ray meets the pinhole's where that is in focus, and starts
// within the aperture.
static void camera_lens_rays_meet_in_focus(void **state) {
    (void)state;
    Arena arena = {0};
    const double skew[10] = {3, -2, 7, -1, 4, 0.5, 0.2, 1, -0.3, 0.7}, focus = 4.5;
    static const uint32_t blades[] = {0, 3, 6};
    for (int i = 0; i < 9; i++) {
        Scene scene = scene_with(&arena, (CameraKind)(i % 3), skew);
        set_lens(&arena, &scene, 0.8, focus, i % 3 == CAMERA_SPHERICAL ? 0 : 0.3, 0);
        scene.camera.blades = blades[i / 3];
        Camera camera = camera_at(&scene, 0);
        assert_true(camera.is_valid);
        Vec3 mean = vec3(0, 0, 0), o, d, middle, along;
        double x = 31, y = 77;
        camera_ray(&camera, x, y, &middle, &along);
        bool is_flat = camera.kind != CAMERA_SPHERICAL;
        double t = is_flat ? focus / vec3_dot(along, camera.forward) : focus;
        Vec3 meeting = vec3_madd(middle, t, along);
        for (int k = 0; k < 900; k++) {
            camera_lens_ray(&camera, x, y, (k / 30 + 0.5) / 30, (k % 30 + 0.5) / 30, &o, &d);
            Vec3 off = vec3_sub(o, middle), to = vec3_sub(meeting, o);
            assert_near(vec3_length(d), 1, 1e-14);
            assert_true(vec3_length(off) <= 0.4 * (1 + 1e-12));
            assert_near(vec3_dot(off, is_flat ? camera.forward : along), 0, 1e-12);
            assert_near(vec3_length(vec3_cross(to, d)), 0, 1e-12);
            mean = vec3_madd(mean, 1.0 / 900, off);
        }
        assert_near(vec3_length(mean), 0, 1e-3);
    }
    arena_free(&arena);
}

// No lens at all is no error; one that is out of range at some instant is.
static void camera_refuses_a_broken_lens(void **state) {
    (void)state;
    static const struct {
        double lens[4];
        bool is_valid;
    } cases[] = {{{0, 1, 0, 0}, true},           {{0.1, 1e30, 0, 0}, true},
                 {{-0.1, 1, 0, 0}, false},       {{0.1, 0, 0, 0}, false},
                 {{0.1, -1, 0, 0}, false},       {{NAN, 1, 0, 0}, false},
                 {{0.1, NAN, 0, 0}, false},      {{0.1, 1, NAN, 0}, false},
                 {{0.1, 1, 0, INFINITY}, false}, {{INFINITY, 1, 0, 0}, false}};
    Arena arena = {0};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Scene scene = scene_with(&arena, CAMERA_PERSPECTIVE, FRONT);
        scene.camera.lens = constants(&arena, cases[i].lens, 4);
        assert_int_equal(camera_at(&scene, 0).is_valid, cases[i].is_valid);
    }
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(camera_perspective_rays),
    cmocka_unit_test(camera_orthographic_agrees_at_the_target),
    cmocka_unit_test(camera_projects_what_its_rays_meet),
    cmocka_unit_test(camera_moves),
    cmocka_unit_test(camera_automatic_sees_the_box),
    cmocka_unit_test(camera_survives_bad_input),
    cmocka_unit_test(camera_shifts_its_picture),
    cmocka_unit_test(camera_spherical_directions),
    cmocka_unit_test(camera_lens_rays_meet_in_focus),
    cmocka_unit_test(camera_refuses_a_broken_lens),
};

SUITE(camera, tests)
