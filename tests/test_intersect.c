// SPDX-License-Identifier: Apache-2.0
// The float kernels against the oracle, at edges and vertices, on bad input, on all processors.
#include "accel/cpu.h"
#include "tests/accel_scenes.h"
#include "tests/suite.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool closest(const Accel *accel, const AccelRay *ray, AccelHit *hit) {
    return accel->type->closest(accel, ray, hit, NULL);
}

static Accel *build_brute(const Geometry *geometry) {
    AccelOptions options = accel_options_default();
    AccelStats stats;
    return accel_find("brute")->build(geometry, &options, &stats);
}

// Distances agree to 4e-6 of the size of things; ids and misses differ only where the oracle says
// edge or tie.
static void expect_as_oracle(const TestScene *s, int n_rays, uint64_t seed) {
    Accel *brute = build_brute(&s->geometry);
    int n_hits = 0;
    for (int i = 0; i < n_rays; i++) {
        AccelRay ray = ray_random(&s->geometry, &seed);
        AccelHit hit;
        OracleHit oracle;
        bool a = closest(brute, &ray, &hit), b = accel_oracle(&s->geometry, &ray, &oracle);
        n_hits += b;
        if (a != b) {
            assert_true(oracle.margin < 1e-3);
        } else if (a && hit.prim != oracle.prim) {
            assert_true(oracle.margin < 1e-3 || fabs(oracle.second_t - oracle.t) < 4e-6);
        } else if (a && oracle.margin > 1e-3) {
            if (!(fabs(hit.t - oracle.t) < 4e-6 * (1 + 1 / oracle.margin))) {
                print_message("ray %d: t %.9g, oracle %.9g, margin %g\n", i, hit.t, oracle.t,
                              oracle.margin);
                fail();
            }
        }
    }
    assert_true(n_hits > n_rays / 20);
    brute->type->destroy(brute);
}

static void intersect_agrees_with_oracle(void **state) {
    (void)state;
    TestScene scenes[] = {scene_propeller(9, 1), scene_head(12, 21, 0.1, 3),
                          scene_soup(200, 4, 0.1, 0.1, 5), scene_spheres(100, 4, 0.05, 0.05, 6)};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        expect_as_oracle(&scenes[i], 3000, i);
        scene_free(&scenes[i]);
    }
}

static AccelRay towards(const float from[3], const double to[3], uint32_t key, float f) {
    AccelRay ray = {.tmin = 0, .tmax = INFINITY, .f = f, .key = key};
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = from[i];
        ray.dir[i] = (float)(to[i] - from[i]);
    }
    return ray;
}

