// SPDX-License-Identifier: Apache-2.0
// The tree over boxes against all boxes one by one.
#include "accel/boxtree.h"
#include "tests/accel_scenes.h"
#include "tests/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TICKS = 64 };

// Things of several segments each, somewhere, some with gaps in time.
static BoxSegment *make_boxes(size_t n_things, size_t *n, uint64_t *seed, double offset) {
    BoxSegment *boxes = malloc((n_things * 8 + 1) * sizeof *boxes);
    *n = 0;
    for (uint32_t id = 0; id < n_things; id++) {
        uint32_t tick = (uint32_t)(test_random(seed) % 8);
        double at[3] = {test_uniform(seed), test_uniform(seed), test_uniform(seed)};
        for (int k = 0; k < 8 && tick < TICKS; k++) {
            BoxSegment *b = &boxes[(*n)++];
            *b = (BoxSegment){.tick0 = tick, .id = id};
            tick += 1 + (uint32_t)(test_random(seed) % 16);
            b->tick1 = tick < TICKS ? tick : TICKS;
            tick += test_random(seed) % 4 == 0;
            for (int i = 0; i < 3; i++) {
                double size = 0.2 * test_uniform(seed) * test_uniform(seed);
                b->lo[i] = (float)(offset + at[i]);
                b->hi[i] = (float)(offset + at[i] + size);
                at[i] += 0.1 * (test_uniform(seed) - 0.5);
            }
        }
    }
    return boxes;
}

// The oracle: the ray's interval in the box by clipping in long double; how far in or out it is.
static bool meets(const BoxSegment *b, const double o[3], const double d[3], double tmin,
                  double tmax, uint32_t tick, long double *entry, long double *depth) {
    long double near = tmin, far = tmax;
    for (int i = 0; i < 3; i++) {
        if (d[i] == 0) {
            if (o[i] < b->lo[i] || o[i] > b->hi[i]) {
                return false;
            }
            continue;
        }
        long double t0 = (b->lo[i] - (long double)o[i]) / d[i],
                    t1 = (b->hi[i] - (long double)o[i]) / d[i];
        near = fmaxl(near, fminl(t0, t1));
        far = fminl(far, fmaxl(t0, t1));
    }
    *entry = near;
    *depth = far - near;
    return near <= far && b->tick0 <= tick && tick < b->tick1;
}

typedef struct {
    const BoxSegment *boxes;
    size_t n;
    const double *o, *d;
    uint32_t tick;
    uint8_t *visited;
    bool stops;    // at the first visit
    bool shortens; // hits what it visits, at the entry of its box
    uint32_t n_visits;
    double best;
} Visits;

static double on_visit(void *context, uint32_t id, const BoxRay *ray, double tmax) {
    (void)ray;
    Visits *v = context;
    v->visited[id]++;
    v->n_visits++;
    if (v->stops) {
        return -INFINITY;
    }
    for (size_t i = 0; v->shortens && i < v->n; i++) {
        long double entry, depth;
        if (v->boxes[i].id == id &&
            meets(&v->boxes[i], v->o, v->d, 0, tmax, v->tick, &entry, &depth) && entry < tmax) {
            tmax = (double)entry;
        }
    }
    v->best = tmax;
    return tmax;
}

static void make_ray(double o[3], double d[3], double offset, uint64_t *seed) {
    uint64_t kind = test_random(seed) % 4;
    for (int i = 0; i < 3; i++) {
        o[i] = offset + 3 * test_uniform(seed) - 1;
        d[i] = offset + test_uniform(seed) - o[i];
    }
    if (kind == 0) { // along an axis
        uint64_t axis = test_random(seed) % 3;
        for (uint64_t i = 0; i < 3; i++) {
            d[i] = i == axis ? d[i] : i & 1 ? 0 : -0.0;
            o[i] = i == axis ? o[i] : offset + test_uniform(seed);
        }
    }
}

