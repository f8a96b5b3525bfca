// SPDX-License-Identifier: Apache-2.0
// Statements and whole files. lang/parser.h says how to read this file.
#include "lang/run.h"

#include <stdio.h>
#include <string.h>

static NodeId parse_block(Parser *p);

static ExtraId words_to_extra(Parser *p, const uint32_t *words, size_t n) {
    size_t base = p->n_stack;
    for (size_t i = 0; i < n; i++) {
        parser_push(p, words[i]);
    }
    return parser_pop_to_extra(p, base);
}

// Takes a name that the rule asks for; false: reported.
static bool take_name(Parser *p, const char *what, const char *hint, Symbol *name, uint32_t *at) {
    if (p->is_lost) {
        return false;
    }
    if (!parser_at(p, TOKEN_NAME)) {
        parser_error_expected(p, what, hint);
        return false;
    }
    *name = p->token.symbol;
    *at = p->token.lo;
    parser_advance(p);
    return true;
}

// "let" NAME "=" expr | "param" NAME "=" expr | "clip" NAME "=" expr
static NodeId parse_let(Parser *p, NodeKind kind) {
    uint32_t lo = p->token.lo, at;
    Symbol name;
    parser_advance(p);
    if (!take_name(p, "a name", NULL, &name, &at)) {
        return 0;
    }
    if (kind == NODE_LET && parser_at(p, TOKEN_LPAREN)) {
        parser_error_expected(p, "'='", "a function is defined with fn: fn f(x) = ...");
    }
    NodeId value = parser_expect(p, TOKEN_ASSIGN, 0) ? parse_expr(p) : 0;
    return value ? parser_node(p, kind, 0, lo, name, value) : 0;
}

// params = "(" [ NAME [ "=" expr ] { "," NAME [ "=" expr ] } [ "," ] ] ")" .
static NodeId parse_params(Parser *p) {
    uint32_t lo = p->token.lo, n = 0;
    size_t base = p->n_stack;
    p->n_brackets++;
    parser_advance(p);
    while (!parser_at(p, TOKEN_RPAREN)) {
        Symbol name;
        uint32_t at;
        if (!take_name(p, "a parameter's name", NULL, &name, &at)) {
            break;
        }
        NodeId value = parser_accept(p, TOKEN_ASSIGN) ? parse_expr(p) : 0;
        parser_push(p, name);
        parser_push(p, at);
        parser_push(p, value);
        n++;
        if (!parser_accept(p, TOKEN_COMMA)) {
            break;
        }
    }
    parser_expect(p, TOKEN_RPAREN, lo);
    p->n_brackets--;
    ExtraId extra = parser_pop_to_extra(p, base);
    return p->is_lost ? 0 : parser_node(p, NODE_PARAMS, 0, lo, extra, n);
}

// "fn" NAME params "=" expr
static NodeId parse_fn(Parser *p) {
    uint32_t lo = p->token.lo, at, words[2];
    Symbol name;
    parser_advance(p);
    if (!take_name(p, "a name", NULL, &name, &at)) {
        return 0;
    }
    if (!parser_at(p, TOKEN_LPAREN)) {
        parser_error_expected(p, "'('", "write fn f(x) = ..., or let for a plain value");
        return 0;
    }
    words[0] = parse_params(p);
    if (parser_at(p, TOKEN_LBRACE)) {
        parser_error_expected(p, "'='", "a function's body is one expression");
    }
    words[1] = parser_expect(p, TOKEN_ASSIGN, 0) ? parse_expr(p) : 0;
    return words[1] ? parser_node(p, NODE_FN, 0, lo, name, words_to_extra(p, words, 2)) : 0;
}

