// SPDX-License-Identifier: Apache-2.0
// Cryptomatte: hashes, ranks, the manifest.
#include "render/cryptomatte.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_CHANNELS = 2 * CRYPTOMATTE_IDS, N_ATTRIBUTES = 4 };

static uint32_t rotate(uint32_t x, int bits) {
    return x << bits | x >> (32 - bits);
}

// One block of four bytes, little-endian, or what is left of one.
static uint32_t scramble(const uint8_t *at, size_t n) {
    uint32_t k = 0;
    for (size_t i = 0; i < n; i++) {
        k |= (uint32_t)at[i] << (8 * i);
    }
    return rotate(k * 0xcc9e2d51u, 15) * 0x1b873593u;
}

uint32_t cryptomatte_hash(const char *name) {
    const uint8_t *at = (const uint8_t *)name;
    size_t n = strlen(name), i = 0;
    uint32_t h = 0;
    for (; i + 4 <= n; i += 4) {
        h = rotate(h ^ scramble(at + i, 4), 13) * 5 + 0xe6546b64u;
    }
    h ^= scramble(at + i, n - i);
    h ^= (uint32_t)n;
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

uint32_t cryptomatte_id(const char *name) {
    uint32_t hash = cryptomatte_hash(name), exponent = hash >> 23 & 255;
    return exponent == 0 || exponent == 255 ? hash ^ 1u << 23 : hash;
}

// ---- Names

// A thing that the picture shows.
typedef struct {
    uint32_t number; // as the film counts it
    uint32_t id;
    const char *name;
} Thing;

typedef struct {
    const Film *film;
    Layer layer;
    Arena *arena;
    Thing *things; // by rising number
    size_t n;
    FilmCounts room;
    Image *image;
} Matte;

static int compare_things(const void *a, const void *b) {
    uint32_t p = ((const Thing *)a)->number, q = ((const Thing *)b)->number;
    return p < q ? -1 : p > q;
}

static Thing *find_thing(const Matte *matte, uint32_t number) {
    const Thing key = {.number = number};
    return bsearch(&key, matte->things, matte->n, sizeof key, compare_things);
}

static void name_things(Matte *matte, const FilmNames *names) {
    matte->n = names->n;
    matte->things = ARENA_ARRAY(matte->arena, names->n, Thing);
    for (size_t i = 0; i < names->n; i++) {
        const FilmName *name = &names->names[i];
        matte->things[i] = (Thing){name->number, cryptomatte_id(name->name), name->name};
    }
}

// ---- Channels

// The counts of a pixel by id: what has the same name is the same thing.
static uint32_t merge(const Matte *matte, FilmCount *counts, uint32_t n) {
    uint32_t n_merged = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t id = find_thing(matte, counts[i].id)->id, k = 0;
        while (k < n_merged && counts[k].id != id) {
            k++;
        }
        if (k < n_merged) {
            counts[k].n += counts[i].n;
        } else {
            counts[n_merged++] = (FilmCount){id, counts[i].n};
        }
    }
    return n_merged;
}

static bool comes_before(FilmCount a, FilmCount b) {
    return a.n > b.n || (a.n == b.n && a.id < b.id);
}

// The largest one, which is taken out of the list.
static FilmCount take_largest(FilmCount *counts, uint32_t *n) {
    uint32_t largest = 0;
    for (uint32_t i = 1; i < *n; i++) {
        largest = comes_before(counts[i], counts[largest]) ? i : largest;
    }
    FilmCount count = counts[largest];
    counts[largest] = counts[--*n];
    return count;
}

static void fill_pixel(Matte *matte, size_t pixel, ImageChannel *channels) {
    uint32_t n_samples = matte->film->n[pixel];
    uint32_t n = film_counts(matte->film, matte->layer, pixel, matte->arena, &matte->room);
    FilmCount *counts = matte->room.counts;
    n = merge(matte, counts, n);
    for (int k = 0; k < CRYPTOMATTE_IDS && n > 0; k++) {
        FilmCount count = take_largest(counts, &n);
        memcpy(&channels[2 * k].values[pixel], &count.id, sizeof count.id);
        channels[2 * k + 1].values[pixel] = (float)((double)count.n / n_samples);
    }
}

