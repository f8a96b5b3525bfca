// SPDX-License-Identifier: Apache-2.0
// Where a statement goes wrong: what is said, and where the parser goes on.
#include "lang/parser.h"

#include <stdio.h>
#include <string.h>

#include "lang/schema.h"

// A text with what stands in the place of its first <x, y, z>: the vector that begins here.
static void with_vector(const Parser *p, const char *text, char *hint, size_t size) {
    static const char pattern[] = "<x, y, z>";
    const char *at = strstr(text, pattern), *vector = parser_text(p, p->token.lo);
    size_t n = strcspn(vector, ">\n\"");
    if (!at || !parser_at(p, TOKEN_LT) || vector[n] != '>' || n > 60) {
        snprintf(hint, size, "%s", text);
        return;
    }
    snprintf(hint, size, "%.*s%.*s%s", (int)(at - text), text, (int)n + 1, vector,
             at + sizeof pattern - 1);
}

// What may have been meant by a word that begins no statement: another language's word, or one
// that is nearly right. False: nothing known.
static bool hint_word(const Parser *p, const char *word, char *hint, size_t size) {
    static const char *const words[] = {
#define KEYWORD(id, text) text,
#include "lang/keywords.def"
#undef KEYWORD
    };
    const char *node = p->within ? symbol_text(p->symbols, p->within) : NULL;
    ObjectKind kind = node ? schema_node(node) : OBJECT_KINDS;
    if (kind != OBJECT_KINDS && schema_property(kind, word) != PROPERTY_COUNT) {
        return false;
    }
    const char *foreign = schema_foreign_word("statement", word);
    const char *here = node ? schema_foreign_word(node, word) : NULL;
    const char *anywhere = schema_foreign_word(NULL, word);
    foreign = here && here != anywhere ? here : foreign;
    if (foreign) {
        with_vector(p, foreign, hint, size);
        return true;
    }
    const char *near = diag_nearest(word, words, KEYWORD_LAST_STATEMENT);
    if (near) {
        snprintf(hint, size, "did you mean '%s'?", near);
    }
    return near;
}

// Values without names, as POV-Ray's nodes begin with them.
static void hint_unnamed(const Parser *p, char *hint, size_t size) {
    const char *node = p->within ? symbol_text(p->symbols, p->within) : NULL;
    ObjectKind kind = node ? schema_node(node) : OBJECT_KINDS;
    const char *foreign = node ? schema_foreign_word(NULL, node) : NULL;
    const char *unnamed = node ? schema_foreign_word(node, "<") : NULL;
    if (kind == OBJECT_KINDS) {
        snprintf(hint, size, "%s%s%s", foreign ? node : "properties are written name = value",
                 foreign ? ": " : "", foreign ? foreign : "");
        return;
    }
    if (unnamed) {
        snprintf(hint, size, "%s", unnamed);
        return;
    }
    // The first property that takes such a value, else the first of all.
    uint32_t first = node_infos[kind].first, end = schema_end(kind), id = first;
    bool is_vector = parser_at(p, TOKEN_LT);
    while (id < end && (is_vector ? property_infos[id].type != PROPERTY_TYPE_VEC3 &&
                                        property_infos[id].type != PROPERTY_TYPE_VEC2
                                  : property_infos[id].type != PROPERTY_TYPE_NUMBER)) {
        id++;
    }
    id = id < end ? id : first;
    bool is_known = first < end && property_infos[id].default_text[0];
    snprintf(hint, size, "properties are written name = value%s%s%s%s", is_known ? ", as " : "",
             is_known ? property_infos[id].name : "", is_known ? " = " : "",
             is_known ? property_infos[id].default_text : "");
}

bool parser_error_late_ends(Parser *p, Token name) {
    const char *text = symbol_text(p->symbols, name.symbol);
    if (name.newline || *parser_text(p, name.hi) != '(' ||
        (strcmp(text, "before") != 0 && strcmp(text, "after") != 0)) {
        return false;
    }
    char hint[80];
    snprintf(hint, sizeof hint, "write it before the '{': keys %s(...) { ... }", text);
    parser_error(p, parser_span(name), hint, "%s(...) of keys stands behind their '}'", text);
    return true;
}

static const char comparison_in_vector[] =
    "a comparison inside a vector needs brackets: <1, (a > b), 2>";