// "def" NAME [ params ] block
static NodeId parse_def(Parser *p) {
    uint32_t lo = p->token.lo, at, words[2] = {0};
    Symbol name;
    parser_advance(p);
    if (!take_name(p, "a name", NULL, &name, &at)) {
        return 0;
    }
    if (parser_at(p, TOKEN_LPAREN)) {
        words[0] = parse_params(p);
        if (parser_at(p, TOKEN_ASSIGN)) {
            parser_error_expected(p, "'{'", "a function is defined with fn: fn f(x) = ...");
        }
    } else if (parser_at(p, TOKEN_ASSIGN)) {
        parser_error_expected(p, "'{'", "write def Name { ... }, or let for a value");
    }
    words[1] = parse_block(p);
    return words[1] ? parser_node(p, NODE_DEF, 0, lo, name, words_to_extra(p, words, 2)) : 0;
}

// "for" NAME "in" expr block
static NodeId parse_for(Parser *p) {
    uint32_t lo = p->token.lo, at, words[2];
    Symbol name = 0;
    const char *hint = "write for i in 0..9 { ... }";
    parser_advance(p);
    if (take_name(p, "a name", hint, &name, &at) && !parser_accept_keyword(p, KEYWORD_IN)) {
        parser_error_expected(p, "'in'", hint);
    }
    words[0] = parse_expr(p);
    words[1] = parse_block(p);
    return words[1] ? parser_node(p, NODE_FOR, 0, lo, name, words_to_extra(p, words, 2)) : 0;
}

// condition of `if` and `when`
static NodeId parse_condition(Parser *p) {
    parser_advance(p);
    NodeId condition = parse_expr(p);
    return condition && parser_error_no_comparison(p) ? 0 : condition;
}

// "if" expr block [ "else" ( block | if-stmt ) ]
static NodeId parse_if(Parser *p) {
    uint32_t lo = p->token.lo, words[2] = {0};
    NodeId condition = parse_condition(p);
    words[0] = parse_block(p);
    if (words[0] && parser_at_keyword(p, KEYWORD_ELSE) && p->next.kind != TOKEN_ASSIGN) {
        parser_advance(p);
        if (!parser_at_keyword(p, KEYWORD_IF)) {
            words[1] = parse_block(p);
        } else if (parser_enter(p)) {
            words[1] = parse_if(p);
            parser_leave(p);
        }
    }
    return p->is_lost ? 0 : parser_node(p, NODE_IF, 0, lo, condition, words_to_extra(p, words, 2));
}

// "when" expr block
static NodeId parse_when(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId condition = parse_condition(p);
    NodeId block = parse_block(p);
    return block ? parser_node(p, NODE_WHEN, 0, lo, condition, block) : 0;
}

// "include" STRING [ "as" NAME ]
static NodeId parse_include(Parser *p) {
    uint32_t lo = p->token.lo, at;
    Symbol name = 0;
    parser_advance(p);
    if (!parser_at(p, TOKEN_STRING)) {
        parser_error_expected(p, "a file's name in double quotes", NULL);
        return 0;
    }
    NodeId path = parse_string(p);
    if (parser_at_keyword(p, KEYWORD_AS) && p->next.kind != TOKEN_ASSIGN) {
        parser_advance(p);
        if (!take_name(p, "a name", NULL, &name, &at)) {
            return 0;
        }
    }
    return parser_node(p, NODE_INCLUDE, 0, lo, path, name);
}

// "assert" expr [ "," expr ]
static NodeId parse_assert(Parser *p) {
    uint32_t lo = p->token.lo;
    parser_advance(p);
    NodeId condition = parse_expr(p);
    NodeId message = parser_accept(p, TOKEN_COMMA) ? parse_expr(p) : 0;
    return p->is_lost ? 0 : parser_node(p, NODE_ASSERT, 0, lo, condition, message);
}

// "print" expr { "," expr } | transform expr { "," expr }
static NodeId parse_values(Parser *p, NodeKind kind, unsigned aux) {
    uint32_t lo = p->token.lo, n = 0;
    size_t base = p->n_stack;
    parser_advance(p);
    do {
        parser_push(p, parse_expr(p));
        n++;
    } while (parser_accept(p, TOKEN_COMMA));
    if (kind == NODE_TRANSFORM && parser_at(p, TOKEN_NUMBER) && !p->token.newline) {
        parser_error_no_comma(p, lo);
    }
    ExtraId extra = parser_pop_to_extra(p, base);
    return p->is_lost ? 0 : parser_node(p, kind, aux, lo, extra, n);
}

