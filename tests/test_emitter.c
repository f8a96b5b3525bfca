// SPDX-License-Identifier: Apache-2.0
// What glows, as a light: against closed forms, against the same picture by bounces alone, and ten
// thousand of it against their sum; the light tree's probabilities.
#include "render/light_tree.h"
#include "render/path.h"
#include "render/tiles.h"
#include "tests/hand_scene.h"
#include "tests/near.h"
#include "tests/scenes.h"

static const double pi = 3.141592653589793;

enum { SIZE = 8 }; // pixels, each a metre wide; the origin is in the middle

static uint32_t begin(TestScene *test, double albedo) {
    test_scene_init(test, SIZE, SIZE);
    test_camera(test, CAMERA_ORTHOGRAPHIC, 100, 2 * atan(SIZE / 200.0));
    test->scene.film.filter = FILTER_BOX;
    test->scene.film.transparent = true;
    uint32_t grey = test_material(test, MATERIAL_MATTE, (double[]){albedo, albedo, albedo}, 3);
    test_moving_square(test, grey, vec3(0, 0, 0), vec3(0, 0, 0), 9);
    return grey;
}

// Radiance of the square at z = 0 per radiance of a sphere over it, at one place.
static double under_sphere(double x, double y, Vec3 at, double radius, double albedo) {
    Vec3 to = vec3_sub(at, vec3(x, y, 0));
    double d2 = vec3_dot(to, to);
    return albedo * radius * radius / d2 * to.z / sqrt(d2);
}

// Mean over pixel k.
typedef double Shade(const void *context, double x, double y);
static double pixel_mean(int k, Shade *shade, const void *context) {
    enum { STEPS = 8 };
    double sum = 0;
    for (int s = 0; s < STEPS * STEPS; s++) {
        double x = k % SIZE - SIZE / 2 + (s % STEPS + 0.5) / STEPS;
        double y = SIZE / 2 - k / SIZE - (s / STEPS + 0.5) / STEPS;
        sum += shade(context, x, y) / (STEPS * STEPS);
    }
    return sum;
}

static void compare(const Film *film, Shade *shade, const void *context, double each, double all) {
    double sum = 0, expected_sum = 0;
    for (int k = 0; k < SIZE * SIZE; k++) {
        double expected = pixel_mean(k, shade, context);
        double value = test_channel(film, k % SIZE, k / SIZE, 0);
        assert_near(value, expected, each * expected + 1e-6);
        sum += value;
        expected_sum += expected;
    }
    assert_near(sum, expected_sum, all * expected_sum);
}

// ---- Spheres

typedef struct {
    Vec3 from, way; // from the shutter's opening to its close
    double radius, glow;
} Ball;

static double shade_ball(const void *context, double x, double y) {
    const Ball *ball = context;
    enum { STEPS = 64 };
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        Vec3 at = vec3_madd(ball->from, (i + 0.5) / STEPS, ball->way);
        sum += ball->glow * under_sphere(x, y, at, ball->radius, 0.5) / STEPS;
    }
    return sum;
}

static void emitter_spheres_at_rest_and_moving(void **state) {
    (void)state;
    static const Ball balls[] = {
        {{6, 0, 2}, {0, 0, 0}, 1, 5},
        {{6, 0, 0.3}, {0, 0, 0}, 0.25, 100}, // low
        {{7, -7, 3}, {0, 14, 0}, 0.5, 20},   // passes by within the shutter
        {{0, 0, 200}, {0, 0, 0}, 50, 1},     // behind the camera
    };
    for (size_t i = 0; i < sizeof balls / sizeof *balls; i++) {
        TestScene test;
        begin(&test, 0.5);
        test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
        uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, balls[i].glow}, 4);
        test_moving_sphere(&test, glow, balls[i].from, vec3_scale(balls[i].way, 24),
                           balls[i].radius);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 1024, &stats);
        compare(film, shade_ball, &balls[i], 0.03, 0.003);
        assert_int_equal(stats.light_samples, 1024 * SIZE * SIZE);
        test_scene_free(&test);
    }
}

