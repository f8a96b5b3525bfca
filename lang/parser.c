// SPDX-License-Identifier: Apache-2.0
// The parser's ground: tokens, errors, nodes.
#include "lang/parser.h"

#include <stdio.h>
#include <string.h>

static Token fetch(Parser *p) {
    Token token = lex_next(&p->lexer);
    if (token.kind == TOKEN_NAME) {
        token.symbol = symbol_of_hashed(p->symbols, parser_text(p, token.lo), token.hi - token.lo,
                                        token.symbol);
    }
    return token;
}

void parser_init(Parser *p, Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag) {
    Syntax *syntax = ARENA_NEW(arena, Syntax);
    *p = (Parser){.arena = arena, .symbols = symbols, .diag = diag, .syntax = syntax};
    *syntax = (Syntax){.file = file, .symbols = symbols};
    // Large files get room at once: a grown array leaves its smaller copies behind. Fresh pages
    // cost nothing until they are used.
    syntax->nodes_capacity = file->size / 5 + 16;
    syntax->nodes = ARENA_ARRAY(arena, syntax->nodes_capacity, Node);
    syntax->extra_capacity = file->size / 8 + 16;
    syntax->extra = ARENA_ARRAY(arena, syntax->extra_capacity, uint32_t);
    syntax->n_nodes = syntax->n_extra = 1; // 0 is none
    syntax->has_errors = !lex_check_text(file, diag);
    diag_next_statement(diag);
    p->lexer = lex_begin(file);
    if (syntax->has_errors) { // what is no text has no other mistakes
        p->lexer.at = p->lexer.end;
    }
    p->token = fetch(p);
    p->next = fetch(p);
    p->last_lo = p->last_hi = p->token.lo;
}

void parser_resume(Parser *p, Arena *arena, Syntax *syntax, Diag *diag, uint32_t offset) {
    *p = (Parser){.arena = arena, .symbols = syntax->symbols, .diag = diag, .syntax = syntax};
    parser_seek(p, offset);
}

void parser_seek(Parser *p, uint32_t offset) {
    p->lexer = lex_at(p->syntax->file, offset);
    p->last_lo = offset > p->syntax->file->base ? offset - 1 : offset;
    p->last_hi = offset;
    p->less_at = p->vector_end = 0;
    p->token = fetch(p);
    p->next = fetch(p);
}

static void report_token(Parser *p, Token token) {
    lex_report(p->syntax->file, token, p->diag);
    p->syntax->has_errors = true;
}

void parser_advance(Parser *p) {
    if (p->token.problem && !p->is_lost) {
        report_token(p, p->token);
    }
    p->n_braces += p->token.kind == TOKEN_LBRACE;
    p->n_braces -= p->token.kind == TOKEN_RBRACE && p->n_braces;
    p->last_lo = p->token.lo;
    p->last_hi = p->token.hi;
    p->token = p->next;
    if (p->token.kind != TOKEN_END) {
        p->next = fetch(p);
    }
}

void parser_split(Parser *p, TokenKind kind) {
    p->token.kind = (uint8_t)kind;
    p->token.hi = p->token.lo + 1;
    p->lexer = lex_at(p->syntax->file, p->token.hi);
    p->next = fetch(p);
}

bool parser_accept(Parser *p, TokenKind kind) {
    if (p->is_lost || p->token.kind != kind) {
        return false;
    }
    parser_advance(p);
    return true;
}

bool parser_accept_keyword(Parser *p, Symbol keyword) {
    if (p->is_lost || !parser_at_keyword(p, keyword)) {
        return false;
    }
    parser_advance(p);
    return true;
}

static void lose(Parser *p) {
    p->is_lost = true;
    p->lost_brackets = p->n_brackets;
    p->syntax->has_errors = true;
}

void parser_error(Parser *p, Span where, const char *hint, const char *format, ...) {
    if (p->is_lost) {
        return;
    }
    if (p->token.problem && where.hi >= p->token.lo) {
        report_token(p, p->token); // it is the cause
    } else {
        char message[512];
        va_list args;
        va_start(args, format);
        vsnprintf(message, sizeof message, format, args);
        va_end(args);
        diag_error(p->diag, where, hint, "%s", message);
    }
    lose(p);
}

