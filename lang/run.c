// SPDX-License-Identifier: Apache-2.0
// Runs: the pattern that a statement's text is, and the comparison of the text behind it.
//
// The patterns of a group are a tree: a piece of text, the number behind it, then the pieces that
// may follow. A statement is compared along one path of it, so that its numbers are read once
// however many patterns there are.
#include "lang/run.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_MISSED = 64, // statements that no pattern fits, before one in eight of all is too many
    LEAST_ALIKE = 4,  // statements of a pattern, in the mean, that make groups worth while
    FIRST_ROWS = 64,  // of a pattern's first block; later ones are larger
    MOST_ROWS = 8192,
    MOST_DIGITS = 9, // of the number that a label ends with
};

typedef struct Pattern Pattern;
typedef struct Piece Piece;

// The text before a number, and the number; or the text behind the last one.
struct Piece {
    const char *text;
    uint32_t size; // blanks before the number left out; any number of them may stand there
    uint8_t unit;
    bool needs_blank; // the text ends with a letter
    bool may_sign;    // a '-' before the number is its sign
    bool is_label;    // the number is what the statement's label ends with
    Pattern *pattern; // it is the last
    Piece *next;      // stands in its place in other patterns
    Piece *behind;    // the first of those that may follow
};

// Rows of numbers, as they were read. Blocks are given back as they are copied into columns.
typedef struct Block {
    struct Block *next;
    uint32_t n, capacity;
    uint32_t *at;     // [capacity]
    double numbers[]; // [capacity][n_slots]
} Block;

struct Pattern {
    NodeId first, node_lo, node_hi;
    NodeId node[RUN_MAX_SLOTS];
    double row[RUN_MAX_SLOTS]; // of the first statement, without signs
    uint64_t negated;          // bit k: number k has a sign in the first statement: the tree a NEG
    uint64_t varying;          // bit k: number k is not the same everywhere
    uint32_t n_slots, n;
    uint8_t kind; // its index
    Block *blocks, *last;
};

struct RunPatterns {
    Arena arena;
    Pattern *patterns[RUN_MAX_PATTERNS];
    uint32_t n_patterns;
    Piece *pieces; // those that patterns begin with
    uint8_t *kinds;
    NodeId *singles;
    size_t n, n_singles, kinds_capacity, singles_capacity;
    size_t n_missed;
    NodeId node; // NODE_RUN
};

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

// -2^2 is not (-2)^2.
static bool may_sign(const Token *tokens, size_t n, size_t k) {
    if (k < 2 || k + 1 >= n || tokens[k + 1].kind == TOKEN_CARET) {
        return false;
    }
    bool has_sign = tokens[k - 1].kind == TOKEN_MINUS;
    return is_opening(tokens[has_sign ? k - 2 : k - 1].kind);
}

static Piece number_piece(const Parser *p, uint32_t from, const Token *tokens, size_t k,
                          bool may_sign) {
    bool is_negated = may_sign && tokens[k - 1].kind == TOKEN_MINUS;
    const char *text = parser_text(p, from);
    const char *end = parser_text(p, tokens[is_negated ? k - 1 : k].lo);
    while (end > text && is_blank(end[-1])) {
        end--;
    }
    return (Piece){.text = text,
                   .size = (uint32_t)(end - text),
                   .unit = tokens[k].unit,
                   .needs_blank = end > text && is_letter(end[-1]),
                   .may_sign = may_sign};
}

// The piece in the tree at *place; it is put there where it is new.
static Piece *find_piece(RunPatterns *r, Piece **place, const Piece *piece) {
    for (; *place; place = &(*place)->next) {
        const Piece *old = *place;
        if (old->size == piece->size && memcmp(old->text, piece->text, piece->size) == 0 &&
            old->unit == piece->unit && old->may_sign == piece->may_sign &&
            old->is_label == piece->is_label && !old->pattern == !piece->pattern) {
            return *place;
        }
    }
    *place = ARENA_NEW(&r->arena, Piece);
    **place = *piece;
    return *place;
}

// The digits that a label ends with and that print as the number that they are; 0: there are none.
static uint32_t label_digits(const char *end, uint32_t size) {
    uint32_t n = 0;
    while (n < size && is_digit(end[-1 - (int)n])) {
        n++;
    }
    return n <= MOST_DIGITS && (n == 1 || end[-(int)n] != '0') ? n : 0;
}

// Where the label of a NODE_OBJECT is; 0: it has none.
static uint32_t label_offset(const Syntax *syntax, NodeId statement) {
    const uint32_t *extra = syntax->extra + syntax->nodes[statement].a;
    return extra[3] ? extra[4] : 0;
}

