// SPDX-License-Identifier: Apache-2.0
// Expressions, from ranges down to numbers. lang/parser.h says how to read this file.
#include "lang/parser.h"

#include <stdio.h>
#include <string.h>

static NodeId parse_cond(Parser *p);
static NodeId parse_sum(Parser *p);
static NodeId parse_unary(Parser *p);

// The tree over operands of these heights is one higher.
static bool grow(Parser *p, unsigned left, unsigned right, uint32_t lo) {
    p->height = (left > right ? left : right) + 1;
    if (p->height <= PARSE_MAX_HEIGHT) {
        return true;
    }
    parser_error(p, (Span){lo, p->last_hi}, "name its parts with let",
                 "expression is too long: over %d operations in a row", PARSE_MAX_HEIGHT);
    return false;
}

static NodeId binary(Parser *p, Operator op, uint32_t lo, NodeId left, unsigned height,
                     NodeId right) {
    if (!right || !grow(p, height, p->height, lo)) {
        return 0;
    }
    return parser_node(p, NODE_BINARY, op, lo, left, right);
}

// A '-', '(' or '[' that begins a line could go on with the line above or be meant as something
// new. Within brackets only the first can be meant; elsewhere it is refused. True: refused.
static bool refuse_at_line_start(Parser *p) {
    if (!p->token.newline || p->n_brackets) {
        return false;
    }
    const char *hint = "to go on with the line above, end that with '-'";
    if (parser_at(p, TOKEN_LPAREN)) {
        hint = "the '(' of a call stands on the line of the function's name";
    } else if (parser_at(p, TOKEN_LBRACKET)) {
        hint = "the '[' of an index stands on the line of what it indexes";
    }
    parser_error(p, parser_span(p->token), hint,
                 "the statement above is finished: a line cannot begin with '%s'",
                 lex_token_text(p->token.kind));
    return true;
}

// A word that works as an operator, unless it is the name of the next property.
static bool at_operator_word(Parser *p, Symbol keyword) {
    return parser_at_keyword(p, keyword) && p->next.kind != TOKEN_ASSIGN;
}

// expr = cond [ ".." cond [ "by" cond ] ] .
NodeId parse_expr(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId low = parse_cond(p);
    if (low && parser_accept(p, TOKEN_RANGE)) {
        unsigned height = p->height;
        NodeId high = parse_cond(p), step = 0;
        height = p->height > height ? p->height : height;
        if (high && at_operator_word(p, KEYWORD_BY)) {
            parser_advance(p);
            step = parse_cond(p);
        }
        size_t base = p->n_stack;
        parser_push(p, high);
        parser_push(p, step);
        ExtraId extra = parser_pop_to_extra(p, base);
        low = grow(p, height, p->height, lo) ? parser_node(p, NODE_RANGE, 0, lo, low, extra) : 0;
        if (low && parser_at(p, TOKEN_RANGE)) {
            parser_error(p, parser_span(p->token), "write a..b by step",
                         "a range has two ends, found a second '..'");
        }
    }
    return p->is_lost ? 0 : low;
}

static NodeId parse_or(Parser *p);

// cond = or [ "?" cond ":" cond ] .
static NodeId parse_cond(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId condition = parse_or(p);
    if (!condition || !parser_accept(p, TOKEN_QUESTION)) {
        return condition;
    }
    unsigned height = p->height;
    if (!parser_enter(p)) {
        return 0;
    }
    NodeId yes = parse_cond(p), no = 0;
    height = p->height > height ? p->height : height;
    if (yes && parser_expect(p, TOKEN_COLON, 0)) {
        no = parse_cond(p);
    }
    parser_leave(p);
    size_t base = p->n_stack;
    parser_push(p, yes);
    parser_push(p, no);
    ExtraId extra = parser_pop_to_extra(p, base);
    if (!no || !grow(p, height, p->height, lo)) {
        return 0;
    }
    return parser_node(p, NODE_COND, 0, lo, condition, extra);
}

static Operator comparison(TokenKind kind) {
    switch (kind) {
    case TOKEN_LT:
        return OPERATOR_LT;
    case TOKEN_LE:
        return OPERATOR_LE;
    case TOKEN_GT:
        return OPERATOR_GT;
    case TOKEN_GE:
        return OPERATOR_GE;
    case TOKEN_EQ:
        return OPERATOR_EQ;
    case TOKEN_NE:
        return OPERATOR_NE;
    default:
        return OPERATOR_COUNT;
    }
}