// What a token is called in a message; the longest of texts are cut.
static void describe(const Parser *p, Token token, char *text, size_t size) {
    int n = token.hi - token.lo < 32 ? (int)(token.hi - token.lo) : 32;
    if (token.kind == TOKEN_END) {
        snprintf(text, size, "the end of the file");
    } else if (token.newline) {
        snprintf(text, size, "the end of the line");
    } else if (token.kind == TOKEN_STRING) {
        snprintf(text, size, "a string");
    } else {
        snprintf(text, size, "'%.*s'", n, parser_text(p, token.lo));
    }
}

void parser_error_expected(Parser *p, const char *what, const char *hint) {
    char found[64], after[64] = "";
    describe(p, p->token, found, sizeof found);
    bool is_first = p->last_lo == p->last_hi;
    if (!is_first && *parser_text(p, p->last_lo) == '"') {
        snprintf(after, sizeof after, " after the string");
    } else if (!is_first) {
        int n = p->last_hi - p->last_lo < 32 ? (int)(p->last_hi - p->last_lo) : 32;
        snprintf(after, sizeof after, " after '%.*s'", n, parser_text(p, p->last_lo));
    }
    bool is_behind = !is_first && (p->token.newline || p->token.kind == TOKEN_END);
    Span where = is_behind ? (Span){p->last_hi, p->last_hi} : parser_span(p->token);
    parser_error(p, where, hint, "expected %s%s, found %s", what, after, found);
}

bool parser_expect(Parser *p, TokenKind kind, uint32_t opened) {
    if (p->is_lost) {
        return false;
    }
    if (p->token.kind == kind) {
        parser_advance(p);
        return true;
    }
    char what[8];
    snprintf(what, sizeof what, "'%s'", lex_token_text(kind));
    parser_error_expected(p, what, NULL);
    if (opened) {
        diag_note(p->diag, (Span){opened, opened + 1}, "to close this '%c'",
                  *parser_text(p, opened));
    }
    return false;
}

bool parser_enter(Parser *p) {
    if (++p->nesting <= PARSE_MAX_NESTING) {
        return true;
    }
    if (!p->is_lost && !p->is_too_deep) {
        diag_error(p->diag, parser_span(p->token), "name the inner parts with let or def",
                   "nested too deeply: over %d levels", PARSE_MAX_NESTING);
    }
    p->is_too_deep = true;
    lose(p);
    p->nesting--;
    return false;
}

void parser_leave(Parser *p) {
    p->nesting--;
}

NodeId parser_node(Parser *p, NodeKind kind, unsigned aux, uint32_t lo, uint32_t a, uint32_t b) {
    Syntax *syntax = p->syntax;
    if (syntax->n_nodes == syntax->nodes_capacity) {
        syntax->nodes = arena_grow(p->arena, syntax->nodes, syntax->n_nodes,
                                   &syntax->nodes_capacity, sizeof *syntax->nodes);
    }
    syntax->nodes[syntax->n_nodes] =
        (Node){.kind = (uint8_t)kind, .aux = (uint8_t)aux, .lo = lo, .a = a, .b = b};
    return (NodeId)syntax->n_nodes++;
}

void parser_push(Parser *p, uint32_t word) {
    if (p->n_stack == p->stack_capacity) {
        p->stack = arena_grow(p->arena, p->stack, p->n_stack, &p->stack_capacity, sizeof *p->stack);
    }
    p->stack[p->n_stack++] = word;
}

ExtraId parser_pop_to_extra(Parser *p, size_t n) {
    Syntax *syntax = p->syntax;
    ExtraId first = (ExtraId)syntax->n_extra;
    for (size_t i = n; i < p->n_stack; i++) {
        if (syntax->n_extra == syntax->extra_capacity) {
            syntax->extra = arena_grow(p->arena, syntax->extra, syntax->n_extra,
                                       &syntax->extra_capacity, sizeof *syntax->extra);
        }
        syntax->extra[syntax->n_extra++] = p->stack[i];
    }
    p->n_stack = n;
    return first;
}
