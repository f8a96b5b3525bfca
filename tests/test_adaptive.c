// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling on films of random numbers, whose means and variances are known.
#include "render/rounds.h"
#include "tests/near.h"

#include <math.h>
#include <string.h>

enum { SIZE = 32 };

// A sample is `high` with the probability `chance`, else `low`.
typedef struct {
    double low, high, chance;
} Noise;

typedef struct {
    Arena arena;
    Film film;
    uint64_t seed;
    Noise noise;
    Noise spot; // of one pixel
    uint32_t spot_x, spot_y;
} Fixture;

static double random_number(uint64_t *state) {
    *state += 0x9e3779b97f4a7c15u;
    uint64_t z = *state;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static void begin(Fixture *f, uint32_t size, Noise noise) {
    *f = (Fixture){.noise = noise, .spot_x = UINT32_MAX};
    film_init(&f->film, &f->arena, FILM_HALVES, size, size);
    f->film.x = 7;
    f->film.y = 3;
}

// What a sample is depends on its place and its index alone, as in rendering.
static void add_sample(Fixture *f, uint32_t x, uint32_t y, uint32_t index) {
    uint64_t state = (f->seed << 48 | (uint64_t)x << 40 | (uint64_t)y << 32 | index) << 8;
    random_number(&state);
    const Noise *noise = x == f->spot_x && y == f->spot_y ? &f->spot : &f->noise;
    double value = random_number(&state) < noise->chance ? noise->high : noise->low;
    const FilmSample sample = {.color = {value, value, value}, .alpha = 1, .index = index};
    film_add(&f->film, x, y, &sample);
}

static void fill(Fixture *f, const Allocation *allocation) {
    for (uint32_t y = f->film.y; y < f->film.y + f->film.height; y++) {
        for (uint32_t x = f->film.x; x < f->film.x + f->film.width; x++) {
            uint32_t n = allocation_count(allocation, &f->film, x, y);
            for (uint32_t i = film_count(&f->film, x, y); i < n; i++) {
                add_sample(f, x, y, i);
            }
        }
    }
}

// All up to a level that is above the pilot.
static void fill_to(Fixture *f, Level level) {
    Allocation allocation;
    film_clear(&f->film);
    allocation_find(&allocation, &f->film, ADAPTIVE_PILOT * LEVEL_SAMPLE);
    fill(f, &allocation);
    adaptive_weigh(&f->film);
    allocation_find(&allocation, &f->film, level);
    fill(f, &allocation);
}

static void film_mean(const Film *film, double *mean) {
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        *mean += (double)film->sum[i][0] / (FILM_UNITS * film->n[i]);
    }
}

static void noise_is_estimated(void **state) {
    (void)state;
    Fixture f;
    begin(&f, SIZE, (Noise){0, 1, 0.5});
    double squares = 0;
    enum { SEEDS = 20 };
    for (f.seed = 1; f.seed <= SEEDS; f.seed++) {
        fill_to(&f, 50 * LEVEL_SAMPLE);
        double noise = adaptive_noise(&f.film).estimate;
        squares += noise * noise / SEEDS;
    }
    // A pixel's variance is 1/4 over its samples, the mean 1/2.
    double expected = 0;
    for (size_t i = 0; i < SIZE * SIZE; i++) {
        expected += 1.0 / f.film.n[i] / (SIZE * SIZE);
    }
    assert_near(sqrt(squares), sqrt(expected), 0.02 * sqrt(expected));
    film_clear(&f.film);
    assert_near(adaptive_noise(&f.film).at_most, 0, 0);
    arena_free(&f.arena);
}

