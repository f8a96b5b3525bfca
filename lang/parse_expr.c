// SPDX-License-Identifier: Apache-2.0
// Expressions, from ranges down to what follows a value. lang/parser.h says how to read this file.
#include "lang/parser.h"

#include <stdio.h>
#include <string.h>

static NodeId parse_cond(Parser *p);
static NodeId parse_unary(Parser *p);

bool parse_grow(Parser *p, unsigned left, unsigned right, uint32_t lo) {
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
    if (!right || !parse_grow(p, height, p->height, lo)) {
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
    if (p->is_lost) {
        return 0;
    }
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
        low = parse_grow(p, height, p->height, lo) ? parser_node(p, NODE_RANGE, 0, lo, low, extra)
                                                   : 0;
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
    if (!no || !parse_grow(p, height, p->height, lo)) {
        return 0;
    }
    return parser_node(p, NODE_COND, 0, lo, condition, extra);
}

Operator parse_comparison(TokenKind kind) {
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
    Operator op = parse_comparison(p->token.kind);
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
    if (right && parse_comparison(p->token.kind) != OPERATOR_COUNT) {
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
    if (!operand || !parse_grow(p, p->height, 0, lo)) {
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
NodeId parse_sum(Parser *p) {
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
    if (p->is_lost || !parse_grow(p, height, p->height, lo)) {
        return 0;
    }
    return parser_node(p, kind, 0, lo, object, b);
}

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
        return operand && parse_grow(p, p->height, 0, lo)
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