static Piece label_piece(const Parser *p, uint32_t from, Token token, uint32_t n_digits) {
    return (Piece){
        .text = parser_text(p, from), .size = token.hi - n_digits - from, .is_label = true};
}

// NULL: the statement is no pattern.
static Pattern *make_pattern(RunPatterns *r, const Parser *p, NodeId statement, NodeId node_lo,
                             uint32_t lo, uint32_t hi) {
    Token tokens[RUN_MAX_TOKENS];
    size_t n = read_tokens(p, lo, hi, tokens);
    uint32_t from = lo;
    NodeId node = node_lo;
    Pattern *pattern = ARENA_NEW(&r->arena, Pattern);
    Piece **place = &r->pieces;
    uint32_t label = label_offset(p->syntax, statement);
    for (size_t k = 0; k < n; k++) {
        uint32_t size = tokens[k].hi - tokens[k].lo;
        uint32_t n_digits =
            label && tokens[k].lo == label ? label_digits(parser_text(p, tokens[k].hi), size) : 0;
        if (n_digits && pattern->n_slots < RUN_MAX_SLOTS) {
            Piece piece = label_piece(p, from, tokens[k], n_digits);
            place = &find_piece(r, place, &piece)->behind;
            pattern->node[pattern->n_slots] = statement;
            pattern->row[pattern->n_slots++] =
                strtod(parser_text(p, tokens[k].hi - n_digits), NULL);
            from = tokens[k].hi;
            continue;
        }
        if (tokens[k].kind != TOKEN_NUMBER) {
            continue;
        }
        uint32_t slot = pattern->n_slots++;
        if (slot == RUN_MAX_SLOTS || !(node = find_number(p->syntax, &node, tokens[k].lo))) {
            return NULL;
        }
        Piece piece = number_piece(p, from, tokens, k, may_sign(tokens, n, k));
        bool is_negated = piece.may_sign && tokens[k - 1].kind == TOKEN_MINUS;
        place = &find_piece(r, place, &piece)->behind;
        pattern->node[slot] = node;
        pattern->negated |= (uint64_t)is_negated << slot;
        pattern->row[slot] = tokens[k].number;
        from = tokens[k].hi;
    }
    Piece tail = {.text = parser_text(p, from), .size = hi - from, .pattern = pattern};
    return n > 0 && find_piece(r, place, &tail)->pattern == pattern ? pattern : NULL;
}

// ---- Comparison

// The digits at the end of a name.
static bool match_label(Lexer *lexer, double *x) {
    const char *at = lexer->at;
    for (*x = 0; is_digit(*at) && at - lexer->at <= MOST_DIGITS; at++) {
        *x = 10 * *x + (*at - '0');
    }
    ptrdiff_t n = at - lexer->at;
    if (n == 0 || n > MOST_DIGITS || (n > 1 && *lexer->at == '0') || is_letter(*at)) {
        return false;
    }
    lexer->at = at;
    return true;
}

// The number at lexer->at, behind blanks and its sign.
static bool match_number(const Piece *piece, Lexer *lexer, double *x) {
    const char *at = lexer->at;
    if (piece->is_label) {
        return match_label(lexer, x);
    }
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
    if (lex_plain_number(lexer, x)) {
        *x = is_negated ? -*x : *x;
        return piece->unit == UNIT_NONE;
    }
    Token token = lex_next(lexer);
    *x = is_negated ? -token.number : token.number;
    return token.kind == TOKEN_NUMBER && !token.problem && token.unit == piece->unit;
}

// Takes a statement of one of the patterns; row[] gets its numbers. NULL: it is another.
static Pattern *match(const Piece *piece, Lexer *lexer, double *row) {
    const char *text = lexer->at;
    size_t left = (size_t)(lexer->end - text);
    for (; piece; piece = piece->next) {
        if (left < piece->size || memcmp(text, piece->text, piece->size) != 0) {
            continue;
        }
        lexer->at = text + piece->size;
        Pattern *pattern = piece->pattern;
        if (!pattern && match_number(piece, lexer, row)) {
            pattern = match(piece->behind, lexer, row + 1);
        }
        if (pattern) {
            return pattern;
        }
    }
    lexer->at = text;
    return NULL;
}

// ---- Rows

