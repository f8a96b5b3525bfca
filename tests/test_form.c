// SPDX-License-Identifier: Apache-2.0
// What forms hold: baked worlds against placed ones, creases, packed normals.
#include "render/world_parts.h"
#include "tests/hand_scene.h"
#include "tests/near.h"

#include <string.h>

static const double PI = 3.141592653589793;

// Baked and not, the same things are hit at the same places, within the tolerance.
static void baking_keeps_the_picture(void **state) {
    (void)state;
    Arena arena = {0};
    Shape shapes[3] = {hand_mesh(mesh_cube(&arena, 1)), hand_mesh(mesh_cube(&arena, 1)),
                       hand_mesh(mesh_grid(&arena, 4, 8))};
    Affine mirror = {{{-2, 0, 0, 3}, {0, 2, 0, 0}, {0, 0, 2, 0}}};
    shapes[0].transform = program_turning(&arena, 5, vec3(-2, 0, 0), vec3(3, 0, 0));
    shapes[1].transform = program_affine(&arena, &mirror);
    Scene scene = hand_scene(&arena, shapes, 3, 50, 10);
    RenderOptions options = hand_options();
    options.tolerance = 0.01;
    World *worlds[2];
    WorldView *views[2];
    const int64_t frame = 3;
    uint32_t n_taken;
    RenderStats stats = {0};
    for (int k = 0; k < 2; k++) {
        options.bake = k;
        worlds[k] = world_build(&scene, &options, &frame, 1, NULL, &n_taken, &stats);
        views[k] = world_view_new(worlds[k]);
    }
    assert_int_equal(worlds[1]->parts.n_bodies, 1);
    uint64_t random = 1;
    int n_hits = 0, n_differ = 0;
    for (int k = 0; k < 2000; k++) {
        Instant at = {2, hand_random(&random)};
        Vec3 o = {8 * hand_random(&random) - 4, 4 * hand_random(&random) - 2, 20};
        Vec3 dir = {0.2 * hand_random(&random) - 0.1, 0.1, -1};
        WorldHit a, b;
        SurfacePoint p, q;
        world_view_time(views[0], at);
        world_view_time(views[1], at);
        bool is_hit = world_closest(views[0], o, dir, 0, INFINITY, &a);
        if (is_hit != world_closest(views[1], o, dir, 0, INFINITY, &b) ||
            (is_hit && (a.object != b.object || a.prim != b.prim))) {
            n_differ++; // at an edge
            continue;
        }
        if (is_hit) {
            world_surface(views[0], o, dir, &a, &p);
            world_surface(views[1], o, dir, &b, &q);
            assert_near(vec3_length(vec3_sub(p.P, q.P)), 0, 0.004);
            assert_near(vec3_dot(p.Ng, q.Ng), 1, 1e-4);
            assert_near(vec3_length(vec3_sub(p.velocity, q.velocity)), 0, 0.3);
            n_hits++;
        }
    }
    assert_true(n_hits > 800 && n_differ < 10);
    for (int k = 0; k < 2; k++) {
        world_view_destroy(views[k], NULL);
        world_destroy(worlds[k]);
    }
    arena_free(&arena);
}

static void creases_split_normals(void **state) {
    (void)state;
    Arena arena = {0};
    Mesh *cube = mesh_cube(&arena, 1);
    assert_int_equal(smoothing_new(&arena, cube, 30 * PI / 180, true).n_normals, 24);
    assert_int_equal(smoothing_new(&arena, cube, 90 * PI / 180, true).n_normals, 8);
    assert_null(smoothing_new(&arena, cube, -1, true).index);
    // Seams do not show: two vertices at one place share a normal.
    Mesh *grid = mesh_grid(&arena, 4, 1);
    grid->index[0] = grid->n_vertices - 1;
    memcpy(&grid->position[3 * (size_t)(grid->n_vertices - 1)], grid->position, 3 * sizeof(double));
    Smoothing s = smoothing_new(&arena, grid, 0.5, true);
    assert_int_equal(s.index[0], s.index[3]);
    arena_free(&arena);
}

static void normals_survive_packing(void **state) {
    (void)state;
    uint64_t random = 17;
    for (int k = 0; k < 20000; k++) {
        Vec3 n = {hand_random(&random) - 0.5, hand_random(&random) - 0.5,
                  hand_random(&random) - 0.5};
        n = k < 6 ? vec3(k == 0   ? 1
                         : k == 1 ? -1
                                  : 0,
                         k == 2   ? 1
                         : k == 3 ? -1
                                  : 0,
                         k == 4   ? 1
                         : k == 5 ? -1
                                  : 0)
                  : vec3_normalize(n);
        assert_near(vec3_length(vec3_sub(normal_unpack(normal_pack(n)), n)), 0, 7e-5);
    }
    assert_int_equal(normal_pack(vec3(0, 0, 0)), 0);
    assert_int_equal(normal_pack(vec3(NAN, 0, 1)), 0);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(baking_keeps_the_picture),
    cmocka_unit_test(creases_split_normals),
    cmocka_unit_test(normals_survive_packing),
};

SUITE(form, tests)
