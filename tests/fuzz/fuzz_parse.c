// SPDX-License-Identifier: Apache-2.0
// A libFuzzer target: any bytes are parsed, as a file and as an expression, and every node of the
// tree has an extent within the file. `make fuzz` builds and runs it.
#include <stdint.h>
#include <stdlib.h>

#include "lang/syntax.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_nodes(const Syntax *syntax, const SourceFile *file, FILE *out) {
    for (NodeId id = 1; id < syntax->n_nodes && syntax->root; id++) {
        Span span = syntax_span(syntax, id);
        if (span.lo < file->base || span.lo > span.hi || span.hi > file->base + file->size) {
            abort();
        }
    }
    syntax_dump(syntax, out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static FILE *out;
    if (!out && !(out = fopen("/dev/null", "w"))) {
        return 0;
    }
    Arena arena = {0};
    Sources sources = {.arena = &arena};
    const SourceFile *file = source_add(&sources, "f", (const char *)data, size, (Span){0});
    Diag *diag = diag_new(&arena, &sources, out, size & 1, false);
    Symbols *symbols = symbols_new(&arena);
    Syntax *syntax = syntax_parse(&arena, symbols, file, diag);
    if (syntax->has_errors != (diag_n_errors(diag) > 0)) {
        abort();
    }
    check_nodes(syntax, file, out);
    if (syntax_parse_expr(&arena, symbols, file, diag, &syntax)) {
        check_nodes(syntax, file, out);
    }
    arena_free(&arena);
    return 0;
}
