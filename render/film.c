// SPDX-License-Identifier: Apache-2.0
// Exact sums of samples.
#include "render/film.h"

#include <stdlib.h>
#include <string.h>

// Of film times, in frame periods: 2^24 of them within +-2^20 stay below 2^63.
static const double TIME_LIMIT = 0x1p20 - 1;

__extension__ typedef unsigned __int128 U128;

#define IN(layer) (1u << LAYER_##layer)

// What holds the sums, but for the ids, and the layers that need it.
#define ARRAYS                                                                                     \
    ARRAY(sum, ~0u)                                                                                \
    ARRAY(n, ~0u)                                                                                  \
    ARRAY(rank, IN(Z) | IN(NORMAL) | IN(POSITION) | IN(MOTION))                                    \
    ARRAY(depth, IN(Z))                                                                            \
    ARRAY(normal, IN(NORMAL))                                                                      \
    ARRAY(position, IN(POSITION))                                                                  \
    ARRAY(motion, IN(MOTION))                                                                      \
    ARRAY(albedo, IN(ALBEDO))                                                                      \
    ARRAY(square, IN(VARIANCE))                                                                    \
    ARRAY(time, IN(TIME))                                                                          \
    ARRAY(n_hits, IN(TIME))                                                                        \
    ARRAY(half, FILM_HALVES)                                                                       \
    ARRAY(weight, FILM_HALVES)

static const uint32_t id_layers[N_FILM_IDS] = {IN(OBJECT), IN(MATERIAL)};

static size_t pixels_of(const Film *film) {
    return (size_t)film->width * film->height;
}

void film_init(Film *film, Arena *arena, uint32_t layers, uint32_t width, uint32_t height) {
    *film = (Film){.width = width, .height = height, .layers = layers, .arena = arena};
    size_t n = pixels_of(film);
#define ARRAY(name, wanted)                                                                        \
    if ((wanted) == ~0u || layers & (wanted)) {                                                    \
        film->name = arena_array(arena, n, sizeof *film->name);                                    \
    }
    ARRAYS
#undef ARRAY
    for (int k = 0; k < N_FILM_IDS; k++) {
        film->ids[k] = layers & id_layers[k] ? ARENA_ARRAY(arena, n, FilmIds) : NULL;
    }
    film_clear(film);
}

static void clear_ids(Film *film, FilmIds *ids) {
    for (size_t i = 0; i < pixels_of(film); i++) {
        for (FilmIds *more = ids[i].more, *next; more; more = next) {
            next = more->more;
            more->more = film->spare;
            film->spare = more;
        }
    }
    memset(ids, 0, pixels_of(film) * sizeof *ids);
}

void film_clear(Film *film) {
    size_t n = pixels_of(film);
#define ARRAY(name, wanted)                                                                        \
    if (film->name) {                                                                              \
        memset(film->name, 0, n * sizeof *film->name);                                             \
    }
    ARRAYS
#undef ARRAY
    for (size_t i = 0; film->rank && i < n; i++) {
        film->rank[i] = UINT64_MAX;
    }
    for (int k = 0; k < N_FILM_IDS; k++) {
        if (film->ids[k]) {
            clear_ids(film, film->ids[k]);
        }
    }
}

static int64_t to_fixed(double value) {
    double units = rint(value * FILM_UNITS);
    return units >= 0x1p63 ? INT64_MAX : units > 0 ? (int64_t)units : 0;
}

static void add(int64_t *sum, int64_t value) {
    if (__builtin_add_overflow(*sum, value, sum)) {
        *sum = INT64_MAX;
    }
}

static U128 wide_of(const uint64_t halves[2]) {
    return (U128)halves[1] << 64 | halves[0];
}

static void add_wide(uint64_t sum[2], U128 value) {
    U128 all = wide_of(sum);
    if (__builtin_add_overflow(all, value, &all)) {
        all = ~(U128)0;
    }
    sum[0] = (uint64_t)all;
    sum[1] = (uint64_t)(all >> 64);
}

static FilmIds *new_ids(Film *film) {
    FilmIds *ids;
#pragma omp critical(film)
    {
        ids = film->spare;
        if (ids) {
            film->spare = ids->more;
        } else {
            ids = ARENA_NEW(film->arena, FilmIds);
        }
    }
    *ids = (FilmIds){{0}};
    return ids;
}

