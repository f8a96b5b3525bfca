// SPDX-License-Identifier: Apache-2.0
// The extents of nodes. A node keeps only where it begins; where it ends is found by lexing again
// behind the end of its last part, which costs as many steps as the last parts are deep.
#include "lang/syntax.h"

#include <string.h>

#include "lang/lex.h"

// The first token at or behind an offset.
static Token token_at(const Syntax *syntax, uint32_t offset) {
    Lexer lexer = lex_at(syntax->file, offset);
    return lex_next(&lexer);
}

// Behind the n-th token from an offset on.
static uint32_t behind(const Syntax *syntax, uint32_t offset, unsigned n) {
    Lexer lexer = lex_at(syntax->file, offset);
    uint32_t end = offset;
    while (n--) {
        end = lex_next(&lexer).hi;
    }
    return end;
}

// Behind the bracket that closes; a comma may stand before it, and after errors anything that
// the parser has skipped.
static uint32_t behind_closing(const Syntax *syntax, uint32_t offset, TokenKind closing) {
    Lexer lexer = lex_at(syntax->file, offset);
    unsigned depth = 0;
    for (;;) {
        Token token = lex_next(&lexer);
        if (token.kind == TOKEN_END || (!depth && token.kind == closing)) {
            return token.hi;
        }
        // `<1, 2>==v` is lexed as `>=` and `=`.
        if (!depth && closing == TOKEN_GT && token.kind == TOKEN_GE) {
            return token.lo + 1;
        }
        depth += token.kind == TOKEN_LBRACE;
        depth -= token.kind == TOKEN_RBRACE && depth;
    }
}

static uint32_t end_of(const Syntax *syntax, NodeId id);

// Behind a part and the brackets around it.
static uint32_t outer_end(const Syntax *syntax, NodeId id) {
    return behind(syntax, end_of(syntax, id), syntax->nodes[id].parens);
}

static uint32_t end_of_args(const Syntax *syntax, uint32_t callee_end, ExtraId args) {
    const uint32_t *words = &syntax->extra[args];
    uint32_t end =
        words[0] ? outer_end(syntax, words[3 * words[0]]) : behind(syntax, callee_end, 1);
    return behind_closing(syntax, end, TOKEN_RPAREN);
}

static uint32_t end_of_keys(const Syntax *syntax, const Node *node) {
    const uint32_t *words = &syntax->extra[node->a];
    words += 1 + words[0];
    const uint32_t *last = words + 1 + 3 * (words[0] - 1);
    return behind_closing(syntax, outer_end(syntax, last[2] ? last[2] : last[1]), TOKEN_RBRACE);
}

static uint32_t end_of_params(const Syntax *syntax, const Node *node) {
    uint32_t end = node->lo + 1;
    if (node->b) {
        const uint32_t *last = &syntax->extra[node->a + 3 * (node->b - 1)];
        end = last[2] ? outer_end(syntax, last[2]) : behind(syntax, last[1], 1);
    }
    return behind_closing(syntax, end, TOKEN_RPAREN);
}

static uint32_t end_of_block(const Syntax *syntax, NodeId id, const Node *node) {
    if (id == syntax->root) {
        return syntax->file->base + syntax->file->size;
    }
    uint32_t end = node->b ? outer_end(syntax, syntax->extra[node->a + node->b - 1]) : node->lo + 1;
    return behind_closing(syntax, end, TOKEN_RBRACE);
}

// Of the elements of a vector, list, print or transform; closing: TOKEN_END, if there is none.
static uint32_t end_of_elements(const Syntax *syntax, const Node *node, TokenKind closing) {
    uint32_t end = node->b ? outer_end(syntax, syntax->extra[node->a + node->b - 1]) : node->lo + 1;
    return closing == TOKEN_END ? end : behind_closing(syntax, end, closing);
}