// Within a glowing sphere everything white glows as it does, whatever its shape.
static void emitter_furnace(void **state) {
    (void)state;
    TestScene test;
    uint32_t white = begin(&test, 1);
    uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 3}, 4);
    test.scene.render.bounces = 6;
    test_moving_sphere(&test, glow, vec3(20, 10, 5), vec3(0, 0, 0), 400);
    test_moving_sphere(&test, white, vec3(0, 0, 3), vec3(0, 0, 0), 2);
    RenderStats stats = {0};
    const Film *film = test_film(&test, 256, &stats);
    double mean = 0;
    for (int k = 0; k < SIZE * SIZE; k++) {
        mean += test_channel(film, k % SIZE, k / SIZE, 0) / (SIZE * SIZE);
    }
    assert_near(mean, 3, 0.01);
    test_scene_free(&test);
}

// ---- Against bounces alone

// A scene of emitters of all kinds over surfaces of all kinds.
static void mixed_scene(TestScene *test) {
    begin(test, 0.6);
    test->scene.shutter = (ShutterSettings){.length = 1, .open = 0};
    test->scene.render.bounces = 2;
    uint32_t glow = test_material(test, MATERIAL_GLOW, (double[]){1, 0.7, 0.4, 6}, 4);
    uint32_t strobe = test_strobe(test, 0.6 / 24, 5);
    uint32_t metal = test_material(test, MATERIAL_METAL, (double[]){0.9, 0.8, 0.7, 0.3}, 4);
    uint32_t gloss = test_material(test, MATERIAL_GLOSS, (double[]){0.2, 0.4, 0.7, 0.2, 1.5}, 5);
    test_moving_sphere(test, metal, vec3(-2, 1, 1), vec3(0, 0, 0), 1.2);
    test_moving_sphere(test, gloss, vec3(1, -2, 1), vec3(20, 0, 0), 1);
    test_moving_sphere(test, glow, vec3(0, 2, 1.5), vec3(24, -24, 0), 0.5);
    test_facing_square(test, strobe, 5, 2);
    test_moving_sphere(test, glow, vec3(-1, -2, 1), vec3(0, 0, 12), 0.8);
    // An ellipsoid.
    static const double stretched[4][4] = {{1, 0.3, 0, 0}, {0, 0.6, 0, 0}, {0, 0, 1, 0}};
    Affine map;
    memcpy(map.m, stretched, sizeof map.m);
    test->shapes[test->scene.n_shapes - 1].transform = program_affine(&test->arena, &map);
}

static const Film *film_by_bounces(TestScene *test, uint32_t spp) {
    RenderOptions options = test_options(test, spp);
    const int64_t frame = 1;
    uint32_t n_taken;
    PathScene paths;
    RenderStats stats = {0};
    PathTroubles troubles = {.lights = ARENA_ARRAY(&test->arena, TEST_SCENE_MAX, bool),
                             .materials = ARENA_ARRAY(&test->arena, TEST_SCENE_MAX, bool)};
    Progress progress = {.kind = PROGRESS_NONE};
    Film *film = ARENA_NEW(&test->arena, Film);
    film_init(film, &test->arena, test->scene.film.layers, SIZE, SIZE);
    path_scene_init(&paths, &test->arena, &test->scene);
    memset(paths.materials.glows, 0,
           test->scene.n_materials * sizeof *paths.materials.glows); // not as lights
    World *world =
        world_build(&test->scene, &options, &frame, 1, &test->reporter, &n_taken, &stats);
    const TilePass pass = {.frame = frame, .n = spp, .due = INFINITY};
    assert_int_equal(
        tiles_trace(&paths, world, &options, &pass, film, &progress, &stats, &troubles),
        TILES_DONE);
    assert_int_equal(stats.light_samples, 0);
    world_destroy(world);
    return film;
}