void parser_error_no_block(Parser *p, Token first, bool is_dotted, bool is_labelled) {
    char hint[200] = "";
    TokenKind kind = p->token.kind;
    int n_head = p->last_hi - first.lo < 60 ? (int)(p->last_hi - first.lo) : 60;
    bool is_same_line = !p->token.newline;
    if (parser_error_late_ends(p, first)) {
        return;
    }
    if (first.lo > p->vector_end && p->vector_end && !first.newline &&
        (kind == TOKEN_GT || kind == TOKEN_COMMA || kind == TOKEN_PLUS)) {
        snprintf(hint, sizeof hint, "%s", comparison_in_vector);
    } else if (!is_same_line && kind == TOKEN_NAME && !is_labelled &&
               (p->next.kind == TOKEN_LBRACE || p->next.kind == TOKEN_LBRACKET)) {
        snprintf(hint, sizeof hint, "a label stands on the line of what it labels");
    } else if (!is_same_line && kind == TOKEN_LPAREN) {
        snprintf(hint, sizeof hint, "the '(' stands on the line of the name before it");
    } else if (kind == TOKEN_ASSIGN && is_dotted) {
        snprintf(hint, sizeof hint, "a property is set in its node's block: film { fps = 24 }");
    } else if (kind == TOKEN_ASSIGN && *parser_text(p, p->last_lo) == ')') {
        snprintf(hint, sizeof hint, "write fn %.*s = ...", n_head, parser_text(p, first.lo));
    } else if (is_same_line &&
               hint_word(p, symbol_text(p->symbols, first.symbol), hint, sizeof hint)) {
    } else if (kind == TOKEN_COMMA && p->within && !is_dotted && !is_labelled) {
        hint_unnamed(p, hint, sizeof hint);
    } else if (kind == TOKEN_COLON || (is_same_line && parser_begins_value(kind) &&
                                       !(is_labelled && kind == TOKEN_NAME))) {
        snprintf(hint, sizeof hint, "to set a property, write %.40s = ...",
                 symbol_text(p->symbols, first.symbol));
    }
    const char *what = is_labelled || is_dotted ? "'{'" : "'=' or '{'";
    parser_error_expected(p, what, hint[0] ? hint : NULL);
}

void parser_error_no_statement(Parser *p, uint32_t less_at) {
    TokenKind kind = p->token.kind;
    const char *hint = NULL;
    char unnamed[200];
    bool follows_vector = p->vector_end && p->vector_end == p->last_hi && !p->token.newline;
    bool follows_brace = p->last_hi > p->last_lo && *parser_text(p, p->last_lo) == '{';
    if (kind == TOKEN_COMMA && less_at) {
        parser_error(p, (Span){less_at, less_at + 1},
                     "a vector as an argument needs brackets: n(<p, q>)",
                     "'<' after a value compares, and no ',' can follow a comparison here");
        return;
    }
    if (kind == TOKEN_COMMA) {
        hint = "statements are not separated by commas";
    } else if (follows_vector && kind == TOKEN_NUMBER) {
        hint = comparison_in_vector;
    } else if (kind == TOKEN_MINUS ||
               ((kind == TOKEN_LPAREN || kind == TOKEN_LBRACKET) && p->token.newline)) {
        hint = "to go on with the line above, end that with an operator";
    } else if ((kind == TOKEN_LT || kind == TOKEN_NUMBER) && follows_brace) {
        hint_unnamed(p, unnamed, sizeof unnamed);
        hint = unnamed;
    } else if (parser_begins_value(kind) || kind == TOKEN_COLON) {
        hint = "properties are written name = value";
    } else if (kind == TOKEN_LBRACE) {
        hint = "a block belongs to a node: group { ... }";
    } else if (kind == TOKEN_ASSIGN) {
        hint = p->token.newline || follows_brace || p->last_lo == p->last_hi
                   ? "a name stands on the left of '='"
                   : "write '==' to compare";
    }
    char text[40];
    int n = p->token.hi - p->token.lo < 32 ? (int)(p->token.hi - p->token.lo) : 32;
    snprintf(text, sizeof text, "%.*s", n, parser_text(p, p->token.lo));
    parser_error(p, parser_span(p->token), hint, "expected a statement, found %s%s%s",
                 kind == TOKEN_STRING ? "a string" : "'", kind == TOKEN_STRING ? "" : text,
                 kind == TOKEN_STRING ? "" : "'");
}

// Of the line of offset, but not more than LONGEST_INDENT before it: nobody indents that far, and
// a file of one line stays quick.
enum { LONGEST_INDENT = 4096 };

static const char *line_start(const Parser *p, uint32_t offset) {
    const char *at = parser_text(p, offset), *start = at;
    while (start > p->syntax->file->text && start[-1] != '\n' && at - start < LONGEST_INDENT) {
        start--;
    }
    return start;
}