static uint32_t end_of(const Syntax *syntax, NodeId id) {
    const Node *node = &syntax->nodes[id];
    const uint32_t *extra = syntax->extra;
    switch ((NodeKind)node->kind) {
    case NODE_NUMBER:
    case NODE_STRING:
    case NODE_NAME:
        return behind(syntax, node->lo, 1);
    case NODE_VECTOR:
        return end_of_elements(syntax, node, TOKEN_GT);
    case NODE_LIST:
        return end_of_elements(syntax, node, TOKEN_RBRACKET);
    case NODE_PRINT:
    case NODE_TRANSFORM:
        return end_of_elements(syntax, node, TOKEN_END);
    case NODE_COMPREHENSION:
        return behind_closing(syntax, outer_end(syntax, extra[node->a + 4]), TOKEN_RBRACKET);
    case NODE_KEYS:
        return end_of_keys(syntax, node);
    case NODE_MODE:
        return node->b ? end_of_args(syntax, behind(syntax, node->lo, 1), node->b)
                       : behind(syntax, node->lo, 1);
    case NODE_CALL:
        return end_of_args(syntax, outer_end(syntax, node->a), node->b);
    case NODE_MEMBER:
        return behind(syntax, outer_end(syntax, node->a), 2);
    case NODE_INDEX:
        return behind_closing(syntax, outer_end(syntax, node->b), TOKEN_RBRACKET);
    case NODE_UNARY:
        return outer_end(syntax, node->a);
    case NODE_COND:
        return outer_end(syntax, extra[node->b + 1]);
    case NODE_RANGE:
        return outer_end(syntax, extra[node->b + 1] ? extra[node->b + 1] : extra[node->b]);
    case NODE_BINARY:
    case NODE_LET:
    case NODE_PARAM:
    case NODE_CLIP:
    case NODE_RATE:
    case NODE_PROPERTY:
    case NODE_WHEN:
        return outer_end(syntax, node->b);
    case NODE_FN:
    case NODE_DEF:
    case NODE_FOR:
        return outer_end(syntax, extra[node->b + 1]);
    case NODE_IF:
        return outer_end(syntax, extra[node->b + 1] ? extra[node->b + 1] : extra[node->b]);
    case NODE_INCLUDE:
        return behind(syntax, outer_end(syntax, node->a), node->b ? 2 : 0);
    case NODE_ASSERT:
        return outer_end(syntax, node->b ? node->b : node->a);
    case NODE_SIM:
    case NODE_JOINT:
        return outer_end(syntax, extra[node->a + 4]);
    case NODE_OBJECT:
        return outer_end(syntax, extra[node->a + 6]);
    case NODE_BLOCK:
        return end_of_block(syntax, id, node);
    case NODE_PARAMS:
        return end_of_params(syntax, node);
    case NODE_NONE:
    case NODE_RUN:
        break;
    }
    return node->lo;
}

Span syntax_span(const Syntax *syntax, NodeId id) {
    if (!id) {
        return (Span){0};
    }
    return (Span){syntax->nodes[id].lo, end_of(syntax, id)};
}

Span syntax_word_span(const Syntax *syntax, uint32_t offset) {
    Token token = token_at(syntax, offset);
    return (Span){token.lo, token.hi};
}

Span syntax_name_span(const Syntax *syntax, NodeId id) {
    const Node *node = &syntax->nodes[id];
    switch ((NodeKind)node->kind) {
    case NODE_OBJECT:
        return syntax_span(syntax, syntax->extra[node->a + 1]);
    case NODE_RATE:
    case NODE_PROPERTY:
        return syntax_word_span(syntax, node->lo);
    case NODE_LET:
    case NODE_PARAM:
    case NODE_FN:
    case NODE_DEF:
    case NODE_FOR:
    case NODE_CLIP:
        return syntax_word_span(syntax, behind(syntax, node->lo, 1));
    case NODE_SIM:
    case NODE_JOINT:
        return syntax_word_span(syntax, syntax->extra[node->a + 3]);
    default:
        return syntax_span(syntax, id);
    }
}

double syntax_number(const Node *node) {
    uint64_t bits = (uint64_t)node->b << 32 | node->a;
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}
