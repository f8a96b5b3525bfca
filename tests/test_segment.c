// SPDX-License-Identifier: Apache-2.0
// Equation 4 against closed forms and against boxes that are sampled densely.
#include "accel/segment.h"
#include "tests/accel_scenes.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

static SegmentList segments_of(const TestScene *s, double kappa) {
    Budget budget = {0};
    SegmentList list;
    assert_true(segment_all(&s->geometry, kappa, 1u << 30, &budget, &list));
    return list;
}

static void forget(SegmentList *list) {
    Budget budget = {.used = SIZE_MAX / 2};
    segment_free(list, &budget);
}

// A triangle whose box is 1 x 1 x 0 at first, which moves by speed[] per key.
static TestScene make_flight(uint32_t n_keys, double x, double z) {
    TestScene s = scene_new(GEOMETRY_TRIANGLES, 1, 3, n_keys);
    static const float corner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    for (uint32_t i = 0; i < 3 * n_keys; i++) {
        s.index[i % 3] = i % 3;
        s.position[3 * i] = corner[i % 3][0] + (float)(x * (i / 3));
        s.position[3 * i + 1] = corner[i % 3][1];
        s.position[3 * i + 2] = (float)(z * (i / 3));
    }
    return s;
}

// Half area after a way w along x: 1 + w, from 1. So kappa - 1 is the way that a segment lasts.
static void segment_follows_equation_4(void **state) {
    (void)state;
    static const struct {
        double kappa, speed;
        uint32_t length, n;
    } cases[] = {{2, 0.25, 64, 2}, {2, 0.5, 32, 4},    {1.25, 0.25, 16, 8}, {4, 0.25, 128, 1},
                 {1.5, 4, 2, 64},  {1.01, 16, 1, 128}, {3, 0.1875, 128, 1}, {2, 0.1875, 85, 2}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        TestScene s = make_flight(9, cases[i].speed, 0);
        SegmentList list = segments_of(&s, cases[i].kappa);
        assert_int_equal(list.n, cases[i].n);
        for (uint32_t k = 0; k < list.n; k++) {
            assert_int_equal(list.boxes[k].tick0, k * cases[i].length);
            uint32_t end = (k + 1) * cases[i].length;
            assert_int_equal(list.boxes[k].tick1, end < 128 ? end : 128);
        }
        forget(&list);
        scene_free(&s);
    }
}

static void segment_of_what_stands_still_is_one(void **state) {
    (void)state;
    for (uint32_t n_keys = 1; n_keys < 40; n_keys += 13) {
        TestScene s = make_flight(n_keys, 0, 0);
        SegmentList list = segments_of(&s, 1.0001);
        assert_int_equal(list.n, 1);
        assert_int_equal(list.boxes[0].tick1, 16 * (n_keys > 1 ? n_keys - 1 : 1));
        assert_true(list.kappa_median > 0.99 && list.kappa_median <= 1);
        forget(&list);
        scene_free(&s);
    }
}

// The box at one time, in long double, straight from the definition of motion.
static void grow_box(const Geometry *g, uint32_t prim, double tick, long double lo[3],
                     long double hi[3]) {
    uint32_t span = (uint32_t)(tick / 16);
    span = span > g->n_keys - 2 ? g->n_keys - 2 : span;
    long double f = tick / 16 - span;
    for (uint32_t c = 0; c < 3; c++) {
        const float *a = g->position + 3 * ((size_t)g->n_vertices * span + g->index[3 * prim + c]);
        const float *b = a + 3 * (size_t)g->n_vertices;
        for (int k = 0; k < 3; k++) {
            long double p = a[k] + f * ((long double)b[k] - a[k]);
            lo[k] = fminl(lo[k], p);
            hi[k] = fmaxl(hi[k], p);
        }
    }
}

static long double swept_area(const Geometry *g, uint32_t prim, double t0, double t1,
                              long double lo[3], long double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (double t = t0; t <= t1; t += 0.25) {
        grow_box(g, prim, t, lo, hi);
    }
    long double w = hi[0] - lo[0], h = hi[1] - lo[1], d = hi[2] - lo[2];
    return w * h + h * d + d * w;
}

static void check_segment(const Geometry *g, const BoxSegment *b, double kappa) {
    long double lo[3], hi[3], end_lo[3], end_hi[3];
    long double first = swept_area(g, b->id, b->tick0, b->tick0, lo, hi);
    long double longer = swept_area(g, b->id, b->tick0, b->tick1 + 1, end_lo, end_hi);
    long double swept = swept_area(g, b->id, b->tick0, b->tick1, lo, hi);
    long double eps = 1e-6L * 3; // diagonals are below sqrt(3)
    assert_true(b->tick1 == b->tick0 + 1 || swept <= kappa * (first + eps) * (1 + 1e-12L));
    assert_true(b->tick1 == 16 * (g->n_keys - 1) || longer > kappa * first * (1 - 1e-12L));
    for (int k = 0; k < 3; k++) {
        assert_true(b->lo[k] < lo[k] && hi[k] < b->hi[k]);
        assert_true(lo[k] - b->lo[k] < 1e-5 && b->hi[k] - hi[k] < 1e-5); // and not much larger
    }
}