// Characters before offset on its line.
static uint32_t indent_of(const Parser *p, uint32_t offset) {
    return (uint32_t)(parser_text(p, offset) - line_start(p, offset));
}

// Spaces at the beginning of the line of offset.
static uint32_t line_indent(const Parser *p, uint32_t offset) {
    const char *start = line_start(p, offset);
    return (uint32_t)strspn(start, " \t");
}

// Skips to what surely is the next statement: a name that begins a line no further right than
// this statement did, or, with all brackets closed, `name =` or a line that begins with a name.
void parser_skip_statement(Parser *p, Token first, unsigned braces) {
    uint32_t indent = indent_of(p, first.lo);
    unsigned keys_braces = p->n_braces > braces ? p->n_braces - braces : 0;
    unsigned brackets = p->lost_brackets > keys_braces ? p->lost_brackets - keys_braces : 0;
    if (p->token.lo == first.lo && !parser_at(p, TOKEN_RBRACE)) {
        parser_advance(p);
    }
    for (; !parser_at(p, TOKEN_END); parser_advance(p)) {
        TokenKind kind = p->token.kind, next = p->next.kind;
        bool is_line = kind == TOKEN_NAME && p->token.newline;
        if (is_line && indent_of(p, p->token.lo) <= indent) {
            p->n_braces = braces;
            return;
        }
        if (kind == TOKEN_LPAREN || kind == TOKEN_LBRACKET) {
            brackets++;
        } else if ((kind == TOKEN_RPAREN || kind == TOKEN_RBRACKET) && brackets) {
            brackets--;
        }
        if (p->n_braces > braces) {
            continue;
        }
        bool is_open = next == TOKEN_LBRACE || next == TOKEN_PRIME || next == TOKEN_DOT ||
                       parser_begins_value(next);
        if (kind == TOKEN_RBRACE || kind == TOKEN_SEMICOLON ||
            (kind == TOKEN_NAME && !brackets && (next == TOKEN_ASSIGN || (is_line && is_open)))) {
            return;
        }
    }
}

void parser_error_no_comma(Parser *p, uint32_t lo) {
    char hint[120];
    int n = (int)(p->last_hi - lo), n_value = (int)(p->token.hi - p->token.lo);
    snprintf(hint, sizeof hint, "write %.*s, %.*s", n < 50 ? n : 50, parser_text(p, lo),
             n_value < 40 ? n_value : 40, parser_text(p, p->token.lo));
    parser_error_expected(p, "','", hint);
}

bool parser_error_no_comparison(Parser *p) {
    if (!parser_at(p, TOKEN_ASSIGN) || p->is_lost) {
        return false;
    }
    parser_error_expected(p, "'=='", "write '==' to compare");
    return true;
}

// Where a '{' stands on this line behind a mistake, its block is read for the mistakes in it.
bool parser_reach_block(Parser *p) {
    if (!p->is_lost && parser_at(p, TOKEN_LBRACE)) {
        return true;
    }
    char hint[80] = "";
    if (parser_at(p, TOKEN_NAME) && !p->token.newline) {
        snprintf(hint, sizeof hint, "write the braces of its block: { %.40s ... }",
                 symbol_text(p->symbols, p->token.symbol));
    }
    parser_error_expected(p, "'{'", hint[0] ? hint : NULL);
    while (!p->lost_brackets && !p->token.newline && !parser_at(p, TOKEN_LBRACE) &&
           !parser_at(p, TOKEN_RBRACE) && !parser_at(p, TOKEN_SEMICOLON) &&
           !parser_at(p, TOKEN_END)) {
        parser_advance(p);
    }
    return !p->lost_brackets && !p->token.newline && parser_at(p, TOKEN_LBRACE);
}

// A '}' further left than the line of its '{' is probably that of an outer block.
void parser_suspect_block(Parser *p, uint32_t lo) {
    if (!p->suspect && p->token.newline && line_indent(p, p->token.lo) < line_indent(p, lo)) {
        p->suspect = lo;
    }
}

// The file has ended in a block; said once, of the one that most probably lacks its '}'.
void parser_error_open_block(Parser *p, uint32_t lo) {
    if (!p->is_cut && !p->is_too_deep) {
        uint32_t at = p->suspect ? p->suspect : lo;
        parser_error(p, (Span){at, at + 1}, NULL, "block without a closing '}'");
    }
    p->is_cut = p->is_lost = true;
}
