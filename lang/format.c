// SPDX-License-Identifier: Apache-2.0
// The canonical layout: tokens go to lines one by one, comments come from the gaps between them.
#include "lang/format.h"

#include <string.h>

#include "lang/lex.h"

enum { INDENT = 2 };

// What a token is, where its kind alone does not say.
enum {
    ROLE_STATEMENT = 1, // begins one
    ROLE_WORD = 2,      // of a statement that goes on with an expression, as print
    ROLE_VECTOR = 4,    // '<' that opens one
    ROLE_SIGN = 8,      // '-' before its only operand
};

// A line, or a comment on a line of its own (then code is empty).
typedef struct {
    const char *code, *comment;
    uint32_t n_code, n_comment, indent;
    bool has_blank; // an empty line before
    bool is_ragged; // a comment over several lines stands in it: its columns are none
    // The '=' or '{' of what it begins with, if there is one: where neighbours have theirs in the
    // same column it stays in one.
    TokenKind mark;
    uint32_t mark_at, mark_from, pad; // columns: in the code, in the file; spaces put before it
    // It hangs from this column of the code of an earlier line: 1 more than its index, or 0.
    size_t hangs_on;
    uint32_t hangs_at;
} Line;

// An open bracket.
typedef struct {
    TokenKind kind;
    uint32_t token;        // its offset
    uint32_t outer, inner; // indents of the line that it stands on, and of those within
    uint32_t n_questions;  // '?' that wait for their ':'
    bool is_block;         // a statement stands in it
    bool is_followed;      // on its line: by a token in a column of the file, and of a line's code
    uint32_t from, at;
    size_t line;
} Open;

typedef struct {
    Arena *arena;
    const SourceFile *file;
    const uint8_t *roles; // by character
    Line *lines;
    size_t n_lines, lines_capacity;
    Line line; // being made: its code is text
    char *text;
    size_t n_text, text_capacity;
    size_t n_counted; // of the text, which has so many columns
    uint32_t code_column;
    const char *row_at; // in the file, and the column there
    uint32_t row_column;
    Open *open; // [0] is the file
    size_t n_open, open_capacity;
    Token last;
    uint8_t last_role;
    bool is_last_call;   // the last token can be called or indexed
    bool has_break;      // a line ended behind the last token
    size_t n_open_first; // open brackets where the line began
    bool has_blank;
} Formatter;

static const char *text_at(const Formatter *f, uint32_t offset) {
    return f->file->text + (offset - f->file->base);
}

static bool is_text(const Formatter *f, Token token, const char *text) {
    size_t n = strlen(text);
    return token.hi - token.lo == n && memcmp(text_at(f, token.lo), text, n) == 0;
}

static const uint8_t *find_roles(Arena *arena, const Syntax *syntax) {
    uint8_t *roles = ARENA_ARRAY(arena, syntax->file->size + 1, uint8_t);
    uint32_t base = syntax->file->base;
    for (NodeId id = 1; id < syntax->n_nodes; id++) {
        const Node *node = syntax_node(syntax, id);
        if (node->kind == NODE_VECTOR) {
            roles[node->lo - base] |= ROLE_VECTOR;
        } else if (node->kind == NODE_UNARY && node->aux == OPERATOR_NEG) {
            roles[node->lo - base] |= ROLE_SIGN;
        } else if (node->kind == NODE_BLOCK) {
            for (uint32_t i = 0; i < node->b; i++) {
                const Node *statement = syntax_node(syntax, syntax->extra[node->a + i]);
                bool is_word = statement->kind == NODE_PRINT || statement->kind == NODE_ASSERT ||
                               statement->kind == NODE_TRANSFORM || statement->kind == NODE_WHEN;
                roles[statement->lo - base] |= ROLE_STATEMENT | (is_word ? ROLE_WORD : 0);
            }
        }
    }
    return roles;
}