static void add_id(Film *film, FilmIds *ids, uint32_t id, uint32_t n) {
    for (;; ids = ids->more) {
        for (int i = 0; i < FILM_IDS; i++) {
            if (ids->n[i] == 0) {
                ids->id[i] = id;
            }
            if (ids->id[i] == id) {
                ids->n[i] += n;
                return;
            }
        }
        if (!ids->more) {
            ids->more = new_ids(film);
        }
    }
}

// From the high bits down: whether it lies outside of the pixel, 31 bits of its distance from the
// shutter's middle, 8 of that from the pixel's centre, its index.
static uint64_t rank_of(const FilmSample *sample) {
    double away = fabs(sample->u - 0.5) * 0x1p32;
    double off = sqrt(sample->dx * sample->dx + sample->dy * sample->dy) * 360;
    uint64_t time = away < 0x7fffffff ? (uint64_t)away : 0x7fffffff;
    uint64_t place = off < 255 ? (uint64_t)off : 255;
    uint64_t is_outside = fabs(sample->dx) > 0.5 || fabs(sample->dy) > 0.5;
    return is_outside << 63 | time << 32 | place << 24 | (sample->index & 0xffffff);
}

static void put_vector(float *to, Vec3 v) {
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
}

static void keep_one(Film *film, size_t i, const FilmSample *sample) {
    uint64_t rank = rank_of(sample);
    if (rank >= film->rank[i]) {
        return;
    }
    film->rank[i] = rank;
    if (film->depth) {
        film->depth[i] = (float)sample->depth;
    }
    if (film->normal) {
        put_vector(film->normal[i], sample->normal);
    }
    if (film->position) {
        put_vector(film->position[i], sample->position);
    }
    if (film->motion) {
        film->motion[i][0] = (float)sample->motion[0];
        film->motion[i][1] = (float)sample->motion[1];
    }
}

static bool are_finite(const double v[3]) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static void add_color(Film *film, size_t i, const FilmSample *sample) {
    for (int c = 0; c < 3; c++) {
        int64_t value = to_fixed(sample->color[c]);
        add(&film->sum[i][c], value);
        if (film->square) {
            add_wide(film->square[i][c], (U128)value * (U128)value);
        }
        if (film->half && sample->index % 2 == 0) {
            add(&film->half[i][c], value);
        }
    }
    add(&film->sum[i][3], to_fixed(sample->alpha));
}

static void add_surface(Film *film, size_t i, const FilmSample *sample) {
    for (int c = 0; film->albedo && are_finite(sample->albedo) && c < 3; c++) {
        add(&film->albedo[i][c], to_fixed(sample->albedo[c]));
    }
    if (film->time) {
        double time = fmax(-TIME_LIMIT, fmin(TIME_LIMIT, sample->film_time));
        film->time[i] += (int64_t)rint(time * FILM_TIME_UNITS);
        film->n_hits[i]++;
    }
    const uint32_t id[N_FILM_IDS] = {sample->object, sample->material};
    for (int k = 0; k < N_FILM_IDS; k++) {
        if (film->ids[k]) {
            add_id(film, &film->ids[k][i], id[k], 1);
        }
    }
}

bool film_add(Film *film, uint32_t x, uint32_t y, const FilmSample *sample) {
    size_t i = (size_t)(y - film->y) * film->width + (x - film->x);
    bool is_finite = are_finite(sample->color) && isfinite(sample->alpha);
    film->n[i]++;
    if (is_finite) {
        add_color(film, i, sample);
    }
    if (sample->is_hit) {
        add_surface(film, i, sample);
    }
    if (film->rank) {
        keep_one(film, i, sample);
    }
    return is_finite;
}

static int compare_counts(const void *a, const void *b) {
    const FilmCount *p = a, *q = b;
    if (p->n != q->n) {
        return p->n > q->n ? -1 : 1;
    }
    return p->id < q->id ? -1 : p->id > q->id;
}

uint32_t film_counts(const Film *film, Layer layer, size_t pixel, Arena *arena, FilmCounts *out) {
    uint32_t n = 0;
    const FilmIds *ids = &film->ids[layer == LAYER_MATERIAL][pixel];
    for (; ids; ids = ids->more) {
        for (int i = 0; i < FILM_IDS && ids->n[i]; i++) {
            out->counts = arena_grow(arena, out->counts, n, &out->capacity, sizeof *out->counts);
            out->counts[n++] = (FilmCount){ids->id[i], ids->n[i]};
        }
    }
    if (n > 1) {
        qsort(out->counts, n, sizeof *out->counts, compare_counts);
    }
    return n;
}

