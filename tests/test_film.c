// SPDX-License-Identifier: Apache-2.0
// The film: sums that do not depend on the order, what is not finite, saturation, channels.
#include "render/film.h"
#include "tests/near.h"

#include <string.h>

enum { N = 500 };

static uint64_t random_next(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    return *state ^= *state << 17;
}

static double random_unit(uint64_t *state) {
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

// Values over 12 orders of magnitude, where sums in floating point depend on the order.
static FilmSample sample_at(int i, double *u) {
    uint64_t state = 0x9e3779b97f4a7c15u * (uint64_t)(i + 1);
    random_next(&state);
    FilmSample s = {.alpha = random_unit(&state), .depth = i, .normal = {i, -i, 2 * i}};
    for (int c = 0; c < 3; c++) {
        s.color[c] = pow(10, 12 * random_unit(&state) - 6);
    }
    *u = random_unit(&state);
    return s;
}

static void film_does_not_know_the_order(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 1, 1);
    FilmPixel first = {{0}};
    uint64_t seed = 88172645463325252u;
    int order[N];
    for (int i = 0; i < N; i++) {
        order[i] = i;
    }
    for (int round = 0; round < 20; round++) {
        film_clear(&film);
        for (int i = 0; i < N; i++) {
            double u;
            FilmSample s = sample_at(order[i], &u);
            assert_true(film_add(&film, 0, 0, &s, u, (uint32_t)order[i]));
        }
        if (round == 0) {
            first = film.pixels[0];
        }
        assert_memory_equal(&first, &film.pixels[0], sizeof first);
        for (int i = N - 1; i > 0; i--) {
            int j = (int)(random_next(&seed) % (uint64_t)(i + 1)), kept = order[i];
            order[i] = order[j];
            order[j] = kept;
        }
    }
    arena_free(&arena);
}

static void film_means_are_right(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 3, 2);
    long double sum[4] = {0};
    double nearest = 2, depth = 0;
    for (int i = 0; i < N; i++) {
        double u;
        FilmSample s = sample_at(i, &u);
        film_add(&film, 2, 1, &s, u, (uint32_t)i);
        for (int c = 0; c < 4; c++) {
            sum[c] += c < 3 ? s.color[c] : s.alpha;
        }
        if (fabs(u - 0.5) < nearest) {
            nearest = fabs(u - 0.5);
            depth = s.depth;
        }
    }
    Image image;
    film_image(&film, &arena, &image);
    assert_int_equal(image.width, 3);
    assert_int_equal(image.height, 2);
    const char *names[] = {"R", "G", "B", "A", "Z", "normal.X", "normal.Y", "normal.Z", "samples"};
    assert_int_equal(image.n_channels, 9);
    for (int c = 0; c < 9; c++) {
        assert_string_equal(image.channels[c].name, names[c]);
        for (int i = 0; i < 5; i++) {
            assert_true(image.channels[c].values[i] == 0);
        }
    }
    for (int c = 0; c < 4; c++) {
        double mean = (double)(sum[c] / N);
        assert_near(image.channels[c].values[5], mean, 1e-7 * mean + 0x1p-29);
    }
    assert_near(image.channels[4].values[5], depth, 0);
    assert_near(image.channels[6].values[5], -depth, 0);
    assert_near(image.channels[8].values[5], N, 0);
    arena_free(&arena);
}

static void film_takes_ties_by_index(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 1, 1);
    for (uint32_t i = 10; i > 0; i--) {
        FilmSample s = {.depth = i};
        film_add(&film, 0, 0, &s, 0.5, i);
    }
    assert_near(film.pixels[0].depth, 1, 0);
    arena_free(&arena);
}

static void film_refuses_what_is_not_finite(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 1, 1);
    FilmSample good = {.color = {1, 1, 1}, .alpha = 1}, bad = good;
    bad.color[1] = NAN;
    assert_true(film_add(&film, 0, 0, &good, 0.5, 0));
    assert_false(film_add(&film, 0, 0, &bad, 0.5, 1));
    bad.color[1] = INFINITY;
    assert_false(film_add(&film, 0, 0, &bad, 0.5, 2));
    bad.color[1] = -1;
    assert_true(film_add(&film, 0, 0, &bad, 0.5, 3));
    Image image;
    film_image(&film, &arena, &image);
    assert_near(image.channels[0].values[0], 0.5, 0);
    assert_near(image.channels[1].values[0], 0.25, 0);
    arena_free(&arena);
}

// Slices of the samples add up to the same film, in any order.
static void film_merges_exactly(void **state) {
    (void)state;
    Arena arena = {0};
    Film whole, parts[3], sum;
    film_init(&whole, &arena, 2, 1);
    film_init(&sum, &arena, 2, 1);
    for (int p = 0; p < 3; p++) {
        film_init(&parts[p], &arena, 2, 1);
    }
    for (int i = 0; i < N; i++) {
        double u;
        FilmSample s = sample_at(i, &u);
        s.color[2] *= 1e30; // saturates
        film_add(&whole, 1, 0, &s, u, (uint32_t)i);
        film_add(&parts[i * 3 / N], 1, 0, &s, u, (uint32_t)i);
    }
    for (int p = 2; p >= 0; p--) {
        film_merge(&sum, &parts[p]);
    }
    assert_int_equal(film_count(&sum, 0, 0), 0);
    assert_int_equal(film_count(&sum, 1, 0), N);
    FilmPlane a[FILM_MAX_PLANES], b[FILM_MAX_PLANES];
    uint32_t n = film_planes(&whole, a);
    assert_int_equal(film_planes(&sum, b), n);
    for (uint32_t i = 0; i < n; i++) {
        assert_string_equal(a[i].name, b[i].name);
        assert_int_equal(a[i].size, b[i].size);
        assert_memory_equal(a[i].data, b[i].data, 2 * a[i].size);
    }
    arena_free(&arena);
}

static void film_saturates(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, 1, 1);
    FilmSample s = {.color = {1e300, 3e10, 1}};
    film_add(&film, 0, 0, &s, 0.5, 0);
    film_add(&film, 0, 0, &s, 0.5, 1);
    assert_true(film.pixels[0].sum[0] == INT64_MAX);
    assert_true(film.pixels[0].sum[1] == INT64_MAX);
    assert_true(film.pixels[0].sum[2] == 2ll << 28);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(film_does_not_know_the_order),
    cmocka_unit_test(film_means_are_right),
    cmocka_unit_test(film_takes_ties_by_index),
    cmocka_unit_test(film_refuses_what_is_not_finite),
    cmocka_unit_test(film_merges_exactly),
    cmocka_unit_test(film_saturates),
};

SUITE(film, tests)
