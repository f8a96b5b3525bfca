// SPDX-License-Identifier: Apache-2.0
// Runs: the pattern that a statement's text is, and the comparison of the text behind it.
#include "lang/run.h"

#include <stdlib.h>
#include <string.h>

// The text before a number, and the number.
typedef struct {
    const char *text;
    uint32_t size; // blanks before the number left out; any number of them may stand there
    NodeId node;
    uint8_t unit;
    bool needs_blank; // the text ends with a letter
    bool may_sign;    // a '-' before the number is its sign
    bool is_negated;  // it has one in the first statement: the tree has a NEG
} Piece;

typedef struct {
    Piece pieces[RUN_MAX_SLOTS];
    uint32_t n;
    const char *tail; // behind the last number
    uint32_t tail_size;
} Pattern;

typedef struct {
    double *numbers; // [n][pattern.n]
    uint32_t *at;
    size_t n, capacity;
} Rows;

static bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_';
}

// What stands before an operand, so that a '-' behind it is a sign.
static bool is_opening(TokenKind kind) {
    return kind == TOKEN_LT || kind == TOKEN_COMMA || kind == TOKEN_ASSIGN ||
           kind == TOKEN_LPAREN || kind == TOKEN_LBRACKET || kind == TOKEN_COLON;
}

// ---- The pattern

static size_t read_tokens(const Parser *p, uint32_t lo, uint32_t hi, Token *tokens) {
    Lexer lexer = lex_at(p->syntax->file, lo);
    size_t n = 0;
    while (n < RUN_MAX_TOKENS) {
        tokens[n] = lex_next(&lexer);
        if (tokens[n].lo >= hi || tokens[n].kind == TOKEN_END) {
            return n;
        }
        n++;
    }
    return 0;
}

// The number's node in the tree from *node on; 0: there is none.
static NodeId find_number(const Syntax *syntax, NodeId *node, uint32_t lo) {
    for (; *node < syntax->n_nodes; ++*node) {
        const Node *n = &syntax->nodes[*node];
        if (n->kind == NODE_NUMBER && n->lo == lo) {
            return *node;
        }
    }
    return 0;
}

static void add_piece(const Parser *p, Pattern *pattern, uint32_t from, const Token *tokens,
                      size_t k, bool may_sign) {
    Piece *piece = &pattern->pieces[pattern->n++];
    bool is_negated = may_sign && tokens[k - 1].kind == TOKEN_MINUS;
    const char *text = parser_text(p, from);
    const char *end = parser_text(p, tokens[is_negated ? k - 1 : k].lo);
    while (end > text && is_blank(end[-1])) {
        end--;
    }
    piece->text = text;
    piece->size = (uint32_t)(end - text);
    piece->unit = tokens[k].unit;
    piece->needs_blank = end > text && is_letter(end[-1]);
    piece->may_sign = may_sign;
    piece->is_negated = is_negated;
}

// -2^2 is not (-2)^2.
static bool may_sign(const Token *tokens, size_t n, size_t k) {
    if (k < 2 || k + 1 >= n || tokens[k + 1].kind == TOKEN_CARET) {
        return false;
    }
    bool has_sign = tokens[k - 1].kind == TOKEN_MINUS;
    return is_opening(tokens[has_sign ? k - 2 : k - 1].kind);
}

// False: the statement is no pattern.
static bool make_pattern(const Parser *p, NodeId node, uint32_t lo, uint32_t hi, Pattern *pattern) {
    Token tokens[RUN_MAX_TOKENS];
    size_t n = read_tokens(p, lo, hi, tokens);
    uint32_t from = lo;
    pattern->n = 0;
    for (size_t k = 0; k < n; k++) {
        if (tokens[k].kind != TOKEN_NUMBER) {
            continue;
        }
        NodeId number = find_number(p->syntax, &node, tokens[k].lo);
        if (!number || pattern->n == RUN_MAX_SLOTS) {
            return false;
        }
        add_piece(p, pattern, from, tokens, k, may_sign(tokens, n, k));
        pattern->pieces[pattern->n - 1].node = number;
        from = tokens[k].hi;
    }
    pattern->tail = parser_text(p, from);
    pattern->tail_size = hi - from;
    return n > 0;
}

// ---- Comparison

// The number at *at, behind blanks and its sign.
static bool match_number(const Piece *piece, Lexer *lexer, double *x) {
    const char *at = lexer->at;
    while (is_blank(*at)) {
        at++;
    }
    if (piece->needs_blank && at == lexer->at) {
        return false;
    }
    bool is_negated = piece->may_sign && *at == '-';
    if (is_negated) {
        at++;
        while (is_blank(*at)) {
            at++;
        }
    }
    if (!is_digit(*at) && !(*at == '.' && is_digit(at[1]))) {
        return false;
    }
    lexer->at = at;
    Token token = lex_next(lexer);
    *x = is_negated != piece->is_negated ? -token.number : token.number;
    return token.kind == TOKEN_NUMBER && !token.problem && token.unit == piece->unit;
}

static bool match_text(Lexer *lexer, const char *text, size_t size) {
    if ((size_t)(lexer->end - lexer->at) < size || memcmp(lexer->at, text, size) != 0) {
        return false;
    }
    lexer->at += size;
    return true;
}

