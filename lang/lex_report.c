// SPDX-License-Identifier: Apache-2.0
// What is wrong with a token or with the bytes of a file, in words.
#include "lang/lex.h"

#include <stdio.h>
#include <string.h>

#include "lang/schema.h"
#include "lang/utf8.h"

// Characters that people write in other languages, or that editors write for them.
static const struct {
    const char *text, *hint;
} strangers[] = {
    {"!", "write 'not'"},
    {"&&", "write 'and'"},
    {"||", "write 'or'"},
    {"#", "comments begin with //, and definitions with let or def"},
    {"\xe2\x80\x9c", "strings stand in straight double quotes: \"...\""},
    {"\xe2\x80\x9d", "strings stand in straight double quotes: \"...\""},
    {"\xe2\x80\x98", "strings stand in straight double quotes: \"...\""},
    {"\xe2\x80\x99", "strings stand in straight double quotes: \"...\""},
    {"\xe2\x88\x92", "this is not the minus of the keyboard: write '-'"},
    {"\xe2\x80\x93", "this is not the minus of the keyboard: write '-'"},
    {"\xc3\x97", "write '*'"},
    {"\xc2\xb0", "write deg, touching the number: 90deg"},
    {"\xc2\xa0", "this is a no-break space: write a plain one"},
    {"\xef\xbb\xbf", "this is a byte order mark inside the file: delete it"},
    {"\xcf\x80", "write 'pi'"},
};

// The digits of a color behind a '#': #rgb or #rrggbb; 0: there are none.
static int color_digits(const char *text) {
    size_t n = strspn(text, "0123456789abcdefABCDEF");
    bool is_whole = !strchr("ghijklmnopqrstuvwxyzGHIJKLMNOPQRSTUVWXYZ_", text[n]) || !text[n];
    return (n == 3 || n == 6) && is_whole ? (int)n : 0;
}

static void report_character(const SourceFile *file, Token token, Diag *diag) {
    const char *text = file->text + (token.lo - file->base);
    int size = (int)(token.hi - token.lo);
    const char *hint = NULL;
    for (size_t i = 0; i < sizeof strangers / sizeof strangers[0]; i++) {
        if (strlen(strangers[i].text) == (size_t)size &&
            memcmp(strangers[i].text, text, (size_t)size) == 0) {
            hint = strangers[i].hint;
        }
    }
    char color[32];
    int n_digits = *text == '#' ? color_digits(text + 1) : 0;
    if (n_digits) {
        snprintf(color, sizeof color, "write srgb(\"#%.*s\")", n_digits, text + 1);
        hint = color;
    }
    size_t n_word = strspn(text + 1, "abcdefghijklmnopqrstuvwxyz");
    if (*text == '#' && !n_digits && n_word < sizeof color) { // #declare, #macro
        snprintf(color, sizeof color, "%.*s", (int)n_word, text + 1);
        const char *foreign = schema_foreign_word("statement", color);
        hint = foreign ? foreign : hint;
    }
    Span where = {token.lo, token.hi};
    unsigned char c = (unsigned char)*text;
    if (c < 0x20 || c == 0x7f) {
        diag_error(diag, where, hint, "unexpected control character (byte %d)", c);
    } else {
        diag_error(diag, where, hint, "unexpected character '%.*s'", size, text);
    }
}