static void segment_is_largest_that_fits(void **state) {
    (void)state;
    static const double kappas[] = {1.1, 2, 4};
    for (int i = 0; i < 3; i++) {
        TestScene scenes[] = {scene_propeller(9, 0.5), scene_head(8, 7, 0.1, 2),
                              scene_soup(60, 6, 0.05, 0.05, 3)};
        for (int k = 0; k < 3; k++) {
            SegmentList list = segments_of(&scenes[k], kappas[i]);
            assert_true(list.n >= scenes[k].geometry.n_prims);
            for (uint32_t n = 0; n < list.n; n += 1 + list.n / 3000) {
                check_segment(&scenes[k].geometry, &list.boxes[n], kappas[i]);
            }
            forget(&list);
            scene_free(&scenes[k]);
        }
    }
}

static void segment_skips_what_is_not_there(void **state) {
    (void)state;
    TestScene s = make_flight(9, 0.001, 0);
    s.position[9 * 3 + 4] = NAN; // key 3: spans 2 and 3
    s.share[6] = 0;
    SegmentList list = segments_of(&s, 10);
    static const uint32_t want[3][2] = {{0, 32}, {64, 96}, {112, 128}};
    assert_int_equal(list.n, 3);
    assert_int_equal(list.n_dropped, 1);
    for (uint32_t i = 0; i < 3; i++) {
        assert_int_equal(list.boxes[i].tick0, want[i][0]);
        assert_int_equal(list.boxes[i].tick1, want[i][1]);
        // What lies beyond does not leak in.
        assert_true(list.boxes[i].hi[0] < 1.1f);
    }
    forget(&list);
    scene_free(&s);
}

// A jump across a span of no share is in no box.
static void segment_does_not_cross_a_break(void **state) {
    (void)state;
    TestScene s = make_flight(4, 0, 0);
    for (int i = 18; i < 36; i += 3) { // keys 2 and 3
        s.position[i] += 1000;
    }
    s.share[1] = 0;
    SegmentList list = segments_of(&s, 1e30);
    assert_int_equal(list.n, 2);
    assert_int_equal(list.n_dropped, 0);
    assert_true(list.boxes[0].hi[0] < 1.1f && list.boxes[1].lo[0] > 999);
    forget(&list);
    scene_free(&s);
}

// An area of 0 does not make the rule cut for ever: one tick at the least, and slack by its size.
static void segment_ends_on_what_has_no_area(void **state) {
    (void)state;
    TestScene line = make_flight(3, 0, 1); // opens from a line along x
    for (int i = 0; i < 9; i += 3) {
        line.position[i + 1] = 0;
    }
    SegmentList list = segments_of(&line, 2);
    assert_true(list.n >= 2 && list.n <= 32);
    forget(&list);
    scene_free(&line);
    TestScene point = make_flight(3, 1, 1);
    for (int i = 0; i < 27; i++) {
        point.position[i] = (float)(i / 9);
    }
    list = segments_of(&point, 2); // never any extent: never hit
    assert_int_equal(list.n, 0);
    forget(&list);
    scene_free(&point);
}

static void segment_counts_its_memory(void **state) {
    (void)state;
    TestScene s = scene_soup(500, 5, 0.05, 0.05, 3);
    Budget budget = {0};
    SegmentList list;
    assert_true(segment_all(&s.geometry, 2, 1u << 30, &budget, &list));
    assert_int_equal(budget.used, list.capacity * sizeof(BoxSegment));
    uint32_t n = list.n;
    segment_free(&list, &budget);
    assert_int_equal(budget.used, 0);
    assert_false(segment_all(&s.geometry, 2, n - 1, &budget, &list));
    assert_int_equal(budget.used, 0);
    assert_true(segment_all(&s.geometry, 2, n, &budget, &list));
    segment_free(&list, &budget);
    Budget tight = {.limit = n / 2 * sizeof(BoxSegment)};
    assert_false(segment_all(&s.geometry, 2, n, &tight, &list));
    assert_true(tight.used == 0 && tight.peak <= tight.limit);
    scene_free(&s);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(segment_follows_equation_4),
    cmocka_unit_test(segment_of_what_stands_still_is_one),
    cmocka_unit_test(segment_is_largest_that_fits),
    cmocka_unit_test(segment_skips_what_is_not_there),
    cmocka_unit_test(segment_does_not_cross_a_break),
    cmocka_unit_test(segment_ends_on_what_has_no_area),
    cmocka_unit_test(segment_counts_its_memory),
};

SUITE(segment, tests)
