// SPDX-License-Identifier: Apache-2.0
// The trees against brute force, bit for bit, on what is easy and what is nasty.
// STRESS=1 in the environment: 10,000 triangles and 100,000 rays instead of the quick sizes.
#include "accel/cpu.h"
#include "tests/accel_scenes.h"
#include "tests/suite.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const structures[] = {"kd4-thesis", "bvh16", "kd3"};
enum { STRUCTURES = 3, SLOW = 2 }; // from SLOW on

static bool is_stress(void) {
    return getenv("STRESS") != NULL;
}

static Accel *build(const char *name, const Geometry *geometry, const AccelOptions *options,
                    AccelStats *stats) {
    AccelStats own;
    Accel *accel = accel_find(name)->build(geometry, options, stats ? stats : &own);
    char why[300] = "";
    if (!accel->type->validate(accel, why, sizeof why)) {
        fail_msg("%s is not valid: %s", name, why);
    }
    return accel;
}

static void print_ray(const char *name, const AccelRay *r, const AccelHit *a, const AccelHit *b) {
    print_message("%s: ray {{%a, %a, %a}, {%a, %a, %a}, %a, %a, %a, %u}: prim %d t %a u %a v %a; "
                  "brute: prim %d t %a u %a v %a\n",
                  name, r->origin[0], r->origin[1], r->origin[2], r->dir[0], r->dir[1], r->dir[2],
                  r->tmin, r->tmax, r->f, r->key, a->prim, a->t, a->u, a->v, b->prim, b->t, b->u,
                  b->v);
}

static bool expect_hit(const Accel *accel, const AccelRay *ray, bool is_hit, const AccelHit *hit) {
    AccelHit a = {0};
    bool hit_a = accel->type->closest(accel, ray, &a, NULL);
    if (hit_a != is_hit || memcmp(&a, hit, sizeof a) != 0) {
        print_ray(accel->type->name, ray, &a, hit);
        fail();
    }
    assert_int_equal(accel->type->occluded(accel, ray, NULL), is_hit);
    return is_hit;
}

static bool expect_same(const Accel *accel, const Accel *brute, const AccelRay *ray) {
    AccelHit b = {0};
    bool is_hit = brute->type->closest(brute, ray, &b, NULL);
    return expect_hit(accel, ray, is_hit, &b);
}

// A random ray, or one of those that are known to break things.
static AccelRay make_ray(const Geometry *geometry, int i, uint64_t *seed) {
    AccelRay ray = ray_random(geometry, seed);
    uint32_t n_spans = geometry->n_keys > 1 ? geometry->n_keys - 1 : 1;
    uint64_t r = test_random(seed);
    const float *vertex =
        geometry->position +
        3 * (test_random(seed) % ((uint64_t)geometry->n_keys * geometry->n_vertices));
    static const float small[] = {0, -0.0f, 1e-45f, -1e-40f, 1e-38f, -1e-30f, 1e-20f};
    int axis = (int)((r >> 8) % 3);
    switch (i % 16) {
    case 0: // along an axis
        ray.dir[(axis + 1) % 3] = small[(r >> 16) % 7];
        ray.dir[(axis + 2) % 3] = small[(r >> 24) % 7];
        break;
    case 1: // along an axis, at a vertex: in the planes that its edges give
        ray.dir[(axis + 1) % 3] = ray.dir[(axis + 2) % 3] = 0;
        ray.origin[(axis + 1) % 3] = vertex[(axis + 1) % 3];
        ray.origin[(axis + 2) % 3] = vertex[(axis + 2) % 3];
        break;
    case 2: // at a vertex
        for (int k = 0; k < 3; k++) {
            ray.dir[k] = vertex[k] - ray.origin[k];
        }
        break;
    case 3: // from a vertex
        memcpy(ray.origin, vertex, sizeof ray.origin);
        break;
    case 4: // on a key
        ray.f = r & 256 ? 1 : 0;
        break;
    case 5: // on a tick, and next to it
        ray.f = (float)(r >> 8 & 15) / 16;
        ray.f = r & 1 ? nextafterf(ray.f, 1) : r & 2 ? fmaxf(nextafterf(ray.f, -1), 0) : ray.f;
        break;
    case 6: // a short one, forwards and backwards
        ray.tmin = (float)(test_uniform(seed) - 0.5);
        ray.tmax = ray.tmin + (float)test_uniform(seed);
        break;
    case 7: // long and short directions
        for (int k = 0; k < 3; k++) {
            ray.dir[k] = ldexpf(ray.dir[k], (int)(r >> 8 & 255) - 128);
        }
        break;
    case 8: // nearly in a plane
        ray.dir[axis] = small[(r >> 16) % 7];
        ray.origin[axis] = vertex[axis];
        break;
    case 9: // from far away; from very far all nodes of a tree are met, which takes its time
        for (int k = 0; k < 3; k++) {
            ray.origin[k] -= ray.dir[k] * ldexpf(1, (int)(r >> 8 & (is_stress() ? 7 : 31)));
        }
        ray.tmin = r & 1 ? -1e10f : 0;
        break;
    case 10: // the end of time
        ray.key = n_spans - 1;
        ray.f = 1;
        break;
    case 11: // behind
        ray.tmin = -10;
        break;
    }
    return ray;
}

