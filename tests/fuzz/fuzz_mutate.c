// SPDX-License-Identifier: Apache-2.0
// Mutations of scenes: of tokens, of brackets and of statements, by the language's own lexer, and
// of bytes by libFuzzer.
#include <string.h>

#include "lang/lex.h"
#include "tests/fuzz/fuzz_grammar.h"

enum { MAX_TEXT = 1 << 16, MAX_TOKENS = 8192, MAX_NEW = 4096, NO_MATE = UINT32_MAX };

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t max_size);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size, unsigned seed);
size_t LLVMFuzzerCustomCrossOver(const uint8_t *data1, size_t size1, const uint8_t *data2,
                                 size_t size2, uint8_t *out, size_t max_size, unsigned seed);

typedef struct {
    uint32_t lo, hi; // bytes
    uint8_t kind;
    bool newline;
    uint32_t mate; // the other one of a pair of brackets, or NO_MATE
} Piece;

typedef struct {
    char text[MAX_TEXT + SOURCE_PADDING];
    uint32_t size, max;
    Piece pieces[MAX_TOKENS];
    uint32_t n;
} Tokens;

static Tokens tokens, others;

// ---- Reading

static TokenKind close_of(TokenKind open) {
    return open == TOKEN_LPAREN     ? TOKEN_RPAREN
           : open == TOKEN_LBRACKET ? TOKEN_RBRACKET
           : open == TOKEN_LBRACE   ? TOKEN_RBRACE
                                    : TOKEN_END;
}

static void cut(Tokens *t, const uint8_t *data, size_t size, size_t max) {
    static uint32_t open[MAX_TOKENS];
    t->size = (uint32_t)(size < MAX_TEXT ? size : MAX_TEXT);
    t->max = (uint32_t)(max < MAX_TEXT ? max : MAX_TEXT);
    memcpy(t->text, data, t->size);
    memset(t->text + t->size, 0, SOURCE_PADDING);
    const SourceFile file = {.path = "f", .text = t->text, .base = 1, .size = t->size};
    Lexer lexer = lex_begin(&file);
    uint32_t n_open = 0;
    for (t->n = 0; t->n < MAX_TOKENS; t->n++) {
        Token token = lex_next(&lexer);
        if (token.kind == TOKEN_END) {
            break;
        }
        Piece *piece = &t->pieces[t->n];
        *piece = (Piece){token.lo - 1, token.hi - 1, token.kind, token.newline, NO_MATE};
        if (close_of(token.kind) != TOKEN_END) {
            open[n_open++] = t->n;
        } else if (n_open && token.kind == close_of(t->pieces[open[n_open - 1]].kind)) {
            piece->mate = open[--n_open];
            t->pieces[piece->mate].mate = t->n;
        }
    }
}

// A piece of the kind, from a random one on; t->n: there is none.
static uint32_t find_kind(const Tokens *t, Writer *w, uint32_t kinds_lo, uint32_t kinds_hi) {
    uint32_t at = t->n ? fuzz_random(w, t->n) : 0;
    for (uint32_t i = 0; i < t->n; i++, at = at + 1 < t->n ? at + 1 : 0) {
        if (t->pieces[at].kind >= kinds_lo && t->pieces[at].kind <= kinds_hi) {
            return at;
        }
    }
    return t->n;
}

// An open bracket that is closed; t->n: there is none.
static uint32_t find_group(const Tokens *t, Writer *w) {
    uint32_t at = t->n ? fuzz_random(w, t->n) : 0;
    for (uint32_t i = 0; i < t->n; i++, at = at + 1 < t->n ? at + 1 : 0) {
        if (t->pieces[at].mate != NO_MATE && t->pieces[at].mate > at) {
            return at;
        }
    }
    return t->n;
}

// Where a statement may begin: behind a brace, or at the beginning of a line.
static uint32_t find_gap(const Tokens *t, Writer *w) {
    uint32_t at = fuzz_random(w, t->n + 1);
    for (uint32_t i = 0; i < t->n && at < t->n; i++, at++) {
        bool is_behind =
            at && t->pieces[at - 1].kind >= TOKEN_LBRACE && t->pieces[at - 1].kind <= TOKEN_RBRACE;
        if (is_behind || t->pieces[at].newline) {
            return t->pieces[at].lo;
        }
    }
    return t->size;
}

// From the piece on to the end of what it begins: a name and its brackets, "f(x)", "box { }".
static uint32_t end_of(const Tokens *t, uint32_t at) {
    uint32_t end = at;
    for (uint32_t i = at; i < t->n && i < at + 3; i++) {
        if (t->pieces[i].mate != NO_MATE && t->pieces[i].mate > i) {
            end = t->pieces[i].mate;
            break;
        }
    }
    return t->pieces[end].hi;
}

