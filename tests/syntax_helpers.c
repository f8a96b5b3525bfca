// SPDX-License-Identifier: Apache-2.0
// Parses text and keeps the tree and what was reported, for tests of the front end.
#include "tests/syntax_helpers.h"

#include <stdlib.h>
#include <string.h>

#include "tests/suite.h"

static void begin(Parsed *parsed, const char *path, const char *text, size_t size, bool json) {
    *parsed = (Parsed){0};
    parsed->sources.arena = &parsed->arena;
    parsed->file = source_add(&parsed->sources, path, text, size, (Span){0});
    parsed->symbols = symbols_new(&parsed->arena);
    parsed->out = open_memstream(&parsed->report, &parsed->report_size);
    assert_non_null(parsed->out);
    parsed->diag = diag_new(&parsed->arena, &parsed->sources, parsed->out, json, false);
}

void parse_text(Parsed *parsed, const char *path, const char *text, size_t size, bool json) {
    begin(parsed, path, text, size, json);
    parsed->syntax = syntax_parse(&parsed->arena, parsed->symbols, parsed->file, parsed->diag);
    diag_finish(parsed->diag);
    fflush(parsed->out);
}

void parse_expr_text(Parsed *parsed, const char *text) {
    begin(parsed, "-D", text, strlen(text), false);
    parsed->expr = syntax_parse_expr(&parsed->arena, parsed->symbols, parsed->file, parsed->diag,
                                     &parsed->syntax);
    fflush(parsed->out);
}

char *parsed_dump(const Parsed *parsed) {
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    syntax_dump(parsed->syntax, out);
    fclose(out);
    return text;
}

void parsed_free(Parsed *parsed) {
    fclose(parsed->out);
    free(parsed->report);
    arena_free(&parsed->arena);
}

char *read_test_file(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (!file) {
        fail_msg("cannot read %s: tests run in the tree's top folder", path);
    }
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    for (int c; (c = getc(file)) != EOF;) {
        fputc(c, out);
    }
    fclose(file);
    fclose(out);
    return text;
}
