// SPDX-License-Identifier: Apache-2.0
// What is seen of differences between images: similarity, FLIP, pictures of them, flicker.
#include "render/compare_pair.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "render/flip.h"
#include "render/ssim.h"

bool compare_pair_is_finite(const ComparePair *pair, char *message, size_t n) {
    for (size_t c = 0; c < pair->n_channels; c++) {
        for (size_t i = 0; i < (size_t)pair->width * pair->height; i++) {
            bool is_fine_a = isfinite(pair->a[c]->values[i]);
            if (!is_fine_a || !isfinite(pair->b[c]->values[i])) {
                snprintf(message, n, "the %s image is not finite at pixel %zu, %zu in %s",
                         is_fine_a ? "second" : "first", i % pair->width, i / pair->width,
                         pair->b[c]->name);
                return false;
            }
        }
    }
    return true;
}

static float displayed(float v) {
    double x = v > 0 ? fmin((double)v, 1) : 0;
    return (float)(x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055);
}

static void copy_displayed(const ComparePair *pair, const float *from, float *to) {
    for (size_t i = 0; i < (size_t)pair->width * pair->height; i++) {
        to[i] = displayed(from[i]);
    }
}

// Of what is no color: all that the reference has; 1 where that is nothing.
static double range_of(const ComparePair *pair, size_t c) {
    const float *values = pair->b[c]->values;
    double least = (double)values[0], most = least;
    for (size_t i = 0; i < (size_t)pair->width * pair->height; i++) {
        least = fmin(least, (double)values[i]);
        most = fmax(most, (double)values[i]);
    }
    return most > least ? most - least : 1;
}

static double ssim_of(const ComparePair *pair) {
    Arena arena = {0};
    const size_t n = (size_t)pair->width * pair->height;
    double sum = 0;
    if (pair->width < SSIM_WINDOW || pair->height < SSIM_WINDOW) {
        return NAN;
    }
    float *shown = pair->is_color ? ARENA_ARRAY(&arena, 2 * n, float) : NULL;
    for (size_t c = 0; c < pair->n_channels; c++) {
        const float *a = pair->a[c]->values, *b = pair->b[c]->values;
        double range = 1;
        if (pair->is_color) {
            copy_displayed(pair, a, shown);
            copy_displayed(pair, b, shown + n);
            a = shown;
            b = shown + n;
        } else {
            range = range_of(pair, c);
        }
        sum += ssim_mean(a, b, pair->width, pair->height, range);
    }
    arena_free(&arena);
    return sum / (double)pair->n_channels;
}

bool compare_perceived(const Image *a, const Image *b, const char *layer, bool wants_hdr,
                       Perceived *result, float *map, char *message, size_t n) {
    ComparePair pair;
    *result = (Perceived){NAN, NAN, NAN};
    if (!compare_pair(a, b, layer, &pair, message, n) ||
        !compare_pair_is_finite(&pair, message, n)) {
        return false;
    }
    result->ssim = ssim_of(&pair);
    if (pair.is_color) {
        FlipImage test = {.width = pair.width, .height = pair.height}, reference = test;
        for (int c = 0; c < 3; c++) {
            test.planes[c] = pair.a[c]->values;
            reference.planes[c] = pair.b[c]->values;
        }
        result->flip = flip_ldr(&test, &reference, FLIP_PIXELS_PER_DEGREE, map);
        if (wants_hdr) {
            result->hdr_flip = flip_hdr(&test, &reference, FLIP_PIXELS_PER_DEGREE, NULL);
        }
    }
    return true;
}

bool compare_difference(Arena *arena, const Image *a, const Image *b, const char *layer,
                        Image *difference, char *message, size_t n) {
    ComparePair pair;
    if (!compare_pair(a, b, layer, &pair, message, n)) {
        return false;
    }
    const size_t n_pixels = (size_t)pair.width * pair.height;
    *difference = (Image){pair.width, pair.height, .n_channels = (uint32_t)pair.n_channels};
    difference->channels = ARENA_ARRAY(arena, pair.n_channels, ImageChannel);
    for (size_t c = 0; c < pair.n_channels; c++) {
        float *values = ARENA_ARRAY(arena, n_pixels, float);
        for (size_t i = 0; i < n_pixels; i++) {
            values[i] = pair.a[c]->values[i] - pair.b[c]->values[i];
        }
        difference->channels[c] = (ImageChannel){pair.b[c]->name, values, false};
    }
    return true;
}

// ---- Parts of the error

enum { MOST_RENDERINGS = 8 };

typedef struct {
    double noise, bias, bias_squares, reference, mean;
    uint64_t n;
} PartSums;

// One value in all renderings and references. Pairs of different pictures, each once.
static void add_value(PartSums *sums, const double *a, uint32_t n, const double *b, uint32_t n_b) {
    double noise = 0, bias = 0;
    uint32_t n_pairs = 0;
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t k = i + 1; k < n; k++, n_pairs++) {
            const double *last = &b[n_b - 1];
            noise += 0.5 * (a[i] - a[k]) * (a[i] - a[k]);
            bias += 0.5 * ((a[i] - b[0]) * (a[k] - *last) + (a[k] - b[0]) * (a[i] - *last));
        }
    }
    sums->noise += noise / n_pairs;
    sums->bias += bias / n_pairs;
    sums->bias_squares += bias / n_pairs * (bias / n_pairs);
    sums->reference += 0.25 * (b[0] - b[n_b - 1]) * (b[0] - b[n_b - 1]);
    sums->mean += 0.5 * (b[0] + b[n_b - 1]);
    sums->n++;
}

