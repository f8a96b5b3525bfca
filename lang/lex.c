// SPDX-License-Identifier: Apache-2.0
// The lexer: a table of character classes, one function per kind of token.
#include "lang/lex.h"

#include "lang/symbols.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    E,
    S,
    N,
    L,
    D,
    Q,
    P,
    H
}; // end or NUL, space, newline, letter, digit, quote, punctuation,
    // anything else ("here nothing")
static const uint8_t classes[256] = {
    E, H, H, H, H, H, H, H, H, S, N, S, S, S, H, H, // control
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    S, P, Q, H, H, P, H, P, P, P, P, P, P, P, P, P, //  !"#$%&'()*+,-./
    D, D, D, D, D, D, D, D, D, D, P, P, P, P, P, P, // 0123456789:;<=>?
    H, L, L, L, L, L, L, L, L, L, L, L, L, L, L, L, // @ABCDEFGHIJKLMNO
    L, L, L, L, L, L, L, L, L, L, L, P, H, P, P, L, // PQRSTUVWXYZ[\]^_
    H, L, L, L, L, L, L, L, L, L, L, L, L, L, L, L, // `abcdefghijklmno
    L, L, L, L, L, L, L, L, L, L, L, P, H, P, H, H, // pqrstuvwxyz{|}~
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, // bytes of UTF-8
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
    H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, H, //
};

static const uint8_t punctuation[128] = {
    ['('] = TOKEN_LPAREN, [')'] = TOKEN_RPAREN,  ['['] = TOKEN_LBRACKET,  [']'] = TOKEN_RBRACKET,
    ['{'] = TOKEN_LBRACE, ['}'] = TOKEN_RBRACE,  ['<'] = TOKEN_LT,        ['>'] = TOKEN_GT,
    ['='] = TOKEN_ASSIGN, ['+'] = TOKEN_PLUS,    ['-'] = TOKEN_MINUS,     ['*'] = TOKEN_STAR,
    ['/'] = TOKEN_SLASH,  ['%'] = TOKEN_PERCENT, ['^'] = TOKEN_CARET,     ['.'] = TOKEN_DOT,
    [','] = TOKEN_COMMA,  [':'] = TOKEN_COLON,   [';'] = TOKEN_SEMICOLON, ['?'] = TOKEN_QUESTION,
    ['\''] = TOKEN_PRIME, ['!'] = TOKEN_BAD,
};

static const struct {
    const char *text;
    size_t size;
} units[UNIT_COUNT] = {
#define UNIT(id, text, dimension, factor) {text, sizeof text - 1},
#include "lang/units.def"
#undef UNIT
};

const char *lex_token_text(TokenKind kind) {
    static const char *const texts[TOKEN_COUNT] = {
#define TOKEN(id, text) [TOKEN_##id] = text,
#include "lang/tokens.def"
#undef TOKEN
    };
    return texts[kind] ? texts[kind] : "";
}

const char *lex_unit_text(Unit unit) {
    return units[unit].text;
}

static inline uint8_t class_of(char c) {
    return classes[(unsigned char)c];
}

static inline bool is_word(char c) {
    return class_of(c) == L || class_of(c) == D;
}

Lexer lex_at(const SourceFile *file, uint32_t offset) {
    return (Lexer){file, file->text + (offset - file->base), file->text + file->size};
}

Lexer lex_begin(const SourceFile *file) {
    Lexer lexer = lex_at(file, file->base);
    if (memcmp(lexer.at, "\xef\xbb\xbf", 3) == 0) {
        lexer.at += 3;
    }
    if (lexer.at[0] == '#' && lexer.at[1] == '!') {
        while (lexer.at < lexer.end && *lexer.at != '\n') {
            lexer.at++;
        }
    }
    return lexer;
}

// Leaves lexer->at behind the comment. False: it is not closed.
static bool skip_comment(Lexer *lexer, bool *newline) {
    if (lexer->at[1] == '/') {
        const char *end = memchr(lexer->at, '\n', (size_t)(lexer->end - lexer->at));
        lexer->at = end ? end : lexer->end;
        return true;
    }
    for (const char *at = lexer->at + 2; at < lexer->end; at++) {
        *newline |= *at == '\n';
        if (at[0] == '*' && at[1] == '/') {
            lexer->at = at + 2;
            return true;
        }
    }
    return false;
}