// "sim" NAME NAME block
static NodeId parse_sim(Parser *p) {
    uint32_t lo = p->token.lo, words[5] = {0};
    const char *hint = "write sim rigid Name { ... } or sim state Name { ... }";
    parser_advance(p);
    (void)(take_name(p, "the kind and a name", hint, &words[0], &words[1]) &&
           take_name(p, "a name", hint, &words[2], &words[3]));
    words[4] = parse_block(p);
    return words[4] ? parser_node(p, NODE_SIM, 0, lo, words_to_extra(p, words, 5), 0) : 0;
}

// [ label ] into its Symbol, its offset and its index, on the same line.
static void parse_label(Parser *p, uint32_t words[3]) {
    if (!p->is_lost && parser_at(p, TOKEN_NAME) && !p->token.newline) {
        words[0] = p->token.symbol;
        words[1] = p->token.lo;
        parser_advance(p);
        if (parser_at(p, TOKEN_LBRACKET) && !p->token.newline) {
            words[2] = parse_index(p);
        }
    }
}

// "joint" NAME [ label ] block
static NodeId parse_joint(Parser *p) {
    uint32_t lo = p->token.lo, words[6] = {0}, label[3] = {0};
    parser_advance(p);
    take_name(p, "the kind", "write joint hinge { ... }", &words[0], &words[1]);
    parse_label(p, label);
    words[2] = label[0];
    words[3] = label[0] ? label[1] : words[1];
    words[5] = label[2];
    words[4] = parse_block(p);
    return words[4] ? parser_node(p, NODE_JOINT, 0, lo, words_to_extra(p, words, 6), 0) : 0;
}

// NAME "=" expr | NAME "'" "=" expr
static NodeId parse_property(Parser *p, NodeKind kind) {
    Token name = p->token;
    parser_advance(p);
    if (kind == NODE_RATE) {
        parser_advance(p);
    }
    NodeId value = parser_expect(p, TOKEN_ASSIGN, 0) ? parse_expr(p) : 0;
    return value ? parser_node(p, kind, 0, name.lo, name.symbol, value) : 0;
}

// path = NAME { "." NAME } .
static NodeId parse_path(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId path = parser_node(p, NODE_NAME, 0, lo, p->token.symbol, 0);
    parser_advance(p);
    for (unsigned depth = 1; parser_accept(p, TOKEN_DOT); depth++) {
        Symbol name;
        uint32_t at;
        if (!take_name(p, "a name", NULL, &name, &at)) {
            return 0;
        }
        if (depth == PARSE_MAX_NESTING) {
            parser_error(p, (Span){lo, p->last_hi}, NULL, "path has over %d parts",
                         PARSE_MAX_NESTING);
        }
        path = parser_node(p, NODE_MEMBER, 0, lo, path, name);
    }
    return path;
}

// [ "instance" ] path [ args ] [ label ] block      label = NAME [ "[" expr "]" ] .
static NodeId parse_object(Parser *p) {
    uint32_t words[7] = {0};
    enum { IS_INSTANCE, PATH, ARGS, LABEL, LABEL_AT, LABEL_INDEX, BLOCK, N_WORDS };
    uint32_t lo = p->token.lo;
    if (parser_at_keyword(p, KEYWORD_INSTANCE) && p->next.kind == TOKEN_NAME && !p->next.newline) {
        words[IS_INSTANCE] = 1;
        parser_advance(p);
    }
    Token first = p->token;
    words[PATH] = parse_path(p);
    bool is_dotted = p->last_lo != first.lo;
    if (parser_at(p, TOKEN_LPAREN) && !p->token.newline) {
        words[ARGS] = parse_args(p);
    }
    parse_label(p, &words[LABEL]);
    if (!p->is_lost && !parser_at(p, TOKEN_LBRACE)) {
        parser_error_no_block(p, first, is_dotted || words[IS_INSTANCE],
                              words[LABEL] || words[ARGS]);
    }
    Symbol outer = p->within;
    p->within = is_dotted ? 0 : first.symbol;
    words[BLOCK] = parse_block(p);
    p->within = outer;
    if (!words[BLOCK]) {
        return 0;
    }
    return parser_node(p, NODE_OBJECT, 0, lo, words_to_extra(p, words, N_WORDS), 0);
}

