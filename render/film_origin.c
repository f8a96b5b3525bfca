// SPDX-License-Identifier: Apache-2.0
// Whether two films are of the same samples, by what they were made from.
#include "render/film_file.h"

#include <string.h>

// These say how many samples there are and how they were asked for, not what one of them is.
static bool is_of_the_run(const char *name) {
    static const char *const names[] = {"command", "samples", "noise", "stopped"};
    bool is_one = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        is_one |= strcmp(name, names[i]) == 0;
    }
    return is_one;
}

static const ImageAttribute *find(const ImageAttribute *attributes, uint32_t n, const char *name) {
    for (uint32_t i = 0; i < n; i++) {
        if (!strcmp(attributes[i].name, name)) {
            return &attributes[i];
        }
    }
    return NULL;
}

static const char *value_of(Arena *arena, const ImageAttribute *a) {
    if (!a) {
        return "not there";
    }
    switch (a->kind) {
    case ATTRIBUTE_STRING:
        return a->string;
    case ATTRIBUTE_INT:
        return arena_printf(arena, "%.17g", a->number);
    case ATTRIBUTE_FLOAT:
        // As exactly as EXR holds them.
        return arena_printf(arena, "%.9g", (double)(float)a->number);
    case ATTRIBUTE_RATIONAL:
        break;
    }
    return arena_printf(arena, "%d/%u", a->numerator, a->denominator);
}

// Each of a is in b with the same value. is_swapped: a is the other one.
static bool are_in(Arena *arena, const ImageAttribute *a, uint32_t n_a, const ImageAttribute *b,
                   uint32_t n_b, bool is_strict, bool is_swapped, FilmDifference *difference) {
    for (uint32_t i = 0; i < n_a; i++) {
        const char *mine = value_of(arena, &a[i]);
        const char *other = value_of(arena, find(b, n_b, a[i].name));
        if ((is_strict || !is_of_the_run(a[i].name)) && strcmp(mine, other) != 0) {
            *difference = is_swapped ? (FilmDifference){a[i].name, other, mine}
                                     : (FilmDifference){a[i].name, mine, other};
            return false;
        }
    }
    return true;
}

bool film_attributes_agree(Arena *arena, const ImageAttribute *a, uint32_t n_a,
                           const ImageAttribute *b, uint32_t n_b, bool is_strict,
                           FilmDifference *difference) {
    return are_in(arena, a, n_a, b, n_b, is_strict, false, difference) &&
           are_in(arena, b, n_b, a, n_a, is_strict, true, difference);
}

const char *film_origin_crop(Arena *arena, const FilmOrigin *origin) {
    bool is_whole = origin->width == origin->full_width && origin->height == origin->full_height;
    return is_whole ? NULL
                    : arena_printf(arena, "%u,%u,%u,%u of %ux%u", origin->x,
                                   origin->x + origin->width, origin->y, origin->y + origin->height,
                                   origin->full_width, origin->full_height);
}

const char *film_origin_layers(Arena *arena, const FilmOrigin *origin) {
    static const char *const names[LAYER_COUNT] = {
#define LAYER(id, name, channels, help) name,
#include "render/layers.def"
#undef LAYER
    };
    const char *list = "";
    for (int k = 0; k < LAYER_COUNT; k++) {
        if (origin->layers >> k & 1) {
            list = arena_printf(arena, "%s%s%s", list, *list ? "," : "", names[k]);
        }
    }
    return *list ? list : "none";
}

static const char *size_of(Arena *arena, const FilmOrigin *origin) {
    const char *crop = film_origin_crop(arena, origin);
    const char *size = arena_printf(arena, "%ux%u", origin->width, origin->height);
    return crop ? arena_printf(arena, "%s (crop %s)", size, crop) : size;
}

static bool differ(const char *name, const char *a, const char *b, FilmDifference *difference) {
    *difference = (FilmDifference){name, a, b};
    return strcmp(a, b) != 0;
}

bool film_origin_agrees(Arena *arena, const FilmOrigin *a, const FilmOrigin *b,
                        FilmDifference *difference) {
    if (differ("size", size_of(arena, a), size_of(arena, b), difference) ||
        differ("list of layers", film_origin_layers(arena, a), film_origin_layers(arena, b),
               difference)) {
        return false;
    }
    return film_attributes_agree(arena, a->attributes, a->n_attributes, b->attributes,
                                 b->n_attributes, false, difference) &&
           film_attributes_agree(arena, a->settings, a->n_settings, b->settings, b->n_settings,
                                 false, difference);
}
