// SPDX-License-Identifier: Apache-2.0
// Source files: one space of offsets, and lines found by a sparse count of line ends.
#include "lang/source.h"

#include <string.h>

// A line number costs a look-up and at most this many characters to scan.
enum { LINE_BLOCK = 1024 };

static const uint32_t *count_lines(Arena *arena, const char *text, size_t size) {
    uint32_t *counts = ARENA_ARRAY(arena, size / LINE_BLOCK + 1, uint32_t);
    uint32_t lines = 0;
    for (size_t block = 0; block <= size / LINE_BLOCK; block++) {
        const char *at = text + block * LINE_BLOCK, *end = at + LINE_BLOCK;
        end = end < text + size ? end : text + size;
        counts[block] = lines;
        while ((at = memchr(at, '\n', (size_t)(end - at)))) {
            lines++;
            at++;
        }
    }
    return counts;
}

const SourceFile *source_add(Sources *sources, const char *path, const char *text, size_t size,
                             Span included_from) {
    char *copy = arena_alloc(sources->arena, size + SOURCE_PADDING);
    if (size) {
        memcpy(copy, text, size);
    }
    return source_adopt(sources, path, copy, size, included_from);
}

const SourceFile *source_adopt(Sources *sources, const char *path, const char *text, size_t size,
                               Span included_from) {
    uint32_t base = sources->end ? sources->end : 1;
    if (size >= UINT32_MAX - 16 - base) {
        return NULL;
    }
    sources->files = arena_grow(sources->arena, sources->files, sources->n_files,
                                &sources->capacity, sizeof *sources->files);
    SourceFile *file = &sources->files[sources->n_files++];
    *file = (SourceFile){
        .path = arena_string(sources->arena, path, strlen(path)),
        .text = text,
        .base = base,
        .size = (uint32_t)size,
        .included_from = included_from,
        .lines = count_lines(sources->arena, text, size),
    };
    sources->end = base + (uint32_t)size + 1;
    return file;
}

const SourceFile *source_of(const Sources *sources, uint32_t offset) {
    size_t lo = 0, hi = sources->n_files;
    while (lo < hi) {
        size_t middle = lo + (hi - lo) / 2;
        const SourceFile *file = &sources->files[middle];
        if (offset < file->base) {
            hi = middle;
        } else if (offset > file->base + file->size) {
            lo = middle + 1;
        } else {
            return file;
        }
    }
    return NULL;
}

static uint32_t line_of(const SourceFile *file, uint32_t at) {
    uint32_t line = file->lines[at / LINE_BLOCK] + 1;
    for (uint32_t i = at - at % LINE_BLOCK; i < at; i++) {
        line += file->text[i] == '\n';
    }
    return line;
}

uint32_t source_line(const Sources *sources, uint32_t offset) {
    const SourceFile *file = source_of(sources, offset);
    return file ? line_of(file, offset - file->base) : 0;
}

SourcePlace source_place(const Sources *sources, uint32_t offset) {
    const SourceFile *file = source_of(sources, offset);
    if (!file) {
        return (SourcePlace){0};
    }
    uint32_t at = offset - file->base, start = at;
    while (start && file->text[start - 1] != '\n') {
        start--;
    }
    uint32_t column = 1;
    for (uint32_t i = start; i < at; i++) {
        // Bytes 10xxxxxx go on with a character.
        column += ((unsigned char)file->text[i] & 0xc0) != 0x80;
    }
    return (SourcePlace){file, line_of(file, at), column};
}