uint32_t film_planes(const Film *film, FilmPlane planes[FILM_MAX_PLANES]) {
    uint32_t n = 0;
#define ARRAY(name, wanted)                                                                        \
    if (film->name) {                                                                              \
        planes[n++] = (FilmPlane){#name, film->name, sizeof *film->name};                          \
    }
    ARRAYS
#undef ARRAY
    return n;
}

uint32_t film_count(const Film *film, uint32_t x, uint32_t y) {
    return film->n[(size_t)(y - film->y) * film->width + (x - film->x)];
}

FilmTotals film_totals(const Film *film) {
    FilmTotals totals = {.least = UINT32_MAX};
    for (size_t i = 0; i < pixels_of(film); i++) {
        uint32_t n = film->n[i];
        totals.least = n < totals.least ? n : totals.least;
        totals.most = n > totals.most ? n : totals.most;
        totals.total += n;
    }
    return totals;
}

// ---- Adding films

#define TAKE(name)                                                                                 \
    if (film->name) {                                                                              \
        memcpy(&film->name[i], &more->name[i], sizeof film->name[i]);                              \
    }

static void merge_one(Film *film, const Film *more, size_t i) {
    if (more->rank[i] < film->rank[i]) {
        TAKE(rank)
        TAKE(depth)
        TAKE(normal)
        TAKE(position)
        TAKE(motion)
    }
}

static void merge_sums(Film *film, const Film *more, size_t i) {
    film->n[i] += more->n[i];
    for (int c = 0; c < 4; c++) {
        add(&film->sum[i][c], more->sum[i][c]);
    }
    for (int c = 0; film->albedo && c < 3; c++) {
        add(&film->albedo[i][c], more->albedo[i][c]);
    }
    for (int c = 0; film->square && c < 3; c++) {
        add_wide(film->square[i][c], wide_of(more->square[i][c]));
    }
    if (film->time) {
        film->time[i] += more->time[i];
        film->n_hits[i] += more->n_hits[i];
    }
    for (int c = 0; film->half && c < 3; c++) {
        add(&film->half[i][c], more->half[i][c]);
    }
    if (film->weight && film->weight[i] == 0) {
        film->weight[i] = more->weight[i];
    }
}

static void merge_ids(Film *film, FilmIds *ids, const FilmIds *more) {
    for (; more; more = more->more) {
        for (int i = 0; i < FILM_IDS && more->n[i]; i++) {
            add_id(film, ids, more->id[i], more->n[i]);
        }
    }
}

void film_merge(Film *film, const Film *more) {
    for (size_t i = 0; i < pixels_of(film); i++) {
        merge_sums(film, more, i);
        if (film->rank) {
            merge_one(film, more, i);
        }
        for (int k = 0; k < N_FILM_IDS; k++) {
            if (film->ids[k]) {
                merge_ids(film, &film->ids[k][i], &more->ids[k][i]);
            }
        }
    }
}

// ---- Objects and materials as words

uint32_t *film_save_ids(const Film *film, Arena *arena, size_t *n) {
    static const Layer layer[N_FILM_IDS] = {LAYER_OBJECT, LAYER_MATERIAL};
    FilmCounts room = {0};
    uint32_t *words = NULL;
    size_t capacity = 0;
    *n = 0;
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; film->ids[k] && i < pixels_of(film); i++) {
            uint32_t n_counts = film_counts(film, layer[k], i, arena, &room);
            for (uint32_t c = 0; c <= 2 * n_counts; c++) {
                words = arena_grow(arena, words, *n, &capacity, sizeof *words);
                words[(*n)++] = c == 0  ? n_counts
                                : c % 2 ? room.counts[c / 2].id
                                        : room.counts[c / 2 - 1].n;
            }
        }
    }
    return words;
}

bool film_restore_ids(Film *film, const uint32_t *words, size_t n) {
    size_t at = 0;
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; film->ids[k] && i < pixels_of(film); i++) {
            if (at == n || (n - at - 1) / 2 < words[at]) {
                return false;
            }
            for (uint32_t left = words[at++]; left > 0; left--, at += 2) {
                if (words[at + 1] == 0) {
                    return false;
                }
                add_id(film, &film->ids[k][i], words[at], words[at + 1]);
            }
        }
    }
    return at == n;
}
