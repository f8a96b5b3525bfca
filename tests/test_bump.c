// SPDX-License-Identifier: Apache-2.0
// Slopes of surfaces and the normals of bumps and normal maps, against closed forms.
#include "render/material.h"
#include "tests/hand_scene.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

// One shape, met by a ray from above that is a little off its middle.
typedef struct {
    Arena arena;
    Shape shape;
    Material material;
    Scene scene;
    World *world;
    WorldView *view;
    Vec3 dir;
    SurfacePoint point, beside[2];
    SurfaceSlope slope;
} Bumped;

static void bumped_init(Bumped *b, Shape shape, Material material, Vec3 origin, Vec3 dir) {
    Reports reports = {0};
    Reporter reporter = hand_reporter(&reports);
    RenderOptions options = hand_options();
    RenderStats stats = {0};
    const int64_t frame = 1;
    uint32_t n_taken;
    WorldHit hit;
    b->shape = shape;
    b->material = material;
    b->scene = hand_scene(&b->arena, &b->shape, 1, 10, 100);
    b->scene.materials = &b->material;
    b->scene.n_materials = 1;
    b->world = world_build(&b->scene, &options, &frame, 1, &reporter, &n_taken, &stats);
    b->view = world_view_new(b->world);
    b->dir = vec3_normalize(dir);
    assert_true(world_closest(b->view, origin, b->dir, 0, INFINITY, &hit));
    world_surface(b->view, origin, b->dir, &hit, &b->point);
    world_surface_slope(b->view, &hit, &b->point, &b->slope);
    material_beside(&b->point, &b->slope, b->dir, 1e-4, b->beside);
}

static void bumped_free(Bumped *b) {
    world_view_destroy(b->view, NULL);
    world_destroy(b->world);
    arena_free(&b->arena);
}

static Vec3 normal_of(Bumped *b) {
    Materials materials;
    const MaterialPlace place = {&b->point, b->beside, 0};
    materials_init(&materials, &b->arena, &b->scene);
    assert_true(materials.needs_neighbours);
    return material_normal(&materials, 0, &place, &b->slope, b->dir);
}

static Material matte(Arena *arena) {
    Code c = {.n = 0};
    const uint32_t half = code_number(&c, 0.5), out[3] = {half, half, half};
    return (Material){.kind = MATERIAL_MATTE, .program = code_done(&c, arena, out, 3)};
}

// input * factor, or the sine of that.
static const Program *program_of(Arena *arena, Input input, double factor, bool is_sine) {
    Code c = {.n = 0};
    uint32_t out = code_op(&c, OP_MUL, code_input(&c, input), code_number(&c, factor));
    out = is_sine ? code_op(&c, OP_SIN, out, out) : out;
    return code_done(&c, arena, &out, 1);
}

static void assert_vec(Vec3 a, Vec3 b, double within) {
    assert_near(a.x, b.x, within);
    assert_near(a.y, b.y, within);
    assert_near(a.z, b.z, within);
}

// A grid in the plane z = 0, under a transform that shears and scales: h = sin(8 x) / 8 of the
// world's x has the slope cos(8 x) in the plane.
static void bump_of_a_triangle(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        Bumped b = {.arena = {0}};
        Affine map = affine_identity();
        map.m[0][0] = i ? 3 : 1;
        map.m[0][1] = i ? 0.4 : 0;
        Shape shape = hand_mesh(mesh_grid(&b.arena, 4, 2));
        shape.transform = program_affine(&b.arena, &map);
        Material material = matte(&b.arena);
        Code c = {.n = 0};
        uint32_t x = code_op(&c, OP_MUL, code_input(&c, IN_WX), code_number(&c, 8));
        uint32_t h = code_op(&c, OP_DIV, code_op(&c, OP_SIN, x, x), code_number(&c, 8));
        material.height = code_done(&c, &b.arena, &h, 1);
        bumped_init(&b, shape, material, vec3(0.3, 0.2, 5), vec3(0.1, -0.05, -1));
        double slope = cos(8 * b.point.P.x);
        assert_vec(normal_of(&b), vec3_normalize(vec3(-slope, 0, 1)), 1e-3);
        bumped_free(&b);
    }
}

