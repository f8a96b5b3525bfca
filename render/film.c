// SPDX-License-Identifier: Apache-2.0
// Exact sums of samples.
#include "render/film.h"

#include <string.h>

static const double UNITS = 0x1p28;

void film_init(Film *film, Arena *arena, uint32_t width, uint32_t height) {
    *film = (Film){.width = width, .height = height};
    film->pixels = ARENA_ARRAY(arena, (size_t)width * height, FilmPixel);
    film_clear(film);
}

void film_clear(Film *film) {
    size_t n = (size_t)film->width * film->height;
    memset(film->pixels, 0, n * sizeof *film->pixels);
    for (size_t i = 0; i < n; i++) {
        film->pixels[i].rank = UINT64_MAX;
    }
}

uint32_t film_planes(const Film *film, FilmPlane planes[FILM_MAX_PLANES]) {
    planes[0] = (FilmPlane){"pixels", film->pixels, sizeof *film->pixels};
    return 1;
}

uint32_t film_count(const Film *film, uint32_t x, uint32_t y) {
    return film->pixels[(size_t)y * film->width + x].n;
}

static int64_t to_fixed(double value) {
    double units = rint(value * UNITS);
    return units >= 0x1p63 ? INT64_MAX : units > 0 ? (int64_t)units : 0;
}

static void add_fixed(int64_t *sum, int64_t units) {
    if (__builtin_add_overflow(*sum, units, sum)) {
        *sum = INT64_MAX;
    }
}

static void add(int64_t *sum, double value) {
    add_fixed(sum, to_fixed(value));
}

// The distance from the shutter's middle in the high bits, the index in the low ones.
static uint64_t rank_of(double u, uint32_t index) {
    return (uint64_t)(fabs(u - 0.5) * 0x1p32) << 32 | index;
}

bool film_add(Film *film, uint32_t x, uint32_t y, const FilmSample *sample, double u,
              uint32_t index) {
    FilmPixel *pixel = &film->pixels[(size_t)y * film->width + x];
    const double *c = sample->color;
    bool is_finite = isfinite(c[0]) && isfinite(c[1]) && isfinite(c[2]) && isfinite(sample->alpha);
    pixel->n++;
    if (is_finite) {
        for (int i = 0; i < 3; i++) {
            add(&pixel->sum[i], c[i]);
        }
        add(&pixel->sum[3], sample->alpha);
    }
    uint64_t rank = rank_of(u, index);
    if (rank < pixel->rank) {
        pixel->rank = rank;
        pixel->depth = (float)sample->depth;
        pixel->normal[0] = (float)sample->normal.x;
        pixel->normal[1] = (float)sample->normal.y;
        pixel->normal[2] = (float)sample->normal.z;
    }
    return is_finite;
}

void film_merge(Film *film, const Film *more) {
    size_t n = (size_t)film->width * film->height;
    for (size_t i = 0; i < n; i++) {
        FilmPixel *to = &film->pixels[i];
        const FilmPixel *from = &more->pixels[i];
        to->n += from->n;
        for (int c = 0; c < 4; c++) {
            add_fixed(&to->sum[c], from->sum[c]);
        }
        if (from->rank < to->rank) {
            to->rank = from->rank;
            to->depth = from->depth;
            memcpy(to->normal, from->normal, sizeof to->normal);
        }
    }
}

// Channels in the order in which film_image fills them.
enum { R, G, B, A, Z, NORMAL_X, NORMAL_Y, NORMAL_Z, SAMPLES, N_CHANNELS };

static const char *const channel_names[N_CHANNELS] = {
    "R", "G", "B", "A", "Z", "normal.X", "normal.Y", "normal.Z", "samples"};

void film_image(const Film *film, Arena *arena, Image *image) {
    size_t n = (size_t)film->width * film->height;
    *image = (Image){.width = film->width, .height = film->height, .n_channels = N_CHANNELS};
    image->channels = ARENA_ARRAY(arena, N_CHANNELS, ImageChannel);
    for (int c = 0; c < N_CHANNELS; c++) {
        image->channels[c] = (ImageChannel){.name = channel_names[c],
                                            .values = ARENA_ARRAY(arena, n, float),
                                            .half = c >= NORMAL_X && c <= NORMAL_Z};
    }
    for (size_t i = 0; i < n; i++) {
        const FilmPixel *pixel = &film->pixels[i];
        double weight = pixel->n ? 1 / (UNITS * pixel->n) : 0;
        for (int c = R; c <= A; c++) {
            image->channels[c].values[i] = (float)((double)pixel->sum[c] * weight);
        }
        image->channels[Z].values[i] = pixel->depth;
        for (int c = 0; c < 3; c++) {
            image->channels[NORMAL_X + c].values[i] = pixel->normal[c];
        }
        image->channels[SAMPLES].values[i] = (float)pixel->n;
    }
}