// Of what is not just there: mixes that glow, holes, glass around what glows and beside it, who
// sees what.
static void layered_scene(TestScene *test) {
    uint32_t grey = begin(test, 0.6);
    test->scene.render.bounces = 4;
    const double no = 0;
    uint32_t glow = test_material(test, MATERIAL_GLOW, (double[]){1, 0.7, 0.4, 6}, 4);
    uint32_t veil = test_material(test, MATERIAL_GLOW, (double[]){0.4, 0.7, 1, 8}, 4);
    test->materials[veil].opacity = test_numbers(test, (double[]){0.4}, 1);
    uint32_t coal = test_material(test, MATERIAL_MIX, (double[]){0.3}, 1);
    test->materials[coal].parts[0] = grey;
    test->materials[coal].parts[1] = veil;
    uint32_t frosted =
        test_material(test, MATERIAL_GLASS, (double[]){0.8, 0.6, 0.9, 1.3, 0.7, 1}, 6);
    uint32_t lit = test_material(test, MATERIAL_MIX, (double[]){0.5}, 1);
    test->materials[lit].parts[0] = frosted;
    test->materials[lit].parts[1] = glow;
    test_moving_sphere(test, veil, vec3(-2, 2, 1.5), vec3(0, 0, 0), 1);
    test_moving_sphere(test, coal, vec3(2, 2, 1), vec3(0, 0, 0), 1);
    test_moving_sphere(test, lit, vec3(2, -2, 1.5), vec3(0, 0, 0), 0.8);
    test_moving_sphere(test, frosted, vec3(-2, -2, 1.5), vec3(0, 0, 0), 1.2);
    test_moving_sphere(test, glow, vec3(-2, -2, 1.5), vec3(0, 0, 0), 0.5); // within
    test_facing_square(test, coal, -4.5, 2);
    struct {
        uint32_t material;
        RayKind unseen;
        Vec3 at;
    } ones[] = {{glow, RAY_CAMERA, {0, 0, 3}},    {glow, RAY_SHADOW, {3.5, 0, 1}},
                {glow, RAY_BOUNCE, {-3.5, 0, 1}}, {grey, RAY_CAMERA, {0, 1, 1}},
                {grey, RAY_SHADOW, {0, -1, 1}},   {grey, RAY_BOUNCE, {1, 0, 1}}};
    for (size_t i = 0; i < sizeof ones / sizeof *ones; i++) {
        test_moving_sphere(test, ones[i].material, ones[i].at, vec3(0, 0, 0), 0.4);
        Shape *shape = &test->shapes[test->scene.n_shapes - 1];
        shape->seen[ones[i].unseen] = test_numbers(test, &no, 1);
    }
}

typedef void SceneFunction(TestScene *test);

static void emitter_agrees_with_bounces(void **state) {
    (void)state;
    SceneFunction *const scenes[] = {mixed_scene, layered_scene};
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        TestScene test;
        scenes[i](&test);
        RenderStats stats = {0};
        const Film *film = test_film(&test, 4096, &stats);
        const Film *plain = film_by_bounces(&test, 1 << 14);
        double sum = 0, expected = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            for (int c = 0; c < 3; c++) {
                double value = test_channel(film, k % SIZE, k / SIZE, c);
                double by_bounces = test_channel(plain, k % SIZE, k / SIZE, c);
                assert_near(value, by_bounces, 0.15 * by_bounces + 0.03);
                sum += value;
                expected += by_bounces;
            }
        }
        assert_near(sum, expected, 0.01 * expected);
        test_scene_free(&test);
    }
}

static void begin_turning_mesh(TestScene *test) {
    mixed_scene(test);
    // A mesh of 128 triangles: what glows goes through the tree.
    Shape shape = hand_mesh(mesh_grid(&test->arena, 8, 0.5));
    shape.material = 1;
    shape.transform = program_turning(&test->arena, 50, vec3(1, 1, 2), vec3(0, 30, 0));
    test->shapes[test->scene.n_shapes++] = shape;
}

