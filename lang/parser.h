// SPDX-License-Identifier: Apache-2.0
// What the two halves of the parser share: lang/parse.c has the statements, lang/parse_expr.c the
// expressions.
//
// How to read them: each function stands under its grammar rule, takes the tokens that belong to
// the rule, and returns a node, or 0 after an error. After an error the parser is `lost`: nothing
// more is reported, expect() fails, and the statement's function skips to the next statement.
// Lists of unknown length are gathered on one stack and then moved to the tree's `extra`.
#ifndef LANG_PARSER_H
#define LANG_PARSER_H

#include "lang/lex.h"
#include "lang/symbols.h"

enum {
    PARSE_MAX_NESTING = 256, // of blocks, brackets and prefix operators; bounds the C stack
    PARSE_MAX_HEIGHT = 1000, // of one expression's tree; a sum of n terms is n high
};

typedef struct {
    Arena *arena;
    Arena *lasting; // of the tables of runs; NULL: there are none
    Symbols *symbols;
    Diag *diag;
    Syntax *syntax;
    Lexer lexer;
    Token token, next;         // the one to be taken, and the one after it
    uint32_t last_lo, last_hi; // the token taken last
    uint32_t *stack;
    size_t n_stack, stack_capacity;
    unsigned nesting;
    unsigned height;        // of the expression parsed last
    unsigned n_brackets;    // open in this statement, of any kind within an expression
    unsigned n_braces;      // open in the file, those of keys too
    unsigned lost_brackets; // n_brackets where the parser was lost
    bool is_lost;
    bool is_too_deep; // reported; once for a file
    bool is_cut;      // the end of the file came in a block; reported
    uint32_t suspect; // the first '{' whose '}' stands as if it were another's, or 0
    // For hints, offsets in this statement, or 0:
    uint32_t less_at;    // the last '<' that compares
    uint32_t vector_end; // behind the last vector
    Symbol within;       // the name of the node whose block it is
} Parser;

void parser_init(Parser *p, Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag);
// Goes on with a tree at an offset of its file.
void parser_resume(Parser *p, Arena *arena, Syntax *syntax, Diag *diag, uint32_t offset);
// The next token is the one behind the offset, where the last one ends.
void parser_seek(Parser *p, uint32_t offset);
void parser_advance(Parser *p);
// Cuts the token behind its first character, which is one of this kind.
void parser_split(Parser *p, TokenKind kind);
// Takes the token if it is of this kind.
bool parser_accept(Parser *p, TokenKind kind);
bool parser_accept_keyword(Parser *p, Symbol keyword);
// Takes the token or reports what was expected. `opened`: offset of the bracket to be closed, or 0.
bool parser_expect(Parser *p, TokenKind kind, uint32_t opened);

static inline bool parser_at(const Parser *p, TokenKind kind) {
    return p->token.kind == kind;
}
static inline bool parser_at_keyword(const Parser *p, Symbol keyword) {
    return p->token.kind == TOKEN_NAME && p->token.symbol == keyword;
}

// Reports unless the parser is lost already, and makes it so. hint may be NULL.
void parser_error(Parser *p, Span where, const char *hint, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// "expected WHAT after 'last', found 'token'", at the place where it is missing.
void parser_error_expected(Parser *p, const char *what, const char *hint);

// One level deeper, until parser_leave. False: too deep, reported.
bool parser_enter(Parser *p);
void parser_leave(Parser *p);

NodeId parser_node(Parser *p, NodeKind kind, unsigned aux, uint32_t lo, uint32_t a, uint32_t b);
void parser_push(Parser *p, uint32_t word);
// Moves what was pushed since the stack had n words to `extra`; returns where it lies.
ExtraId parser_pop_to_extra(Parser *p, size_t n);

static inline Span parser_span(Token token) {
    return (Span){token.lo, token.hi};
}
static inline const char *parser_text(const Parser *p, uint32_t offset) {
    return p->syntax->file->text + (offset - p->syntax->file->base);
}

// lang/parse_errors.c
static inline bool parser_begins_value(TokenKind kind) {
    return kind == TOKEN_NUMBER || kind == TOKEN_STRING || kind == TOKEN_NAME || kind == TOKEN_LT ||
           kind == TOKEN_LBRACKET || kind == TOKEN_LPAREN || kind == TOKEN_MINUS;
}
// The block of a node is missing. `first`: the path's first name; is_dotted: more follow, or
// instance stands before it; is_labelled: its label or arguments are there.
void parser_error_no_block(Parser *p, Token first, bool is_dotted, bool is_labelled);
// Something stands where a statement should begin; less_at is of the statement before.
void parser_error_no_statement(Parser *p, uint32_t less_at);
// After an error, to the next statement or the '}' of its block.
void parser_skip_statement(Parser *p, Token first, unsigned braces);
// A value follows the last argument of a transform without a ','. `lo`: of the statement.
void parser_error_no_comma(Parser *p, uint32_t lo);
// A finished value is followed by '=', which does not compare; false: it is not.
bool parser_error_no_comparison(Parser *p);
// Is the name that of before(...) or after(...) behind the keys that it belongs to? Then reported.
bool parser_error_late_ends(Parser *p, Token name);
// At a '{', or, after an error, at the one on the same line. False: there is none, reported.
bool parser_reach_block(Parser *p);
// The token is the '}' of the '{' at lo: does it look like another's?
void parser_suspect_block(Parser *p, uint32_t lo);
void parser_error_open_block(Parser *p, uint32_t lo);

// lang/parse_expr.c
NodeId parse_expr(Parser *p);
NodeId parse_sum(Parser *p);
// To extra: n, (name or 0, offset, value)... The token is '('.
ExtraId parse_args(Parser *p);
// "[" expr "]"
NodeId parse_index(Parser *p);
// The tree over operands of these heights is one higher; false: too high, reported.
bool parse_grow(Parser *p, unsigned left, unsigned right, uint32_t lo);
// OPERATOR_COUNT: none.
Operator parse_comparison(TokenKind kind);

// lang/parse_value.c
NodeId parse_prim(Parser *p);
NodeId parse_string(Parser *p);

#endif
