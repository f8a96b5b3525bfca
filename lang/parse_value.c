// SPDX-License-Identifier: Apache-2.0
// Values: what an expression begins with. lang/parser.h says how to read this file.
#include "lang/parser.h"

#include <stdio.h>
#include <string.h>

// The text between the quotes, escapes resolved.
static Symbol string_symbol(Parser *p, Token token) {
    const char *text = parser_text(p, token.lo) + 1;
    size_t n = token.hi - token.lo - 1;
    n -= token.problem != LEX_OPEN_STRING;
    if (!memchr(text, '\\', n)) {
        return symbol_of(p->symbols, text, n);
    }
    char *resolved = arena_alloc(p->arena, n);
    size_t size = 0;
    for (size_t i = 0; i < n; i++) {
        char c = text[i];
        if (c == '\\' && i + 1 < n) {
            c = text[++i];
            c = c == 'n' ? '\n' : c == 't' ? '\t' : c;
        }
        resolved[size++] = c;
    }
    return symbol_of(p->symbols, resolved, size);
}

NodeId parse_string(Parser *p) {
    Token token = p->token;
    parser_advance(p);
    p->height = 1;
    return parser_node(p, NODE_STRING, 0, token.lo, string_symbol(p, token), 0);
}

static NodeId parse_number(Parser *p) {
    Token token = p->token;
    parser_advance(p);
    // Whatever may follow a name that begins a statement tells a unit from it.
    if (!token.unit && parser_at(p, TOKEN_NAME) && !p->token.newline &&
        symbol_is_unit(p->token.symbol) && p->next.kind != TOKEN_ASSIGN &&
        p->next.kind != TOKEN_LBRACE && p->next.kind != TOKEN_PRIME &&
        p->next.kind != TOKEN_LPAREN && p->next.kind != TOKEN_DOT &&
        (p->next.kind != TOKEN_NAME || p->next.newline)) {
        char hint[96];
        int n = token.hi - token.lo < 40 ? (int)(token.hi - token.lo) : 0;
        snprintf(hint, sizeof hint, "write %.*s%.*s", n, parser_text(p, token.lo),
                 (int)(p->token.hi - p->token.lo), parser_text(p, p->token.lo));
        parser_error(p, (Span){token.lo, p->token.hi}, hint,
                     "a unit touches its number, found a space before '%.*s'",
                     (int)(p->token.hi - p->token.lo), parser_text(p, p->token.lo));
        return 0;
    }
    uint64_t bits;
    memcpy(&bits, &token.number, sizeof bits);
    p->height = 1;
    return parser_node(p, NODE_NUMBER, token.unit, token.lo, (uint32_t)bits,
                       (uint32_t)(bits >> 32));
}

// "<" sum { "," sum } ">"
static NodeId parse_vector(Parser *p) {
    uint32_t lo = p->token.lo, n = 0;
    size_t base = p->n_stack;
    unsigned height = 0;
    p->n_brackets++;
    parser_advance(p);
    do {
        if (n && parser_at(p, TOKEN_GT)) {
            parser_error(p, parser_span(p->token), "delete the ',' before it",
                         "expected a value after ',', found '>'");
            break;
        }
        NodeId element = parse_sum(p);
        parser_push(p, element);
        n++;
        height = p->height > height ? p->height : height;
    } while (!p->is_lost && parser_accept(p, TOKEN_COMMA));
    if (parser_at(p, TOKEN_GE) && p->next.kind == TOKEN_ASSIGN && p->next.lo == p->token.hi) {
        parser_split(p, TOKEN_GT); // `<1, 2>==v` was cut into `>=` and `=`
    }
    TokenKind kind = p->token.kind;
    if (kind != TOKEN_GT && (parse_comparison(kind) != OPERATOR_COUNT || kind == TOKEN_QUESTION)) {
        parser_error(p, parser_span(p->token), "put brackets round it: <1, (a < b), 2>",
                     "expected ',' or '>' in a vector, found '%s'", lex_token_text(kind));
    }
    parser_expect(p, TOKEN_GT, lo);
    p->n_brackets--;
    p->vector_end = p->last_hi;
    p->height = height;
    ExtraId extra = parser_pop_to_extra(p, base);
    return !p->is_lost && parse_grow(p, height, 0, lo)
               ? parser_node(p, NODE_VECTOR, 0, lo, extra, n)
               : 0;
}

