// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling: the noise from two halves, weights from the surroundings, counts from weights.
#include "render/adaptive.h"

#include <math.h>

#include "render/sampler.h"

// Standard deviations between an estimated square error and what it is taken to be at most.
static const double DEVIATIONS = 1;

enum {
    REACH = 2,  // a pixel's surroundings: so many pixels to all sides
    BELOW = 10, // weights below that of the mean noise: to half of it
    ABOVE = 32, // and above: to 16 times the noise; more is rather a stray sample
    WEIGHTS = BELOW + 1 + ABOVE,
    SEED = 0x5eed // of what is by chance here; any
};

// A factor of two of noise has 8 weights, one of samples 10: samples go with the noise to the power
// 0.8. Where the square error falls as their number to the power -1.5, as at edges, that is best;
// where it falls as their number, 1 would be. Products, as pow() has other last bits elsewhere.
static const double NOISE_STEP = 1.0905077326652577, SAMPLES_STEP = 1.0717734625362931;

// What weight w, from 1 to WEIGHTS, is from the one of the mean noise, in steps.
static double from_mean(double step, uint32_t w) {
    double value = 1;
    for (uint32_t i = w; i < 1 + BELOW; i++) {
        value /= step;
    }
    for (uint32_t i = 1 + BELOW; i < w; i++) {
        value *= step;
    }
    return value;
}

// Random bits of a place that have nothing to do with those of its samples.
static uint64_t chance(uint32_t x, uint32_t y) {
    return sampler_pixel(SEED, true, 0, x, y).key[0];
}

// Of two neighbours in a line one is of each kind.
static uint32_t kind_of(uint32_t x, uint32_t y) {
    return (uint32_t)(chance(x >> 1, y) >> 63) ^ (x & 1);
}

// Of the mean of red, green and blue, in film units: the sum of the estimated variances.
static double variance_of(const Film *film, size_t i) {
    uint32_t n = film->n[i];
    double sum = 0;
    for (int c = 0; c < 3 && n >= 2; c++) {
        double even = (double)film->half[i][c] / ((n + 1) / 2);
        double odd = (double)(film->sum[i][c] - film->half[i][c]) / (n / 2);
        double half = (even - odd) / 2;
        sum += half * half;
    }
    return sum;
}

static double color_of(const Film *film, size_t i) {
    const int64_t *sum = film->sum[i];
    uint32_t n = film->n[i];
    return n ? ((double)sum[0] + (double)sum[1] + (double)sum[2]) / n : 0;
}

// Sums over pixels; of rows first, lest small terms drown.
typedef struct {
    double square, fourth, color;
} Sums;

static void add_sums(Sums *sums, const Sums *more) {
    sums->square += more->square;
    sums->fourth += more->fourth;
    sums->color += more->color;
}

AdaptiveNoise adaptive_noise(const Film *film) {
    const double n = 3.0 * film->width * film->height;
    Sums sums = {0};
    for (uint32_t y = 0; y < film->height; y++) {
        Sums row = {0};
        for (uint32_t x = 0; x < film->width; x++) {
            size_t i = (size_t)y * film->width + x;
            double square = variance_of(film, i);
            add_sums(&row, &(Sums){square, square * square, color_of(film, i)});
        }
        add_sums(&sums, &row);
    }
    if (!(sums.color > 0)) {
        return (AdaptiveNoise){0};
    }
    double most = sums.square + DEVIATIONS * sqrt(sums.fourth), mean = sums.color / n;
    return (AdaptiveNoise){sqrt(sums.square / n) / mean, sqrt(most / n) / mean};
}

Level adaptive_believed(uint32_t width, uint32_t height) {
    const double all = 0x1p20, pilots = all / ((double)width * height * ADAPTIVE_PILOT);
    return (Level)(fmin(fmax(pilots, 1), 16) * ADAPTIVE_PILOT * LEVEL_SAMPLE);
}

// ---- Weights

static uint32_t clip(uint32_t at, int by, uint32_t size) {
    int64_t to = (int64_t)at + by;
    return to < 0 ? 0 : to >= size ? size - 1 : (uint32_t)to;
}

typedef struct {
    uint32_t width, height;
    uint8_t *kinds;
    float *variances;
} Pilot;

