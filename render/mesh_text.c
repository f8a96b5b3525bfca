// SPDX-License-Identifier: Apache-2.0
// Text of mesh files: numbers, words, lines.
#include "render/mesh_text.h"

#include <ctype.h>
#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool mesh_text_fail(MeshText *text, const char *format, ...) {
    va_list args;
    va_start(args, format);
    int prefix = text->line ? snprintf(text->message, text->n, "line %zu: ", text->line) : 0;
    if (prefix >= 0 && (size_t)prefix < text->n) {
        vsnprintf(text->message + prefix, text->n - (size_t)prefix, format, args);
    }
    va_end(args);
    return false;
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static bool ends_word(const char *at, const char *end) {
    return at == end || *at == ' ' || *at == '\t' || *at == '\n' || *at == '\r';
}

// A decimal number in parts: value = (+-) mantissa * 10^exponent, as far as 19 digits go.
typedef struct {
    uint64_t mantissa;
    int64_t exponent;
    const char *end;
    bool is_negative, is_cut;
} Decimal;

static const char *take_digits(Decimal *d, const char *p, int sign_of_exponent, int *n_digits) {
    for (; is_digit(*p); p++, (*n_digits)++) {
        if (d->mantissa < UINT64_C(1000000000000000000)) {
            d->mantissa = d->mantissa * 10 + (uint64_t)(*p - '0');
            d->exponent -= sign_of_exponent;
        } else {
            d->is_cut |= *p != '0';
            d->exponent += 1 - sign_of_exponent;
        }
    }
    return p;
}

static const char *take_exponent(Decimal *d, const char *p) {
    const char *q = p + 1;
    bool is_negative = *q == '-';
    q += *q == '-' || *q == '+';
    if (!is_digit(*q)) {
        return p;
    }
    int64_t e = 0;
    for (; is_digit(*q); q++) {
        e = e < 100000 ? e * 10 + (*q - '0') : e;
    }
    d->exponent += is_negative ? -e : e;
    return q;
}

// The file ends in a NUL, so that looking at the next byte is always allowed.
static bool take_decimal(Decimal *d, const char *p) {
    int n_digits = 0;
    *d = (Decimal){.is_negative = *p == '-'};
    p += *p == '-' || *p == '+';
    p = take_digits(d, p, 0, &n_digits);
    if (*p == '.') {
        p = take_digits(d, p + 1, 1, &n_digits);
    }
    if (n_digits && (*p == 'e' || *p == 'E')) {
        p = take_exponent(d, p);
    }
    d->end = p;
    return n_digits > 0;
}

// By the C library, whose decimal point depends on the locale.
static double slow_number(const char *from, const char *to) {
    char buffer[64], *copy = buffer;
    const char *point = localeconv()->decimal_point, *dot = memchr(from, '.', (size_t)(to - from));
    size_t n = (size_t)(to - from), n_point = strlen(point);
    if (n + n_point + 1 > sizeof buffer && !(copy = malloc(n + n_point + 1))) {
        return NAN;
    }
    size_t before = dot ? (size_t)(dot - from) : n;
    memcpy(copy, from, before);
    char *end = copy + before;
    if (dot) {
        memcpy(end, point, n_point);
        memcpy(end + n_point, dot + 1, n - before - 1);
        end += n_point + n - before - 1;
    }
    *end = '\0';
    double value = strtod(copy, NULL);
    if (copy != buffer) {
        free(copy);
    }
    return value;
}

static bool take_special(MeshText *text, double *value) {
    static const struct {
        const char *name;
        double value;
    } specials[] = {{"inf", INFINITY}, {"infinity", INFINITY}, {"nan", NAN}};
    const char *p = text->at + (*text->at == '-' || *text->at == '+');
    for (size_t i = 0; i < sizeof specials / sizeof specials[0]; i++) {
        size_t n = strlen(specials[i].name);
        if ((size_t)(text->end - p) >= n && strncasecmp(p, specials[i].name, n) == 0 &&
            ends_word(p + n, text->end)) {
            *value = *text->at == '-' ? -specials[i].value : specials[i].value;
            text->at = p + n;
            return true;
        }
    }
    return false;
}

bool mesh_text_number(MeshText *text, double *value) {
    // Powers of ten that a double holds exactly: with a mantissa below 2^53 one operation gives the
    // correctly rounded result (William Clinger, How to read floating point numbers accurately,
    // 1990).
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                    1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    Decimal d;
    if (!take_decimal(&d, text->at)) {
        return take_special(text, value);
    }
    if (!ends_word(d.end, text->end)) {
        return false;
    }
    if (d.mantissa >> 53 || d.is_cut || d.exponent < -22 || d.exponent > 22) {
        *value = slow_number(text->at, d.end);
    } else {
        double v = (double)d.mantissa;
        v = d.exponent < 0 ? v / powers[-d.exponent] : v * powers[d.exponent];
        *value = d.is_negative ? -v : v;
    }
    text->at = d.end;
    return true;
}

bool mesh_text_integer(MeshText *text, int64_t *value) {
    const char *p = text->at;
    bool is_negative = *p == '-';
    p += *p == '-' || *p == '+';
    if (!is_digit(*p)) {
        return false;
    }
    int64_t v = 0;
    for (; is_digit(*p); p++) {
        int digit = *p - '0';
        v = v > (INT64_MAX - digit) / 10 ? INT64_MAX : v * 10 + digit;
    }
    *value = is_negative ? -v : v;
    text->at = p;
    return true;
}

size_t mesh_text_word(const MeshText *text) {
    const char *p = text->at;
    while (!ends_word(p, text->end)) {
        p++;
    }
    return (size_t)(p - text->at);
}

bool mesh_text_is_word(const MeshText *text, const char *word) {
    size_t n = strlen(word);
    return mesh_text_word(text) == n && memcmp(text->at, word, n) == 0;
}

void mesh_text_skip_blanks(MeshText *text) {
    while (*text->at == ' ' || *text->at == '\t') {
        text->at++;
    }
}

bool mesh_text_at_line_end(const MeshText *text) {
    return text->at == text->end || *text->at == '\n' || *text->at == '\r';
}

void mesh_text_next_line(MeshText *text) {
    while (!mesh_text_at_line_end(text)) {
        text->at++;
    }
    if (text->at < text->end) {
        text->at += text->at[0] == '\r' && text->at[1] == '\n' ? 2 : 1;
        text->line++;
    }
}

void mesh_text_skip_space(MeshText *text) {
    mesh_text_skip_blanks(text);
    while (text->at < text->end && mesh_text_at_line_end(text)) {
        mesh_text_next_line(text);
        mesh_text_skip_blanks(text);
    }
}

MeshWord mesh_text_quote(const MeshText *text) {
    MeshWord word = {""};
    size_t n = mesh_text_word(text), shown = n > 24 ? 24 : n;
    for (size_t i = 0; i < shown; i++) {
        unsigned char c = (unsigned char)text->at[i];
        word.text[i] = c < 0x20 || c > 0x7e ? '?' : (char)c;
    }
    if (n > shown) {
        memcpy(word.text + shown, "...", 4);
    }
    return word;
}
