// SPDX-License-Identifier: Apache-2.0
// Sample points: the net property in every elementary interval, uniformity, independence; filters.
#include "render/filter.h"
#include "render/sampler.h"
#include "render/shutter.h"
#include "tests/near.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.141592653589793;

// Sets with and without a path's meaning, far pixels, far frames: the property is of all.
static const struct {
    uint64_t seed;
    int64_t frame;
    uint32_t x, y, set;
} places[] = {
    {0, 1, 0, 0, 0},
    {0, 1, 0, 0, 1},
    {0, 1, 1, 0, 0},
    {7, -3, 65535, 65535, 0},
    {~0ull, 1 << 20, 3, 9, 12},
    {1, 2, 3, 4, 1000000},
    {2, 2, 3, 4, UINT32_MAX},
};
enum { N_PLACES = sizeof places / sizeof *places };

static Sampler sampler_at(int place) {
    return sampler_pixel(places[place].seed, false, places[place].frame, places[place].x,
                         places[place].y);
}

// Each of the 2^m boxes of 2^-a by 2^-(m-a) holds exactly one of the first 2^m points.
static void sampler_fills_elementary_intervals(void **state) {
    (void)state;
    enum { M_MAX = 10 };
    static unsigned char seen[1 << M_MAX];
    for (int place = 0; place < N_PLACES; place++) {
        Sampler sampler = sampler_at(place);
        for (int m = 0; m <= M_MAX; m++) {
            for (int a = 0; a <= m; a++) {
                memset(seen, 0, sizeof seen);
                for (uint32_t i = 0; i < 1u << m; i++) {
                    double p[SAMPLE_DIMENSIONS];
                    sampler_draw(&sampler, i, places[place].set, p);
                    unsigned column = (unsigned)(p[0] * (1 << a));
                    unsigned row = (unsigned)(p[1] * (1 << (m - a)));
                    assert_int_equal(seen[row << a | column]++, 0);
                }
            }
        }
    }
}

// Each dimension alone, time above all, in 2^k strata; also in every later run of 2^k samples.
static void sampler_stratifies_each_dimension(void **state) {
    (void)state;
    enum { M = 10 };
    for (int place = 0; place < N_PLACES; place++) {
        Sampler sampler = sampler_at(place);
        for (uint32_t first = 0; first < 4u << M; first += 1u << M) {
            unsigned char seen[SAMPLE_DIMENSIONS][1 << M] = {{0}};
            for (uint32_t i = 0; i < 1u << M; i++) {
                double p[SAMPLE_DIMENSIONS];
                sampler_draw(&sampler, first + i, places[place].set, p);
                for (int d = 0; d < SAMPLE_DIMENSIONS; d++) {
                    assert_true(p[d] > 0 && p[d] < 1 && (float)p[d] <= 1);
                    assert_int_equal(seen[d][(int)(p[d] * (1 << M))]++, 0);
                }
            }
        }
    }
}

// Pixel and time together: boxes of 1/8 by 1/8 by 1/8 get 4096/512 = 8 points each; a Sobol triple
// of quality t = 1 may miss by one halving, never more.
static void sampler_stratifies_pixel_and_time(void **state) {
    (void)state;
    Sampler sampler = sampler_at(0);
    int count[512] = {0};
    for (uint32_t i = 0; i < 4096; i++) {
        double p[SAMPLE_DIMENSIONS];
        sampler_draw(&sampler, i, SAMPLE_SET_PIXEL, p);
        count[(int)(p[0] * 8) | (int)(p[1] * 8) << 3 | (int)(p[2] * 8) << 6]++;
    }
    for (int i = 0; i < 512; i++) {
        assert_int_equal(count[i], 8);
    }
}

// One sample each of many places is like independent numbers: chi-squared over 64 cells,
// for neighbours in x, y, frame, set and index, and for pairs of them.
static void assert_uniform(const int *count, int cells, int n) {
    double expected = (double)n / cells, chi = 0;
    for (int i = 0; i < cells; i++) {
        chi += (count[i] - expected) * (count[i] - expected) / expected;
    }
    // Five standard deviations of a chi-squared of cells - 1 degrees of freedom.
    assert_near(chi, cells - 1, 5 * sqrt(2.0 * (cells - 1)));
}

