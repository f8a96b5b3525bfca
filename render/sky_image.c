// SPDX-License-Identifier: Apache-2.0
// Picture skies: reading, looking up, drawing directions.
#include "render/sky_image.h"

#include <stdio.h>

#include "render/image.h"
#include "render/program.h"
#include "render/sampling.h"

static double luminance(const float *rgb) {
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// The sine at the middle of a row, for all that is in it.
static double row_sine(const SkyImage *image, uint32_t row) {
    double sine, cosine;
    sampling_turn((row + 0.5) / image->height / 2, &sine, &cosine);
    return sine;
}

// The mean over a pixel of what is linear between the middles of pixels: its neighbours shine into
// it.
static double pixel_luminance(const SkyImage *image, uint32_t x, uint32_t y) {
    static const double weight[3] = {0.125, 0.75, 0.125};
    uint32_t w = image->width, h = image->height;
    const uint32_t xs[3] = {x ? x - 1 : w - 1, x, x + 1 < w ? x + 1 : 0};
    const uint32_t ys[3] = {y ? y - 1 : 0, y, y + 1 < h ? y + 1 : y};
    double sum = 0;
    for (int i = 0; i < 9; i++) {
        const float *rgb = image->rgb + 3 * ((size_t)ys[i / 3] * w + xs[i % 3]);
        sum += weight[i / 3] * weight[i % 3] * luminance(rgb);
    }
    return sum;
}

static double mean_luminance(const SkyImage *image) {
    double sum = 0, weight = 0;
    for (uint32_t y = 0; y < image->height; y++) {
        double sine = row_sine(image, y), row = 0;
        for (uint32_t x = 0; x < image->width; x++) {
            row += pixel_luminance(image, x, y);
        }
        sum += sine * row / image->width;
        weight += sine;
    }
    return sum / weight;
}

static void make_distribution(Arena *arena, SkyImage *image) {
    double mean = mean_luminance(image) * (1 + 1e-6), sum = 0; // 0/0 below counts as 0
    uint32_t w = image->width, h = image->height;
    double *rows = ARENA_ARRAY(arena, (size_t)h + 1, double);
    float *columns = ARENA_ARRAY(arena, (size_t)h * (w + 1), float);
    for (uint32_t y = 0; y < h; y++) {
        float *cdf = columns + (size_t)y * (w + 1);
        double row = 0;
        for (uint32_t x = 0; x < w; x++) {
            row += fmax(pixel_luminance(image, x, y) / mean - 1, 0);
            cdf[x + 1] = (float)row;
        }
        for (uint32_t x = 1; row > 0 && x <= w; x++) {
            cdf[x] = x < w ? (float)(cdf[x] / row) : 1;
        }
        sum += row * row_sine(image, y);
        rows[y + 1] = sum;
    }
    for (uint32_t y = 1; y <= h && sum > 0; y++) {
        rows[y] = y < h ? rows[y] / sum : 1;
    }
    image->rows = sum > 0 ? rows : NULL;
    image->columns = columns;
}

SkyImage sky_image_from(Arena *arena, float *rgb, uint32_t width, uint32_t height) {
    SkyImage image = {.width = width, .height = height, .rgb = rgb};
    for (size_t i = 0; i < 3 * (size_t)width * height; i++) {
        rgb[i] = isfinite(rgb[i]) && rgb[i] > 0 ? rgb[i] : 0;
    }
    make_distribution(arena, &image);
    return image;
}

bool sky_image_read(Arena *arena, const char *path, SkyImage *image, char *message, size_t n) {
    static const char *const names[3] = {"R", "G", "B"};
    const ImageChannel *channels[3];
    Arena scratch = {0};
    Image file;
    bool is_read = image_read(&scratch, path, &file, message, n);
    for (int c = 0; c < 3 && is_read; c++) {
        channels[c] = image_channel(&file, names[c]);
        channels[c] = channels[c] ? channels[c] : image_channel(&file, "Y"); // grey
        if (!channels[c]) {
            snprintf(message, n, "it has no channel %s: a sky has R, G and B", names[c]);
            is_read = false;
        }
    }
    if (is_read) {
        size_t size = (size_t)file.width * file.height;
        float *rgb = ARENA_ARRAY(arena, 3 * size, float);
        for (size_t i = 0; i < 3 * size; i++) {
            rgb[i] = channels[i % 3]->values[i / 3];
        }
        *image = sky_image_from(arena, rgb, file.width, file.height);
    }
    arena_free(&scratch);
    return is_read;
}

// ---- Directions

// Where a direction is in the picture: u to the right, v down, both in [0, 1].
static void place_of(Vec3 dir, double *u, double *v) {
    double y = dir.y < -1 ? -1 : dir.y > 1 ? 1 : dir.y;
    *u = program_fold(OP_ATAN2, dir.x, -dir.z, 0) / (2 * SAMPLING_PI) + 0.5;
    *v = program_fold(OP_ACOS, y, 0, 0) / SAMPLING_PI;
}

static uint32_t index_of(double place, uint32_t n) {
    double i = floor(place * n);
    return i < 0 ? 0 : i < n ? (uint32_t)i : n - 1;
}

void sky_image_radiance(const SkyImage *image, Vec3 dir, double rgb[3]) {
    double u, v;
    place_of(dir, &u, &v);
    double x = u * image->width - 0.5, y = v * image->height - 0.5;
    double fx = x - floor(x), fy = y - floor(y);
    uint32_t w = image->width, h = image->height;
    uint32_t x0 = x < 0 ? w - 1 : (uint32_t)x % w, x1 = (x0 + 1) % w; // round and round
    uint32_t y0 = y < 0 ? 0 : (uint32_t)y < h ? (uint32_t)y : h - 1;
    uint32_t y1 = y < 0 || y0 + 1 == h ? y0 : y0 + 1; // poles are as their rows
    const float *a = image->rgb + 3 * ((size_t)y0 * w), *b = image->rgb + 3 * ((size_t)y1 * w);
    for (int c = 0; c < 3; c++) {
        double top = a[3 * (size_t)x0 + c] * (1 - fx) + a[3 * (size_t)x1 + c] * fx;
        double low = b[3 * (size_t)x0 + c] * (1 - fx) + b[3 * (size_t)x1 + c] * fx;
        rgb[c] = top * (1 - fy) + low * fy;
    }
}

// Per steradian, of a pixel.
static double pixel_density(const SkyImage *image, uint32_t row, uint32_t column, double sine) {
    const float *cdf = image->columns + (size_t)row * (image->width + 1);
    double share =
        (image->rows[row + 1] - image->rows[row]) * ((double)cdf[column + 1] - cdf[column]);
    double area = 2 * SAMPLING_PI * SAMPLING_PI * sine / ((double)image->width * image->height);
    return area > 0 ? share / area : 0;
}

Vec3 sky_image_sample(const SkyImage *image, double u, double v, double *density) {
    uint32_t row = 0, column = 0;
    for (uint32_t n = image->height; n > 1; n -= n / 2) { // the last one that begins at or below v
        row += image->rows[row + n / 2] <= v ? n / 2 : 0;
    }
    const float *cdf = image->columns + (size_t)row * (image->width + 1);
    for (uint32_t n = image->width; n > 1; n -= n / 2) {
        column += cdf[column + n / 2] <= u ? n / 2 : 0;
    }
    double down = (v - image->rows[row]) / (image->rows[row + 1] - image->rows[row]);
    double along = (u - cdf[column]) / ((double)cdf[column + 1] - cdf[column]);
    double sine, cosine, turn_sine, turn_cosine;
    sampling_turn((row + down) / image->height / 2, &sine, &cosine);
    sampling_turn((column + along) / image->width - 0.5, &turn_sine, &turn_cosine);
    *density = pixel_density(image, row, column, sine);
    return vec3(sine * turn_sine, cosine, -sine * turn_cosine);
}

double sky_image_density(const SkyImage *image, Vec3 dir) {
    double u, v;
    if (!image->rows) {
        return 0;
    }
    place_of(dir, &u, &v);
    double sine2 = dir.x * dir.x + dir.z * dir.z;
    return pixel_density(image, index_of(v, image->height), index_of(u, image->width), sqrt(sine2));
}