// A ball of radius r: h = 0.05 of its own y. On the ball that changes by 0.05 n.y' along a
// meridian, so that the normal is that of the surface p + h n, by the tangent of the meridian.
static void bump_of_a_sphere(void **state) {
    (void)state;
    Bumped b = {.arena = {0}};
    Material material = matte(&b.arena);
    material.height = program_of(&b.arena, IN_PY, 0.05, false);
    bumped_init(&b, hand_sphere(&b.arena, vec3(0, 0, 0), 2), material, vec3(0.4, 0.9, 9),
                vec3(0, 0, -1));
    Vec3 n = b.point.N, up = vec3_normalize(vec3_madd(vec3(0, 1, 0), -n.y, n));
    double rate = 0.05 * up.y; // per metre
    assert_vec(normal_of(&b), vec3_normalize(vec3_madd(n, -rate, up)), 1e-4);
    // The slopes themselves: east and north, a quarter of a turn of v in all.
    assert_near(vec3_dot(b.slope.P[0], n), 0, 1e-6);
    assert_near(vec3_dot(b.slope.P[1], up), 2, 1e-6);
    assert_near(b.slope.v[1], 1 / acos(-1), 1e-12);
    bumped_free(&b);
}

// A plane's u and v are metres: h = 0.2 u rises by a fifth along one axis across the normal.
static void bump_of_a_plane(void **state) {
    (void)state;
    Bumped b = {.arena = {0}};
    Code c = {.n = 0};
    const uint32_t out[4] = {code_number(&c, 0), code_number(&c, 0), code_number(&c, 1),
                             code_number(&c, 0)};
    Shape plane = {.kind = SHAPE_PLANE, .n_instances = 1};
    plane.geometry = code_done(&c, &b.arena, out, 4);
    Material material = matte(&b.arena);
    material.height = program_of(&b.arena, IN_U, 0.2, false);
    bumped_init(&b, plane, material, vec3(0.4, 0.9, 3), vec3(0.2, 0.1, -1));
    assert_vec(normal_of(&b), vec3_normalize(vec3(-0.2, 0, 1)), 1e-6);
    bumped_free(&b);
}

// On the grid u runs along x and v along y: the map's own vector is the normal.
static void normal_map_of_a_triangle(void **state) {
    (void)state;
    Bumped b = {.arena = {0}};
    const Vec3 wanted = vec3_normalize(vec3(0.3, -0.2, 0.8));
    Code c = {.n = 0};
    const uint32_t out[3] = {code_number(&c, 0.5 + 0.5 * wanted.x),
                             code_number(&c, 0.5 + 0.5 * wanted.y),
                             code_number(&c, 0.5 + 0.5 * wanted.z)};
    Mesh *mesh = mesh_grid(&b.arena, 3, 2);
    mesh->uv = ARENA_ARRAY(&b.arena, 2 * (size_t)mesh->n_vertices, float);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        mesh->uv[2 * i] = (float)(5 * mesh->position[3 * i]);
        mesh->uv[2 * i + 1] = (float)(3 * mesh->position[3 * i + 1]);
    }
    Material material = matte(&b.arena);
    material.normal = code_done(&c, &b.arena, out, 3);
    bumped_init(&b, hand_mesh(mesh), material, vec3(0.3, 0.2, 5), vec3(0, 0, -1));
    assert_vec(normal_of(&b), wanted, 1e-6);
    bumped_free(&b);
}

// However steep a bump, the normal is in sight: from the front and from behind.
static void bumps_stay_in_sight(void **state) {
    (void)state;
    for (int i = 0; i < 40; i++) {
        Bumped b = {.arena = {0}};
        Material material = matte(&b.arena);
        material.height = program_of(&b.arena, IN_WX, i % 2 ? 50 : -50, i % 3 == 0);
        Vec3 dir = vec3(0.05 * i - 1, 0.3, i % 4 < 2 ? -1 : 1);
        bumped_init(&b, hand_mesh(mesh_grid(&b.arena, 2, 9)), material, vec3_scale(dir, -2), dir);
        Vec3 n = normal_of(&b);
        double side = vec3_dot(b.point.Ng, b.dir) > 0 ? -1 : 1;
        assert_near(vec3_length(n), 1, 1e-12);
        assert_true(side * vec3_dot(n, b.dir) < 0);
        bumped_free(&b);
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(bump_of_a_triangle),  cmocka_unit_test(bump_of_a_sphere),
    cmocka_unit_test(bump_of_a_plane),     cmocka_unit_test(normal_map_of_a_triangle),
    cmocka_unit_test(bumps_stay_in_sight),
};

SUITE(bump, tests)