static void emitter_same_film_for_any_threads(void **state) {
    (void)state;
    test_any_threads(begin_turning_mesh, test_film);
}

// A clamp cuts what comes after the first bounce: of almost nothing it leaves direct light, a large
// one changes nothing.
static void emitter_clamp_spares_direct_light(void **state) {
    (void)state;
    int64_t pictures[4][SIZE * SIZE][4];
    for (int i = 0; i < 4; i++) {
        TestScene test;
        mixed_scene(&test);
        test.scene.render.bounces = i == 0 ? 0 : 2;
        test.scene.render.clamp = i == 1 ? 1e-12 : i == 2 ? 0 : 1e6;
        RenderStats stats = {0};
        memcpy(pictures[i], test_film(&test, 64, &stats)->sum, sizeof pictures[i]);
        test_scene_free(&test);
    }
    assert_memory_equal(pictures[2], pictures[3], sizeof pictures[2]);
    for (int k = 0; k < SIZE * SIZE; k++) {
        for (int c = 0; c < 3; c++) {
            double direct = (double)pictures[0][k][c] / FILM_UNITS;
            assert_near((double)pictures[1][k][c] / FILM_UNITS, direct, 1e-5 * (1 + direct));
            assert_true(pictures[2][k][c] >= pictures[1][k][c] - 64);
        }
    }
}

// ---- Deforming triangles

// Half the side of a square at z = 3 that grows from 0.5 to 2 while the shutter is open.
static double shade_growing(const void *context, double x, double y) {
    enum { STEPS = 32 };
    double sum = 0, albedo = *(const double *)context;
    for (int i = 0; i < STEPS; i++) {
        double h = 0.5 + 1.5 * (i + 0.5) / STEPS, e = 0;
        const Vec3 corner[4] = {{-h, -h, 3}, {h, -h, 3}, {h, h, 3}, {-h, h, 3}};
        for (int k = 0; k < 4; k++) {
            Vec3 a = vec3_normalize(vec3_sub(corner[k], vec3(x + 7, y, 0)));
            Vec3 b = vec3_normalize(vec3_sub(corner[(k + 1) % 4], vec3(x + 7, y, 0)));
            e += acos(vec3_dot(a, b)) * vec3_normalize(vec3_cross(a, b)).z / 2;
        }
        sum += albedo / pi * fabs(e) * 4 / STEPS;
    }
    return sum;
}

static void emitter_deforming_triangles(void **state) {
    (void)state;
    // Two triangles are asked one by one, 8 * 8 * 2 through the tree.
    for (int i = 0; i < 2; i++) {
        TestScene test;
        begin(&test, 0.5);
        test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
        uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 4}, 4);
        Shape shape = hand_mesh(mesh_grid(&test.arena, i ? 8 : 1, 2));
        Code c = {.n = 0};
        uint32_t t = code_input(&c, IN_T), out[3];
        uint32_t h = code_op(&c, OP_ADD, code_number(&c, 0.5),
                             code_op(&c, OP_MUL, t, code_number(&c, 1.5 * 24)));
        out[0] =
            code_op(&c, OP_ADD, code_op(&c, OP_MUL, code_input(&c, IN_PX), h), code_number(&c, -7));
        out[1] = code_op(&c, OP_MUL, code_input(&c, IN_PY), h);
        out[2] = code_number(&c, 3);
        shape.vertex = code_done(&c, &test.arena, out, 3);
        shape.material = glow;
        test.shapes[test.scene.n_shapes++] = shape;
        RenderStats stats = {0};
        const Film *film = test_film(&test, 1024, &stats);
        const double albedo = 0.5;
        compare(film, shade_growing, &albedo, 0.05, 0.004);
        assert_int_equal(stats.light_samples, 1024 * SIZE * SIZE * 2);
        test_scene_free(&test);
    }
}

// ---- Many

enum { ROW = 100 };

static Vec3 grid_place(int i) {
    return vec3(0.6 * (i % ROW - ROW / 2) + 0.3, 0.6 * (i / ROW - ROW / 2) + 0.3, 150);
}

