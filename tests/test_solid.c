// SPDX-License-Identifier: Apache-2.0
// Triangles as solids: what is open is seen, hulls hold all points, masses are those of textbooks.
#include "render/sim_solid.h"

#include <math.h>
#include <string.h>

#include "accel/vec.h"
#include "tests/near.h"
#include "tests/suite.h"

// A box from the origin, of which the first n triangles are there.
static SimSolid box_solid(Arena *arena, const double size[3], uint32_t n) {
    static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                          {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                          {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    SimSolid solid = {8, n, ARENA_ARRAY(arena, 24, double), ARENA_ARRAY(arena, 36, uint32_t)};
    memcpy(solid.face, faces, sizeof faces);
    for (size_t i = 0; i < 24; i++) {
        solid.point[i] = i / 3 >> i % 3 & 1 ? size[i % 3] : 0;
    }
    return solid;
}

static void masses_are_those_of_boxes(void **state) {
    (void)state;
    Arena arena = {0};
    const double size[3] = {2, 3, 5};
    SimSolid solid = box_solid(&arena, size, 12);
    SimSolidMass m = sim_solid_mass(&solid);
    assert_near(m.mass, 30, 1e-12);
    for (int k = 0; k < 3; k++) {
        double a = size[(k + 1) % 3], b = size[(k + 2) % 3];
        assert_near(m.center[k], size[k] / 2, 1e-12);
        assert_near(m.moment[k], 30 * (a * a + b * b) / 12, 1e-11);
        assert_near(m.moment[3 + k], 0, 1e-11);
    }
    sim_solid_turn_over(&solid);
    assert_near(sim_solid_volume(&solid), -30, 1e-12);
    arena_free(&arena);
}

static void holes_are_counted(void **state) {
    (void)state;
    Arena arena = {0};
    const double size[3] = {1, 1, 1};
    SimSolid solid = box_solid(&arena, size, 12);
    assert_int_equal(sim_solid_n_open(&solid), 0);
    uint32_t *last = solid.face + 33, swap = last[0];
    last[0] = last[1]; // turned the other way
    last[1] = swap;
    assert_int_equal(sim_solid_n_open(&solid), 3);
    solid.n_faces = 11;
    assert_int_equal(sim_solid_n_open(&solid), 3);
    solid.n_faces = 10;
    assert_int_equal(sim_solid_n_open(&solid), 4);
    arena_free(&arena);
}

// Vertices at one place are joined, zeros of either sign too; faces without area go.
static void vertices_are_welded(void **state) {
    (void)state;
    Arena arena = {0};
    double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, -0.0, 0, 0, 1, 0, 0, 0, 0, 1};
    uint32_t index[] = {0, 1, 2, 3, 5, 4, 0, 3, 1};
    Mesh mesh = {.n_vertices = 6, .n_triangles = 3, .position = position, .index = index};
    SimSolid solid;
    assert_true(sim_solid_weld(&arena, &mesh, &solid));
    assert_int_equal(solid.n_points, 4);
    assert_int_equal(solid.n_faces, 2);
    position[4] = NAN;
    assert_false(sim_solid_weld(&arena, &mesh, &solid));
    arena_free(&arena);
}

static double random_to(uint32_t *state, double most) {
    *state = *state * 1664525 + 1013904223;
    return most * (*state >> 8) / 16777216.0;
}

// Closed, and no point outside of any face.
static void check_hull(const SimSolid *points, const SimSolid *hull, double bound) {
    assert_int_equal(sim_solid_n_open(hull), 0);
    assert_int_equal(hull->n_faces, 2 * hull->n_points - 4);
    for (uint32_t f = 0; f < hull->n_faces; f++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const double *at = hull->point + 3 * (size_t)hull->face[3 * f + (uint32_t)k];
            p[k] = vec3(at[0], at[1], at[2]);
        }
        Vec3 n = vec3_normalize(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])));
        for (uint32_t i = 0; i < points->n_points; i++) {
            const double *at = points->point + 3 * (size_t)i;
            assert_true(vec3_dot(n, vec3_sub(vec3(at[0], at[1], at[2]), p[0])) < bound);
        }
    }
}

static void hulls_hold_all_points(void **state) {
    (void)state;
    enum { N = 400 };
    Arena arena = {0};
    double point[3 * N];
    SimSolid solid = {.n_points = N, .point = point}, hull;
    uint32_t seed = 1;
    for (int kind = 0; kind < 4; kind++) {
        for (int round = 0; round < 10; round++) {
            for (int i = 0; i < N; i++) {
                double p[3], length = 0;
                for (int k = 0; k < 3; k++) {
                    p[k] = random_to(&seed, 2) - 1;
                    p[k] = kind == 2 ? floor(3 * p[k]) : p[k]; // many in one plane, many the same
                    length += p[k] * p[k];
                }
                for (int k = 0; k < 3; k++) {
                    double flat = kind == 3 && k == 2 ? 1e-6 : 1;
                    point[3 * i + k] = flat * (kind == 1 ? p[k] / sqrt(length) : p[k]);
                }
            }
            assert_true(sim_solid_hull(&arena, &solid, &hull));
            check_hull(&solid, &hull, 1e-7);
        }
    }
    arena_free(&arena);
}

static void hulls_of_boxes_are_boxes(void **state) {
    (void)state;
    Arena arena = {0};
    const double size[3] = {1, 2, 4}, flat[3] = {1, 2, 0};
    SimSolid solid = box_solid(&arena, size, 3), hull;
    assert_true(sim_solid_hull(&arena, &solid, &hull));
    assert_int_equal(hull.n_points, 8);
    assert_int_equal(hull.n_faces, 12);
    assert_near(sim_solid_volume(&hull), 8, 1e-12);
    solid = box_solid(&arena, flat, 12);
    assert_false(sim_solid_hull(&arena, &solid, &hull));
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(masses_are_those_of_boxes), cmocka_unit_test(holes_are_counted),
    cmocka_unit_test(vertices_are_welded),       cmocka_unit_test(hulls_hold_all_points),
    cmocka_unit_test(hulls_of_boxes_are_boxes),
};

SUITE(solid, tests)
