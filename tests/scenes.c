// SPDX-License-Identifier: Apache-2.0
// Scenes built by hand.
#include "tests/scenes.h"

#include "render/tiles.h"

static void count_message(void *context, SourceRef where, const char *name, const char *message) {
    (void)where;
    TestScene *test = context;
    test->n_errors += name == NULL;
    test->n_warnings += name != NULL;
    strncpy(test->message, message, sizeof test->message - 1);
}

void test_scene_init(TestScene *test, uint32_t width, uint32_t height) {
    memset(test, 0, sizeof *test);
    test->n_threads = 1;
    test->reporter = (Reporter){count_message, test};
    test->scene = (Scene){.film = {.width = width,
                                   .height = height,
                                   .fps = 24,
                                   .first_frame = 1,
                                   .last_frame = 1,
                                   .layers = LAYERS_DEFAULT},
                          .camera = {.automatic = true},
                          .lights = test->lights,
                          .materials = test->materials,
                          .shapes = test->shapes,
                          .hash = "0123456789abcdef0123456789abcdef"};
}

void test_scene_free(TestScene *test) {
    arena_free(&test->arena);
}

RenderOptions test_options(const TestScene *test, uint32_t spp) {
    static const int64_t frame = 1;
    return (RenderOptions){.frames = &frame,
                           .n_frames = 1,
                           .spp = spp,
                           .n_threads = test->n_threads,
                           .accel = &accel_types[0],
                           .accel_options = accel_options_default(),
                           .validate = true,
                           .software = "st4",
                           .command_line = "st4"};
}

// A program of the form out[i] = value[i] + slope[i] * t.
static const Program *line(TestScene *test, const double *value, const double *slope, uint32_t n) {
    Instr code[64] = {{.op = OP_INPUT, .table = IN_T}};
    uint32_t out[16], k = 1;
    for (uint32_t i = 0; i < n; i++) {
        code[k] = (Instr){.op = OP_CONST, .value = value[i]};
        out[i] = k++;
        if (slope && slope[i] != 0) {
            code[k] = (Instr){.op = OP_CONST, .value = slope[i]};
            code[k + 1] = (Instr){.op = OP_MUL, .a = 0, .b = k};
            code[k + 2] = (Instr){.op = OP_ADD, .a = out[i], .b = k + 1};
            out[i] = k + 2;
            k += 3;
        }
    }
    return program_new(&test->arena, code, k, out, n, NULL, 0);
}

void test_camera(TestScene *test, CameraKind kind, double distance, double fov) {
    const double out[10] = {0, 0, distance, 0, 0, 0, 0, 1, 0, fov};
    test->scene.camera = (CameraSettings){.kind = kind, .program = line(test, out, NULL, 10)};
}

void test_lens(TestScene *test, const double value[4], const double slope[4], uint32_t blades) {
    test->scene.camera.lens = line(test, value, slope, 4);
    test->scene.camera.blades = blades;
}

const Program *test_numbers(TestScene *test, const double *out, uint32_t n) {
    return line(test, out, NULL, n);
}

void test_light(TestScene *test, LightKind kind, const double *out, uint32_t n) {
    test->lights[test->scene.n_lights++] =
        (Light){.kind = kind, .program = line(test, out, NULL, n)};
}

uint32_t test_material(TestScene *test, MaterialKind kind, const double *out, uint32_t n) {
    test->materials[test->scene.n_materials] =
        (Material){.kind = kind, .program = line(test, out, NULL, n), .label = "material"};
    return test->scene.n_materials++;
}

uint32_t test_strobe(TestScene *test, double second, double power) {
    Instr code[] = {{.op = OP_CONST, .value = 1},      {.op = OP_INPUT, .table = IN_T},
                    {.op = OP_CONST, .value = second}, {.op = OP_CONST, .value = power},
                    {.op = OP_LE, .a = 2, .b = 1},     {.op = OP_MUL, .a = 4, .b = 3}};
    const uint32_t out[4] = {0, 0, 0, 5};
    test->materials[test->scene.n_materials] =
        (Material){.kind = MATERIAL_GLOW,
                   .program = program_new(&test->arena, code, 6, out, 4, NULL, 0),
                   .label = "strobe"};
    return test->scene.n_materials++;
}

static Shape *add_shape(TestScene *test, ShapeKind kind, uint32_t material, const char *label) {
    Shape *shape = &test->shapes[test->scene.n_shapes++];
    *shape = (Shape){.kind = kind,
                     .label = label,
                     .material = material,
                     .tolerance = 0.01,
                     .smooth = -1,
                     .n_instances = 1};
    return shape;
}

void test_moving_sphere(TestScene *test, uint32_t material, Vec3 at, Vec3 velocity, double radius) {
    const double value[4] = {at.x, at.y, at.z, radius};
    const double slope[4] = {velocity.x, velocity.y, velocity.z, 0};
    add_shape(test, SHAPE_SPHERE, material, "sphere")->geometry = line(test, value, slope, 4);
}