static NodeId parse_named_statement(Parser *p) {
    switch (p->token.symbol) {
    case KEYWORD_LET:
        return parse_let(p, NODE_LET);
    case KEYWORD_PARAM:
        return parse_let(p, NODE_PARAM);
    case KEYWORD_CLIP:
        return parse_let(p, NODE_CLIP);
    case KEYWORD_FN:
        return parse_fn(p);
    case KEYWORD_DEF:
        return parse_def(p);
    case KEYWORD_FOR:
        return parse_for(p);
    case KEYWORD_IF:
        return parse_if(p);
    case KEYWORD_WHEN:
        return parse_when(p);
    case KEYWORD_INCLUDE:
        return parse_include(p);
    case KEYWORD_ASSERT:
        return parse_assert(p);
    case KEYWORD_PRINT:
        return parse_values(p, NODE_PRINT, 0);
    case KEYWORD_TRANSLATE:
        return parse_values(p, NODE_TRANSFORM, TRANSFORM_TRANSLATE);
    case KEYWORD_SCALE:
        return parse_values(p, NODE_TRANSFORM, TRANSFORM_SCALE);
    case KEYWORD_ROTATE:
        return parse_values(p, NODE_TRANSFORM, TRANSFORM_ROTATE);
    case KEYWORD_MATRIX:
        return parse_values(p, NODE_TRANSFORM, TRANSFORM_MATRIX);
    case KEYWORD_SIM:
        return parse_sim(p);
    case KEYWORD_JOINT:
        return parse_joint(p);
    case KEYWORD_ELSE:
        parser_error(p, parser_span(p->token), "else follows the '}' of an if",
                     "'else' without an 'if'");
        return 0;
    case KEYWORD_ST4:
        if (p->next.kind == TOKEN_NUMBER) {
            parser_error(p, parser_span(p->token), "write it before everything else",
                         "the language's version is not at the beginning of the file");
            return 0;
        }
        return parse_object(p);
    default:
        return parse_object(p);
    }
}

// stmt, or 0 after an error; then the parser stands at the next one.
static NodeId parse_statement(Parser *p) {
    Token first = p->token;
    unsigned braces = p->n_braces, nesting = p->nesting;
    size_t base = p->n_stack, n_nodes = p->syntax->n_nodes, n_extra = p->syntax->n_extra;
    uint32_t less_at = p->less_at;
    NodeId node = 0;
    diag_next_statement(p->diag);
    p->less_at = 0;
    p->n_brackets = 0;
    if (first.kind != TOKEN_NAME) {
        parser_error_no_statement(p, less_at);
    } else if (p->next.kind == TOKEN_ASSIGN) {
        node = parse_property(p, NODE_PROPERTY);
    } else if (p->next.kind == TOKEN_PRIME) {
        node = parse_property(p, NODE_RATE);
    } else {
        node = parse_named_statement(p);
    }
    if (p->is_lost) {
        parser_skip_statement(p, first, braces);
        p->is_lost = false;
        p->n_stack = base;
        p->nesting = nesting;
        p->syntax->n_nodes = n_nodes;
        p->syntax->n_extra = n_extra;
        node = 0;
    }
    return node;
}