// NULL: no memory.
static Block *room_for_row(Pattern *pattern) {
    Block *last = pattern->last;
    if (last && last->n < last->capacity) {
        return last;
    }
    uint32_t capacity = !last                         ? FIRST_ROWS
                        : last->capacity >= MOST_ROWS ? MOST_ROWS
                                                      : 4 * last->capacity;
    size_t numbers = (size_t)capacity * pattern->n_slots * sizeof(double);
    Block *block = malloc(sizeof *block + numbers + capacity * sizeof *block->at);
    if (block) {
        *block = (Block){.capacity = capacity};
        block->at = (uint32_t *)((char *)block->numbers + numbers);
        *(last ? &last->next : &pattern->blocks) = block;
        pattern->last = block;
    }
    return block;
}

// row: as the first statement's tree wants the numbers: its own signs left out.
static bool add_row(Pattern *pattern, uint32_t at, const double *row) {
    Block *block = room_for_row(pattern);
    if (!block) {
        return false;
    }
    double *numbers = block->numbers + (size_t)block->n * pattern->n_slots;
    for (uint32_t k = 0; k < pattern->n_slots; k++) {
        numbers[k] = row[k];
        bool is_same = memcmp(&numbers[k], &pattern->row[k], sizeof(double)) == 0;
        pattern->varying |= (uint64_t)!is_same << k;
    }
    block->at[block->n++] = at;
    pattern->n++;
    return true;
}

static void add_member(RunPatterns *r, uint8_t kind) {
    r->kinds = arena_grow(&r->arena, r->kinds, r->n, &r->kinds_capacity, 1);
    r->kinds[r->n++] = kind;
}

// The offset of the next token, comments skipped.
static uint32_t next_offset(const Lexer *lexer) {
    Lexer ahead = *lexer;
    while (is_blank(*ahead.at) || *ahead.at == '\n') {
        ahead.at++;
    }
    if (!is_letter(*ahead.at)) {
        return lex_next(&ahead).lo;
    }
    return lexer->file->base + (uint32_t)(ahead.at - lexer->file->text);
}

bool run_take(RunGather *gather, Parser *p) {
    RunPatterns *r = gather->patterns;
    if (!r || !parser_at(p, TOKEN_NAME)) {
        return false;
    }
    const SourceFile *file = p->syntax->file;
    uint32_t offset = p->token.lo, end = 0;
    for (;;) {
        double row[RUN_MAX_SLOTS];
        Lexer lexer = lex_at(file, offset);
        Pattern *pattern = match(r->pieces, &lexer, row);
        for (uint32_t k = 0; pattern && k < pattern->n_slots; k++) {
            row[k] = pattern->negated >> k & 1 ? -row[k] : row[k];
        }
        if (!pattern || !add_row(pattern, offset, row)) {
            break;
        }
        add_member(r, pattern->kind);
        end = file->base + (uint32_t)(lexer.at - file->text);
        offset = next_offset(&lexer);
    }
    if (end) {
        parser_seek(p, end);
    }
    return end != 0;
}

// ---- Groups

// A run within is evaluated by other means than numbers.
static bool has_run(const Syntax *syntax, NodeId node_lo, NodeId node_hi) {
    for (NodeId i = node_lo; i < node_hi; i++) {
        if (syntax->nodes[i].kind == NODE_RUN) {
            return true;
        }
    }
    return false;
}

static void add_single(RunPatterns *r, NodeId statement) {
    r->singles =
        arena_grow(&r->arena, r->singles, r->n_singles, &r->singles_capacity, sizeof *r->singles);
    r->singles[r->n_singles++] = statement;
    add_member(r, RUN_SINGLE);
}

// The statement is the last of its nodes.
static void add_object(RunPatterns *r, const Parser *p, NodeId statement, NodeId node_lo,
                       uint32_t lo) {
    Pattern *pattern = NULL;
    if (r->n_patterns == RUN_MAX_PATTERNS) {
        r->n_missed++;
    } else if (!has_run(p->syntax, node_lo, statement)) {
        pattern = make_pattern(r, p, statement, node_lo, lo, p->last_hi);
    }
    if (!pattern || !add_row(pattern, lo, pattern->row)) {
        add_single(r, statement);
        return;
    }
    pattern->first = statement;
    pattern->node_lo = node_lo;
    pattern->node_hi = statement + 1;
    pattern->kind = (uint8_t)r->n_patterns;
    r->patterns[r->n_patterns++] = pattern;
    add_member(r, pattern->kind);
}

static RunPatterns *begin_group(Parser *p, uint32_t lo) {
    Arena arena = {0};
    RunPatterns *r = ARENA_NEW(&arena, RunPatterns);
    r->arena = arena;
    r->node = parser_node(p, NODE_RUN, 0, lo, 0, 0);
    return r;
}

