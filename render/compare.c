// SPDX-License-Identifier: Apache-2.0
// How far an image is from a reference. Sums are formed row by row, so that millions of small terms
// do not drown in one large one.
#include "render/compare_pair.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static double ratio(double up, double down) {
    return up == 0 ? 0 : up / down;
}

// "R, G, B, A and 3 more", for messages.
static void list_channels(const Image *image, char *list, size_t n) {
    size_t at = 0;
    list[0] = '\0';
    for (uint32_t i = 0; i < image->n_channels && at < n; i++) {
        if (i == 6) {
            snprintf(list + at, n - at, " and %u more", image->n_channels - i);
            return;
        }
        int put = snprintf(list + at, n - at, "%s%.20s", i ? ", " : "", image->channels[i].name);
        at += put > 0 ? (size_t)put : 0;
    }
}

static const ImageChannel *find(const Image *image, const char *name, const char *which,
                                char *message, size_t n) {
    const ImageChannel *channel = image_channel(image, name);
    if (!channel) {
        char list[256];
        list_channels(image, list, sizeof list);
        snprintf(message, n, "the %s image has no channel %s; it has %s", which, name, list);
    }
    return channel;
}

static bool is_within(const char *name, const char *layer) {
    size_t n = strlen(layer);
    return strncmp(name, layer, n) == 0 && name[n] == '.';
}

// Names of b's channels that make up the layer; 0: there are none, and it may be one of a's.
static size_t name_channels(const Image *b, const char *layer, const char **names) {
    static const char *const color[] = {"R", "G", "B"};
    size_t n = 0;
    if (!layer || !*layer) {
        memcpy(names, color, sizeof color);
        return 3;
    }
    if (image_channel(b, layer)) {
        names[0] = layer;
        return 1;
    }
    for (uint32_t i = 0; i < b->n_channels && n < COMPARE_CHANNELS; i++) {
        if (is_within(b->channels[i].name, layer)) {
            names[n++] = b->channels[i].name;
        }
    }
    return n;
}

// Stored in the order of the file, which is that of the alphabet; FLIP wants red first.
static bool sort_color(const char **names, size_t n) {
    const char *sorted[3] = {0};
    for (size_t i = 0; i < n && n == 3; i++) {
        const char *dot = strrchr(names[i], '.');
        const char *last = dot ? dot + 1 : names[i];
        const char *at = strlen(last) == 1 ? strchr("RGB", *last) : NULL;
        sorted[at ? at - "RGB" : 0] = names[i];
    }
    if (!sorted[0] || !sorted[1] || !sorted[2]) {
        return false;
    }
    memcpy(names, sorted, sizeof sorted);
    return true;
}

bool compare_pair(const Image *a, const Image *b, const char *layer, ComparePair *pair,
                  char *message, size_t n) {
    const char *names[COMPARE_CHANNELS];
    if (a->width != b->width || a->height != b->height) {
        snprintf(message, n, "the sizes differ: %ux%u pixels and %ux%u", a->width, a->height,
                 b->width, b->height);
        return false;
    }
    *pair = (ComparePair){.width = a->width, .height = a->height};
    pair->n_channels = name_channels(b, layer, names);
    if (pair->n_channels == 0) {
        bool a_has = name_channels(a, layer, names) > 0;
        find(a_has ? b : a, layer, a_has ? "second" : "first", message, n);
        return false;
    }
    pair->is_color = sort_color(names, pair->n_channels);
    for (size_t c = 0; c < pair->n_channels; c++) {
        pair->a[c] = find(a, names[c], "first", message, n);
        pair->b[c] = pair->a[c] ? find(b, names[c], "second", message, n) : NULL;
        if (!pair->b[c]) {
            return false;
        }
    }
    return true;
}

const char *const *compare_layers(Arena *arena, const Image *image, uint32_t *n) {
    const char **layers = ARENA_ARRAY(arena, image->n_channels + 1, const char *);
    *n = 0;
    layers[(*n)++] = "";
    for (uint32_t i = 0; i < image->n_channels; i++) {
        const char *name = image->channels[i].name, *dot = strrchr(name, '.');
        bool is_known = strlen(name) == 1 && strchr("RGBA", *name);
        const char *layer =
            dot && dot != name ? arena_string(arena, name, (size_t)(dot - name)) : name;
        for (uint32_t k = 0; k < *n; k++) {
            is_known |= strcmp(layers[k], layer) == 0;
        }
        if (!is_known) {
            layers[(*n)++] = layer;
        }
    }
    return layers;
}

// The first way: counts and means, which the relative measures need before they can sum.
static void count(const ComparePair *pair, Comparison *r) {
    for (uint32_t y = 0; y < pair->height; y++) {
        double sum_a = 0, sum_b = 0;
        for (size_t c = 0; c < pair->n_channels; c++) {
            const float *a = pair->a[c]->values + (size_t)y * pair->width;
            const float *b = pair->b[c]->values + (size_t)y * pair->width;
            for (uint32_t x = 0; x < pair->width; x++) {
                bool is_fine_a = isfinite(a[x]), is_fine_b = isfinite(b[x]);
                r->n_not_finite_a += !is_fine_a;
                r->n_not_finite_b += !is_fine_b;
                if (is_fine_a && is_fine_b) {
                    r->n_values++;
                    sum_a += (double)a[x];
                    sum_b += (double)b[x];
                }
            }
        }
        r->mean_a += sum_a;
        r->mean_b += sum_b;
    }
    r->mean_a = ratio(r->mean_a, (double)r->n_values);
    r->mean_b = ratio(r->mean_b, (double)r->n_values);
}

static void measure_row(const ComparePair *pair, uint32_t y, Comparison *r) {
    double sum = 0, relative = 0, floor_of_b = 0.01 * r->mean_b * r->mean_b;
    for (uint32_t x = 0; x < pair->width; x++) {
        for (size_t c = 0; c < pair->n_channels; c++) {
            float a = pair->a[c]->values[(size_t)y * pair->width + x];
            float b = pair->b[c]->values[(size_t)y * pair->width + x];
            if (!isfinite(a) || !isfinite(b)) {
                continue;
            }
            double d = (double)a - (double)b;
            sum += d * d;
            relative += ratio(d * d, (double)b * (double)b + floor_of_b);
            r->n_different += d != 0;
            if (fabs(d) > r->maximum) {
                r->maximum = fabs(d);
                r->maximum_x = x;
                r->maximum_y = y;
                r->maximum_channel = pair->a[c]->name;
            }
        }
    }
    r->mse += sum;
    r->relative_mse += relative;
}

bool compare_images(const Image *a, const Image *b, const char *layer, Comparison *result,
                    char *message, size_t n) {
    ComparePair pair;
    *result = (Comparison){0};
    if (!compare_pair(a, b, layer, &pair, message, n)) {
        return false;
    }
    count(&pair, result);
    if (result->n_values == 0) {
        snprintf(message, n, "no value is finite in both images");
        return false;
    }
    for (uint32_t y = 0; y < pair.height; y++) {
        measure_row(&pair, y, result);
    }
    result->mse /= (double)result->n_values;
    result->relative_mse /= (double)result->n_values;
    result->rmse = sqrt(result->mse);
    result->relative_rmse = ratio(result->rmse, fabs(result->mean_b));
    result->psnr = -10 * log10(result->mse);
    return true;
}