// Digits with single underscores between them. The first 19 significant ones go to the mantissa;
// how many more there were is returned in *dropped.
static const char *lex_digits(const char *at, uint64_t *mantissa, int *n_significant,
                              int *dropped) {
    for (;; at++) {
        if (*at == '_' && class_of(at[-1]) == D && class_of(at[1]) == D) {
            continue;
        }
        if (class_of(*at) != D) {
            return at;
        }
        if (*n_significant < 19) {
            *mantissa = *mantissa * 10 + (uint64_t)(*at - '0');
            *n_significant += *mantissa != 0;
        } else {
            ++*dropped;
        }
    }
}

// The library's conversion, exact but slow, of text without its underscores.
static double slow_number(Token *token, const char *text, size_t size) {
    char digits[1024];
    size_t n = 0;
    for (size_t i = 0; i < size; i++) {
        if (text[i] == '_') {
            continue;
        }
        if (n == sizeof digits - 1) {
            token->problem = LEX_LONG;
            return 0;
        }
        digits[n++] = text[i];
    }
    digits[n] = 0;
    double value = strtod(digits, NULL);
    if (isinf(value)) {
        token->problem = LEX_HUGE;
        return 0;
    }
    return value;
}

// Both the mantissa and the power of ten are exact doubles here, so that one rounding is left
// (W. D. Clinger, How to read floating point numbers accurately, 1990).
static bool quick_number(uint64_t mantissa, int exponent, int dropped, double *value) {
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                    1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (dropped || mantissa > UINT64_C(1) << 53 || exponent < -22 || exponent > 22) {
        return false;
    }
    *value =
        exponent < 0 ? (double)mantissa / powers[-exponent] : (double)mantissa * powers[exponent];
    return true;
}

bool lex_plain_number(Lexer *lexer, double *value) {
    const char *at = lexer->at, *point = NULL;
    uint64_t mantissa = 0;
    for (;; at++) {
        unsigned digit = (unsigned char)*at - (unsigned)'0';
        if (digit < 10) {
            mantissa = mantissa * 10 + digit;
        } else if (*at == '.' && !point && class_of(at[1]) == D) {
            point = at;
        } else {
            break;
        }
    }
    // 18 digits do not overflow the mantissa.
    if (at == lexer->at || at - lexer->at > 18 || is_word(*at) ||
        !quick_number(mantissa, point ? (int)(point + 1 - at) : 0, 0, value)) {
        return false;
    }
    lexer->at = at;
    return true;
}

static void lex_unit(Lexer *lexer, Token *token) {
    const char *text = lexer->at;
    while (is_word(*lexer->at)) {
        lexer->at++;
    }
    size_t size = (size_t)(lexer->at - text);
    for (int i = 0; i < UNIT_COUNT; i++) {
        if (units[i].size == size && memcmp(units[i].text, text, size) == 0) {
            token->unit = (uint8_t)i;
            return;
        }
    }
    token->problem = LEX_UNIT;
}

static void lex_number(Lexer *lexer, Token *token) {
    const char *text = lexer->at;
    uint64_t mantissa = 0;
    int significant = 0, dropped = 0, fraction = 0;
    const char *at = lex_digits(text, &mantissa, &significant, &dropped);
    if (at[0] == '.' && class_of(at[1]) == D) {
        const char *from = at + 1;
        at = lex_digits(from, &mantissa, &significant, &dropped);
        for (const char *c = from; c < at; c++) {
            fraction += *c != '_';
        }
    }
    int exponent = 0;
    if (at[0] == 'e' || at[0] == 'E') {
        const char *digits = at + 1 + (at[1] == '-' || at[1] == '+');
        if (class_of(*digits) == D) {
            for (; class_of(*digits) == D; digits++) {
                exponent = exponent < 100000 ? exponent * 10 + (*digits - '0') : exponent;
            }
            exponent = at[1] == '-' ? -exponent : exponent;
            at = digits;
        }
    }
    token->kind = TOKEN_NUMBER;
    if (!quick_number(mantissa, exponent - fraction, dropped, &token->number)) {
        token->number = slow_number(token, text, (size_t)(at - text));
    }
    lexer->at = at;
    if (is_word(*at)) {
        lex_unit(lexer, token);
    }
}