static void add_channels(Matte *matte, const char *prefix) {
    Image *image = matte->image;
    size_t n_pixels = (size_t)image->width * image->height;
    ImageChannel *all = ARENA_ARRAY(matte->arena, image->n_channels + N_CHANNELS, ImageChannel);
    ImageChannel *added = all + image->n_channels;
    memcpy(all, image->channels, image->n_channels * sizeof *all);
    for (int i = 0; i < N_CHANNELS; i++) {
        added[i].name = arena_printf(matte->arena, "%s%02d.%c", prefix, i / 4, "RGBA"[i % 4]);
        added[i].values = ARENA_ARRAY(matte->arena, n_pixels, float);
    }
    for (size_t i = 0; i < n_pixels; i++) {
        fill_pixel(matte, i, added);
    }
    image->channels = all;
    image->n_channels += N_CHANNELS;
}

// ---- The header

// A name as a string of JSON takes at most six bytes for each of its own, and two quotes.
static char *put_json_string(char *at, const char *name) {
    *at++ = '"';
    for (; *name; name++) {
        unsigned char c = (unsigned char)*name;
        if (c < 0x20) {
            at += sprintf(at, "\\u%04x", c);
            continue;
        }
        if (c == '"' || c == '\\') {
            *at++ = '\\';
        }
        *at++ = (char)c;
    }
    *at++ = '"';
    return at;
}

// {"name":"hexadecimal id",...}
static const char *make_manifest(const Matte *matte) {
    size_t size = 3;
    for (size_t i = 0; i < matte->n; i++) {
        size += 6 * strlen(matte->things[i].name) + sizeof "\"\":\"00000000\",";
    }
    char *manifest = ARENA_ARRAY(matte->arena, size, char), *at = manifest;
    *at++ = '{';
    for (size_t i = 0; i < matte->n; i++) {
        const Thing *thing = &matte->things[i];
        // Sorted by id: what has the same name stands together.
        if (i == 0 || matte->things[i - 1].id != thing->id) {
            at = put_json_string(at, thing->name);
            at += sprintf(at, ":\"%08x\",", (unsigned)thing->id);
        }
    }
    at -= at[-1] == ',';
    *at++ = '}';
    *at = 0;
    return manifest;
}

static int compare_ids(const void *a, const void *b) {
    uint32_t p = ((const Thing *)a)->id, q = ((const Thing *)b)->id;
    return p < q ? -1 : p > q;
}

static void add_attributes(Matte *matte, const char *prefix) {
    Image *image = matte->image;
    ImageAttribute *all =
        ARENA_ARRAY(matte->arena, image->n_attributes + N_ATTRIBUTES, ImageAttribute);
    memcpy(all, image->attributes, image->n_attributes * sizeof *all);
    // The things are not looked for by number any more.
    qsort(matte->things, matte->n, sizeof *matte->things, compare_ids);
    const char *const values[N_ATTRIBUTES][2] = {{"name", prefix},
                                                 {"hash", "MurmurHash3_32"},
                                                 {"conversion", "uint32_to_float32"},
                                                 {"manifest", make_manifest(matte)}};
    for (int i = 0; i < N_ATTRIBUTES; i++) {
        // The key is the first seven digits of the id of the layer's name.
        const char *name = arena_printf(matte->arena, CRYPTOMATTE_PREFIX "%07x/%s",
                                        (unsigned)(cryptomatte_id(prefix) >> 4), values[i][0]);
        all[image->n_attributes++] =
            (ImageAttribute){.name = name, .kind = ATTRIBUTE_STRING, .string = values[i][1]};
    }
    image->attributes = all;
}

void cryptomatte_add(const FilmNames names[N_FILM_IDS], const Film *film, Arena *arena,
                     Image *image) {
    static const Layer layers[N_FILM_IDS] = {LAYER_OBJECT, LAYER_MATERIAL};
    static const char *const prefix[N_FILM_IDS] = {"CryptoObject", "CryptoMaterial"};
    for (int k = 0; k < N_FILM_IDS; k++) {
        if (film->layers >> layers[k] & 1) {
            Matte matte = {.film = film, .layer = layers[k], .arena = arena, .image = image};
            name_things(&matte, &names[k]);
            add_channels(&matte, prefix[k]);
            add_attributes(&matte, prefix[k]);
        }
    }
}
