// SPDX-License-Identifier: Apache-2.0
// The channels of a picture from the sums of its samples.
#include "render/film.h"

__extension__ typedef unsigned __int128 U128;

#define IN(layer) (1u << LAYER_##layer)

// Channels in the order in which film_image fills them.
typedef struct {
    Arena *arena;
    size_t n; // pixels
    Image *image;
} Channels;

static float *add_channel(Channels *to, const char *name, bool half) {
    Image *image = to->image;
    ImageChannel *channel = &image->channels[image->n_channels++];
    *channel =
        (ImageChannel){.name = name, .values = ARENA_ARRAY(to->arena, to->n, float), .half = half};
    return channel->values;
}

static double mean(int64_t sum, uint32_t n) {
    return n ? (double)sum / (FILM_UNITS * n) : 0;
}

static void add_means(Channels *to, const char *const names[], int n_names, const int64_t *sums,
                      const uint32_t *n) {
    for (int c = 0; c < n_names; c++) {
        float *values = add_channel(to, names[c], false);
        for (size_t i = 0; i < to->n; i++) {
            values[i] = (float)mean(sums[(size_t)n_names * i + (size_t)c], n[i]);
        }
    }
}

static void add_values(Channels *to, const char *const names[], int n_names, const float *of,
                       bool half) {
    for (int c = 0; c < n_names; c++) {
        float *values = add_channel(to, names[c], half);
        for (size_t i = 0; i < to->n; i++) {
            values[i] = of[(size_t)n_names * i + (size_t)c];
        }
    }
}

// The sum of (v - m)^2 is that of v^2 - 2 m v + m^2 for any m, here the mean rounded down: exact,
// even where the terms on the way go beyond 128 bits, as the result does not.
static double variance_of_mean(const uint64_t square[2], int64_t sum, uint32_t n) {
    U128 all = (U128)square[1] << 64 | square[0];
    if (all == ~(U128)0 || sum == INT64_MAX) {
        return INFINITY;
    }
    if (n < 2) {
        return 0;
    }
    U128 m = (U128)(sum / n), total = (U128)sum;
    double rest = (double)(total - m * n);
    double about_m = (double)(all - 2 * m * total + m * m * n);
    double spread = about_m - rest * rest / n;
    return spread > 0 ? spread / (FILM_UNITS * FILM_UNITS) / ((double)n * (n - 1.0)) : 0;
}

static void add_variances(Channels *to, const Film *film) {
    static const char *const names[3] = {"variance.R", "variance.G", "variance.B"};
    for (int c = 0; c < 3; c++) {
        float *values = add_channel(to, names[c], false);
        for (size_t i = 0; i < to->n; i++) {
            values[i] = (float)variance_of_mean(film->square[i][c], film->sum[i][c], film->n[i]);
        }
    }
}

static void add_times(Channels *to, const Film *film) {
    float *values = add_channel(to, "time", false);
    for (size_t i = 0; i < to->n; i++) {
        uint32_t n = film->n_hits[i];
        values[i] = n ? (float)((double)film->time[i] / (FILM_TIME_UNITS * n)) : 0;
    }
}

static void add_samples(Channels *to, const Film *film) {
    float *values = add_channel(to, "samples", false);
    for (size_t i = 0; i < to->n; i++) {
        values[i] = (float)film->n[i];
    }
}

void film_image(const Film *film, Arena *arena, Image *image) {
    enum { MAX_CHANNELS = 4 + 3 * LAYER_COUNT };
    static const char *const color[] = {"R", "G", "B", "A"}, *const depth[] = {"Z"};
    static const char *const normal[] = {"normal.X", "normal.Y", "normal.Z"};
    static const char *const albedo[] = {"albedo.R", "albedo.G", "albedo.B"};
    static const char *const position[] = {"position.X", "position.Y", "position.Z"};
    static const char *const motion[] = {"motion.X", "motion.Y"};
    *image = (Image){.width = film->width, .height = film->height};
    image->channels = ARENA_ARRAY(arena, MAX_CHANNELS, ImageChannel);
    Channels to = {arena, (size_t)film->width * film->height, image};
    add_means(&to, color, 4, *film->sum, film->n);
    if (film->depth) {
        add_values(&to, depth, 1, film->depth, false);
    }
    if (film->normal) {
        add_values(&to, normal, 3, *film->normal, true);
    }
    if (film->albedo) {
        add_means(&to, albedo, 3, *film->albedo, film->n);
    }
    if (film->position) {
        add_values(&to, position, 3, *film->position, false);
    }
    if (film->motion) {
        add_values(&to, motion, 2, *film->motion, false);
    }
    if (film->layers & IN(SAMPLES)) {
        add_samples(&to, film);
    }
    if (film->square) {
        add_variances(&to, film);
    }
    if (film->time) {
        add_times(&to, film);
    }
}