static void sampler_decorrelates_places(void **state) {
    (void)state;
    enum { N = 1 << 16 };
    for (int kind = 0; kind < 5; kind++) {
        int single[64] = {0}, pair[64] = {0};
        double previous = 0.5;
        for (uint32_t i = 0; i < N; i++) {
            Sampler s = sampler_pixel(kind == 4 ? i : 1, false, kind == 2 ? i : 1,
                                      kind == 0 ? i : 5, kind == 1 ? i : 5);
            double p[SAMPLE_DIMENSIONS];
            sampler_draw(&s, 0, kind == 3 ? i : 0, p);
            single[(int)(p[0] * 64)]++;
            pair[(int)(p[2] * 8) << 3 | (int)(previous * 8)]++;
            previous = p[2];
        }
        assert_uniform(single, 64, N);
        assert_uniform(pair, 64, N);
    }
}

// The first sample of the first set against the first of the second.
static void sampler_decorrelates_sets(void **state) {
    (void)state;
    enum { N = 1 << 14 };
    int pair[64] = {0};
    for (uint32_t i = 0; i < N; i++) {
        Sampler s = sampler_pixel(3, false, 1, i % 128, i / 128);
        double p[SAMPLE_DIMENSIONS], q[SAMPLE_DIMENSIONS];
        sampler_draw(&s, 5, 0, p);
        sampler_draw(&s, 5, 1, q);
        pair[(int)(p[0] * 8) << 3 | (int)(q[0] * 8)]++;
    }
    assert_uniform(pair, 64, N);
}

// The even samples are those of the pixel, the odd are independent of them.
static void sampler_halves_are_independent(void **state) {
    (void)state;
    enum { N = 1 << 14 };
    int pair[64] = {0}, odd[64] = {0};
    for (uint32_t i = 0; i < N; i++) {
        Sampler s = sampler_pixel_halves(3, false, 1, i % 128, i / 128);
        Sampler whole = sampler_pixel(3, false, 1, i % 128, i / 128);
        double p[SAMPLE_DIMENSIONS], q[SAMPLE_DIMENSIONS], even[SAMPLE_DIMENSIONS];
        sampler_draw(&s, 10, 1, even);
        sampler_draw(&whole, 5, 1, p);
        assert_memory_equal(even, p, sizeof p);
        sampler_draw(&s, 11, 1, q);
        pair[(int)(p[0] * 8) << 3 | (int)(q[0] * 8)]++;
        odd[(int)(q[0] * 64)]++;
    }
    assert_uniform(pair, 64, N);
    assert_uniform(odd, 64, N);
}

static void sampler_freezes(void **state) {
    (void)state;
    Sampler a = sampler_pixel(9, true, 1, 2, 3), b = sampler_pixel(9, true, 50, 2, 3);
    assert_true(a.key[0] == b.key[0]);
    b = sampler_pixel(9, false, 50, 2, 3);
    assert_true(a.key[0] != b.key[0]);
}

static double blackman_harris(double x) {
    const double turn = 6.283185307179586 * (x / 3 + 0.5);
    return 0.35875 - 0.48829 * cos(turn) + 0.14128 * cos(2 * turn) - 0.01168 * cos(3 * turn);
}

// Against Simpson's rule on the window itself.
static void filter_follows_its_density(void **state) {
    (void)state;
    Filter filter;
    filter_init(&filter, FILTER_BLACKMAN_HARRIS, 0);
    assert_near(filter_offset(&filter, 0), -1.5, 0);
    assert_near(filter_offset(&filter, 0.5), 0, 1e-12);
    assert_near(filter_offset(&filter, 1), 1.5, 0);
    enum { STEPS = 3000 };
    double h = 3.0 / STEPS, sum = 0, total = 3 * 0.35875;
    for (int i = 0; i < STEPS; i++) {
        double x = -1.5 + i * h;
        double u = sum / total;
        assert_near(filter_offset(&filter, u), x, 1e-4);
        sum +=
            h / 6 * (blackman_harris(x) + 4 * blackman_harris(x + h / 2) + blackman_harris(x + h));
    }
    assert_near(sum, total, 1e-9);
    for (int i = 1; i <= 10000; i++) {
        assert_true(filter_offset(&filter, i / 10000.0) >
                    filter_offset(&filter, (i - 1) / 10000.0));
    }
}