static void report_escape(const SourceFile *file, Token token, Diag *diag) {
    const char *text = file->text - file->base;
    for (uint32_t i = token.lo; i + 1 < token.hi; i++) {
        if (text[i] != '\\') {
            continue;
        }
        i++;
        if (!strchr("\"\\nt", text[i])) {
            uint32_t hi = i + 1;
            while (((unsigned char)text[hi] & 0xc0) == 0x80) {
                hi++;
            }
            diag_error(diag, (Span){i - 1, hi}, "a backslash is written \\\\; in a path, write /",
                       "unknown escape '%.*s' in a string: \\\" \\\\ \\n \\t are known",
                       (int)(hi - i + 1), text + i - 1);
            return;
        }
    }
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static void report_unit(const SourceFile *file, Token token, Diag *diag) {
    const char *names[UNIT_COUNT];
    for (int i = 1; i < UNIT_COUNT; i++) {
        names[i - 1] = lex_unit_text((Unit)i);
    }
    const char *text = file->text - file->base;
    uint32_t lo = token.lo;
    for (; lo < token.hi && strchr("0123456789._", text[lo]); lo++) {
        // A number does not begin with one, so that something stands before it.
        if (text[lo] == '_' && !(is_digit(text[lo - 1]) && is_digit(text[lo + 1]))) {
            diag_error(diag, (Span){token.lo, token.hi}, "write 1_000_000",
                       "an underscore in a number stands between two digits");
            return;
        }
    }
    if (lo + 1 < token.hi && (text[lo] == 'e' || text[lo] == 'E') &&
        strchr("0123456789+-", text[lo + 1])) {
        for (lo += 2; lo < token.hi && strchr("0123456789", text[lo]); lo++) {
        }
    }
    char unit[32], hint[160];
    snprintf(unit, sizeof unit, "%.*s", (int)(token.hi - lo), text + lo);
    const char *near = diag_nearest(unit, names, UNIT_COUNT - 1);
    int n_number = lo - token.lo < 32 ? (int)(lo - token.lo) : 32;
    size_t n_digits = unit[0] == 'x' ? strspn(unit + 1, "0123456789") : 0;
    if (n_digits && !unit[n_digits + 1]) { // 640x480
        snprintf(hint, sizeof hint, "write <%.*s, %s>", n_number, text + token.lo, unit + 1);
    } else if (near) {
        snprintf(hint, sizeof hint, "did you mean '%s'?", near);
    } else {
        snprintf(hint, sizeof hint, "to multiply, write %.*s*%s", n_number, text + token.lo, unit);
    }
    diag_error(diag, (Span){lo, token.hi}, hint, "unknown unit '%s'", unit);
}

void lex_report(const SourceFile *file, Token token, Diag *diag) {
    Span where = {token.lo, token.hi};
    switch ((LexProblem)token.problem) {
    case LEX_OK:
        break;
    case LEX_CHARACTER:
        report_character(file, token, diag);
        break;
    case LEX_OPEN_STRING:
        diag_error(diag, where, "a string ends on the line that it begins on",
                   "string without a closing '\"'");
        break;
    case LEX_OPEN_COMMENT:
        diag_error(diag, where, NULL, "comment without a closing '*/'");
        break;
    case LEX_ESCAPE:
        report_escape(file, token, diag);
        break;
    case LEX_UNIT:
        report_unit(file, token, diag);
        break;
    case LEX_HUGE:
        diag_error(diag, where, NULL, "number is too large: the largest is about 1.8e308");
        break;
    case LEX_LONG:
        diag_error(diag, where, NULL, "number has over 1,000 digits");
        break;
    }
}

bool lex_check_text(const SourceFile *file, Diag *diag) {
    const unsigned char *text = (const unsigned char *)file->text;
    bool is_utf16 = (text[0] == 0xff && text[1] == 0xfe) || (text[0] == 0xfe && text[1] == 0xff);
    const char *hint =
        is_utf16 ? "this looks like UTF-16: save the file as UTF-8" : "save the file as UTF-8";
    for (uint32_t i = 0; i < file->size;) {
        // Eight ASCII characters at once: no byte has its high bit, and none is 0 (a byte that is
        // borrows from it when 1 is taken from each).
        uint64_t eight;
        memcpy(&eight, text + i, sizeof eight);
        if (!((eight | (eight - UINT64_C(0x0101010101010101))) & UINT64_C(0x8080808080808080))) {
            i += 8;
            continue;
        }
        unsigned n;
        uint32_t c = utf8_decode(file->text + i, file->text + file->size, &n);
        Span where = {file->base + i, file->base + i + 1};
        if (c == UTF8_BAD && n == 1) {
            diag_error(diag, where, hint, "file is not UTF-8: byte 0x%02x", text[i]);
            return false;
        }
        if (!text[i]) {
            diag_error(diag, where, "this is not a text file", "file contains a NUL byte");
            return false;
        }
        i += n;
    }
    return true;
}
