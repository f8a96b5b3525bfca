// SPDX-License-Identifier: Apache-2.0
// Adding up slices.
#include "render/merge.h"

#include <stdio.h>
#include <stdlib.h>

#include "render/output.h"

typedef struct {
    const char *path;
    FilmOrigin origin;
} Part;

typedef struct {
    Arena arena;
    Part *parts; // by their first sample, once they are sorted
    size_t n_parts;
    char *message;
    size_t n;
} Merge;

static bool refuse(Merge *merge, const char *sentence) {
    snprintf(merge->message, merge->n, "%s", sentence);
    return false;
}

static bool refuse_file(Merge *merge, const char *path, const char *why) {
    return refuse(merge, arena_printf(&merge->arena, "%s: %s", path, why));
}

static int compare_parts(const void *a, const void *b) {
    uint32_t x = ((const Part *)a)->origin.first, y = ((const Part *)b)->origin.first;
    return (x > y) - (x < y);
}

static bool read_origins(Merge *merge, const char *const *paths) {
    char message[OUTPUT_MESSAGE_SIZE];
    for (size_t i = 0; i < merge->n_parts; i++) {
        Part *part = &merge->parts[i];
        part->path = paths[i];
        if (!film_file_read_origin(&merge->arena, part->path, &part->origin, message,
                                   sizeof message)) {
            return refuse_file(merge, part->path, message);
        }
    }
    qsort(merge->parts, merge->n_parts, sizeof *merge->parts, compare_parts);
    return true;
}

static bool belong_together(Merge *merge) {
    const Part *a = &merge->parts[0];
    FilmDifference is;
    for (size_t i = 1; i < merge->n_parts; i++) {
        const Part *b = &merge->parts[i];
        if (!film_origin_agrees(&merge->arena, &a->origin, &b->origin, &is)) {
            return refuse(merge, arena_printf(&merge->arena,
                                              "%s and %s are not of one picture: the %s of one is "
                                              "%s, of the other %s",
                                              a->path, b->path, is.name, is.a, is.b));
        }
    }
    return true;
}

static bool follow_each_other(Merge *merge) {
    for (size_t i = 1; i < merge->n_parts; i++) {
        const Part *a = &merge->parts[i - 1], *b = &merge->parts[i];
        uint32_t end = a->origin.first + a->origin.n, start = b->origin.first;
        if (start < end) {
            uint32_t last = start + b->origin.n < end ? start + b->origin.n : end;
            return refuse(merge, arena_printf(&merge->arena,
                                              "%s and %s overlap: samples %u to %u are in both",
                                              a->path, b->path, start + 1, last));
        }
        if (start > end) {
            return refuse(merge, arena_printf(&merge->arena,
                                              "samples %u to %u are missing, between %s and %s",
                                              end + 1, start, a->path, b->path));
        }
    }
    return true;
}

// The origin of the sum: that of the first part, whose command it keeps.
static FilmOrigin sum_origins(const Merge *merge) {
    FilmOrigin origin = merge->parts[0].origin;
    origin.n = 0;
    for (size_t i = 0; i < merge->n_parts; i++) {
        const FilmOrigin *part = &merge->parts[i].origin;
        origin.n += part->n;
        origin.spp = part->spp > origin.spp ? part->spp : origin.spp;
    }
    return origin;
}

static bool check_outs(Merge *merge, const FilmOrigin *origin, const char *const *outs,
                       size_t n_outs) {
    char message[OUTPUT_MESSAGE_SIZE];
    for (size_t i = 0; i < n_outs; i++) {
        uint32_t last = origin->first + origin->n;
        bool lacks_first = origin->first > 0, lacks_last = last < origin->spp;
        if (!film_file_has_ending(outs[i]) && (lacks_first || lacks_last)) {
            const char *why = arena_printf(
                &merge->arena,
                "samples %u to %u of %u are missing for a picture; a name that ends "
                "in " RENDER_FILM_ENDING " takes what is there",
                lacks_first ? 1 : last + 1, lacks_first ? origin->first : origin->spp, origin->spp);
            return refuse_file(merge, outs[i], why);
        }
        if (!output_check_path(outs[i], message, sizeof message)) {
            return refuse_file(merge, outs[i], message);
        }
    }
    return true;
}

static bool add_part(Merge *merge, const Part *part, Film *sum, FilmOrigin *sum_origin) {
    char message[OUTPUT_MESSAGE_SIZE];
    Arena arena = {0};
    Film film;
    FilmOrigin origin;
    bool is_read = film_file_read(&arena, part->path, &film, &origin, message, sizeof message);
    if (is_read) {
        FilmTotals counts = film_totals(&film);
        is_read = counts.least == origin.n && counts.most == origin.n;
        snprintf(message, sizeof message,
                 "not finished: pixels have %u to %u of %u samples; --resume goes on from there",
                 counts.least, counts.most, origin.n);
    }
    if (is_read) {
        film_merge(sum, &film);
        film_names_add(&merge->arena, sum_origin->names, origin.names);
    } else {
        refuse_file(merge, part->path, message);
    }
    arena_free(&arena);
    return is_read;
}

static bool write_outs(Merge *merge, const Film *film, const FilmOrigin *origin,
                       const char *const *outs, size_t n_outs) {
    char message[OUTPUT_MESSAGE_SIZE];
    for (size_t i = 0; i < n_outs; i++) {
        if (!output_write(outs[i], film, origin, message, sizeof message)) {
            return refuse_file(merge, outs[i], message);
        }
    }
    return true;
}

bool merge_films(const char *const *parts, size_t n_parts, const char *const *outs, size_t n_outs,
                 MergedSamples *samples, char *message, size_t n) {
    Merge merge = {.n_parts = n_parts, .message = message, .n = n};
    merge.parts = ARENA_ARRAY(&merge.arena, n_parts, Part);
    bool is_fine =
        read_origins(&merge, parts) && belong_together(&merge) && follow_each_other(&merge);
    FilmOrigin origin = {0};
    Film sum;
    if (is_fine) {
        origin = sum_origins(&merge);
        is_fine = check_outs(&merge, &origin, outs, n_outs);
    }
    if (is_fine) {
        film_init(&sum, &merge.arena, origin.layers, origin.width, origin.height);
        sum.x = origin.x;
        sum.y = origin.y;
    }
    for (size_t i = 0; i < n_parts && is_fine; i++) {
        is_fine = add_part(&merge, &merge.parts[i], &sum, &origin);
    }
    is_fine = is_fine && write_outs(&merge, &sum, &origin, outs, n_outs);
    *samples = (MergedSamples){origin.first + 1, origin.first + origin.n, origin.spp};
    arena_free(&merge.arena);
    return is_fine;
}