static void put(Formatter *f, const char *text, size_t n) {
    for (size_t i = 0; i < n; i++) {
        f->text = arena_grow(f->arena, f->text, f->n_text, &f->text_capacity, 1);
        f->text[f->n_text++] = text[i];
    }
}

static uint32_t columns(const char *text, uint32_t n) {
    uint32_t columns = 0;
    for (uint32_t i = 0; i < n; i++) {
        columns += ((unsigned char)text[i] & 0xc0) != 0x80;
    }
    return columns;
}

// In the file, of a token not before the last one that was asked for.
static uint32_t column_of(Formatter *f, Token token) {
    const char *to = text_at(f, token.lo);
    for (; f->row_at < to; f->row_at++) {
        bool is_first = ((unsigned char)*f->row_at & 0xc0) != 0x80;
        f->row_column = *f->row_at == '\n' ? 0 : f->row_column + is_first;
    }
    return f->row_column;
}

// Of the line being made.
static uint32_t code_columns(Formatter *f) {
    f->code_column += columns(f->text + f->n_counted, (uint32_t)(f->n_text - f->n_counted));
    f->n_counted = f->n_text;
    return f->code_column;
}

static void end_line(Formatter *f) {
    if (f->n_text || f->line.n_comment) {
        f->line.code = arena_string(f->arena, f->text ? f->text : "", f->n_text);
        f->line.n_code = (uint32_t)f->n_text;
        f->lines = arena_grow(f->arena, f->lines, f->n_lines, &f->lines_capacity, sizeof *f->lines);
        f->lines[f->n_lines++] = f->line;
    }
    f->line = (Line){0};
    f->n_text = f->n_counted = 0;
    f->code_column = 0;
}

static Open *top(const Formatter *f) {
    return &f->open[f->n_open - 1];
}

static void begin_line(Formatter *f, uint32_t indent) {
    end_line(f);
    f->line.indent = indent;
    f->line.has_blank = f->has_blank && f->n_lines;
    f->has_blank = f->has_break = false;
}

static uint32_t trimmed(const char *text, uint32_t n) {
    while (n && strchr(" \t\r", text[n - 1])) {
        n--;
    }
    return n;
}

// A comment behind the last token, of n characters.
static void put_comment(Formatter *f, const char *text, uint32_t n) {
    bool is_line = text[1] == '/';
    n = is_line ? trimmed(text, n) : n;
    if (f->has_break || (!f->n_text && !f->line.n_comment)) {
        begin_line(f, top(f)->inner);
    } else if (!is_line && f->n_text) {
        put(f, " ", 1);
    }
    if (is_line) {
        f->line.comment = text;
        f->line.n_comment = n;
    } else {
        f->line.is_ragged |= memchr(text, '\n', n) != NULL;
        put(f, text, n);
    }
}

// White space and comments up to the next token.
static void put_gap(Formatter *f, uint32_t lo, uint32_t hi) {
    const char *at = text_at(f, lo), *end = text_at(f, hi);
    unsigned n_breaks = 0;
    while (at < end) {
        if (at[0] == '/') {
            const char *from = at;
            if (at[1] == '/') {
                const char *stop = memchr(at, '\n', (size_t)(end - at));
                at = stop ? stop : end;
            } else {
                at = strstr(at + 2, "*/") + 2;
            }
            put_comment(f, from, (uint32_t)(at - from));
            n_breaks = 0;
            continue;
        }
        n_breaks += *at++ == '\n';
        f->has_break |= n_breaks > 0;
        f->has_blank |= n_breaks > 1;
    }
}

static uint32_t indent_of(const Formatter *f, Token token, uint8_t role) {
    const Open *open = top(f);
    if (!f->last.hi) {
        return 0; // the version of the language begins no statement
    }
    if (token.kind == TOKEN_RBRACE || token.kind == TOKEN_RPAREN || token.kind == TOKEN_RBRACKET ||
        (token.kind == TOKEN_GT && open->kind == TOKEN_LT)) {
        return open->outer;
    }
    bool goes_on = open->is_block && !(role & ROLE_STATEMENT) && token.kind != TOKEN_LBRACE &&
                   token.kind != TOKEN_SEMICOLON && !is_text(f, token, "else");
    return open->inner + (goes_on ? INDENT : 0);
}

