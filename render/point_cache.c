// SPDX-License-Identifier: Apache-2.0
// Reading PC2 and MDD, strictly: nothing of the head is believed before the file's length agrees.
#include "render/point_cache.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "render/infile.h"

enum { PC2_HEAD = 32, MDD_HEAD = 8, COUNT_LIMIT = INT32_MAX };

typedef struct {
    int fd;
    size_t size;
    Arena *arena;
    double fps;
    PointCache *cache;
    char *message;
    size_t n;
} Reader;

static const char pc2_magic[12] = "POINTCACHE2";

static uint32_t word_at(const unsigned char *bytes, bool is_big) {
    uint32_t word = 0;
    for (int i = 0; i < 4; i++) {
        word = word << 8 | bytes[is_big ? i : 3 - i];
    }
    return word;
}

static float float_at(const unsigned char *bytes, bool is_big) {
    uint32_t word = word_at(bytes, is_big);
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static MeshStatus bad(Reader *r, const char *why) {
    snprintf(r->message, r->n, "%s", why);
    return MESH_BAD_FORMAT;
}

// False: reported.
static bool take(Reader *r, void *to, size_t offset, size_t size) {
    if (infile_read(r->fd, to, offset, size) == size) {
        return true;
    }
    snprintf(r->message, r->n, "cannot read: %s", errno ? strerror(errno) : "it ends too early");
    return false;
}

// Whether the file holds a head of so many bytes and the samples, no less and no more. 2^31 samples
// of 2^31 points are under 2^66 bytes: too many are found by division.
static bool check_counts(Reader *r, const char *kind, uint32_t n_samples, uint32_t n_points,
                         size_t head) {
    if (n_samples == 0 || n_points == 0 || n_samples > COUNT_LIMIT || n_points > COUNT_LIMIT) {
        snprintf(r->message, r->n, "as %s, its head says %u samples of %u points", kind, n_samples,
                 n_points);
        return false;
    }
    size_t sample = (size_t)n_points * 3 * sizeof(float);
    size_t held = r->size > head ? (r->size - head) / sample : 0;
    if (held < n_samples) {
        snprintf(r->message, r->n,
                 "as %s, it is cut off: %u samples of %u points are announced, %zu are there", kind,
                 n_samples, n_points, held);
        return false;
    }
    if (r->size - head != sample * n_samples) {
        snprintf(r->message, r->n, "%zu bytes follow its %u samples of %u points",
                 r->size - head - sample * n_samples, n_samples, n_points);
        return false;
    }
    *r->cache = (PointCache){.n_samples = n_samples, .n_points = n_points};
    return true;
}

static bool check_times(Reader *r) {
    const PointCache *c = r->cache;
    for (uint32_t i = 0; i < c->n_samples; i++) {
        if (!isfinite(c->seconds[i]) || (i > 0 && !(c->seconds[i] > c->seconds[i - 1]))) {
            snprintf(r->message, r->n, "the times of its samples do not ascend: %g s, then %g s",
                     i ? c->seconds[i - 1] : 0, c->seconds[i]);
            return false;
        }
    }
    return true;
}

static MeshStatus take_samples(Reader *r, size_t head, bool is_big) {
    PointCache *c = r->cache;
    size_t n = 3 * (size_t)c->n_points * c->n_samples;
    c->position = ARENA_ARRAY(r->arena, n, float);
    if (!take(r, c->position, head, n * sizeof(float))) {
        return MESH_NO_FILE;
    }
    for (size_t i = 0; i < n; i++) {
        c->position[i] = float_at((const unsigned char *)&c->position[i], is_big);
    }
    return MESH_OK;
}

static MeshStatus read_pc2(Reader *r, const unsigned char *head) {
    if (r->size < PC2_HEAD) {
        return bad(r, "it is cut off within its head");
    }
    uint32_t version = word_at(head + 12, false);
    double start = float_at(head + 20, false), step = float_at(head + 24, false);
    if (version != 1) {
        snprintf(r->message, r->n, "it is PC2 of version %u; version 1 is known", version);
        return MESH_BAD_FORMAT;
    }
    if (!check_counts(r, "PC2", word_at(head + 28, false), word_at(head + 16, false), PC2_HEAD)) {
        return MESH_BAD_FORMAT;
    }
    r->cache->seconds = ARENA_ARRAY(r->arena, r->cache->n_samples, double);
    for (uint32_t i = 0; i < r->cache->n_samples; i++) {
        r->cache->seconds[i] = (start + i * step) / r->fps;
    }
    return check_times(r) ? take_samples(r, PC2_HEAD, false) : MESH_BAD_FORMAT;
}

static MeshStatus read_mdd(Reader *r, const unsigned char *head) {
    if (r->size < MDD_HEAD) {
        return bad(r, "it is neither PC2 nor MDD");
    }
    uint32_t n_samples = word_at(head, true), n_points = word_at(head + 4, true);
    size_t whole = MDD_HEAD + sizeof(float) * (size_t)n_samples;
    if (!check_counts(r, "MDD", n_samples, n_points, whole)) {
        return MESH_BAD_FORMAT;
    }
    r->cache->seconds = ARENA_ARRAY(r->arena, n_samples, double);
    unsigned char *times = ARENA_ARRAY(r->arena, 4 * (size_t)n_samples, unsigned char);
    if (!take(r, times, MDD_HEAD, 4 * (size_t)n_samples)) {
        return MESH_NO_FILE;
    }
    for (uint32_t i = 0; i < n_samples; i++) {
        r->cache->seconds[i] = float_at(times + 4 * (size_t)i, true);
    }
    return check_times(r) ? take_samples(r, whole, true) : MESH_BAD_FORMAT;
}

MeshStatus point_cache_read(Arena *arena, const char *path, double fps, PointCache *cache,
                            char *message, size_t n) {
    Reader r = {.arena = arena, .fps = fps, .cache = cache, .message = message, .n = n};
    unsigned char head[PC2_HEAD] = {0};
    *cache = (PointCache){0};
    r.fd = infile_open(path, &r.size, message, n);
    if (r.fd < 0) {
        return MESH_NO_FILE;
    }
    MeshStatus status = MESH_NO_FILE;
    if (take(&r, head, 0, r.size < PC2_HEAD ? r.size : PC2_HEAD)) {
        bool is_pc2 = memcmp(head, pc2_magic, sizeof pc2_magic) == 0;
        status = is_pc2 ? read_pc2(&r, head) : read_mdd(&r, head);
    }
    close(r.fd);
    if (status != MESH_OK) {
        *cache = (PointCache){0};
    }
    return status;
}