static void counts_follow_the_level(void **state) {
    (void)state;
    Fixture f;
    begin(&f, SIZE, (Noise){0, 1, 0.1});
    static uint32_t before[SIZE][SIZE];
    memset(before, 0, sizeof before);
    fill_to(&f, ADAPTIVE_PILOT * LEVEL_SAMPLE);
    for (Level level = ADAPTIVE_LEAST * LEVEL_SAMPLE; level < 1000 * LEVEL_SAMPLE;
         level += 1 + level / 7) {
        Allocation allocation;
        allocation_find(&allocation, &f.film, level);
        uint64_t total = 0;
        for (uint32_t y = 0; y < SIZE; y++) {
            for (uint32_t x = 0; x < SIZE; x++) {
                uint32_t n = allocation_count(&allocation, &f.film, f.film.x + x, f.film.y + y);
                assert_true((n & (n - 1)) == 0 && n >= before[y][x] && n >= ADAPTIVE_LEAST);
                assert_true(level < ADAPTIVE_PILOT * LEVEL_SAMPLE || n >= ADAPTIVE_PILOT);
                before[y][x] = n;
                total += n;
            }
        }
        // Rounding by chance has a deviation of at most 0.36 of the number.
        double mean = (double)level / LEVEL_SAMPLE;
        assert_near((double)total / (SIZE * SIZE), mean, 5 * 0.4 * mean / SIZE);
    }
    arena_free(&f.arena);
}

static uint32_t count_at(Fixture *f, uint32_t x, uint32_t y) {
    return film_count(&f->film, f->film.x + x, f->film.y + y);
}

// A pixel that is much noisier than the rest, or not at all: its own number of samples is the same,
// that of its surroundings is not.
static void pixels_do_not_decide_on_themselves(void **state) {
    (void)state;
    Fixture f;
    uint32_t calm[SIZE][SIZE], n_more = 0;
    begin(&f, SIZE, (Noise){0.9, 1, 0.5});
    for (uint32_t at = 3; at < SIZE - 3; at += 5) {
        f.spot_x = UINT32_MAX;
        fill_to(&f, 100 * LEVEL_SAMPLE);
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            calm[i / SIZE][i % SIZE] = count_at(&f, i % SIZE, i / SIZE);
        }
        f.spot = (Noise){0, 30, 0.25};
        f.spot_x = f.film.x + at;
        f.spot_y = f.film.y + 16;
        fill_to(&f, 100 * LEVEL_SAMPLE);
        assert_int_equal(count_at(&f, at, 16), calm[16][at]);
        for (uint32_t y = 14; y <= 18; y++) {
            for (uint32_t x = at - 2; x <= at + 2; x++) {
                n_more += count_at(&f, x, y) >= 2 * calm[y][x];
            }
        }
    }
    // Those of the other kind, about half of 24 in each of 6 places; where both halves of the spot
    // are the same by chance, none.
    assert_in_range(n_more, 36, 84);
    arena_free(&f.arena);
}

// Rare and bright: one sample in 64. The mean over many films is right, as it is where a level is
// given as where the noise decides; and it tells what went wrong where pixels decided themselves.
static void means_are_right(void **state) {
    (void)state;
    enum { SEEDS = 100 };
    const Noise rare = {0, 64, 1.0 / 64};
    // Of the mean over all pixels and seeds, at 64 samples.
    const double deviation = 8 / sqrt(64.0 * SIZE * SIZE * SEEDS);
    Fixture f;
    begin(&f, SIZE, rare);
    double mean = 0, noisy = 0, itself = 0;
    for (f.seed = 1; f.seed <= SEEDS; f.seed++) {
        fill_to(&f, 64 * LEVEL_SAMPLE);
        film_mean(&f.film, &mean);
        RenderOptions options = {.is_adaptive = true, .noise = 0.3, .mean_spp = 5000};
        TilePass pass = {0};
        Rounds rounds;
        film_clear(&f.film);
        rounds_begin(&rounds, &options, &f.film, 0, INFINITY);
        while (rounds_next(&rounds, &pass)) {
            fill(&f, pass.allocation);
        }
        assert_int_equal(rounds.stop, STOP_NOISE);
        assert_true(rounds.noise.at_most <= 0.3);
        film_mean(&f.film, &noisy);
        // Those that have seen nothing in their pilot stay at it.
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            uint32_t x = f.film.x + i % SIZE, y = f.film.y + i / SIZE;
            bool has_seen = false;
            Fixture one = f;
            film_init(&one.film, &f.arena, FILM_HALVES, 1, 1);
            one.film.x = x;
            one.film.y = y;
            for (uint32_t k = 0; k < (has_seen ? 96u : 32u); k++) {
                add_sample(&one, x, y, k);
                has_seen |= one.film.sum[0][0] > 0;
            }
            film_mean(&one.film, &itself);
        }
    }
    double n = SIZE * SIZE * SEEDS;
    assert_near(mean / n, 1, 5 * deviation);
    assert_near(noisy / n, 1, 5 * deviation);
    assert_true(itself / n < 1 - 20 * deviation);
    arena_free(&f.arena);
}