static bool is_tight_behind(TokenKind kind, uint8_t role) {
    return kind == TOKEN_LPAREN || kind == TOKEN_LBRACKET || kind == TOKEN_DOT ||
           kind == TOKEN_RANGE || kind == TOKEN_CARET ||
           (kind == TOKEN_LT && (role & ROLE_VECTOR)) ||
           (kind == TOKEN_MINUS && (role & ROLE_SIGN));
}

// '*', '/', '%' stand as they stood: with a space on any side, they get both.
static bool was_spaced(const Formatter *f, Token token) {
    const char *at = text_at(f, token.lo);
    return strchr(" \t\r\n/", at[-1]) || strchr(" \t\r\n/", at[1]);
}

static bool is_factor(TokenKind kind) {
    return kind == TOKEN_STAR || kind == TOKEN_SLASH || kind == TOKEN_PERCENT;
}

static unsigned spaces_before(const Formatter *f, Token token, uint8_t role) {
    TokenKind kind = token.kind, last = f->last.kind;
    if (role & ROLE_STATEMENT) {
        return last == TOKEN_LBRACE || last == TOKEN_SEMICOLON ? 1 : 2;
    }
    if (is_tight_behind(last, f->last_role) || (last == TOKEN_LBRACE && kind == TOKEN_RBRACE)) {
        return 0;
    }
    if (is_factor(last)) {
        return was_spaced(f, f->last);
    }
    switch (kind) {
    case TOKEN_RPAREN:
    case TOKEN_RBRACKET:
    case TOKEN_COMMA:
    case TOKEN_DOT:
    case TOKEN_RANGE:
    case TOKEN_CARET:
    case TOKEN_PRIME:
        return 0;
    case TOKEN_SEMICOLON:
        return last == TOKEN_LBRACE;
    case TOKEN_GT:
        return top(f)->kind != TOKEN_LT;
    case TOKEN_COLON:
        return top(f)->n_questions > 0;
    case TOKEN_LPAREN:
    case TOKEN_LBRACKET:
        return !f->is_last_call;
    default:
        break;
    }
    return is_factor(kind) ? was_spaced(f, token) : 1;
}

// Words after which '(' and '[' begin a value.
static bool is_operator_word(const Formatter *f, Token token) {
    static const char *const words[] = {"and", "or", "not", "in", "by", "if"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (is_text(f, token, words[i])) {
            return true;
        }
    }
    return false;
}

static void open_bracket(Formatter *f, Token token) {
    uint32_t outer = f->line.indent;
    f->open = arena_grow(f->arena, f->open, f->n_open, &f->open_capacity, sizeof *f->open);
    f->open[f->n_open++] =
        (Open){.kind = token.kind, .outer = outer, .inner = outer + INDENT, .token = token.lo};
}

// Keeps account of brackets and of what may follow.
static void follow(Formatter *f, Token token, uint8_t role) {
    bool is_vector_end = token.kind == TOKEN_GT && top(f)->kind == TOKEN_LT;
    f->is_last_call =
        token.kind == TOKEN_RPAREN || token.kind == TOKEN_RBRACKET || token.kind == TOKEN_STRING ||
        is_vector_end ||
        (token.kind == TOKEN_NAME && !(role & ROLE_WORD) && !is_operator_word(f, token));
    switch (token.kind) {
    case TOKEN_LBRACE:
    case TOKEN_LPAREN:
    case TOKEN_LBRACKET:
        open_bracket(f, token);
        break;
    case TOKEN_LT:
        if (role & ROLE_VECTOR) {
            open_bracket(f, token);
        }
        break;
    case TOKEN_GT:
        f->n_open -= is_vector_end;
        break;
    case TOKEN_RBRACE:
    case TOKEN_RPAREN:
    case TOKEN_RBRACKET:
        f->n_open--;
        break;
    case TOKEN_QUESTION:
        top(f)->n_questions++;
        break;
    case TOKEN_COLON:
        top(f)->n_questions -= top(f)->n_questions > 0;
        break;
    default:
        break;
    }
}

