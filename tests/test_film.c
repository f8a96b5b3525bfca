// SPDX-License-Identifier: Apache-2.0
// The film: sums that do not depend on the order, what is not finite, saturation, channels.
#include "render/film.h"
#include "tests/near.h"
#include "tests/scenes.h"

#include <string.h>

enum { N = 500, ALL = (1 << LAYER_COUNT) - 1 };

static uint64_t random_next(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    return *state ^= *state << 17;
}

static double random_unit(uint64_t *state) {
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

// Values over 12 orders of magnitude, where sums in floating point depend on the order.
static FilmSample sample_at(int i) {
    uint64_t state = 0x9e3779b97f4a7c15u * (uint64_t)(i + 1);
    random_next(&state);
    FilmSample s = {.alpha = random_unit(&state),
                    .index = (uint32_t)i,
                    .is_hit = i % 5 != 0,
                    .object = (uint32_t)(random_next(&state) % 40),
                    .material = (uint32_t)(random_next(&state) % 3),
                    .depth = i,
                    .normal = {i, -i, 2 * i},
                    .position = {3 * i, 4 * i, 5 * i},
                    .motion = {6 * i, 7 * i},
                    .film_time = i};
    for (int c = 0; c < 3; c++) {
        s.color[c] = pow(10, 12 * random_unit(&state) - 6);
        s.albedo[c] = random_unit(&state);
    }
    s.u = random_unit(&state);
    s.dx = random_unit(&state) - 0.5;
    s.dy = random_unit(&state) - 0.5;
    return s;
}

static void film_does_not_know_the_order(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, ALL, 1, 1);
    void *first = NULL;
    uint64_t seed = 88172645463325252u;
    int order[N];
    for (int i = 0; i < N; i++) {
        order[i] = i;
    }
    for (int round = 0; round < 20; round++) {
        film_clear(&film);
        for (int i = 0; i < N; i++) {
            FilmSample s = sample_at(order[i]);
            assert_true(film_add(&film, 0, 0, &s));
        }
        size_t n;
        void *bytes = test_film_bytes(&film, &arena, &n);
        first = round == 0 ? bytes : first;
        assert_memory_equal(first, bytes, n);
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
    film_init(&film, &arena, LAYERS_DEFAULT, 3, 2);
    long double sum[4] = {0};
    double nearest = 2, depth = 0;
    for (int i = 0; i < N; i++) {
        FilmSample s = sample_at(i);
        film_add(&film, 2, 1, &s);
        for (int c = 0; c < 4; c++) {
            sum[c] += c < 3 ? s.color[c] : s.alpha;
        }
        if (fabs(s.u - 0.5) < nearest) {
            nearest = fabs(s.u - 0.5);
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
    film_init(&film, &arena, LAYERS_DEFAULT, 1, 1);
    for (uint32_t i = 10; i > 0; i--) {
        FilmSample s = {.depth = i, .u = 0.5, .index = i};
        film_add(&film, 0, 0, &s);
    }
    assert_near(film.depth[0], 1, 0);
    arena_free(&arena);
}

static void film_refuses_what_is_not_finite(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, LAYERS_DEFAULT, 1, 1);
    FilmSample good = {.color = {1, 1, 1}, .alpha = 1}, bad = good;
    bad.color[1] = NAN;
    assert_true(film_add(&film, 0, 0, &good));
    assert_false(film_add(&film, 0, 0, &bad));
    bad.color[1] = INFINITY;
    assert_false(film_add(&film, 0, 0, &bad));
    bad.color[1] = -1;
    assert_true(film_add(&film, 0, 0, &bad));
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
    film_init(&whole, &arena, ALL, 2, 1);
    film_init(&sum, &arena, ALL, 2, 1);
    for (int p = 0; p < 3; p++) {
        film_init(&parts[p], &arena, ALL, 2, 1);
    }
    for (int i = 0; i < N; i++) {
        FilmSample s = sample_at(i);
        s.color[2] *= 1e30; // saturates
        film_add(&whole, 1, 0, &s);
        film_add(&parts[i * 3 / N], 1, 0, &s);
    }
    for (int p = 2; p >= 0; p--) {
        film_merge(&sum, &parts[p]);
    }
    assert_int_equal(film_count(&sum, 0, 0), 0);
    assert_int_equal(film_count(&sum, 1, 0), N);
    FilmTotals totals = film_totals(&sum);
    assert_int_equal(totals.least, 0);
    assert_int_equal(totals.most, N);
    assert_int_equal(totals.total, N);
    size_t n, n_sum;
    void *bytes = test_film_bytes(&whole, &arena, &n);
    void *bytes_sum = test_film_bytes(&sum, &arena, &n_sum);
    assert_int_equal(n_sum, n);
    assert_memory_equal(bytes_sum, bytes, n);
    arena_free(&arena);
}

// Ids are believed no further than they make sense.
static void film_ids_come_back(void **state) {
    (void)state;
    Arena arena = {0};
    Film film, other;
    film_init(&film, &arena, ALL, 2, 1);
    for (int i = 0; i < N; i++) {
        FilmSample s = sample_at(i);
        film_add(&film, (uint32_t)i % 2, 0, &s);
    }
    size_t n, n_again;
    uint32_t *words = film_save_ids(&film, &arena, &n);
    film_init(&other, &arena, ALL, 2, 1);
    assert_true(film_restore_ids(&other, words, n));
    uint32_t *again = film_save_ids(&other, &arena, &n_again);
    assert_int_equal(n_again, n);
    assert_memory_equal(again, words, n * sizeof *words);
    for (size_t i = 0; i < n; i++) {
        film_clear(&other);
        assert_false(film_restore_ids(&other, words, i));
    }
    film_clear(&other);
    words[0] = UINT32_MAX;
    assert_false(film_restore_ids(&other, words, n));
    arena_free(&arena);
}

static void film_saturates(void **state) {
    (void)state;
    Arena arena = {0};
    Film film;
    film_init(&film, &arena, LAYERS_DEFAULT, 1, 1);
    FilmSample s = {.color = {1e300, 3e10, 1}};
    film_add(&film, 0, 0, &s);
    film_add(&film, 0, 0, &s);
    assert_true(film.sum[0][0] == INT64_MAX);
    assert_true(film.sum[0][1] == INT64_MAX);
    assert_true(film.sum[0][2] == 2ll << 28);
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(film_does_not_know_the_order),
    cmocka_unit_test(film_means_are_right),
    cmocka_unit_test(film_takes_ties_by_index),
    cmocka_unit_test(film_refuses_what_is_not_finite),
    cmocka_unit_test(film_merges_exactly),
    cmocka_unit_test(film_ids_come_back),
    cmocka_unit_test(film_saturates),
};

SUITE(film, tests)
