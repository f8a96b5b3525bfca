// SPDX-License-Identifier: Apache-2.0
// Exact sums of samples.
#include "render/film.h"

#include <stdlib.h>
#include <string.h>

static const double UNITS = 0x1p28;
// Of film times, in frame periods: 2^24 of them within +-2^20 stay below 2^63.
static const double TIME_UNITS = 0x1p19, TIME_LIMIT = 0x1p20 - 1;

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
    ARRAY(n_hits, IN(TIME))

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
    double units = rint(value * UNITS);
    return units >= 0x1p63 ? INT64_MAX : units > 0 ? (int64_t)units : 0;
}

static void add(int64_t *sum, int64_t value) {
    if (__builtin_add_overflow(*sum, value, sum)) {
        *sum = INT64_MAX;
    }
}

static void add_square(uint64_t sum[2], int64_t value) {
    U128 all = (U128)sum[1] << 64 | sum[0], square = (U128)value * (U128)value;
    if (__builtin_add_overflow(all, square, &all)) {
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
            add_square(film->square[i][c], value);
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
        film->time[i] += (int64_t)rint(time * TIME_UNITS);
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

// Bytes that are written one after the other, or read.
typedef struct {
    uint8_t *at;
    const uint8_t *from, *end;
} Bytes;

static void put(Bytes *bytes, const void *value, size_t n) {
    memcpy(bytes->at, value, n);
    bytes->at += n;
}

static bool take(Bytes *bytes, void *value, size_t n) {
    if ((size_t)(bytes->end - bytes->from) < n) {
        return false;
    }
    memcpy(value, bytes->from, n);
    bytes->from += n;
    return true;
}

// An upper bound.
static size_t saved_size(const Film *film) {
    size_t n = pixels_of(film), size = 0;
#define ARRAY(name, wanted) size += film->name ? n * sizeof *film->name : 0;
    ARRAYS
#undef ARRAY
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; film->ids[k] && i < n; i++) {
            size += sizeof(uint32_t);
            for (const FilmIds *ids = &film->ids[k][i]; ids; ids = ids->more) {
                size += FILM_IDS * sizeof(FilmCount);
            }
        }
    }
    return size;
}

void *film_save(const Film *film, Arena *arena, size_t *n) {
    static const Layer layer[N_FILM_IDS] = {LAYER_OBJECT, LAYER_MATERIAL};
    uint8_t *memory = arena_array(arena, saved_size(film), 1);
    Bytes bytes = {.at = memory};
#define ARRAY(name, wanted)                                                                        \
    if (film->name) {                                                                              \
        put(&bytes, film->name, pixels_of(film) * sizeof *film->name);                             \
    }
    ARRAYS
#undef ARRAY
    FilmCounts room = {0};
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; film->ids[k] && i < pixels_of(film); i++) {
            uint32_t n_counts = film_counts(film, layer[k], i, arena, &room);
            put(&bytes, &n_counts, sizeof n_counts);
            for (uint32_t c = 0; c < n_counts; c++) {
                put(&bytes, &room.counts[c], sizeof room.counts[c]);
            }
        }
    }
    *n = (size_t)(bytes.at - memory);
    return memory;
}

static bool restore_ids(Film *film, FilmIds *ids, Bytes *bytes) {
    uint32_t n;
    bool done = take(bytes, &n, sizeof n);
    for (uint32_t i = 0; done && i < n; i++) {
        FilmCount count;
        done = take(bytes, &count, sizeof count) && count.n > 0;
        if (done) {
            add_id(film, ids, count.id, count.n);
        }
    }
    return done;
}

bool film_restore(Film *film, const void *from, size_t n) {
    Bytes bytes = {.from = from, .end = (const uint8_t *)from + n};
    bool done = true;
    film_clear(film);
#define ARRAY(name, wanted)                                                                        \
    if (film->name) {                                                                              \
        done = done && take(&bytes, film->name, pixels_of(film) * sizeof *film->name);             \
    }
    ARRAYS
#undef ARRAY
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; done && film->ids[k] && i < pixels_of(film); i++) {
            done = restore_ids(film, &film->ids[k][i], &bytes);
        }
    }
    done = done && bytes.from == bytes.end;
    if (!done) {
        film_clear(film);
    }
    return done;
}

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
    return n ? (double)sum / (UNITS * n) : 0;
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
    return spread > 0 ? spread / (UNITS * UNITS) / ((double)n * (n - 1.0)) : 0;
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
        values[i] = n ? (float)((double)film->time[i] / (TIME_UNITS * n)) : 0;
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
    Channels to = {arena, pixels_of(film), image};
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
