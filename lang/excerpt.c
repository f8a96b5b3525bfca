// SPDX-License-Identifier: Apache-2.0
// Excerpts of the source, with carets that stand where the characters do.
#include "lang/excerpt.h"

#include <inttypes.h>
#include <string.h>

#include "lang/utf8.h"

// Columns of a terminal, without the margin. What is cut off is marked by three points.
enum { WIDTH = 100, BEFORE = 60, TAB = 4, BYTES = 1000 };

// Columns that a terminal gives to a character: marks that combine have none, East Asian wide
// ones (Unicode Standard Annex 11, its large blocks) and emoji two.
static unsigned width_of(uint32_t c) {
    static const struct {
        uint32_t lo, hi;
        unsigned width;
    } ranges[] = {
        {0x0300, 0x036f, 0},   {0x1100, 0x115f, 2}, {0x200b, 0x200f, 0},   {0x2e80, 0xa4cf, 2},
        {0xac00, 0xd7a3, 2},   {0xf900, 0xfaff, 2}, {0xfe00, 0xfe0f, 0},   {0xfe30, 0xfe6f, 2},
        {0xff00, 0xff60, 2},   {0xffe0, 0xffe6, 2}, {0x1f300, 0x1f64f, 2}, {0x1f900, 0x1f9ff, 2},
        {0x20000, 0x3fffd, 2},
    };
    for (size_t i = 0; c >= ranges[0].lo && i < sizeof ranges / sizeof ranges[0]; i++) {
        if (c >= ranges[i].lo && c <= ranges[i].hi) {
            return ranges[i].width;
        }
    }
    return c == '\t' ? TAB : 1;
}

static unsigned width_between(const char *from, const char *to) {
    unsigned width = 0, size;
    for (; from < to; from += size) {
        width += width_of(utf8_decode(from, to, &size));
    }
    return width;
}

// Characters that would steer the terminal, or that it cannot show, are replaced.
static void put_line(FILE *out, const char *from, const char *to) {
    unsigned size;
    for (; from < to; from += size) {
        uint32_t c = utf8_decode(from, to, &size);
        if (c == '\t') {
            fprintf(out, "%*s", TAB, "");
        } else if (utf8_steers(c) || c == UTF8_BAD) {
            fputs("\xef\xbf\xbd", out);
        } else {
            fwrite(from, 1, size, out);
        }
    }
}

// What is shown of the line [start, stop) around `at`, in columns and in bytes: marks that combine
// have no columns, and a line may hold a million of them.
static const char *leftmost(const char *start, const char *at) {
    const char *left = at;
    for (unsigned width = 0, size; left > start && width < BEFORE && at - left < BYTES;) {
        do {
            left--;
        } while (left > start && ((unsigned char)*left & 0xc0) == 0x80);
        width += width_of(utf8_decode(left, at, &size));
    }
    return left;
}

static const char *rightmost(const char *left, const char *stop) {
    const char *right = left;
    for (unsigned width = 0, size; right < stop && width < WIDTH && right - left < 2 * BYTES;) {
        width += width_of(utf8_decode(right, stop, &size));
        right += size;
    }
    return right;
}

void excerpt_text(FILE *out, const char *text) {
    const char *end = text + strlen(text);
    unsigned size;
    for (; text < end; text += size) {
        uint32_t c = utf8_decode(text, end, &size);
        if (utf8_steers(c) || c == UTF8_BAD) {
            fputs(c < 0x80 ? "?" : "\xef\xbf\xbd", out);
        } else {
            fwrite(text, 1, size, out);
        }
    }
}

static void put_hint(FILE *out, const char *color, const char *hint, const char *off) {
    fputs(color, out);
    excerpt_text(out, hint);
    fprintf(out, "%s\n", off);
}

void excerpt_print(FILE *out, SourcePlace place, Span where, const char *hint, const char *color,
                   const char *off) {
    if (!place.file) {
        if (hint) {
            fputs("      | ", out);
            put_hint(out, color, hint, off);
        }
        return;
    }
    const char *text = place.file->text, *end = text + place.file->size;
    const char *at = text + (where.lo - place.file->base), *start = at, *stop = at;
    while (start > text && start[-1] != '\n') {
        start--;
    }
    while (stop < end && *stop != '\n') {
        stop++;
    }
    if (stop > start && stop[-1] == '\r' && stop > at) {
        stop--;
    }
    const char *left = start, *right = stop;
    if (stop - start > BYTES || width_between(start, stop) > WIDTH) {
        left = leftmost(start, at);
        right = rightmost(left, stop);
    }
    const char *last = text + (where.hi - place.file->base);
    last = where.hi < where.lo || last > right ? right : last;
    const char *mark = left > start ? "..." : "";
    fprintf(out, "%5" PRIu32 " | %s", place.line, mark);
    put_line(out, left, right);
    fprintf(out, "%s\n      | %*s%s^", right < stop ? "..." : "",
            (int)(strlen(mark) + width_between(left, at)), "", color);
    for (unsigned n = width_between(at, last); n > 1; n--) {
        fputc('~', out);
    }
    fputs(hint ? " " : "", out);
    put_hint(out, "", hint ? hint : "", off);
}
