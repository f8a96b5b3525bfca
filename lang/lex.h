// SPDX-License-Identifier: Apache-2.0
// The lexer: tokens of one file, one at a time, from any offset on, without allocating.
//
// What is wrong with a token is kept in it and reported when the parser comes to it, since the
// parser looks one token ahead and an error belongs to the statement that it stands in.
#ifndef LANG_LEX_H
#define LANG_LEX_H

#include "lang/diag.h"
#include "lang/source.h"
#include "lang/syntax.h"

typedef enum {
    TOKEN_END,
    TOKEN_NAME,
    TOKEN_NUMBER,
    TOKEN_STRING,
    TOKEN_BAD, // characters that begin no token
#define TOKEN(id, text) TOKEN_##id,
#include "lang/tokens.def"
#undef TOKEN
    TOKEN_COUNT
} TokenKind;

typedef enum {
    LEX_OK,
    LEX_CHARACTER,
    LEX_OPEN_STRING,
    LEX_OPEN_COMMENT,
    LEX_ESCAPE,
    LEX_UNIT,
    LEX_HUGE,
    LEX_LONG,
} LexProblem;

typedef struct {
    uint8_t kind;    // TokenKind
    uint8_t problem; // LexProblem
    uint8_t unit;    // of a number
    bool newline;    // first on its line
    uint32_t lo, hi;
    uint32_t symbol; // a name's hash; the parser replaces it by the symbol
    double number;   // unit not applied
} Token;

typedef struct {
    const SourceFile *file;
    const char *at, *end;
} Lexer;

// Behind the byte order mark and a first line that begins with #!.
Lexer lex_begin(const SourceFile *file);
Lexer lex_at(const SourceFile *file, uint32_t offset);
Token lex_next(Lexer *lexer);
// The number at lexer->at, if it is a short one without exponent, unit or '_': what lex_next makes
// of it, only sooner. False: it is none of these, and not taken.
bool lex_plain_number(Lexer *lexer, double *value);

// Reports the token's problem; LEX_OK: nothing.
void lex_report(const SourceFile *file, Token token, Diag *diag);

// Reports a file that is no text: the first byte that is not UTF-8, or the first NUL. False then.
bool lex_check_text(const SourceFile *file, Diag *diag);

const char *lex_token_text(TokenKind kind); // of punctuation: "("
const char *lex_unit_text(Unit unit);

#endif