// The first comparison is left, the operator at op_at, and the operand from middle on.
static void refuse_second_comparison(Parser *p, Span left, uint32_t op_at, uint32_t middle) {
    char hint[200] = "join two comparisons with 'and'";
    int n = (int)(p->last_hi - middle), n_left = (int)(left.hi - left.lo);
    if (n < 40 && n_left < 40) {
        snprintf(hint, sizeof hint, "write %.*s %.*s %.*s and %.*s %s ...", n_left,
                 parser_text(p, left.lo), parser_text(p, op_at)[1] == '=' ? 2 : 1,
                 parser_text(p, op_at), n, parser_text(p, middle), n, parser_text(p, middle),
                 lex_token_text(p->token.kind));
    }
    parser_error(p, parser_span(p->token), hint, "a comparison has two sides, found a second '%s'",
                 lex_token_text(p->token.kind));
}

// cmp = sum [ ( "<" | "<=" | ">" | ">=" | "==" | "!=" ) sum ] .
static NodeId parse_cmp(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId left = parse_sum(p);
    Operator op = comparison(p->token.kind);
    if (!left || op == OPERATOR_COUNT) {
        return left;
    }
    unsigned height = p->height;
    uint32_t left_hi = p->last_hi, op_at = p->token.lo;
    if (op == OPERATOR_LT) {
        p->less_at = op_at;
    }
    parser_advance(p);
    uint32_t middle = p->token.lo;
    NodeId right = parse_sum(p);
    if (right && comparison(p->token.kind) != OPERATOR_COUNT) {
        refuse_second_comparison(p, (Span){lo, left_hi}, op_at, middle);
    }
    return binary(p, op, lo, left, height, right);
}

// not = "not" not | cmp .
static NodeId parse_not(Parser *p) {
    uint32_t lo = p->token.lo;
    if (!parser_at_keyword(p, KEYWORD_NOT)) {
        return parse_cmp(p);
    }
    parser_advance(p);
    if (!parser_enter(p)) {
        return 0;
    }
    NodeId operand = parse_not(p);
    parser_leave(p);
    if (!operand || !grow(p, p->height, 0, lo)) {
        return 0;
    }
    return parser_node(p, NODE_UNARY, OPERATOR_NOT, lo, operand, 0);
}

// and = not { "and" not } .
static NodeId parse_and(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId left = parse_not(p);
    while (left && at_operator_word(p, KEYWORD_AND)) {
        unsigned height = p->height;
        parser_advance(p);
        NodeId right = parse_not(p);
        left = binary(p, OPERATOR_AND, lo, left, height, right);
    }
    return left;
}

// or = and { "or" and } .
static NodeId parse_or(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId left = parse_and(p);
    while (left && at_operator_word(p, KEYWORD_OR)) {
        unsigned height = p->height;
        parser_advance(p);
        NodeId right = parse_and(p);
        left = binary(p, OPERATOR_OR, lo, left, height, right);
    }
    return left;
}

// prod = unary { ( "*" | "/" | "%" ) unary } .
static NodeId parse_prod(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId left = parse_unary(p);
    while (left) {
        Operator op = parser_at(p, TOKEN_STAR)      ? OPERATOR_MUL
                      : parser_at(p, TOKEN_SLASH)   ? OPERATOR_DIV
                      : parser_at(p, TOKEN_PERCENT) ? OPERATOR_MOD
                                                    : OPERATOR_COUNT;
        if (op == OPERATOR_COUNT) {
            break;
        }
        unsigned height = p->height;
        parser_advance(p);
        if (op == OPERATOR_MUL && parser_at(p, TOKEN_STAR) && p->token.lo == p->last_hi) {
            parser_error(p, (Span){p->last_lo, p->token.hi}, "write a^b", "'**' is not known");
            return 0;
        }
        NodeId right = parse_unary(p);
        left = binary(p, op, lo, left, height, right);
    }
    return left;
}

// sum = prod { ( "+" | "-" ) prod } .
static NodeId parse_sum(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId left = parse_prod(p);
    while (left && (parser_at(p, TOKEN_PLUS) || parser_at(p, TOKEN_MINUS))) {
        Operator op = parser_at(p, TOKEN_PLUS) ? OPERATOR_ADD : OPERATOR_SUB;
        if (op == OPERATOR_SUB && refuse_at_line_start(p)) {
            return 0;
        }
        unsigned height = p->height;
        parser_advance(p);
        NodeId right = parse_prod(p);
        left = binary(p, op, lo, left, height, right);
    }
    return left;
}

// "[" expr "]"
NodeId parse_index(Parser *p) {
    uint32_t opened = p->token.lo;
    if (!parser_enter(p)) {
        return 0;
    }
    p->n_brackets++;
    parser_advance(p);
    NodeId index = parse_expr(p);
    index = index && parser_expect(p, TOKEN_RBRACKET, opened) ? index : 0;
    p->n_brackets--;
    parser_leave(p);
    return index;
}