static double shade_grid(const void *context, double x, double y) {
    double sum = 0, n = *(const double *)context;
    for (int i = 0; i < n; i++) {
        sum += 3000 * under_sphere(x, y, grid_place(i), 0.05, 0.5);
    }
    return sum;
}

// Ten thousand spheres behind the camera against the sum over them, and their cost.
static void emitter_ten_thousand(void **state) {
    (void)state;
    TestScene test;
    begin(&test, 0.5);
    test.scene.film.width = test.scene.film.height = SIZE;
    uint32_t glow = test_material(&test, MATERIAL_GLOW, (double[]){1, 1, 1, 3000}, 4);
    Code c = {.n = 0};
    uint32_t out[4];
    double *loops = ARENA_ARRAY(&test.arena, 2 * ROW * ROW, double);
    for (int i = 0; i < ROW * ROW; i++) {
        loops[2 * i] = grid_place(i).x;
        loops[2 * i + 1] = grid_place(i).y;
    }
    out[0] = code_input(&c, IN_LOOP0);
    out[1] = code_input(&c, IN_LOOP1);
    out[2] = code_number(&c, 150);
    out[3] = code_number(&c, 0.05);
    test.shapes[test.scene.n_shapes++] = (Shape){.kind = SHAPE_SPHERE,
                                                 .label = "sphere",
                                                 .geometry = code_done(&c, &test.arena, out, 4),
                                                 .material = glow,
                                                 .tolerance = 0.25,
                                                 .n_instances = ROW * ROW,
                                                 .n_loops = 2,
                                                 .loops = loops};
    RenderStats stats = {0};
    const Film *film = test_film(&test, 256, &stats);
    const double n = ROW * ROW;
    compare(film, shade_grid, &n, 0.02, 0.003);
    assert_int_equal(stats.light_samples, LIGHT_CHOICE_DRAWN * 256 * SIZE * SIZE);
    assert_true(stats.shadow_rays <= LIGHT_CHOICE_DRAWN * 256 * SIZE * SIZE);
    test_scene_free(&test);
}

// Thirty lamps, spots and areas, moving and still: the tree against one by one.
static void emitter_many_lamps(void **state) {
    (void)state;
    enum { LAMPS = 30, PARTS = 5 };
    static Light lights[LAMPS];
    double sum[SIZE * SIZE] = {0}, expected[SIZE * SIZE] = {0};
    TestScene test;
    for (int part = 0; part <= PARTS; part++) {
        begin(&test, 0.5);
        uint32_t metal = test_material(&test, MATERIAL_METAL, (double[]){0.9, 0.9, 0.9, 0.2}, 4);
        test_moving_sphere(&test, metal, vec3(1, 1, 0), vec3(0, 0, 0), 2);
        uint64_t random = 7;
        test.scene.shutter = (ShutterSettings){.length = 1, .open = 0};
        for (int i = 0; i < LAMPS; i++) {
            double x = 8 * hand_random(&random) - 4, y = 8 * hand_random(&random) - 4;
            double z = 3 + 2 * hand_random(&random);
            const LightKind kinds[] = {LIGHT_LAMP, LIGHT_SPOT, LIGHT_AREA};
            const double sheet[14] = {x, y, z, 50, 1, 1, 1, 1, 0.3, 0, 0, 0, 0.3, 0.1};
            double ball[13] = {x, y, z, 30, 1, 1, 1, i % 2 * 0.2, 0.3, 0, -1, 1, 0.3};
            Code c = {.n = 0};
            uint32_t out[14], n = i % 3 == 0 ? 8 : i % 3 == 1 ? 13 : 14;
            for (uint32_t k = 0; k < n; k++) {
                out[k] = code_number(&c, i % 3 == 2 ? sheet[k] : ball[k]);
            }
            if (i % 4 == 0) {
                uint32_t way = code_op(&c, OP_MUL, code_input(&c, IN_T), code_number(&c, 24 * 3));
                out[0] = code_op(&c, OP_ADD, out[0], way);
            }
            lights[i] =
                (Light){.kind = kinds[i % 3], .program = code_done(&c, &test.arena, out, n)};
        }
        test.scene.lights = part < PARTS ? lights + part * (LAMPS / PARTS) : lights;
        test.scene.n_lights = part < PARTS ? LAMPS / PARTS : LAMPS;
        RenderStats stats = {0};
        const Film *film = test_film(&test, part < PARTS ? 1024 : 4096, &stats);
        for (int k = 0; k < SIZE * SIZE; k++) {
            double value = test_channel(film, k % SIZE, k / SIZE, 0);
            *(part < PARTS ? &expected[k] : &sum[k]) += value;
        }
        test_scene_free(&test);
    }
    double all = 0, all_expected = 0;
    for (int k = 0; k < SIZE * SIZE; k++) {
        assert_near(sum[k], expected[k], 0.2 * expected[k] + 0.03);
        all += sum[k];
        all_expected += expected[k];
    }
    assert_near(all, all_expected, 0.01 * all_expected);
}