// The share of samples below x, in closed form.
static double share_below(FilterKind kind, double x, double width) {
    double f = 2 * x / width; // -1..1
    switch (kind) {
    case FILTER_BOX:
        return 0.5 + 0.5 * f;
    case FILTER_TRIANGLE:
        return f < 0 ? 0.5 * (1 + f) * (1 + f) : 1 - 0.5 * (1 - f) * (1 - f);
    case FILTER_GAUSSIAN:
        return 0.5 + 0.5 * erf(3 * f / sqrt(2)) / erf(3 / sqrt(2));
    case FILTER_BLACKMAN_HARRIS:
        return 0.5 + 0.5 * f +
               (-0.48829 / PI * sin(PI * (1 + f)) + 0.14128 / (2 * PI) * sin(2 * PI * (1 + f)) -
                0.01168 / (3 * PI) * sin(3 * PI * (1 + f))) /
                   (2 * 0.35875);
    }
    return NAN;
}

static void filter_shares_are_in_closed_form(void **state) {
    (void)state;
    static const double widths[] = {0, 0.5, 1, 2, 4.5};
    static const double usual[] = {3, 1, 2, 3};
    for (int kind = FILTER_BLACKMAN_HARRIS; kind <= FILTER_GAUSSIAN; kind++) {
        for (int w = 0; w < 5; w++) {
            Filter filter;
            filter_init(&filter, (FilterKind)kind, widths[w]);
            double width = widths[w] > 0 ? widths[w] : usual[kind], last = -width;
            assert_near(filter_offset(&filter, 0), -width / 2, 0);
            assert_near(filter_offset(&filter, 1), width / 2, 0);
            for (int i = 0; i <= 20000; i++) {
                double x = filter_offset(&filter, i / 20000.0);
                assert_true(x > last);
                assert_near(share_below((FilterKind)kind, x, width), i / 20000.0, 1e-5);
                last = x;
            }
        }
    }
}

// A millionth of a frame, a week into the film: the instants stay apart and in the interval.
static void shutter_keeps_its_resolution(void **state) {
    (void)state;
    ShutterSettings shutter = {.length = 1e-6, .open = 0.25};
    int64_t frame = 24ll * 3600 * 24 * 7;
    double last = 0;
    for (int i = 0; i < 1000; i++) {
        Instant at = shutter_instant(&shutter, frame, 0, (i + 0.5) / 1000);
        assert_true(at.frame == frame - 1);
        assert_true(at.frac > last && at.frac >= 0.25 && at.frac <= 0.25 + 1e-6);
        last = at.frac;
    }
    shutter = (ShutterSettings){.length = 10, .open = -5};
    Instant at = shutter_instant(&shutter, 1, 0, 0.05);
    assert_true(at.frame == -5);
    assert_near(at.frac, 0.5, 1e-12);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(sampler_fills_elementary_intervals),
    cmocka_unit_test(sampler_stratifies_each_dimension),
    cmocka_unit_test(sampler_stratifies_pixel_and_time),
    cmocka_unit_test(sampler_decorrelates_places),
    cmocka_unit_test(sampler_decorrelates_sets),
    cmocka_unit_test(sampler_halves_are_independent),
    cmocka_unit_test(sampler_freezes),
    cmocka_unit_test(filter_follows_its_density),
    cmocka_unit_test(filter_shares_are_in_closed_form),
    cmocka_unit_test(shutter_keeps_its_resolution),
};

SUITE(sampler, tests)