// The root mean square noise of the pixels around (x, y), of the film, that are not of its kind.
static double noise_around(const Pilot *pilot, uint32_t x, uint32_t y) {
    const uint8_t kind = pilot->kinds[(size_t)y * pilot->width + x];
    double sum = 0;
    uint32_t n = 0;
    for (uint32_t v = clip(y, -REACH, pilot->height); v <= clip(y, REACH, pilot->height); v++) {
        for (uint32_t u = clip(x, -REACH, pilot->width); u <= clip(x, REACH, pilot->width); u++) {
            size_t i = (size_t)v * pilot->width + u;
            sum += pilot->kinds[i] != kind ? (double)pilot->variances[i] : 0;
            n += pilot->kinds[i] != kind;
        }
    }
    return n ? sqrt(sum / n) : 0;
}

// The last that is not above the ratio, else the first.
static uint8_t weight_of(double ratio) {
    uint32_t low = 1, high = WEIGHTS + 1;
    while (high - low > 1) {
        uint32_t middle = (low + high) / 2;
        if (from_mean(NOISE_STEP, middle) <= ratio) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return (uint8_t)low;
}

void adaptive_weigh(Film *film) {
    Arena arena = {0};
    const size_t n = (size_t)film->width * film->height;
    Pilot pilot = {film->width, film->height, ARENA_ARRAY(&arena, n, uint8_t),
                   ARENA_ARRAY(&arena, n, float)};
    float *noise = ARENA_ARRAY(&arena, n, float);
    double mean[2] = {0};
    uint32_t n_of[2] = {0};
    for (size_t i = 0; i < n; i++) {
        uint32_t x = (uint32_t)(i % film->width), y = (uint32_t)(i / film->width);
        pilot.kinds[i] = (uint8_t)kind_of(film->x + x, film->y + y);
        pilot.variances[i] = (float)variance_of(film, i);
    }
    for (size_t i = 0; i < n; i++) {
        uint32_t x = (uint32_t)(i % film->width), y = (uint32_t)(i / film->width);
        noise[i] = (float)noise_around(&pilot, x, y);
        mean[pilot.kinds[i]] += (double)noise[i];
        n_of[pilot.kinds[i]]++;
    }
    for (size_t i = 0; i < n; i++) {
        double all = mean[pilot.kinds[i]] / n_of[pilot.kinds[i]];
        film->weight[i] = weight_of(all > 0 ? (double)noise[i] / all : 1);
    }
    arena_free(&arena);
}

// ---- Counts

static void count_weights(const Film *film, uint32_t counts[2][256]) {
    for (uint32_t y = 0; y < film->height; y++) {
        for (uint32_t x = 0; x < film->width; x++) {
            uint8_t weight = film->weight[(size_t)y * film->width + x];
            counts[kind_of(film->x + x, film->y + y)][weight]++;
        }
    }
}

static double half_at(double scale, uint32_t weight) {
    double least = ADAPTIVE_PILOT / 2, most = ADAPTIVE_MOST / 2;
    return fmin(fmax(least, scale * from_mean(SAMPLES_STEP, weight)), most);
}

// By which weights are to be multiplied, so that the halves have `half` samples in the mean.
static double find_scale(const uint32_t counts[256], double half) {
    double low = 0, high = 0x1p32;
    for (int step = 0; step < 80; step++) {
        double middle = (low + high) / 2, sum = 0, n = 0;
        for (uint32_t w = 0; w < 256; w++) {
            sum += counts[w] ? counts[w] * half_at(middle, w) : 0;
            n += counts[w];
        }
        if (sum <= half * n) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

void allocation_find(Allocation *allocation, const Film *film, Level level) {
    const double half = (double)level / (2 * LEVEL_SAMPLE);
    const bool is_even = level <= ADAPTIVE_PILOT * LEVEL_SAMPLE;
    uint32_t counts[2][256] = {{0}};
    if (!is_even) {
        count_weights(film, counts);
    }
    for (int kind = 0; kind < 2; kind++) {
        double scale = is_even ? 0 : find_scale(counts[kind], half);
        for (uint32_t w = 0; w < 256; w++) {
            allocation->half[kind][w] = is_even ? half : half_at(scale, w);
        }
    }
}

uint32_t allocation_count(const Allocation *allocation, const Film *film, uint32_t x, uint32_t y) {
    size_t i = (size_t)(y - film->y) * film->width + (x - film->x);
    int exponent;
    double ratio = 2 * frexp(allocation->half[kind_of(x, y)][film->weight[i]], &exponent) - 1;
    bool is_up = (double)(chance(x, y) >> 40) * 0x1p-24 < ratio;
    return 2u << (exponent - 1 + is_up);
}