// ---- Writing

// text takes the place of [lo, hi). False: it does not fit.
static bool splice(Tokens *t, uint32_t lo, uint32_t hi, const char *text, size_t n) {
    if (t->size - (hi - lo) + n > t->max) {
        return false;
    }
    memmove(t->text + lo + n, t->text + hi, t->size - hi);
    memcpy(t->text + lo, text, n);
    t->size = (uint32_t)(t->size - (hi - lo) + n);
    return true;
}

static bool change_number(Tokens *t, Writer *w) {
    uint32_t at = find_kind(t, w, TOKEN_NUMBER, TOKEN_NUMBER);
    if (at == t->n) {
        return false;
    }
    fuzz_write_number(w);
    return splice(t, t->pieces[at].lo, t->pieces[at].hi, w->text, w->n);
}

static bool change_name(Tokens *t, Writer *w) {
    uint32_t at = find_kind(t, w, TOKEN_NAME, TOKEN_NAME);
    uint32_t other = find_kind(t, w, TOKEN_NAME, TOKEN_NAME);
    if (at == t->n) {
        return false;
    }
    if (fuzz_one_in(w, 2)) {
        const Piece *piece = &t->pieces[other];
        fuzz_put_text(w, t->text + piece->lo, piece->hi - piece->lo);
    } else {
        fuzz_write_name(w);
    }
    return splice(t, t->pieces[at].lo, t->pieces[at].hi, w->text, w->n);
}

static bool change_punctuation(Tokens *t, Writer *w) {
    uint32_t at = find_kind(t, w, TOKEN_BAD, TOKEN_COUNT);
    if (at == t->n) {
        return false;
    }
    fuzz_write_punctuation(w);
    return splice(t, t->pieces[at].lo, t->pieces[at].hi, w->text, w->n);
}

// A few tokens go, or stand twice.
static bool change_few(Tokens *t, Writer *w) {
    if (!t->n) {
        return false;
    }
    uint32_t at = fuzz_random(w, t->n), last = at + fuzz_random(w, 4);
    last = last < t->n ? last : t->n - 1;
    uint32_t lo = t->pieces[at].lo, hi = t->pieces[last].hi;
    if (fuzz_one_in(w, 2)) {
        return splice(t, lo, hi, "", 0);
    }
    uint32_t to = t->pieces[fuzz_random(w, t->n)].lo;
    fuzz_put_text(w, t->text + lo, hi - lo);
    fuzz_put(w, " ");
    return splice(t, to, to, w->text, w->n);
}

// A value is written anew: that of a property, what is in brackets, or a single one.
static bool change_value(Tokens *t, Writer *w) {
    uint32_t assign = find_kind(t, w, TOKEN_ASSIGN, TOKEN_ASSIGN), group = find_group(t, w);
    if (assign > 0 && assign + 1 < t->n && fuzz_one_in(w, 2)) {
        const Piece *name = &t->pieces[assign - 1];
        char property[32] = "";
        uint32_t n = name->hi - name->lo;
        memcpy(property, t->text + name->lo, n < sizeof property ? n : 0);
        fuzz_write_property_value(w, property, 3);
        return splice(t, t->pieces[assign + 1].lo, end_of(t, assign + 1), w->text, w->n);
    }
    if (group < t->n && t->pieces[group].kind != TOKEN_LBRACE && fuzz_one_in(w, 2)) {
        fuzz_write_expression(w, 3);
        return splice(t, t->pieces[group].hi, t->pieces[t->pieces[group].mate].lo, w->text, w->n);
    }
    uint32_t at = find_kind(t, w, TOKEN_NAME, TOKEN_NUMBER);
    if (at == t->n) {
        return false;
    }
    fuzz_write_expression(w, 2);
    return splice(t, t->pieces[at].lo, t->pieces[at].hi, w->text, w->n);
}

static bool insert_statement(Tokens *t, Writer *w) {
    uint32_t at = find_gap(t, w);
    fuzz_put(w, "\n");
    fuzz_write_statement(w, 3);
    return splice(t, at, at, w->text, w->n);
}

// What is in brackets goes, or is wrapped in more of them, or takes another's place.
static bool change_group(Tokens *t, Writer *w) {
    uint32_t a = find_group(t, w), b = find_group(t, w);
    if (a == t->n) {
        return false;
    }
    uint32_t lo = t->pieces[a].lo, hi = t->pieces[t->pieces[a].mate].hi;
    if (fuzz_one_in(w, 3)) {
        return splice(t, lo + 1, hi - 1, "", 0);
    }
    if (fuzz_one_in(w, 2)) {
        lo += 1, hi -= 1;
        int depth = 1 + (int)fuzz_random(w, fuzz_one_in(w, 8) ? 200 : 4);
        bool is_block = t->pieces[a].kind == TOKEN_LBRACE;
        for (int i = 0; i < depth; i++) {
            fuzz_put(w, is_block ? "group { " : "(");
        }
        fuzz_put_text(w, t->text + lo, hi - lo);
        for (int i = 0; i < depth; i++) {
            fuzz_put(w, is_block ? " }" : ")");
        }
        return splice(t, lo, hi, w->text, w->n);
    }
    uint32_t from = t->pieces[b].lo, to = t->pieces[t->pieces[b].mate].hi;
    fuzz_put_text(w, t->text + from, to - from);
    return splice(t, lo, hi, w->text, w->n);
}

