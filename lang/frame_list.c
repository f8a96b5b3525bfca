// SPDX-License-Identifier: Apache-2.0
// Lists of frames: reading them, and spelling them out.
#include "lang/frame_list.h"

#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool fail(char *message, size_t n, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static bool fail(char *message, size_t n, const char *format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(message, n, format, args);
    va_end(args);
    return false;
}

// Reads a number of at most FRAME_MAX; no spaces, no plus sign.
static bool read_number(const char **at, int64_t *number) {
    const char *digits = *at + (**at == '-');
    if (!isdigit((unsigned char)*digits)) {
        return false;
    }
    char *end;
    errno = 0;
    long long value = strtoll(*at, &end, 10);
    if (errno || value > FRAME_MAX || value < -FRAME_MAX) {
        return false;
    }
    *number = value;
    *at = end;
    return true;
}

static bool read_span(const char **at, FrameSpan *span, char *message, size_t n) {
    const char *start = *at;
    *span = (FrameSpan){.step = 1};
    if (!read_number(at, &span->first)) {
        return fail(message, n, "'%.20s' does not begin with a frame number", start);
    }
    span->last = span->first;
    if (**at == '-') {
        ++*at;
        span->is_open = !read_number(at, &span->last);
    }
    if (**at == 'x') {
        span->is_open |= !memchr(start + 1, '-', (size_t)(*at - start - 1));
        ++*at;
        if (!read_number(at, &span->step) || span->step < 1) {
            return fail(message, n, "'%.20s' has no step of at least 1 after its 'x'", start);
        }
    }
    if (!span->is_open && span->last < span->first) {
        return fail(message, n, "%lld-%lld runs backwards", (long long)span->first,
                    (long long)span->last);
    }
    return true;
}

bool frame_list_parse(Arena *arena, const char *text, FrameList *list, char *message, size_t n) {
    size_t most = 1;
    for (const char *c = text; *c; c++) {
        most += *c == ',';
    }
    FrameSpan *spans = ARENA_ARRAY(arena, most, FrameSpan);
    *list = (FrameList){.spans = spans};
    for (const char *at = text;; at++) {
        if (!read_span(&at, &spans[list->n_spans++], message, n)) {
            return false;
        }
        if (!*at) {
            return true;
        }
        if (*at != ',') {
            return fail(message, n, "'%.20s' is not part of a list such as 1-48,60,72x2", at);
        }
    }
}

static int compare_frames(const void *a, const void *b) {
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static uint64_t span_count(const FrameSpan *span, int64_t film_last) {
    int64_t last = span->is_open ? film_last : span->last;
    return last < span->first ? 0 : (uint64_t)(last - span->first) / (uint64_t)span->step + 1;
}

const int64_t *frame_list_frames(Arena *arena, const FrameList *list, int64_t film_last,
                                 uint32_t *n_frames) {
    uint64_t n = 0;
    *n_frames = 0;
    for (uint32_t i = 0; i < list->n_spans; i++) {
        n += span_count(&list->spans[i], film_last);
        if (n > FRAME_LIST_MAX) {
            return NULL;
        }
    }
    int64_t *frames = ARENA_ARRAY(arena, n, int64_t);
    size_t used = 0;
    for (uint32_t i = 0; i < list->n_spans; i++) {
        uint64_t count = span_count(&list->spans[i], film_last);
        for (uint64_t k = 0; k < count; k++) {
            frames[used++] = list->spans[i].first + (int64_t)k * list->spans[i].step;
        }
    }
    qsort(frames, used, sizeof *frames, compare_frames);
    for (size_t i = 0; i < used; i++) {
        if (!i || frames[i] != frames[i - 1]) {
            frames[(*n_frames)++] = frames[i];
        }
    }
    return frames;
}
