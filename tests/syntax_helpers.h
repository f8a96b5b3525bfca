// SPDX-License-Identifier: Apache-2.0
// Parses text and keeps the tree and what was reported, for tests of the front end.
#ifndef TESTS_SYNTAX_HELPERS_H
#define TESTS_SYNTAX_HELPERS_H

#include "lang/syntax.h"

typedef struct {
    Arena arena;
    Sources sources;
    Symbols *symbols;
    const SourceFile *file;
    Diag *diag;
    Syntax *syntax;
    NodeId expr; // of parse_expr_text
    FILE *out;
    char *report; // what diag wrote, after parsed_finish
    size_t report_size;
} Parsed;

void parse_text(Parsed *parsed, const char *path, const char *text, size_t size, bool json);
void parse_expr_text(Parsed *parsed, const char *text);
// The tree as text; free() it.
char *parsed_dump(const Parsed *parsed);
void parsed_free(Parsed *parsed);

// The whole file, NUL-terminated; fails the test if it cannot be read. free() it.
char *read_test_file(const char *path, size_t *size);

#endif
