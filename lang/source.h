// SPDX-License-Identifier: Apache-2.0
// Source files in one space of offsets, so that a place anywhere is 32 bits and a span is 64.
#ifndef LANG_SOURCE_H
#define LANG_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "accel/arena.h"

// Offsets [lo, hi) in a Sources. lo == hi == 0: nowhere (the command line, a default).
typedef struct {
    uint32_t lo, hi;
} Span;

typedef struct {
    const char *path;      // as the user would name it
    const char *text;      // NUL-terminated, but may hold NULs before
    uint32_t base, size;   // its offsets are [base, base + size]
    Span included_from;    // the string in the include statement; lo == hi == 0 for the main file
    const uint32_t *lines; // line ends before every 1024th character
} SourceFile;

typedef struct {
    Arena *arena;
    SourceFile *files;
    size_t n_files, capacity;
    uint32_t end; // the next file's base; begins at 1
} Sources;

// So many NULs follow a text: who reads a few characters ahead needs no test for the end.
enum { SOURCE_PADDING = 8 };

// The text is borrowed: it is followed by SOURCE_PADDING NULs and lives as long as the Sources.
// NULL when the space of 2^32 - 16 offsets is full.
const SourceFile *source_adopt(Sources *sources, const char *path, const char *text, size_t size,
                               Span included_from);
// Copies text.
const SourceFile *source_add(Sources *sources, const char *path, const char *text, size_t size,
                             Span included_from);
const SourceFile *source_of(const Sources *sources, uint32_t offset); // NULL: nowhere

typedef struct {
    const SourceFile *file;
    uint32_t line, column; // from 1; columns count Unicode characters
} SourcePlace;

SourcePlace source_place(const Sources *sources, uint32_t offset);
// Its line alone, which is quick to find however long the line is; 0: nowhere.
uint32_t source_line(const Sources *sources, uint32_t offset);

static inline Span span_join(Span a, Span b) {
    return (Span){a.lo < b.lo ? a.lo : b.lo, a.hi > b.hi ? a.hi : b.hi};
}

#endif
