// SPDX-License-Identifier: Apache-2.0
// Scenes built by hand for the tests of the renderer: no language in between.
#ifndef TESTS_SCENES_H
#define TESTS_SCENES_H

#include <math.h>
#include <string.h>

#include "accel/vec.h"
#include "render/film.h"
#include "render/render.h"
#include "tests/suite.h"

enum { TEST_SCENE_MAX = 16 };

typedef struct {
    Arena arena;
    Scene scene;
    Light lights[TEST_SCENE_MAX];
    Material materials[TEST_SCENE_MAX];
    Shape shapes[TEST_SCENE_MAX];
    uint32_t n_threads;
    Reporter reporter;
    int n_errors, n_warnings;
    char message[512]; // the last one
} TestScene;

// 24 frames a second, frame 1, an instant shutter, 0 bounces, nothing in it; automatic camera.
void test_scene_init(TestScene *test, uint32_t width, uint32_t height);
void test_scene_free(TestScene *test);
RenderOptions test_options(const TestScene *test, uint32_t spp); // out is NULL

// Frame 1, in the test's arena; nothing may have been dropped. stats is added to.
const Film *test_film(TestScene *test, uint32_t spp, RenderStats *stats);
double test_pixel(const Film *film, int pixel, int c);      // counted row by row
double test_channel(const Film *film, int x, int y, int c); // 0..2: r g b, 3: alpha
// All that the film holds, from the arena; *n gets how many bytes.
void *test_film_bytes(const Film *film, Arena *arena, size_t *n);

typedef const Film *TestTrace(TestScene *test, uint32_t spp, RenderStats *stats);
// Asserts that 1, 2 and 5 threads make the same film of the scene that `begin` makes.
void test_any_threads(void (*begin)(TestScene *test), TestTrace *trace);

// At (0, 0, distance), looking at the origin.
void test_camera(TestScene *test, CameraKind kind, double distance, double fov);
// aperture, focus, shift x and y: value + slope * t. After test_camera.
void test_lens(TestScene *test, const double value[4], const double slope[4], uint32_t blades);

// A program that gives these.
const Program *test_numbers(TestScene *test, const double *out, uint32_t n);
void test_light(TestScene *test, LightKind kind, const double *out, uint32_t n);
uint32_t test_material(TestScene *test, MaterialKind kind, const double *out, uint32_t n);
// Glows with the given power from that second on, dark before.
uint32_t test_strobe(TestScene *test, double second, double power);

// At `at` when t is 0, moving with that velocity; not moving: its programs read no time.
void test_moving_sphere(TestScene *test, uint32_t material, Vec3 at, Vec3 velocity, double radius);
// In the x-y plane, facing +z, of half side h.
void test_moving_square(TestScene *test, uint32_t material, Vec3 at, Vec3 velocity, double h);
// Through the origin, halfway between +z and +x.
void test_tilted_square(TestScene *test, uint32_t material, double h);
// At (x, 0, 0), facing -x.
void test_facing_square(TestScene *test, uint32_t material, double x, double h);
// At (0, 0, z), facing -z.
void test_turned_square(TestScene *test, uint32_t material, double z, double h);

#endif
