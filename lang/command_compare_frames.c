// SPDX-License-Identifier: Apache-2.0
// st4 compare: which frames two patterns of names have.
#include "lang/command_compare.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "render/render.h"

enum { PATH_SIZE = 4096 };

typedef struct {
    int64_t *frames; // ascending
    size_t n, capacity;
} Frames;

// Where the pattern's number stands in its text; *length 0: nowhere.
static size_t find_number(const char *pattern, size_t *length) {
    size_t at = strcspn(pattern, "#%");
    *length = pattern[at] == '#' ? strspn(pattern + at, "#") : 0;
    if (pattern[at] == '%') {
        size_t n = 1 + strspn(pattern + at + 1, "0123456789");
        *length = pattern[at + n] == 'd' ? n + 1 : 0;
    }
    return at;
}

bool compare_is_pattern(const char *path) {
    size_t length;
    find_number(path, &length);
    return length > 0;
}

static int compare_numbers(const void *a, const void *b) {
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// The frame that a file of the pattern's folder holds. False: none of the pattern's.
static bool read_frame(const char *pattern, size_t folder, const char *name, int64_t *frame) {
    size_t length, at = find_number(pattern, &length);
    char path[PATH_SIZE], *end;
    if (at < folder || strncmp(pattern + folder, name, at - folder) != 0) {
        return false;
    }
    errno = 0;
    *frame = strtoll(name + (at - folder), &end, 10);
    return errno == 0 && end != name + (at - folder) &&
           render_frame_path(pattern, *frame, true, path, sizeof path) &&
           strcmp(path + folder, name) == 0;
}

static bool list_frames(Arena *arena, const char *pattern, Frames *frames, char *message,
                        size_t n) {
    const char *slash = strrchr(pattern, '/');
    size_t folder = slash ? (size_t)(slash + 1 - pattern) : 0;
    DIR *dir = opendir(folder ? arena_string(arena, pattern, folder) : ".");
    if (!dir) {
        snprintf(message, n, "%s: cannot read its folder: %s", pattern, strerror(errno));
        return false;
    }
    int64_t frame;
    for (struct dirent *entry = readdir(dir); entry; entry = readdir(dir)) {
        if (read_frame(pattern, folder, entry->d_name, &frame)) {
            frames->frames = arena_grow(arena, frames->frames, frames->n, &frames->capacity,
                                        sizeof *frames->frames);
            frames->frames[frames->n++] = frame;
        }
    }
    closedir(dir);
    if (frames->n == 0) {
        snprintf(message, n, "%s: there is no such file for any frame", pattern);
        return false;
    }
    qsort(frames->frames, frames->n, sizeof *frames->frames, compare_numbers);
    return true;
}

static void refuse_missing(const char *has, const char *lacks, int64_t frame, char *message,
                           size_t n) {
    snprintf(message, n, "frame %lld: there is a picture of %s, but none of %s", (long long)frame,
             has, lacks);
}

const int64_t *compare_find_frames(Arena *arena, const char *a, const char *b, size_t *n_frames,
                                   char *message, size_t n) {
    Frames of_a = {0}, of_b = {0};
    if (!list_frames(arena, a, &of_a, message, n) || !list_frames(arena, b, &of_b, message, n)) {
        return NULL;
    }
    for (size_t i = 0; i < of_a.n || i < of_b.n; i++) {
        if (i == of_b.n || (i < of_a.n && of_a.frames[i] < of_b.frames[i])) {
            refuse_missing(a, b, of_a.frames[i], message, n);
            return NULL;
        }
        if (i == of_a.n || of_b.frames[i] < of_a.frames[i]) {
            refuse_missing(b, a, of_b.frames[i], message, n);
            return NULL;
        }
    }
    *n_frames = of_a.n;
    return of_a.frames;
}