static void lex_string(Lexer *lexer, Token *token) {
    token->kind = TOKEN_STRING;
    const char *at = lexer->at + 1;
    for (; *at != '"'; at++) {
        if (at >= lexer->end || *at == '\n') {
            token->problem = LEX_OPEN_STRING;
            lexer->at = at;
            return;
        }
        if (*at == '\\') {
            at++;
            if (at >= lexer->end || *at == '\n') {
                at--;
            } else if (!strchr("\"\\nt", *at)) {
                token->problem = LEX_ESCAPE;
            }
        }
    }
    lexer->at = at + 1;
}

static void lex_name(Lexer *lexer, Token *token) {
    uint32_t hash = SYMBOL_HASH;
    const char *at = lexer->at;
    do {
        hash = symbol_hash_step(hash, (unsigned char)*at++);
    } while (is_word(*at));
    token->kind = TOKEN_NAME;
    token->symbol = hash;
    lexer->at = at;
}

static void lex_punctuation(Lexer *lexer, Token *token) {
    char c = lexer->at[0], next = lexer->at[1];
    token->kind = punctuation[(unsigned char)c];
    lexer->at++;
    if (next == '=' && (c == '<' || c == '>' || c == '=' || c == '!')) {
        token->kind = c == '<' ? TOKEN_LE : c == '>' ? TOKEN_GE : c == '=' ? TOKEN_EQ : TOKEN_NE;
        lexer->at++;
    } else if (c == '.' && next == '.') {
        token->kind = TOKEN_RANGE;
        lexer->at++;
    } else if (token->kind == TOKEN_BAD) {
        token->problem = LEX_CHARACTER;
    }
}

static void lex_bad(Lexer *lexer, Token *token) {
    const char *at = lexer->at++;
    // A character of several bytes is one token; so are && and ||.
    while (((unsigned char)*lexer->at & 0xc0) == 0x80) {
        lexer->at++;
    }
    if ((*at == '&' || *at == '|') && at[1] == *at) {
        lexer->at++;
    }
    token->kind = TOKEN_BAD;
    token->problem = LEX_CHARACTER;
}

// Leaves lexer->at at the first character of a token. False: a comment is not closed there.
static bool skip_blank(Lexer *lexer, bool *newline) {
    for (;;) {
        char c = *lexer->at;
        uint8_t class = class_of(c);
        if (class == S || class == N) {
            *newline |= class == N;
            lexer->at++;
        } else if (c == '/' && (lexer->at[1] == '/' || lexer->at[1] == '*')) {
            if (!skip_comment(lexer, newline)) {
                return false;
            }
        } else if (class == E && lexer->at < lexer->end) {
            lexer->at++; // a NUL; lex_check_text has reported it
        } else {
            return true;
        }
    }
}

Token lex_next(Lexer *lexer) {
    Token token = {.kind = TOKEN_END};
    const SourceFile *file = lexer->file;
    token.newline = lexer->at == file->text;
    bool is_open = !skip_blank(lexer, &token.newline);
    token.lo = file->base + (uint32_t)(lexer->at - file->text);
    if (is_open) {
        token.kind = TOKEN_BAD;
        token.problem = LEX_OPEN_COMMENT;
        token.hi = token.lo + 2;
        lexer->at = lexer->end;
        return token;
    }
    switch (class_of(*lexer->at)) {
    case L:
        lex_name(lexer, &token);
        break;
    case D:
        lex_number(lexer, &token);
        break;
    case Q:
        lex_string(lexer, &token);
        break;
    case P:
        if (lexer->at[0] == '.' && class_of(lexer->at[1]) == D) {
            lex_number(lexer, &token);
        } else {
            lex_punctuation(lexer, &token);
        }
        break;
    case H:
        lex_bad(lexer, &token);
        break;
    default:
        break;
    }
    token.hi = file->base + (uint32_t)(lexer->at - file->text);
    return token;
}