// Takes a statement of the pattern; row[pattern->n] gets its numbers. False: it is another.
static bool match(const Pattern *pattern, Lexer *lexer, double *row) {
    for (uint32_t k = 0; k < pattern->n; k++) {
        const Piece *piece = &pattern->pieces[k];
        if (!match_text(lexer, piece->text, piece->size) || !match_number(piece, lexer, &row[k])) {
            return false;
        }
    }
    return match_text(lexer, pattern->tail, pattern->tail_size);
}

// ---- Rows

// False: no memory. A large block is moved by the system without being copied.
static bool reserve_row(Rows *rows, uint32_t n_slots) {
    if (rows->n < rows->capacity) {
        return true;
    }
    size_t larger = rows->capacity ? 2 * rows->capacity : RUN_MIN;
    double *numbers = realloc(rows->numbers, larger * (n_slots + 1) * sizeof *numbers);
    rows->numbers = numbers ? numbers : rows->numbers;
    uint32_t *at = numbers ? realloc(rows->at, larger * sizeof *at) : NULL;
    rows->at = at ? at : rows->at;
    rows->capacity = at ? larger : rows->capacity;
    return at != NULL;
}

// The offset of the next token, comments skipped.
static uint32_t next_offset(const Lexer *lexer) {
    Lexer ahead = *lexer;
    return lex_next(&ahead).lo;
}

// Takes what is like the pattern from `offset` on; returns where the last one ends.
static uint32_t take_rows(Parser *p, const Pattern *pattern, uint32_t offset, Rows *rows) {
    const SourceFile *file = p->syntax->file;
    uint32_t end = p->last_hi;
    while (reserve_row(rows, pattern->n)) {
        Lexer lexer = lex_at(file, offset);
        if (!match(pattern, &lexer, &rows->numbers[rows->n * pattern->n])) {
            break;
        }
        rows->at[rows->n++] = offset;
        end = file->base + (uint32_t)(lexer.at - file->text);
        offset = next_offset(&lexer);
    }
    p->no_run_before = offset;
    return end;
}

static bool varies(const Rows *rows, uint32_t n_slots, uint32_t slot) {
    for (size_t i = 1; i < rows->n; i++) {
        if (memcmp(&rows->numbers[i * n_slots + slot], &rows->numbers[slot], sizeof(double))) {
            return true;
        }
    }
    return false;
}

static const RunSlot *make_columns(Parser *p, const Pattern *pattern, const Rows *rows,
                                   uint32_t *n_slots) {
    RunSlot *slots = ARENA_ARRAY(p->arena, pattern->n, RunSlot);
    *n_slots = 0;
    for (uint32_t k = 0; k < pattern->n; k++) {
        if (!varies(rows, pattern->n, k)) {
            continue;
        }
        double *values = ARENA_ARRAY(p->lasting, rows->n, double);
        for (size_t i = 0; i < rows->n; i++) {
            values[i] = rows->numbers[i * pattern->n + k];
        }
        slots[(*n_slots)++] = (RunSlot){pattern->pieces[k].node, values};
    }
    return slots;
}

static NodeId make_run(Parser *p, NodeId statement, NodeId node_lo, const Pattern *pattern,
                       const Rows *rows) {
    Syntax *syntax = p->syntax;
    syntax->runs = arena_grow(p->arena, syntax->runs, syntax->n_runs, &syntax->runs_capacity,
                              sizeof *syntax->runs);
    Run *run = &syntax->runs[syntax->n_runs];
    uint32_t *at = ARENA_ARRAY(p->arena, rows->n, uint32_t);
    memcpy(at, rows->at, rows->n * sizeof *at);
    *run = (Run){.first = statement, .node_lo = node_lo, .at = at, .n = (uint32_t)rows->n};
    run->node_hi = (NodeId)syntax->n_nodes;
    run->slots = make_columns(p, pattern, rows, &run->n_slots);
    return parser_node(p, NODE_RUN, 0, at[0], (uint32_t)syntax->n_runs++, 0);
}

NodeId run_gather(Parser *p, NodeId statement, NodeId node_lo, uint32_t lo) {
    Pattern pattern;
    Rows rows = {0};
    Lexer first = lex_at(p->syntax->file, lo);
    bool is_candidate = p->lasting && p->syntax->nodes[statement].kind == NODE_OBJECT &&
                        lo >= p->no_run_before && p->token.kind == TOKEN_NAME;
    if (!is_candidate || *first.at != *parser_text(p, p->token.lo)) {
        return statement;
    }
    // A run within is evaluated by other means than numbers.
    if (p->syntax->n_runs && p->syntax->runs[p->syntax->n_runs - 1].first >= node_lo) {
        return statement;
    }
    if (make_pattern(p, node_lo, lo, p->last_hi, &pattern) && reserve_row(&rows, pattern.n) &&
        match(&pattern, &first, rows.numbers)) {
        rows.at[rows.n++] = lo;
        uint32_t end = take_rows(p, &pattern, p->token.lo, &rows);
        if (rows.n >= RUN_MIN) {
            statement = make_run(p, statement, node_lo, &pattern, &rows);
            parser_seek(p, end);
        }
    }
    free(rows.numbers);
    free(rows.at);
    return statement;
}

const RunSlot *run_slot(const Run *run, NodeId node) {
    uint32_t lo = 0, hi = run->n_slots;
    while (lo < hi) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (run->slots[middle].node < node) {
            lo = middle + 1;
        } else {
            hi = middle;
        }
    }
    return lo < run->n_slots && run->slots[lo].node == node ? &run->slots[lo] : NULL;
}