// args = "(" [ [ WORD "=" ] expr { "," [ WORD "=" ] expr } [ "," ] ] ")" .
ExtraId parse_args(Parser *p) {
    uint32_t opened = p->token.lo;
    size_t base = p->n_stack;
    unsigned height = 0;
    if (!parser_enter(p)) {
        return 0;
    }
    p->n_brackets++;
    parser_advance(p);
    parser_push(p, 0);
    while (!parser_at(p, TOKEN_RPAREN)) {
        bool is_named = parser_at(p, TOKEN_NAME) && p->next.kind == TOKEN_ASSIGN;
        parser_push(p, is_named ? p->token.symbol : 0);
        parser_push(p, is_named ? p->token.lo : 0);
        if (is_named) {
            parser_advance(p);
            parser_advance(p);
        }
        NodeId value = parse_expr(p);
        parser_push(p, value);
        p->stack[base]++;
        height = p->height > height ? p->height : height;
        if (!value || !parser_accept(p, TOKEN_COMMA)) {
            break;
        }
    }
    parser_expect(p, TOKEN_RPAREN, opened);
    p->n_brackets--;
    parser_leave(p);
    p->height = height;
    return parser_pop_to_extra(p, base);
}

// { "." WORD | "[" expr "]" | args }
static NodeId parse_suffix(Parser *p, uint32_t lo, NodeId object) {
    unsigned height = p->height;
    uint32_t b = 0;
    NodeKind kind = NODE_CALL;
    if (parser_at(p, TOKEN_DOT)) {
        if (p->syntax->nodes[object].kind == NODE_NUMBER) {
            parser_error(p, (Span){lo, p->token.hi}, "write a 0 behind the point: 1.0",
                         "digits are missing after the decimal point");
            return 0;
        }
        parser_advance(p);
        if (!parser_at(p, TOKEN_NAME)) {
            parser_error_expected(p, "a name", NULL);
            return 0;
        }
        kind = NODE_MEMBER;
        b = p->token.symbol;
        parser_advance(p);
        p->height = 0;
    } else if (refuse_at_line_start(p)) {
        return 0;
    } else if (parser_at(p, TOKEN_LBRACKET)) {
        kind = NODE_INDEX;
        b = parse_index(p);
    } else {
        b = parse_args(p);
    }
    if (p->is_lost || !grow(p, height, p->height, lo)) {
        return 0;
    }
    return parser_node(p, kind, 0, lo, object, b);
}

static NodeId parse_prim(Parser *p);

// post = prim { "." WORD | "[" expr "]" | args } .
static NodeId parse_post(Parser *p) {
    uint32_t lo = p->token.lo;
    NodeId object = parse_prim(p);
    while (object && (parser_at(p, TOKEN_DOT) || parser_at(p, TOKEN_LBRACKET) ||
                      parser_at(p, TOKEN_LPAREN))) {
        object = parse_suffix(p, lo, object);
    }
    return object;
}

// unary = "-" unary | post [ "^" unary ] .
static NodeId parse_unary(Parser *p) {
    uint32_t lo = p->token.lo;
    if (parser_accept(p, TOKEN_MINUS)) {
        if (!parser_enter(p)) {
            return 0;
        }
        NodeId operand = parse_unary(p);
        parser_leave(p);
        return operand && grow(p, p->height, 0, lo)
                   ? parser_node(p, NODE_UNARY, OPERATOR_NEG, lo, operand, 0)
                   : 0;
    }
    NodeId left = parse_post(p);
    if (!left || !parser_at(p, TOKEN_CARET)) {
        return left;
    }
    unsigned height = p->height;
    parser_advance(p);
    if (!parser_enter(p)) {
        return 0;
    }
    NodeId right = parse_unary(p);
    parser_leave(p);
    return binary(p, OPERATOR_POW, lo, left, height, right);
}

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
    if (kind != TOKEN_GT && (comparison(kind) != OPERATOR_COUNT || kind == TOKEN_QUESTION)) {
        parser_error(p, parser_span(p->token), "put brackets round it: <1, (a < b), 2>",
                     "expected ',' or '>' in a vector, found '%s'", lex_token_text(kind));
    }
    parser_expect(p, TOKEN_GT, lo);
    p->n_brackets--;
    p->vector_end = p->last_hi;
    p->height = height;
    ExtraId extra = parser_pop_to_extra(p, base);
    return !p->is_lost && grow(p, height, 0, lo) ? parser_node(p, NODE_VECTOR, 0, lo, extra, n) : 0;
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
    if (!body || !parser_expect(p, TOKEN_RBRACKET, lo) || !grow(p, height, p->height, lo)) {
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
        if (is_closed && grow(p, height, 0, lo)) {
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
    if (value && (kind == TOKEN_QUESTION || comparison(kind) != OPERATOR_COUNT)) {
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
    ExtraId extra = parser_pop_to_extra(p, base);
    return !p->is_lost && grow(p, height, 0, lo) ? parser_node(p, NODE_KEYS, 0, lo, extra, 0) : 0;
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
static NodeId parse_prim(Parser *p) {
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