// A statement, again and again with other numbers: a run (lang/run.h).
static bool repeat_statement(Tokens *t, Writer *w) {
    uint32_t brace = find_kind(t, w, TOKEN_LBRACE, TOKEN_LBRACE);
    if (!brace || brace == t->n || t->pieces[brace].mate == NO_MATE ||
        t->pieces[brace].mate < brace) {
        return false;
    }
    uint32_t first = brace - 1, last = t->pieces[brace].mate;
    uint32_t n = 2 + fuzz_random(w, 100);
    for (uint32_t i = 0; i < n && w->n + 256 < w->max; i++) {
        uint32_t from = t->pieces[first].lo;
        for (uint32_t k = first; k <= last; k++) {
            const Piece *piece = &t->pieces[k];
            if (piece->kind == TOKEN_NUMBER && !fuzz_one_in(w, 4)) {
                fuzz_put_text(w, t->text + from, piece->lo - from);
                fuzz_put(w, "%u", i);
                from = piece->hi;
            }
        }
        fuzz_put_text(w, t->text + from, t->pieces[last].hi - from);
        fuzz_put(w, "\n");
    }
    return splice(t, t->pieces[last].hi, t->pieces[last].hi, w->text, w->n);
}

static bool add_file(Tokens *t, Writer *w) {
    fuzz_write_file(w);
    return splice(t, t->size, t->size, w->text, w->n);
}

static bool write_anew(Tokens *t, Writer *w) {
    fuzz_write_scene(w);
    return splice(t, 0, t->size, w->text, w->n);
}

typedef bool Mutation(Tokens *t, Writer *w);
static Mutation *const mutations[] = {
    change_number,      change_number,    change_name,      change_name,
    change_punctuation, change_few,       change_few,       change_value,
    change_value,       change_value,     insert_statement, insert_statement,
    change_group,       repeat_statement, add_file,         write_anew,
};

// ---- The doors

static char new_text[MAX_NEW];

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size, unsigned seed) {
    Writer w = {.text = new_text, .max = MAX_NEW, .state = seed};
    if (fuzz_random(&w, 5) == 0) {
        return LLVMFuzzerMutate(data, size, max_size);
    }
    uint32_t n = 1 + fuzz_random(&w, 3), n_done = 0;
    for (uint32_t i = 0; n_done < n && i < 2 * n; i++) {
        cut(&tokens, data, size, max_size);
        w.n = 0;
        w.max = max_size < MAX_NEW ? max_size : MAX_NEW;
        if (mutations[fuzz_random(&w, N_OF(mutations))](&tokens, &w)) {
            n_done++;
            size = tokens.size;
            memcpy(data, tokens.text, size);
        }
    }
    return n_done ? size : LLVMFuzzerMutate(data, size, max_size);
}

// A statement of the second stands in the first, or one's brackets hold what the other's hold.
size_t LLVMFuzzerCustomCrossOver(const uint8_t *data1, size_t size1, const uint8_t *data2,
                                 size_t size2, uint8_t *out, size_t max_size, unsigned seed) {
    Writer w = {.text = new_text, .max = MAX_NEW, .state = seed};
    cut(&tokens, data1, size1, max_size);
    cut(&others, data2, size2, max_size);
    uint32_t group = find_group(&others, &w);
    if (group < others.n) {
        uint32_t from = others.pieces[group].lo, end = others.pieces[others.pieces[group].mate].hi;
        if (others.pieces[group].kind == TOKEN_LBRACE) {
            for (uint32_t k = group; k > 0 && !others.pieces[k].newline && k + 8 > group; k--) {
                from = others.pieces[k - 1].lo;
            }
            uint32_t at = find_gap(&tokens, &w);
            splice(&tokens, at, at, others.text + from, end - from);
        } else {
            uint32_t own = find_group(&tokens, &w);
            if (own < tokens.n) {
                splice(&tokens, tokens.pieces[own].lo, tokens.pieces[tokens.pieces[own].mate].hi,
                       others.text + from, end - from);
            }
        }
    }
    size_t size = tokens.size < max_size ? tokens.size : max_size;
    memcpy(out, tokens.text, size);
    return size;
}