static const Mesh *square_mesh(TestScene *test, double h) {
    static const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const uint32_t index[6] = {0, 1, 2, 0, 2, 3};
    Mesh *mesh = ARENA_NEW(&test->arena, Mesh);
    *mesh = (Mesh){.n_vertices = 4,
                   .n_triangles = 2,
                   .position = ARENA_ARRAY(&test->arena, 12, double),
                   .index = ARENA_ARRAY(&test->arena, 6, uint32_t)};
    for (int i = 0; i < 4; i++) {
        mesh->position[3 * i] = corner[i][0] * h;
        mesh->position[3 * i + 1] = corner[i][1] * h;
    }
    memcpy(mesh->index, index, sizeof index);
    return mesh;
}

static void add_square(TestScene *test, uint32_t material, double h, const double map[12],
                       const double slope[12]) {
    Shape *shape = add_shape(test, SHAPE_MESH, material, "square");
    shape->mesh = square_mesh(test, h);
    shape->transform = line(test, map, slope, 12);
}

void test_moving_square(TestScene *test, uint32_t material, Vec3 at, Vec3 velocity, double h) {
    const double map[12] = {1, 0, 0, at.x, 0, 1, 0, at.y, 0, 0, 1, at.z};
    const double slope[12] = {[3] = velocity.x, [7] = velocity.y, [11] = velocity.z};
    add_square(test, material, h, map, slope);
}

void test_tilted_square(TestScene *test, uint32_t material, double h) {
    const double k = sqrt(0.5), map[12] = {k, 0, k, 0, 0, 1, 0, 0, -k, 0, k, 0};
    add_square(test, material, h, map, NULL);
}

void test_facing_square(TestScene *test, uint32_t material, double x, double h) {
    const double map[12] = {0, 0, -1, x, 0, 1, 0, 0, 1, 0, 0, 0};
    add_square(test, material, h, map, NULL);
}

void test_turned_square(TestScene *test, uint32_t material, double z, double h) {
    const double map[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, z};
    add_square(test, material, h, map, NULL);
}

const Film *test_film(TestScene *test, uint32_t spp, RenderStats *stats) {
    Arena *arena = &test->arena;
    RenderOptions options = test_options(test, spp);
    const int64_t frame = 1;
    uint32_t n_taken;
    PathScene paths;
    PathTroubles troubles = {.lights = ARENA_ARRAY(arena, test->scene.n_lights, bool),
                             .materials = ARENA_ARRAY(arena, test->scene.n_materials, bool)};
    Progress progress = {.kind = PROGRESS_NONE};
    Film *film = ARENA_NEW(arena, Film);
    film_init(film, arena, test->scene.film.layers, test->scene.film.width,
              test->scene.film.height);
    path_scene_init(&paths, arena, &test->scene);
    World *world = world_build(&test->scene, &options, &frame, 1, &test->reporter, &n_taken, stats);
    assert_non_null(world);
    const TilePass pass = {.frame = frame, .n = spp, .due = INFINITY};
    assert_int_equal(tiles_trace(&paths, world, &options, &pass, film, &progress, stats, &troubles),
                     TILES_DONE);
    world_destroy(world);
    assert_false(troubles.camera);
    assert_int_equal(stats->dropped_samples, 0);
    return film;
}

double test_pixel(const Film *film, int pixel, int c) {
    return (double)film->sum[pixel][c] / FILM_UNITS / film->n[pixel];
}

double test_channel(const Film *film, int x, int y, int c) {
    return test_pixel(film, y * (int)film->width + x, c);
}

void *test_film_bytes(const Film *film, Arena *arena, size_t *n) {
    FilmPlane planes[FILM_MAX_PLANES];
    uint32_t n_planes = film_planes(film, planes);
    size_t n_pixels = (size_t)film->width * film->height, n_words, at = 0;
    const uint32_t *words = film_save_ids(film, arena, &n_words);
    *n = n_words * sizeof *words;
    for (uint32_t i = 0; i < n_planes; i++) {
        *n += n_pixels * planes[i].size;
    }
    uint8_t *bytes = ARENA_ARRAY(arena, *n, uint8_t);
    for (uint32_t i = 0; i < n_planes; i++) {
        memcpy(bytes + at, planes[i].data, n_pixels * planes[i].size);
        at += n_pixels * planes[i].size;
    }
    if (n_words) {
        memcpy(bytes + at, words, n_words * sizeof *words);
    }
    return bytes;
}

void test_any_threads(void (*begin)(TestScene *test), TestTrace *trace) {
    static const uint32_t threads[] = {1, 2, 5};
    Arena arena = {0};
    void *first = NULL;
    size_t n_first = 0, n;
    for (int i = 0; i < 3; i++) {
        TestScene test;
        RenderStats stats = {0};
        begin(&test);
        test.n_threads = threads[i];
        void *bytes = test_film_bytes(trace(&test, 16, &stats), &arena, &n);
        first = i == 0 ? bytes : first;
        n_first = i == 0 ? n : n_first;
        assert_int_equal(n, n_first);
        assert_memory_equal(first, bytes, n);
        test_scene_free(&test);
    }
    arena_free(&arena);
}