// What has no place in the order of objects may stand between them.
static bool is_unordered(NodeKind kind) {
    return kind == NODE_LET || kind == NODE_PARAM || kind == NODE_FN || kind == NODE_DEF ||
           kind == NODE_PROPERTY || kind == NODE_TRANSFORM;
}

NodeId run_add(RunGather *gather, Parser *p, NodeId statement, NodeId node_lo, uint32_t lo) {
    NodeKind kind = p->syntax->nodes[statement].kind;
    RunPatterns *r = gather->patterns;
    if (!p->lasting || gather->is_off || is_unordered(kind)) {
        return statement;
    }
    if (kind != NODE_OBJECT) {
        run_end(gather, p);
        return statement;
    }
    if (!r && gather->n_objects++ < RUN_MIN) {
        return statement;
    }
    bool is_first = !r;
    if (is_first) {
        r = gather->patterns = begin_group(p, lo);
    }
    add_object(r, p, statement, node_lo, lo);
    NodeId node = is_first ? r->node : 0;
    if (r->n_missed > MOST_MISSED + r->n / 8) {
        gather->is_off = r->n < LEAST_ALIKE * RUN_MAX_PATTERNS;
        run_end(gather, p);
        gather->n_objects = RUN_MIN; // the next group begins at once
    }
    return node;
}

static Run finish_run(Parser *p, Pattern *pattern) {
    uint32_t *at = ARENA_ARRAY(p->arena, pattern->n, uint32_t), which[RUN_MAX_SLOTS], n_slots = 0;
    double *columns[RUN_MAX_SLOTS];
    for (uint32_t k = 0; k < pattern->n_slots; k++) {
        if (pattern->varying >> k & 1) {
            columns[n_slots] = ARENA_ARRAY(p->lasting, pattern->n, double);
            which[n_slots++] = k;
        }
    }
    size_t row = 0;
    for (Block *block = pattern->blocks, *next; block; block = next) {
        next = block->next;
        memcpy(at + row, block->at, block->n * sizeof *at);
        for (uint32_t i = 0; i < block->n; i++, row++) {
            const double *numbers = block->numbers + (size_t)i * pattern->n_slots;
            for (uint32_t s = 0; s < n_slots; s++) {
                columns[s][row] = numbers[which[s]];
            }
        }
        free(block);
    }
    RunSlot *slots = ARENA_ARRAY(p->arena, n_slots, RunSlot);
    for (uint32_t s = 0; s < n_slots; s++) {
        uint32_t to = s; // the label's node is the last, though it is written before others
        for (; to > 0 && slots[to - 1].node > pattern->node[which[s]]; to--) {
            slots[to] = slots[to - 1];
        }
        slots[to] = (RunSlot){pattern->node[which[s]], columns[s]};
    }
    return (Run){pattern->first, pattern->node_lo, pattern->node_hi, pattern->n, n_slots, at,
                 slots};
}

void run_end(RunGather *gather, Parser *p) {
    RunPatterns *r = gather->patterns;
    Syntax *syntax = p->syntax;
    gather->n_objects = 0;
    if (!r) {
        return;
    }
    gather->patterns = NULL;
    syntax->runs = arena_grow(p->arena, syntax->runs, syntax->n_runs, &syntax->runs_capacity,
                              sizeof *syntax->runs);
    Run *runs = ARENA_ARRAY(p->arena, r->n_patterns, Run);
    for (uint32_t k = 0; k < r->n_patterns; k++) {
        runs[k] = finish_run(p, r->patterns[k]);
    }
    bool is_mixed = r->n_patterns > 1 || r->n_singles > 0; // all may be singles
    uint8_t *kinds = is_mixed ? ARENA_ARRAY(p->arena, r->n, uint8_t) : NULL;
    NodeId *singles = ARENA_ARRAY(p->arena, r->n_singles, NodeId);
    if (is_mixed) {
        memcpy(kinds, r->kinds, r->n);
    }
    if (r->n_singles) {
        memcpy(singles, r->singles, r->n_singles * sizeof *singles);
    }
    syntax->nodes[r->node].a = (uint32_t)syntax->n_runs;
    syntax->runs[syntax->n_runs++] =
        (RunGroup){runs, kinds, singles, (uint32_t)r->n, r->n_patterns, (uint32_t)r->n_singles};
    Arena arena = r->arena;
    arena_free(&arena);
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