// From inside a closed mesh that moves, at its own vertices and the middles of its edges.
static void intersect_lets_nothing_escape(void **state) {
    (void)state;
    TestScene s = scene_head(16, 5, 0, 1);
    Accel *brute = build_brute(&s.geometry);
    uint64_t seed = 3;
    uint32_t n_vertices = s.geometry.n_vertices;
    for (int i = 0; i < 6000; i++) {
        uint32_t key = (uint32_t)(test_random(&seed) % 4),
                 triangle = (uint32_t)(test_random(&seed) % s.geometry.n_prims);
        float f = i % 3 ? (float)test_uniform(&seed) : (float)(i % 2);
        const uint32_t *index = s.index + 3 * triangle;
        double to[3];
        float from[3];
        for (int k = 0; k < 3; k++) {
            const float *a = s.position + 3 * (size_t)(n_vertices * key) + k,
                        *b = a + 3 * n_vertices;
            double v0 = a[3 * index[0]] + f * ((double)b[3 * index[0]] - a[3 * index[0]]);
            double v1 = a[3 * index[1]] + f * ((double)b[3 * index[1]] - a[3 * index[1]]);
            to[k] = i % 2 ? v0 : (v0 + v1) / 2;
            from[k] = i % 5 ? (float)(0.3 * (test_uniform(&seed) - 0.5)) : 0;
        }
        AccelRay ray = towards(from, to, key, f);
        AccelHit hit;
        assert_true(closest(brute, &ray, &hit));
        assert_true(hit.u >= 0 && hit.v >= 0 && hit.u + hit.v < 1.00001f);
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

static void intersect_holds_moving_spheres(void **state) {
    (void)state;
    TestScene s = scene_spheres(1, 5, 0.3, 0.1, 9);
    Accel *brute = build_brute(&s.geometry);
    uint64_t seed = 4;
    for (int i = 0; i < 20000; i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        const float *a = s.position + 3 * ray.key, *b = a + 3;
        double r = s.radius[ray.key] + ray.f * ((double)s.radius[ray.key + 1] - s.radius[ray.key]);
        double in = r * (i % 2 ? 0.999 : 0.5) / sqrt(3);
        for (int k = 0; k < 3; k++) {
            ray.origin[k] =
                (float)(a[k] + ray.f * ((double)b[k] - a[k]) + in * (2 * test_uniform(&seed) - 1));
        }
        AccelHit hit;
        assert_true(closest(brute, &ray, &hit));
        assert_true(hit.t > 0);
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

// Any order of the vertices, any copy: the lowest id, and one distance.
static void intersect_takes_lowest_of_coincident(void **state) {
    (void)state;
    static const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                     {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    uint64_t seed = 8;
    int n_hits = 0;
    for (int round = 0; round < 300; round++) {
        TestScene one = scene_soup(1, 3, 0.4, 0.1, (uint64_t)round);
        TestScene s = scene_new(GEOMETRY_TRIANGLES, 6, 18, 3);
        for (uint32_t i = 0; i < 18; i++) {
            s.index[i] = i;
            for (uint32_t k = 0; k < 3; k++) {
                memcpy(s.position + 3 * (18 * k + i),
                       one.position +
                           3 * (3 * k + (uint32_t)orders[(i / 3 + (uint32_t)round) % 6][i % 3]),
                       12);
            }
        }
        Accel *brute = build_brute(&s.geometry);
        for (int i = 0; i < 40; i++) {
            AccelRay ray = ray_random(&s.geometry, &seed);
            AccelHit hit;
            if (closest(brute, &ray, &hit)) {
                n_hits++;
                assert_int_equal(hit.prim, 0);
            }
        }
        brute->type->destroy(brute);
        scene_free(&s);
        scene_free(&one);
    }
    assert_true(n_hits > 500);
}

// Weights belong to the vertices of index[prim], in that order.
static void intersect_weights_give_the_point(void **state) {
    (void)state;
    TestScene s = scene_soup(100, 3, 0.2, 0.1, 21);
    Accel *brute = build_brute(&s.geometry);
    uint64_t seed = 2;
    for (int i = 0; i < 2000; i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        AccelHit hit;
        OracleHit oracle;
        if (closest(brute, &ray, &hit) && accel_oracle(&s.geometry, &ray, &oracle) &&
            hit.prim == oracle.prim && oracle.margin > 0.01) {
            assert_true(fabs(hit.u - oracle.u) < 1e-3 && fabs(hit.v - oracle.v) < 1e-3);
        }
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

static void expect_miss(const Accel *accel, AccelRay ray) {
    AccelHit hit;
    assert_false(closest(accel, &ray, &hit));
    assert_int_equal(hit.prim, ACCEL_NO_PRIM);
    assert_false(accel->type->occluded(accel, &ray, NULL));
}

static void intersect_refuses_bad_rays(void **state) {
    (void)state;
    TestScene s = scene_head(8, 3, 0, 0);
    Accel *brute = build_brute(&s.geometry);
    const float bad[] = {NAN, INFINITY, -INFINITY};
    AccelRay good = {.dir = {0.1f, 0.2f, 1}, .tmin = 0, .tmax = 10, .f = 0.5f};
    AccelHit hit;
    assert_true(closest(brute, &good, &hit));
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            AccelRay ray = good;
            ray.origin[k] = bad[i];
            expect_miss(brute, ray);
            ray = good;
            ray.dir[k] = bad[i];
            expect_miss(brute, ray);
        }
        AccelRay ray = good;
        ray.tmin = bad[i];
        expect_miss(brute, ray);
        ray = good;
        ray.f = bad[i];
        expect_miss(brute, ray);
    }
    AccelRay ray = good;
    ray.tmax = NAN;
    expect_miss(brute, ray);
    ray = good;
    ray.key = 2;
    expect_miss(brute, ray);
    ray = good;
    memset(ray.dir, 0, sizeof ray.dir);
    expect_miss(brute, ray);
    ray = good;
    ray.tmax = INFINITY;
    assert_true(closest(brute, &ray, &hit));
    brute->type->destroy(brute);
    scene_free(&s);
}

// A direction times any power of two gives the distance divided by it.
static void intersect_takes_any_length_of_direction(void **state) {
    (void)state;
    TestScene s = scene_head(8, 3, 0.1, 1);
    Accel *brute = build_brute(&s.geometry);
    uint64_t seed = 6;
    for (int i = 0; i < 2000; i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        AccelHit hit, scaled;
        bool is_hit = closest(brute, &ray, &hit);
        int e = (int)(test_random(&seed) % 240) - 120;
        for (int k = 0; k < 3; k++) {
            ray.dir[k] = ldexpf(ray.dir[k], e);
        }
        // Small components may have been lost on the way down; only whole rays are compared.
        bool whole = fabsf(ray.dir[0]) > FLT_MIN && fabsf(ray.dir[1]) > FLT_MIN &&
                     fabsf(ray.dir[2]) > FLT_MIN;
        if (whole && isfinite(ldexpf(1, -e) * 4)) {
            assert_int_equal(closest(brute, &ray, &scaled), is_hit);
            if (is_hit) {
                assert_int_equal(hit.prim, scaled.prim);
                assert_true(ldexpf(hit.t, -e) == scaled.t);
            }
        }
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

// So short a direction that what it hits is beyond the largest distance, or just within.
static void intersect_takes_denormal_directions(void **state) {
    (void)state;
    TestScene s = scene_new(GEOMETRY_TRIANGLES, 1, 3, 1);
    const float corners[9] = {1e-3f, -1, -1, 1e-3f, 1, -1, 1e-3f, 0, 1};
    memcpy(s.position, corners, sizeof corners);
    s.index[1] = 1, s.index[2] = 2;
    Accel *brute = build_brute(&s.geometry);
    AccelRay ray = {.dir = {0x1p-149f, 0, 0}, .tmax = INFINITY};
    AccelHit hit;
    assert_false(closest(brute, &ray, &hit)); // 7e41
    ray.dir[0] = 0x1p-132f;
    assert_true(closest(brute, &ray, &hit)); // 5e36
    assert_true(fabsf(hit.t / ldexpf(1e-3f, 132) - 1) < 1e-6f);
    brute->type->destroy(brute);
    scene_free(&s);
}

static void intersect_never_hits_degenerate(void **state) {
    (void)state;
    // A point, a line of distinct vertices, two equal vertices, and vertices that are no numbers.
    static const float at[5][3][3] = {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                                      {{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}},
                                      {{-1, 0, 0}, {-1, 0, 0}, {1, 0, 0}},
                                      {{NAN, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                                      {{INFINITY, 0, 0}, {0, 1, 0}, {-1, -1, 0}}};
    uint64_t seed = 1;
    for (int i = 0; i < 5; i++) {
        TestScene s = scene_new(GEOMETRY_TRIANGLES, 1, 3, 2);
        s.index[1] = 1, s.index[2] = 2;
        memcpy(s.position, at[i], sizeof at[i]);
        memcpy(s.position + 9, at[i], sizeof at[i]);
        Accel *brute = build_brute(&s.geometry);
        for (int k = 0; k < 1000; k++) {
            AccelRay ray = ray_random(&s.geometry, &seed);
            // At it, exactly; but three points on a line are a sliver once they are rounded.
            if (k % 2 && i != 1) {
                for (int j = 0; j < 3; j++) {
                    ray.dir[j] = -ray.origin[j];
                }
            }
            expect_miss(brute, ray);
        }
        brute->type->destroy(brute);
        scene_free(&s);
    }
}

static void intersect_is_alike_on_all_processors(void **state) {
    (void)state;
    TestScene scenes[] = {scene_head(12, 5, 0.1, 3), scene_spheres(50, 4, 0.1, 0.05, 6)};
    for (int k = 0; k < 2; k++) {
        assert_true(cpu_set("scalar"));
        assert_int_equal(cpu_now(), CPU_SCALAR);
        Accel *scalar = build_brute(&scenes[k].geometry);
        for (int cpu = CPU_SCALAR + 1; cpu < CPU_COUNT; cpu++) {
            assert_int_equal(cpu_set(cpu_names[cpu]), cpu_has((Cpu)cpu));
            Accel *other = build_brute(&scenes[k].geometry);
            uint64_t seed = 5;
            for (int i = 0; i < 3000; i++) {
                AccelRay ray = ray_random(&scenes[k].geometry, &seed);
                AccelHit a = {0}, b = {0};
                closest(other, &ray, &a);
                closest(scalar, &ray, &b);
                assert_memory_equal(&a, &b, sizeof a);
            }
            other->type->destroy(other);
        }
        scalar->type->destroy(scalar);
        scene_free(&scenes[k]);
    }
    assert_false(cpu_set("abacus"));
    assert_true(cpu_set(NULL));
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(intersect_agrees_with_oracle),
    cmocka_unit_test(intersect_lets_nothing_escape),
    cmocka_unit_test(intersect_holds_moving_spheres),
    cmocka_unit_test(intersect_takes_lowest_of_coincident),
    cmocka_unit_test(intersect_weights_give_the_point),
    cmocka_unit_test(intersect_refuses_bad_rays),
    cmocka_unit_test(intersect_takes_any_length_of_direction),
    cmocka_unit_test(intersect_takes_denormal_directions),
    cmocka_unit_test(intersect_never_hits_degenerate),
    cmocka_unit_test(intersect_is_alike_on_all_processors),
};

SUITE(intersect, tests)