// Where a line goes on within brackets, under the first of what they hold.
static void hang(Formatter *f, Token token) {
    const Open *open = top(f);
    if (open->is_followed && column_of(f, token) == open->from && open->line < f->n_lines) {
        f->line.hangs_on = open->line + 1;
        f->line.hangs_at = open->at;
    }
}

static void follow_open(Formatter *f, Token token) {
    Open *open = top(f);
    bool is_next = f->n_open > 1 && f->last.hi && open->token == f->last.lo;
    if (is_next && !f->line.is_ragged) {
        open->is_followed = true;
        open->from = column_of(f, token);
        open->at = code_columns(f);
        open->line = f->n_lines;
    }
}

static void mark(Formatter *f, Token token) {
    bool is_mark = token.kind == TOKEN_ASSIGN || token.kind == TOKEN_LBRACE;
    if (is_mark && f->n_text && !f->line.is_ragged && f->n_open == f->n_open_first &&
        !f->line.mark_at) {
        f->line.mark = token.kind;
        f->line.mark_at = code_columns(f);
        f->line.mark_from = column_of(f, token);
    }
}

static void put_token(Formatter *f, Token token) {
    uint8_t role = f->roles[token.lo - f->file->base];
    top(f)->is_block |= (role & ROLE_STATEMENT) != 0;
    bool is_first = !f->n_text;
    if (f->has_break || (is_first && !f->line.n_comment)) {
        f->has_blank &= token.kind != TOKEN_RBRACE && f->last.kind != TOKEN_LBRACE;
        begin_line(f, indent_of(f, token, role));
        f->n_open_first = f->n_open;
        hang(f, token);
    } else {
        put(f, "  ", spaces_before(f, token, role));
        follow_open(f, token);
    }
    mark(f, token);
    put(f, text_at(f, token.lo), token.hi - token.lo);
    follow(f, token, role);
    f->last = token;
    f->last_role = role;
}

static bool has_both(const Line *line) {
    return line->n_code && line->n_comment;
}

// Behind the code; where a comment over several lines stands in it, on the last of these.
static uint32_t end_column(const Line *line) {
    uint32_t row = line->n_code;
    while (row && line->code[row - 1] != '\n') {
        row--;
    }
    return columns(line->code + row, line->n_code - row) + (row ? 0 : line->indent + line->pad);
}

// Comments behind the code of neighbouring lines begin at one column.
static uint32_t comment_column(const Formatter *f, size_t i) {
    uint32_t column = 0;
    size_t first = i;
    while (first > 0 && has_both(&f->lines[first - 1]) && !f->lines[first].has_blank) {
        first--;
    }
    for (size_t j = first; j < f->n_lines && has_both(&f->lines[j]); j++) {
        if (j > first && f->lines[j].has_blank) {
            break;
        }
        uint32_t end = end_column(&f->lines[j]);
        column = end > column ? end : column;
    }
    return column + 2;
}

static bool is_aligned(const Line *a, const Line *b) {
    return b->mark_at && !b->has_blank && a->mark == b->mark && a->indent == b->indent &&
           a->mark_from == b->mark_from;
}