// ---- The tree

static void emitter_tree_probabilities(void **state) {
    (void)state;
    static const uint32_t sizes[] = {1, 2, 3, 9, 100, 1000};
    uint64_t random = 11;
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        Arena arena = {0};
        uint32_t n = sizes[s];
        LightBounds *b = ARENA_ARRAY(&arena, n, LightBounds);
        for (uint32_t i = 0; i < n; i++) {
            Vec3 at = vec3(hand_random(&random) - 0.5, hand_random(&random) - 0.5,
                           i % 3 ? hand_random(&random) : 0);
            at = i % 7 == 3 ? vec3(0.1, 0.2, 0.3) : at; // some at one place
            double r = i % 2 ? 0.02 : 0;
            Vec3 axis = vec3_normalize(vec3(hand_random(&random) - 0.5, 0.1, 0.3));
            b[i] = (LightBounds){vec3_sub(at, vec3(r, r, r)),
                                 vec3_add(at, vec3(r, r, r)),
                                 axis,
                                 i % 4 ? 1 : -1,
                                 i % 5 ? 0 : 0.8,
                                 i % 6 == 0,
                                 i % 10 == 9 ? 0 : pow(10, 8 * hand_random(&random) - 4)};
        }
        const LightTree *tree = light_tree_build(&arena, b, n);
        for (int k = 0; k < 20; k++) {
            Vec3 from = vec3(3 * hand_random(&random) - 1.5, hand_random(&random), 0.1);
            Vec3 normal = k % 3 ? vec3(0, 0, 1) : vec3(0, 0, 0);
            double sum = 0;
            for (uint32_t i = 0; i < n; i++) {
                double p = light_tree_probability(tree, from, normal, i);
                assert_true(b[i].power > 0 ? p > 0 : p == 0);
                sum += p;
            }
            assert_near(sum, 1, 1e-9);
            for (int j = 0; j < 50; j++) {
                double p;
                uint32_t i = light_tree_sample(tree, from, normal, hand_random(&random), &p);
                assert_true(i < n && b[i].power > 0);
                assert_near(p / light_tree_probability(tree, from, normal, i), 1, 1e-9);
            }
        }
        arena_free(&arena);
    }
    Arena arena = {0};
    LightBounds dark = {.power = 0};
    assert_null(light_tree_build(&arena, &dark, 1));
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(emitter_spheres_at_rest_and_moving),
    cmocka_unit_test(emitter_furnace),
    cmocka_unit_test(emitter_agrees_with_bounces),
    cmocka_unit_test(emitter_same_film_for_any_threads),
    cmocka_unit_test(emitter_clamp_spares_direct_light),
    cmocka_unit_test(emitter_deforming_triangles),
    cmocka_unit_test(emitter_ten_thousand),
    cmocka_unit_test(emitter_many_lamps),
    cmocka_unit_test(emitter_tree_probabilities),
};

SUITE(emitter, tests)