// The same ray, ended exactly at the hit, and just before it; and begun just before it, and at it.
static void expect_exact_ends(const Accel *accel, const Accel *brute, AccelRay ray, float t) {
    ray.tmax = t;
    assert_true(expect_same(accel, brute, &ray));
    ray.tmin = nextafterf(t, -INFINITY);
    assert_true(expect_same(accel, brute, &ray));
    ray.tmin = t;
    ray.tmax = INFINITY;
    expect_same(accel, brute, &ray);
    ray.tmin = fminf(0, t - 1);
    ray.tmax = nextafterf(t, -INFINITY);
    expect_same(accel, brute, &ray);
}

static void expect_as_brute(const TestScene *s, const AccelOptions *options, int n_rays,
                            double least_hits, uint64_t seed) {
    Accel *brute = build("brute", &s->geometry, options, NULL), *accels[STRUCTURES];
    for (int k = 0; k < STRUCTURES; k++) {
        accels[k] = build(structures[k], &s->geometry, options, NULL);
    }
    int n_hits = 0;
    for (int i = 0; i < n_rays; i++) {
        AccelRay ray = make_ray(&s->geometry, i, &seed);
        AccelHit hit = {0};
        bool is_hit = brute->type->closest(brute, &ray, &hit, NULL);
        n_hits += is_hit;
        for (int k = 0; k < STRUCTURES; k++) {
            if (k >= SLOW && n_rays > 20000 && i % 20 != 0) {
                continue; // a tree without cuts in time is as slow as brute force on the head
            }
            expect_hit(accels[k], &ray, is_hit, &hit);
            if (is_hit && i % 16 == 12) {
                expect_exact_ends(accels[k], brute, ray, hit.t);
            }
        }
    }
    assert_true(n_hits >= least_hits * n_rays);
    for (int k = 0; k < STRUCTURES; k++) {
        accels[k]->type->destroy(accels[k]);
    }
    brute->type->destroy(brute);
}

static void kd4_is_brute_on_propeller(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    TestScene s = scene_propeller(is_stress() ? 9 : 5, 0.5);
    expect_as_brute(&s, &options, is_stress() ? 100000 : 2000, 0.05, 1);
    scene_free(&s);
}

static void kd4_is_brute_on_head(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    TestScene s = scene_head(is_stress() ? 51 : 20, is_stress() ? 21 : 11, 0.02, 3);
    expect_as_brute(&s, &options, is_stress() ? 100000 : 1000, 0.3, 2);
    scene_free(&s);
}

static void kd4_is_brute_on_bumpy_sphere(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    TestScene s = scene_head(is_stress() ? 51 : 18, 3, 0.25, 0.4);
    expect_as_brute(&s, &options, is_stress() ? 100000 : 5000, 0.3, 3);
    scene_free(&s);
}

static void kd4_is_brute_on_soups(void **state) {
    (void)state;
    uint64_t seed = 77;
    for (uint32_t i = 0; i < (is_stress() ? 200u : 24u); i++) {
        AccelOptions options = accel_options_default();
        options.leaf_size = i % 5;
        options.kappa = 1.1 + 3 * test_uniform(&seed);
        options.max_depth = i % 7 == 6 ? 5 : 0;
        uint32_t n = 1 + (uint32_t)(test_random(&seed) % 200), n_keys = 1 + i % 6;
        double size = pow(10, -3 * test_uniform(&seed)), wander = i % 3 ? 0.2 * size : 0.5;
        TestScene s = scene_soup(n, n_keys, size, wander, i);
        expect_as_brute(&s, &options, 1000, 0, i);
        scene_free(&s);
        s = scene_spheres(n, n_keys, size, wander, i);
        expect_as_brute(&s, &options, 1000, 0, i);
        scene_free(&s);
    }
}