// "for" NAME "in" expr [ "if" expr ] ":" expr "]"
static NodeId parse_comprehension(Parser *p, uint32_t lo) {
    parser_advance(p);
    Symbol variable = p->token.symbol;
    uint32_t at = p->token.lo;
    parser_advance(p);
    if (!parser_accept_keyword(p, KEYWORD_IN)) {
        parser_error_expected(p, "'in'", "write [for i in 0..9: f(i)]");
        return 0;
    }
    NodeId iterated = parse_expr(p), condition = 0, body = 0;
    unsigned height = p->height;
    if (iterated && parser_accept_keyword(p, KEYWORD_IF)) {
        condition = parse_expr(p);
        height = p->height > height ? p->height : height;
    }
    if (!p->is_lost && parser_expect(p, TOKEN_COLON, 0)) {
        body = parse_expr(p);
    }
    if (!body || !parser_expect(p, TOKEN_RBRACKET, lo) || !parse_grow(p, height, p->height, lo)) {
        return 0;
    }
    size_t base = p->n_stack;
    parser_push(p, variable);
    parser_push(p, at);
    parser_push(p, iterated);
    parser_push(p, condition);
    parser_push(p, body);
    return parser_node(p, NODE_COMPREHENSION, 0, lo, parser_pop_to_extra(p, base), 0);
}

// list = "[" [ expr { "," expr } [ "," ] ] "]" | "[" "for" ... "]" .
static NodeId parse_list(Parser *p) {
    uint32_t lo = p->token.lo, n = 0;
    size_t base = p->n_stack;
    unsigned height = 0;
    p->n_brackets++;
    parser_advance(p);
    NodeId list = 0;
    if (parser_at_keyword(p, KEYWORD_FOR) && p->next.kind == TOKEN_NAME) {
        list = parse_comprehension(p, lo);
    } else {
        while (!parser_at(p, TOKEN_RBRACKET)) {
            NodeId element = parse_expr(p);
            parser_push(p, element);
            n++;
            height = p->height > height ? p->height : height;
            if (!element || !parser_accept(p, TOKEN_COMMA)) {
                break;
            }
        }
        bool is_closed = parser_expect(p, TOKEN_RBRACKET, lo);
        ExtraId extra = parser_pop_to_extra(p, base);
        if (is_closed && parse_grow(p, height, 0, lo)) {
            list = parser_node(p, NODE_LIST, 0, lo, extra, n);
        }
    }
    p->n_brackets--;
    return list;
}

// mode = WORD [ args ] .
static NodeId parse_mode(Parser *p) {
    uint32_t lo = p->token.lo;
    Symbol name = p->token.symbol;
    parser_advance(p);
    ExtraId args = parser_at(p, TOKEN_LPAREN) ? parse_args(p) : 0;
    return p->is_lost ? 0 : parser_node(p, NODE_MODE, 0, lo, name, args);
}

// sum ":" sum [ mode ]
static void parse_key(Parser *p) {
    NodeId time = parse_sum(p), value = 0, mode = 0;
    if (time && parser_expect(p, TOKEN_COLON, 0)) {
        value = parse_sum(p);
    }
    if (value && parser_at(p, TOKEN_NAME)) {
        mode = parse_mode(p);
    }
    TokenKind kind = p->token.kind;
    if (value && (kind == TOKEN_QUESTION || parse_comparison(kind) != OPERATOR_COUNT)) {
        parser_error(p, parser_span(p->token),
                     kind == TOKEN_QUESTION
                         ? "a conditional as a key's value needs brackets: 1s: (a ? b : c)"
                         : "a comparison as a key's value needs brackets: 1s: (a < b)",
                     "expected ',' or '}' after a key's value, found '%s'", lex_token_text(kind));
    }
    parser_push(p, time);
    parser_push(p, value);
    parser_push(p, mode);
}