// Marks that stood in one column stand in one again, the least that has room for all.
static void align_marks(Formatter *f) {
    for (size_t first = 0, end; first < f->n_lines; first = end) {
        uint32_t column = f->lines[first].mark_at;
        for (end = first + 1; column && end < f->n_lines; end++) {
            if (!is_aligned(&f->lines[first], &f->lines[end])) {
                break;
            }
            column = f->lines[end].mark_at > column ? f->lines[end].mark_at : column;
        }
        for (size_t i = first; i < end; i++) {
            f->lines[i].pad = column - f->lines[i].mark_at;
        }
    }
}

static void align_hanging(Formatter *f) {
    for (size_t i = 0; i < f->n_lines; i++) {
        Line *line = &f->lines[i];
        if (line->hangs_on) {
            const Line *from = &f->lines[line->hangs_on - 1];
            uint32_t pad = from->mark_at && line->hangs_at >= from->mark_at ? from->pad : 0;
            line->indent = from->indent + line->hangs_at + pad;
        }
    }
}

// The bytes of so many columns.
static uint32_t bytes_of(const char *text, uint32_t n) {
    uint32_t i = 0;
    for (; n || ((unsigned char)text[i] & 0xc0) == 0x80; i++) {
        n -= ((unsigned char)text[i] & 0xc0) != 0x80;
    }
    return i;
}

// A comment over several lines keeps their indentation, but no white space at their ends.
static void write_code(const Line *line, FILE *out) {
    const char *at = line->code, *end = at + line->n_code;
    if (line->pad) {
        uint32_t n = bytes_of(at, line->mark_at);
        fprintf(out, "%.*s%*s", (int)n, at, (int)line->pad, "");
        at += n;
    }
    while (at < end) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        uint32_t n = (uint32_t)((stop ? stop : end) - at);
        fwrite(at, 1, stop ? trimmed(at, n) : n, out);
        if (stop) {
            fputc('\n', out);
        }
        at += n + (stop != NULL);
    }
}

static void write_lines(const Formatter *f, FILE *out) {
    uint32_t column = 0;
    for (size_t i = 0; i < f->n_lines; i++) {
        const Line *line = &f->lines[i];
        fprintf(out, "%s%*s", line->has_blank ? "\n" : "", (int)line->indent, "");
        write_code(line, out);
        if (has_both(line)) {
            bool goes_on = i && has_both(line - 1) && !line->has_blank;
            column = goes_on ? column : comment_column(f, i);
            fprintf(out, "%*s", (int)(column - end_column(line)), "");
        }
        fwrite(line->n_comment ? line->comment : "", 1, line->n_comment, out);
        fputc('\n', out);
    }
}

static void put_tokens(Formatter *f) {
    Lexer lexer = lex_begin(f->file);
    uint32_t end = f->file->base + (uint32_t)(lexer.at - f->file->text);
    const char *first = strstr(f->file->text, "#!"); // behind the mark, if there is one
    if (first && first < lexer.at) {
        put(f, first, trimmed(first, (uint32_t)(lexer.at - first)));
    }
    for (;;) {
        Token token = lex_next(&lexer);
        if (token.kind == TOKEN_GE && top(f)->kind == TOKEN_LT) {
            token.kind = TOKEN_GT; // `<1, 2>==v` was cut into `>=` and `=`
            token.hi = token.lo + 1;
            lexer = lex_at(f->file, token.hi);
        }
        put_gap(f, end, token.lo);
        if (token.kind == TOKEN_END) {
            break;
        }
        put_token(f, token);
        end = token.hi;
    }
    end_line(f);
}

bool format_source(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag, FILE *out) {
    const Syntax *syntax = syntax_parse(arena, symbols, file, diag);
    if (syntax->has_errors) {
        return false;
    }
    Formatter f = {
        .arena = arena, .file = file, .roles = find_roles(arena, syntax), .row_at = file->text};
    f.open = arena_grow(arena, NULL, 0, &f.open_capacity, sizeof *f.open);
    f.open[f.n_open++] = (Open){.is_block = true};
    put_tokens(&f);
    align_marks(&f);
    align_hanging(&f);
    write_lines(&f, out);
    return true;
}