bool compare_parts(const Image *a, uint32_t n, const Image *b, uint32_t n_b, const char *layer,
                   ErrorParts *parts, char *message, size_t size) {
    ComparePair pairs[MOST_RENDERINGS], halves;
    PartSums sums = {0};
    n = n < MOST_RENDERINGS ? n : MOST_RENDERINGS;
    for (uint32_t i = 0; i < n; i++) {
        if (!compare_pair(&a[i], &b[0], layer, &pairs[i], message, size)) {
            return false;
        }
    }
    if (!compare_pair(&b[n_b - 1], &b[0], layer, &halves, message, size)) {
        return false;
    }
    for (size_t c = 0; c < halves.n_channels; c++) {
        for (size_t at = 0; at < (size_t)halves.width * halves.height; at++) {
            double values[MOST_RENDERINGS];
            const double of_b[2] = {(double)halves.b[c]->values[at],
                                    (double)halves.a[c]->values[at]};
            bool is_fine = isfinite(of_b[0]) && isfinite(of_b[1]);
            for (uint32_t i = 0; i < n; i++) {
                values[i] = (double)pairs[i].a[c]->values[at];
                is_fine &= isfinite(values[i]);
            }
            if (is_fine) {
                add_value(&sums, values, n, of_b, n_b);
            }
        }
    }
    if (sums.n == 0) {
        snprintf(message, size, "no value is finite in all pictures");
        return false;
    }
    double values = (double)sums.n, bias = sums.bias / values;
    double variance = fmax(sums.bias_squares / values - bias * bias, 0);
    *parts = (ErrorParts){
        .mean = sums.mean / values,
        .noise = sqrt(sums.noise / values),
        .bias_square = bias,
        // The channels of a pixel have the same paths.
        .bias_error = sqrt(variance * (double)halves.n_channels / values),
        .noise_of_ref = n_b > 1 ? sqrt(sums.reference / values) : NAN,
    };
    return true;
}

// ---- Flicker

struct FlickerSum {
    Arena *arena;
    size_t n_values; // of a frame
    uint32_t width, n_frames;
    double *sum, *squares, *last; // of d, for each value
    double mean_b, changes, last_change;
};

FlickerSum *flicker_new(Arena *arena) {
    FlickerSum *sum = ARENA_NEW(arena, FlickerSum);
    sum->arena = arena;
    return sum;
}

static bool start_or_check(FlickerSum *sum, const ComparePair *pair, char *message, size_t n) {
    size_t n_values = (size_t)pair->width * pair->height * pair->n_channels;
    if (sum->n_frames == 0) {
        sum->n_values = n_values;
        sum->width = pair->width;
        sum->sum = ARENA_ARRAY(sum->arena, n_values, double);
        sum->squares = ARENA_ARRAY(sum->arena, n_values, double);
        sum->last = ARENA_ARRAY(sum->arena, n_values, double);
    }
    if (n_values != sum->n_values || pair->width != sum->width) {
        snprintf(message, n, "%ux%u pixels and %zu channels are not what the frames before have",
                 pair->width, pair->height, pair->n_channels);
        return false;
    }
    return true;
}

bool flicker_add(FlickerSum *sum, const Image *a, const Image *b, const char *layer, char *message,
                 size_t n) {
    ComparePair pair;
    if (!compare_pair(a, b, layer, &pair, message, n) ||
        !compare_pair_is_finite(&pair, message, n) || !start_or_check(sum, &pair, message, n)) {
        return false;
    }
    double change = 0, total_b = 0;
    size_t n_pixels = (size_t)pair.width * pair.height;
    for (size_t i = 0; i < sum->n_values; i++) {
        size_t c = i / n_pixels, at = i % n_pixels;
        double b_value = (double)pair.b[c]->values[at];
        double d = (double)pair.a[c]->values[at] - b_value, step = d - sum->last[i];
        total_b += b_value;
        change += step * step;
        sum->sum[i] += d;
        sum->squares[i] += d * d;
        sum->last[i] = d;
    }
    sum->mean_b += total_b / (double)sum->n_values;
    sum->last_change = sum->n_frames ? change / (double)sum->n_values : 0;
    sum->changes += sum->last_change;
    sum->n_frames++;
    return true;
}

Flicker flicker_result(const FlickerSum *sum) {
    Flicker result = {.n_frames = sum->n_frames};
    double frames = sum->n_frames, variance = 0;
    if (sum->n_frames == 0) {
        return result;
    }
    for (size_t i = 0; i < sum->n_values; i++) {
        double mean = sum->sum[i] / frames;
        variance += fmax(sum->squares[i] / frames - mean * mean, 0);
    }
    result.deviation = sqrt(variance / (double)sum->n_values);
    result.change = sum->n_frames > 1 ? sqrt(sum->changes / (frames - 1)) : 0;
    result.last_change = sqrt(sum->last_change);
    result.mean_b = sum->mean_b / frames;
    return result;
}