// { stmt } until '}' or the end
static uint32_t parse_statements(Parser *p) {
    size_t base = p->n_stack;
    RunGather gather = {0};
    while (!parser_at(p, TOKEN_RBRACE) && !parser_at(p, TOKEN_END)) {
        if (parser_accept(p, TOKEN_SEMICOLON)) {
            run_end(&gather, p);
            continue;
        }
        if (run_take(&gather, p)) {
            continue;
        }
        NodeId node_lo = (NodeId)p->syntax->n_nodes;
        uint32_t lo = p->token.lo;
        NodeId statement = parse_statement(p);
        statement = statement ? run_add(&gather, p, statement, node_lo, lo) : 0;
        if (statement) {
            parser_push(p, statement);
        }
    }
    run_end(&gather, p);
    return (uint32_t)(p->n_stack - base);
}

// block = "{" { stmt } "}" .
static NodeId parse_block(Parser *p) {
    if (!parser_reach_block(p)) {
        return 0;
    }
    bool was_lost = p->is_lost;
    uint32_t lo = p->token.lo;
    p->is_lost = false;
    if (!parser_enter(p)) {
        return 0;
    }
    parser_advance(p);
    size_t base = p->n_stack;
    uint32_t n = parse_statements(p);
    ExtraId extra = parser_pop_to_extra(p, base);
    parser_leave(p);
    diag_next_statement(p->diag);
    p->n_brackets = 0;
    if (parser_at(p, TOKEN_END)) {
        parser_error_open_block(p, lo);
        return 0;
    }
    parser_suspect_block(p, lo);
    parser_advance(p);
    p->is_lost = was_lost;
    return was_lost ? 0 : parser_node(p, NODE_BLOCK, 0, lo, extra, n);
}

// [ "st4" NUMBER ]
static void parse_version(Parser *p) {
    if (!parser_at_keyword(p, KEYWORD_ST4) || p->next.kind != TOKEN_NUMBER) {
        return;
    }
    parser_advance(p);
    p->syntax->version = p->token.number;
    if (p->token.number != 1 || p->token.unit) {
        diag_error(p->diag, parser_span(p->token), "write st4 1",
                   "unknown version of the language: this program knows version 1");
        p->syntax->has_errors = true;
    }
    parser_advance(p);
}

// file = [ "st4" NUMBER ] { stmt } .
static Syntax *parse_file(Parser *p) {
    parse_version(p);
    uint32_t n = parse_statements(p);
    while (parser_at(p, TOKEN_RBRACE)) {
        diag_next_statement(p->diag);
        parser_error(p, parser_span(p->token), NULL, "'}' without a '{'");
        p->is_lost = false;
        parser_advance(p);
        n += parse_statements(p);
    }
    diag_next_statement(p->diag);
    ExtraId extra = parser_pop_to_extra(p, 0);
    p->syntax->root = parser_node(p, NODE_BLOCK, 0, p->syntax->file->base, extra, n);
    return p->syntax;
}

Syntax *syntax_parse(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag) {
    Parser parser;
    parser_init(&parser, arena, symbols, file, diag);
    return parse_file(&parser);
}

Syntax *syntax_parse_runs(Arena *arena, Arena *lasting, Symbols *symbols, const SourceFile *file,
                          Diag *diag) {
    Parser parser;
    parser_init(&parser, arena, symbols, file, diag);
    parser.lasting = lasting;
    return parse_file(&parser);
}

NodeId run_parse_statement(Parser *p, uint32_t offset) {
    parser_seek(p, offset);
    return parse_statement(p);
}

NodeId syntax_parse_expr(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag,
                         Syntax **syntax) {
    Parser parser, *p = &parser;
    parser_init(p, arena, symbols, file, diag);
    // There is no next line's statement to be taken for a value or an operator.
    p->n_brackets = 1;
    NodeId node = parse_expr(p);
    if (node && !parser_at(p, TOKEN_END)) {
        parser_error_expected(p, "the end of the expression", NULL);
    }
    diag_next_statement(diag);
    *syntax = p->syntax;
    p->syntax->root = p->syntax->has_errors ? 0 : node;
    return p->syntax->root;
}