// keys = "keys" { mode } "{" sum ":" sum [ mode ] { "," sum ":" sum [ mode ] } [ "," ] "}" .
static NodeId parse_keys(Parser *p) {
    uint32_t lo = p->token.lo;
    size_t base = p->n_stack;
    parser_advance(p);
    parser_push(p, 0);
    p->n_brackets++;
    while (parser_at(p, TOKEN_NAME) && !p->is_lost) {
        NodeId mode = parse_mode(p);
        parser_push(p, mode);
        p->stack[base]++;
    }
    uint32_t opened = p->token.lo;
    size_t count = p->n_stack;
    parser_push(p, 0);
    unsigned height = 1;
    if (parser_expect(p, TOKEN_LBRACE, 0)) {
        do {
            parse_key(p);
            p->stack[count]++;
            height = p->height > height ? p->height : height;
        } while (!p->is_lost && parser_accept(p, TOKEN_COMMA) && !parser_at(p, TOKEN_RBRACE));
        parser_expect(p, TOKEN_RBRACE, opened);
    }
    p->n_brackets--;
    // Outside of brackets that is a statement that begins with a name, and reported as such.
    if (p->n_brackets && parser_at(p, TOKEN_NAME)) {
        parser_error_late_ends(p, p->token);
    }
    ExtraId extra = parser_pop_to_extra(p, base);
    return !p->is_lost && parse_grow(p, height, 0, lo) ? parser_node(p, NODE_KEYS, 0, lo, extra, 0)
                                                       : 0;
}

// A word that begins the next line's statement: a value is missing before it.
static bool at_next_statement(const Parser *p) {
    return p->token.newline && !p->n_brackets &&
           (p->next.kind == TOKEN_ASSIGN ||
            (p->token.symbol <= KEYWORD_LAST_STATEMENT && p->next.kind == TOKEN_NAME));
}

static NodeId parse_brackets(Parser *p) {
    uint32_t opened = p->token.lo;
    p->n_brackets++;
    parser_advance(p);
    NodeId inner = parse_expr(p);
    if (inner && parser_at(p, TOKEN_COMMA)) {
        parser_error(p, parser_span(p->token), "a vector is written <x, y, z>, a list [a, b]",
                     "expected ')', found ','");
    }
    if (inner) {
        parser_error_no_comparison(p);
    }
    inner = inner && parser_expect(p, TOKEN_RPAREN, opened) ? inner : 0;
    p->n_brackets--;
    if (inner) {
        p->syntax->nodes[inner].parens++;
    }
    return inner;
}

static void report_no_value(Parser *p) {
    const char *hint = NULL;
    if (p->less_at && p->last_hi - p->last_lo == 1 && *parser_text(p, p->last_lo) == '>') {
        hint = "'<' after a value compares: a vector as an argument needs brackets, n(<p, q>)";
    } else if (parser_at(p, TOKEN_PLUS)) {
        hint = "there is no sign '+': delete it";
    } else if (parser_at(p, TOKEN_PRIME)) {
        hint = "strings stand in double quotes: \"...\"";
    } else if (parser_at(p, TOKEN_LBRACE)) {
        hint = "a list is written [a, b], keys are written keys { 0s: a, 1s: b }";
    } else if (parser_at(p, TOKEN_ASSIGN) && *parser_text(p, p->last_lo) == '=') {
        hint = "write '==' to compare";
    }
    parser_error_expected(p, "a value", hint);
}

// prim = NUMBER | STRING | NAME | "(" expr ")" | "<" sum { "," sum } ">" | list | keys .
NodeId parse_prim(Parser *p) {
    Token token = p->token;
    NodeId node = 0;
    switch (token.kind) {
    case TOKEN_NUMBER:
        return parse_number(p);
    case TOKEN_STRING:
        return parse_string(p);
    case TOKEN_NAME:
        if (at_next_statement(p)) {
            break;
        }
        if (token.symbol == KEYWORD_KEYS &&
            (p->next.kind == TOKEN_LBRACE || p->next.kind == TOKEN_NAME)) {
            if (!parser_enter(p)) {
                return 0;
            }
            node = parse_keys(p);
            parser_leave(p);
            return node;
        }
        parser_advance(p);
        p->height = 1;
        return parser_node(p, NODE_NAME, 0, token.lo, token.symbol, 0);
    case TOKEN_LPAREN:
    case TOKEN_LT:
    case TOKEN_LBRACKET:
        if (!parser_enter(p)) {
            return 0;
        }
        node = token.kind == TOKEN_LPAREN ? parse_brackets(p)
               : token.kind == TOKEN_LT   ? parse_vector(p)
                                          : parse_list(p);
        parser_leave(p);
        return node;
    default:
        break;
    }
    report_no_value(p);
    return 0;
}