static void expect_all_visited(size_t n_things, double offset, const AccelOptions *options,
                               uint64_t seed) {
    size_t n;
    BoxSegment *boxes = make_boxes(n_things, &n, &seed, offset);
    double share[TICKS];
    for (int i = 0; i < TICKS; i++) {
        share[i] = i / 16 == 1 ? 0 : 1;
    }
    AccelStats stats;
    BoxTree *tree = boxtree_build(boxes, n, TICKS, share, options, &stats);
    char why[200] = "";
    if (!boxtree_validate(tree, why, sizeof why)) {
        fail_msg("%s", why);
    }
    assert_true(boxtree_bytes(tree) <= stats.peak_bytes);
    uint8_t *visited = malloc(n_things + 1);
    for (int i = 0; i < 1000; i++) {
        double o[3], d[3];
        uint32_t tick = (uint32_t)(test_random(&seed) % TICKS);
        make_ray(o, d, offset, &seed);
        Visits v = {boxes, n, o, d, tick, visited};
        memset(visited, 0, n_things + 1);
        boxtree_trace(tree, o, d, 0, INFINITY, tick, on_visit, &v, NULL);
        double nearest = INFINITY;
        for (size_t k = 0; k < n; k++) {
            long double entry, depth;
            if (meets(&boxes[k], o, d, 0, INFINITY, tick, &entry, &depth)) {
                assert_true(visited[boxes[k].id]);
                nearest = fmin(nearest, (double)entry);
            }
        }
        v.shortens = true;
        v.best = INFINITY;
        boxtree_trace(tree, o, d, 0, INFINITY, tick, on_visit, &v, NULL);
        assert_true(v.best == nearest);
        if (nearest < INFINITY) {
            Visits first = {boxes, n, o, d, tick, visited, .stops = true};
            boxtree_trace(tree, o, d, 0, INFINITY, tick, on_visit, &first, NULL);
            assert_int_equal(first.n_visits, 1);
        }
    }
    free(visited);
    boxtree_destroy(tree);
    free(boxes);
}

static void boxtree_finds_all(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    static const size_t counts[] = {0, 1, 7, 60, 500};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        options.leaf_size = i % 2 ? 1 : 8;
        expect_all_visited(counts[i], i == 3 ? 1000 : 0, &options, i);
    }
}

static void boxtree_keeps_memory_bound(void **state) {
    (void)state;
    AccelOptions options = accel_options_default();
    uint64_t seed = 5;
    size_t n;
    BoxSegment *boxes = make_boxes(300, &n, &seed, 0);
    AccelStats whole;
    boxtree_destroy(boxtree_build(boxes, n, TICKS, NULL, &options, &whole));
    for (int i = 1; i <= 20; i++) {
        options.memory = n * sizeof *boxes + 1000 + whole.peak_bytes * (size_t)i / 10;
        AccelStats stats;
        BoxTree *tree = boxtree_build(boxes, n, TICKS, NULL, &options, &stats);
        char why[200];
        assert_true(boxtree_validate(tree, why, sizeof why));
        assert_true(stats.peak_bytes <= options.memory);
        assert_true(boxtree_bytes(tree) <= options.memory);
        boxtree_destroy(tree);
        expect_all_visited(10, 0, &options, (uint64_t)i);
    }
    free(boxes);
}

static void boxtree_takes_bad_input(void **state) {
    (void)state;
    BoxSegment boxes[] = {{{0, 0, 0}, {1, 1, 1}, 0, 4, 0},
                          {{NAN, 0, 0}, {1, 1, 1}, 0, 4, 1},
                          {{0, 0, 0}, {1, 1, NAN}, 0, 4, 2},
                          {{1, 1, 1}, {0, 0, 0}, 0, 4, 3},
                          {{0, 0, 0}, {1, 1, 1}, 3, 3, 4},
                          {{0, 0, 0}, {0, 0, 0}, 0, 9, 5},
                          {{-INFINITY, 0, 0}, {INFINITY, 1, 1}, 0, 4, 6}};
    AccelOptions options = accel_options_default();
    AccelStats stats;
    BoxTree *tree = boxtree_build(boxes, 7, 4, NULL, &options, &stats);
    assert_int_equal(stats.n_segments, 3);
    assert_int_equal(stats.n_dropped, 4);
    uint8_t visited[7] = {0};
    double o[3] = {-1, 0, 0}, d[3] = {1, 0, 0};
    Visits v = {boxes, 7, o, d, 0, visited};
    boxtree_trace(tree, o, d, 0, INFINITY, 77, on_visit, &v, NULL);
    static const uint8_t want[7] = {1, 0, 0, 0, 0, 1, 1};
    assert_memory_equal(visited, want, 7);
    v.n_visits = 0;
    double nan[3] = {0, NAN, 0}, zero[3] = {0, 0, 0}, inf[3] = {INFINITY, 0, 0};
    boxtree_trace(tree, nan, d, 0, 1, 0, on_visit, &v, NULL);
    boxtree_trace(tree, inf, d, 0, 1, 0, on_visit, &v, NULL);
    boxtree_trace(tree, o, nan, 0, 1, 0, on_visit, &v, NULL);
    boxtree_trace(tree, o, zero, 0, 1, 0, on_visit, &v, NULL);
    boxtree_trace(tree, o, inf, 0, 1, 0, on_visit, &v, NULL);
    boxtree_trace(tree, o, d, 0, NAN, 0, on_visit, &v, NULL);
    boxtree_trace(tree, o, d, 2, 1, 0, on_visit, &v, NULL);
    assert_int_equal(v.n_visits, 0);
    boxtree_destroy(tree);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(boxtree_finds_all),
    cmocka_unit_test(boxtree_keeps_memory_bound),
    cmocka_unit_test(boxtree_takes_bad_input),
};

SUITE(boxtree, tests)