static void bounds_are_kept(void **state) {
    (void)state;
    static const struct {
        double noise, mean_spp;
        RenderStop stop;
        Level least, most;
    } cases[] = {
        {0, 1, STOP_SAMPLES, 128, 128},           {0, 7, STOP_SAMPLES, 448, 448},
        {0, 37.25, STOP_SAMPLES, 2384, 2384},     {0.001, 100, STOP_SAMPLES, 6400, 6400},
        {1, 100, STOP_SAMPLES, 6400, 6400},       {0.02, 9000, STOP_NOISE, 2000 * 64, 3500 * 64},
        {1, 512, STOP_NOISE, 512 * 64, 512 * 64},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Fixture f;
        begin(&f, SIZE, (Noise){0, 1, 0.5});
        RenderOptions options = {.noise = cases[i].noise, .mean_spp = cases[i].mean_spp};
        TilePass pass = {0};
        Rounds rounds;
        rounds_begin(&rounds, &options, &f.film, 0, INFINITY);
        while (rounds_next(&rounds, &pass)) {
            fill(&f, pass.allocation);
            assert_true(rounds_expect(&rounds) > 0);
        }
        assert_int_equal(rounds.stop, cases[i].stop);
        assert_in_range(rounds.level, cases[i].least, cases[i].most);
        arena_free(&f.arena);
    }
}

// The last place of all, from which the film is gone on with, is left to the same end.
static void rounds_go_on(void **state) {
    (void)state;
    Fixture a, b;
    RenderOptions options = {.noise = 0.1, .mean_spp = 1000};
    TilePass pass = {0};
    Rounds rounds;
    begin(&a, SIZE, (Noise){0, 1, 0.5});
    begin(&b, SIZE, (Noise){0, 1, 0.5});
    rounds_begin(&rounds, &options, &a.film, 0, INFINITY);
    while (rounds_next(&rounds, &pass)) {
        fill(&a, pass.allocation);
    }
    rounds_begin(&rounds, &options, &b.film, 0, INFINITY);
    bool is_begun = rounds_next(&rounds, &pass);
    while (is_begun) {
        // Some of the round, then a run that knows the film and the level alone.
        for (uint32_t i = 0; i < SIZE; i += 3) {
            uint32_t x = b.film.x + i, y = b.film.y + i;
            if (film_count(&b.film, x, y) < allocation_count(pass.allocation, &b.film, x, y)) {
                add_sample(&b, x, y, film_count(&b.film, x, y));
            }
        }
        rounds_begin(&rounds, &options, &b.film, rounds.level, INFINITY);
        assert_true(rounds_next(&rounds, &pass));
        fill(&b, pass.allocation);
        is_begun = rounds_next(&rounds, &pass);
    }
    assert_memory_equal(a.film.sum, b.film.sum, SIZE * SIZE * sizeof *a.film.sum);
    assert_memory_equal(a.film.n, b.film.n, SIZE * SIZE * sizeof *a.film.n);
    assert_memory_equal(a.film.half, b.film.half, SIZE * SIZE * sizeof *a.film.half);
    arena_free(&a.arena);
    arena_free(&b.arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(noise_is_estimated),
    cmocka_unit_test(counts_follow_the_level),
    cmocka_unit_test(pixels_do_not_decide_on_themselves),
    cmocka_unit_test(means_are_right),
    cmocka_unit_test(bounds_are_kept),
    cmocka_unit_test(rounds_go_on),
};

SUITE(adaptive, tests)