// Cubes on a grid: every face is in planes that many edges share, rays run along them.
static void kd4_is_brute_on_grid(void **state) {
    (void)state;
    enum { SIDE = 4 };
    TestScene s = scene_new(GEOMETRY_TRIANGLES, 12 * SIDE * SIDE * SIDE, 8 * SIDE * SIDE * SIDE, 2);
    static const uint32_t quads[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
    for (uint32_t c = 0; c < SIDE * SIDE * SIDE; c++) {
        for (uint32_t v = 0; v < 8; v++) {
            for (uint32_t k = 0; k < 2; k++) {
                float *p = s.position + 3 * (8 * SIDE * SIDE * SIDE * k + 8 * c + v);
                p[0] = (float)(c % SIDE) / SIDE + (v & 1 ? 0.25f : 0) - 0.5f;
                p[1] = (float)(c / SIDE % SIDE) / SIDE + (v & 2 ? 0.125f : 0) - 0.5f;
                p[2] = (float)(c / SIDE / SIDE) / SIDE + (v & 4 ? 0.125f : 0) - 0.5f +
                       (k ? 0.125f : 0);
            }
        }
        for (uint32_t q = 0; q < 6; q++) {
            static const uint32_t corner[6] = {0, 1, 2, 0, 2, 3};
            for (uint32_t i = 0; i < 6; i++) {
                s.index[3 * (12 * c + 2 * q) + i] = 8 * c + quads[q][corner[i]];
            }
        }
    }
    AccelOptions options = accel_options_default();
    expect_as_brute(&s, &options, 3000, 0.1, 1);
    Accel *brute = build("brute", &s.geometry, &options, NULL);
    for (int k = 0; k < STRUCTURES; k++) {
        Accel *accel = build(structures[k], &s.geometry, &options, NULL);
        for (int i = 0; i < 26 * 125; i++) { // all 26 directions, from the points of the grid
            int d = i % 26 + (i % 26 > 12), o = i / 26;
            AccelRay ray = {.tmax = INFINITY, .f = (float)(i % 3) / 2};
            int dir[3] = {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
            int at[3] = {o % 5, o / 5 % 5, o / 25};
            for (int j = 0; j < 3; j++) {
                ray.dir[j] = (float)dir[j];
                ray.origin[j] = (float)at[j] / 4 - 0.5f - 2 * ray.dir[j];
            }
            expect_same(accel, brute, &ray);
        }
        accel->type->destroy(accel);
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

// Triangles that close to a point or a line and open again, slivers, things that fly far.
static void kd4_is_brute_on_degenerate(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    uint64_t seed = 31;
    TestScene s = scene_soup(120, 5, 0.1, 0.02, 4);
    uint32_t n = s.geometry.n_vertices;
    for (uint32_t prim = 0; prim < 120; prim++) {
        float *key = s.position + 3 * (size_t)(3 * prim), *at = key + 3 * (size_t)n * (prim % 5);
        switch (prim % 6) {
        case 0: // a point on one key
            memcpy(at + 3, at, 12);
            memcpy(at + 6, at, 12);
            break;
        case 1: // a line along an axis on one key
            at[4] = at[7] = at[1];
            at[5] = at[8] = at[2];
            break;
        case 2: // always a sliver
            for (uint32_t k = 0; k < 5; k++) {
                for (int i = 0; i < 3; i++) {
                    key[3 * n * k + 6 + (uint32_t)i] =
                        key[3 * n * k + (uint32_t)i] + (float)pow(10, -3 - prim % 10);
                }
            }
            break;
        case 3: // always a point
            for (uint32_t k = 0; k < 5; k++) {
                memcpy(key + 3 * n * k + 3, key + 3 * n * k, 12);
                memcpy(key + 3 * n * k + 6, key + 3 * n * k, 12);
            }
            break;
        case 4: // flies 1e6 of its size
            for (int i = 0; i < 9; i++) {
                at[i] *= 1e5f;
            }
            break;
        }
    }
    expect_as_brute(&s, &options, 6000, 0, seed);
    scene_free(&s);
}

static void kd4_is_brute_on_what_is_not_finite(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    options.leaf_size = 1;
    uint64_t seed = 13;
    const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (int kind = 0; kind < 2; kind++) {
        TestScene s = kind ? scene_spheres(60, 6, 0.1, 0.1, 4) : scene_soup(60, 6, 0.1, 0.1, 4);
        for (uint32_t i = 0; i < 40; i++) {
            size_t at = test_random(&seed) % (3 * (uint64_t)s.geometry.n_vertices * 6);
            s.position[at] = bad[i % 5];
            if (kind) {
                s.radius[at / 3] = i % 6 ? bad[i % 3] : -1;
            }
        }
        AccelStats stats;
        Accel *accel = build("kd4-thesis", &s.geometry, &options, &stats);
        assert_true(stats.n_dropped > 10 && stats.n_dropped < 60);
        accel->type->destroy(accel);
        expect_as_brute(&s, &options, 4000, 0.05, 7);
        scene_free(&s);
    }
}

// Spans that no ray falls into: what jumps over them is not swept.
static void kd4_leaves_gaps_out(void **state) {
    (void)state;
    TestScene s = scene_soup(100, 7, 0.05, 0.01, 9);
    for (uint32_t k = 0; k < 7; k++) { // spans 2 and 4 are jumps
        for (size_t i = 0; i < 3 * (size_t)s.geometry.n_vertices; i++) {
            s.position[3 * (size_t)s.geometry.n_vertices * k + i] += k > 4   ? -40.0f
                                                                     : k > 2 ? 50.0f
                                                                             : 0.0f;
        }
    }
    s.share[2] = s.share[4] = 0;
    AccelOptions options = accel_options_default();
    options.kappa = 1e30;
    AccelStats stats;
    Accel *brute = build("brute", &s.geometry, &options, NULL);
    Accel *accel = build("kd4-thesis", &s.geometry, &options, &stats);
    assert_int_equal(stats.n_segments, 300);
    assert_true(stats.kappa_max < 5);
    uint64_t seed = 3;
    for (int i = 0; i < 5000; i++) {
        AccelRay ray = make_ray(&s.geometry, i, &seed);
        for (int k = 0; k < 3; k++) {
            ray.origin[k] += ray.key > 4 ? 10.0f : ray.key > 2 ? 50.0f : 0.0f;
        }
        if (s.share[ray.key] > 0) {
            expect_same(accel, brute, &ray);
        }
    }
    accel->type->destroy(accel);
    brute->type->destroy(brute);
    scene_free(&s);
}

static void kd4_keeps_memory_bound(void **state) {
    (void)state;
    TestScene s = scene_head(10, 9, 0.1, 3);
    AccelOptions options = accel_options_default();
    Accel *brute = build("brute", &s.geometry, &options, NULL);
    for (int k = 0; k < STRUCTURES; k++) {
        options.memory = 0;
        AccelStats whole, stats;
        Accel *accel = build(structures[k], &s.geometry, &options, &whole);
        accel->type->destroy(accel);
        assert_int_equal(whole.leaves_by[LEAF_BY_MEMORY], 0);
        assert_true(whole.peak_bytes >= whole.tree_bytes + whole.segment_bytes);
        static const double shares[] = {1e-9, 0.001, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5,
                                        0.7,  0.9,   0.99, 1,    1.5, 2,   4};
        uint64_t seed = 3;
        for (size_t i = 0; i < sizeof shares / sizeof shares[0]; i++) {
            options.memory = 1000 + (size_t)(shares[i] * (double)whole.peak_bytes);
            accel = build(structures[k], &s.geometry, &options, &stats);
            assert_true(stats.peak_bytes <= options.memory);
            assert_true(stats.tree_bytes + stats.segment_bytes <= stats.peak_bytes);
            assert_true(shares[i] < 1 || stats.n_nodes == whole.n_nodes);
            for (int j = 0; j < 300; j++) {
                AccelRay ray = make_ray(&s.geometry, j, &seed);
                expect_same(accel, brute, &ray);
            }
            accel->type->destroy(accel);
        }
    }
    brute->type->destroy(brute);
    scene_free(&s);
}

static void kd4_counts_truly(void **state) {
    (void)state;
    TestScene s = scene_head(10, 9, 0.1, 2);
    AccelOptions options = accel_options_default();
    AccelStats a, b;
    Accel *accel = build("kd4-thesis", &s.geometry, &options, &a);
    uint64_t n_leaves = 0;
    for (int i = 0; i < LEAF_REASONS; i++) {
        n_leaves += a.leaves_by[i];
    }
    assert_int_equal(n_leaves, a.n_leaves);
    assert_int_equal(a.n_nodes, 2 * a.n_leaves - 1);
    assert_int_equal(a.n_prims, s.geometry.n_prims);
    assert_true(a.n_segments > a.n_prims && a.n_time_splits > 0);
    assert_true(a.tree_bytes >= 8 * a.n_nodes + 4 * a.n_references);
    assert_true(a.tree_bytes < 8 * a.n_nodes + 4 * a.n_references + 500);
    assert_int_equal(a.segment_bytes, 12 * a.n_segments);
    assert_true(a.kappa_min >= 1 - 1e-6 && a.kappa_median >= a.kappa_min &&
                a.kappa_max >= a.kappa_median);
    AccelCounters count = {0};
    uint64_t seed = 1;
    AccelHit hit;
    for (int i = 0; i < 100; i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        accel->type->closest(accel, &ray, &hit, &count);
    }
    assert_int_equal(count.rays, 100);
    assert_true(count.nodes > 100 && count.prim_tests < 100 * a.n_prims);
    accel->type->destroy(accel);
    options.n_threads = 2;
    accel = build("kd4-thesis", &s.geometry, &options, &b);
    assert_true(b.n_nodes == a.n_nodes && b.n_references == a.n_references);
    accel->type->destroy(accel);
    accel = build("kd3", &s.geometry, &options, &b);
    assert_true(b.n_segments == a.n_segments && b.n_time_splits == 0);
    accel->type->destroy(accel);
    scene_free(&s);
}

static void kd4_takes_nothing_and_one(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    for (uint32_t n = 0; n < 3; n++) {
        for (uint32_t n_keys = 1; n_keys < 4; n_keys++) {
            TestScene s = scene_soup(n, n_keys, 0.4, 0.1, n);
            s.geometry.span_share = n_keys == 2 ? NULL : s.share;
            for (int k = 0; k < STRUCTURES && n == 0; k++) {
                Accel *accel = build(structures[k], &s.geometry, &options, NULL);
                AccelRay ray = {.dir = {0, 0, 1}, .tmax = 1};
                AccelHit hit;
                assert_false(accel->type->closest(accel, &ray, &hit, NULL));
                assert_int_equal(hit.prim, ACCEL_NO_PRIM);
                assert_false(accel->type->occluded(accel, &ray, NULL));
                accel->type->destroy(accel);
            }
            if (n > 0) {
                expect_as_brute(&s, &options, 500, 0, n);
            }
            scene_free(&s);
        }
    }
}

// Many copies of the same: the build ends, the lowest wins.
static void kd4_ends_on_coincident(void **state) {
    (void)state;
    enum { COPIES = 2000 };
    AccelOptions options = accel_options_default();
    TestScene s = scene_new(GEOMETRY_TRIANGLES, COPIES, 3, 3);
    TestScene one = scene_soup(1, 3, 0.4, 0.1, 5);
    memcpy(s.position, one.position, 27 * sizeof(float));
    for (uint32_t i = 0; i < 3 * COPIES; i++) {
        s.index[i] = (i % 3 + i / 3) % 3;
    }
    AccelStats stats;
    Accel *accel = build("kd4-thesis", &s.geometry, &options, &stats);
    assert_true(stats.n_references <= 4 * stats.n_segments);
    uint64_t seed = 2;
    int n_hits = 0;
    for (int i = 0; i < 300; i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        AccelHit hit;
        if (accel->type->closest(accel, &ray, &hit, NULL)) {
            n_hits++;
            assert_int_equal(hit.prim, 0);
        }
    }
    assert_true(n_hits > 10);
    accel->type->destroy(accel);
    scene_free(&one);
    scene_free(&s);
}

// From inside closed things that move, at vertices and middles of edges: nothing gets out.
static void kd4_lets_nothing_escape(void **state) {
    (void)state;
    TestScene s = scene_head(24, 5, 0, 2);
    AccelOptions options = accel_options_default();
    Accel *accel = build("kd4-thesis", &s.geometry, &options, NULL);
    uint64_t seed = 17;
    size_t n = s.geometry.n_vertices;
    for (int i = 0; i < (is_stress() ? 1000000 : 60000); i++) {
        AccelRay ray = {.tmax = INFINITY, .key = (uint32_t)(test_random(&seed) % 4)};
        ray.f = i % 7 ? (float)test_uniform(&seed) : (float)(i % 2);
        const uint32_t *index = s.index + 3 * (test_random(&seed) % s.geometry.n_prims);
        const float *a = s.position + 3 * n * ray.key, *b = a + 3 * n;
        for (int k = 0; k < 3; k++) {
            size_t v0 = 3 * (size_t)index[0] + (size_t)k, v1 = 3 * (size_t)index[i % 2] + (size_t)k;
            double p = a[v0] + ray.f * ((double)b[v0] - a[v0]),
                   q = a[v1] + ray.f * ((double)b[v1] - a[v1]);
            ray.origin[k] = i % 5 ? (float)(0.3 * (test_uniform(&seed) - 0.5)) : 0;
            ray.dir[k] = (float)((p + q) / 2 - ray.origin[k]);
        }
        AccelHit hit;
        assert_true(accel->type->closest(accel, &ray, &hit, NULL));
    }
    accel->type->destroy(accel);
    scene_free(&s);
}

static void kd4_agrees_with_oracle(void **state) {
    (void)state;
    TestScene s = scene_head(is_stress() ? 51 : 20, 5, 0.1, 1);
    AccelOptions options = accel_options_default();
    Accel *accel = build("kd4-thesis", &s.geometry, &options, NULL);
    uint64_t seed = 19;
    for (int i = 0; i < (is_stress() ? 10000 : 2000); i++) {
        AccelRay ray = ray_random(&s.geometry, &seed);
        AccelHit hit;
        OracleHit oracle;
        bool a = accel->type->closest(accel, &ray, &hit, NULL);
        bool b = accel_oracle(&s.geometry, &ray, &oracle);
        if (a != b || (a && hit.prim != oracle.prim)) {
            assert_true(oracle.margin < 1e-3 || oracle.second_t - oracle.t < 1e-5);
        } else if (a && oracle.margin > 1e-3) {
            assert_true(fabs(hit.t - oracle.t) < 4e-6 * (1 + 1 / oracle.margin));
        }
    }
    accel->type->destroy(accel);
    scene_free(&s);
}

static void kd4_is_alike_on_all_processors(void **state) {
    (void)state;
    TestScene s = scene_head(12, 5, 0.1, 1);
    AccelOptions options = accel_options_default();
    cpu_set("scalar");
    Accel *scalar = build("kd4-thesis", &s.geometry, &options, NULL);
    for (int cpu = CPU_SCALAR + 1; cpu < CPU_COUNT; cpu++) {
        if (!cpu_set(cpu_names[cpu])) {
            continue;
        }
        Accel *other = build("kd4-thesis", &s.geometry, &options, NULL);
        uint64_t seed = 19;
        for (int i = 0; i < 5000; i++) {
            AccelRay ray = make_ray(&s.geometry, i, &seed);
            expect_same(other, scalar, &ray);
        }
        other->type->destroy(other);
    }
    cpu_set(NULL);
    scalar->type->destroy(scalar);
    scene_free(&s);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(kd4_is_brute_on_propeller),
    cmocka_unit_test(kd4_is_brute_on_head),
    cmocka_unit_test(kd4_is_brute_on_bumpy_sphere),
    cmocka_unit_test(kd4_is_brute_on_soups),
    cmocka_unit_test(kd4_is_brute_on_grid),
    cmocka_unit_test(kd4_is_brute_on_degenerate),
    cmocka_unit_test(kd4_is_brute_on_what_is_not_finite),
    cmocka_unit_test(kd4_leaves_gaps_out),
    cmocka_unit_test(kd4_keeps_memory_bound),
    cmocka_unit_test(kd4_counts_truly),
    cmocka_unit_test(kd4_takes_nothing_and_one),
    cmocka_unit_test(kd4_ends_on_coincident),
    cmocka_unit_test(kd4_lets_nothing_escape),
    cmocka_unit_test(kd4_agrees_with_oracle),
    cmocka_unit_test(kd4_is_alike_on_all_processors),
};

SUITE(kd4, tests)
