// SPDX-License-Identifier: Apache-2.0
// Sources, symbols and diagnostics: places, what is shown and how often, JSON, nearest names.
#include "lang/diag.h"

#include <stdlib.h>
#include <string.h>

#include "lang/syntax.h"
#include "tests/suite.h"

typedef struct {
    Arena arena;
    Sources sources;
    FILE *out;
    char *text;
    size_t size;
    Diag *diag;
} Fixture;

static void begin(Fixture *f, bool json) {
    *f = (Fixture){0};
    f->sources.arena = &f->arena;
    f->out = open_memstream(&f->text, &f->size);
    f->diag = diag_new(&f->arena, &f->sources, f->out, json, false);
}

static const char *written(Fixture *f) {
    fflush(f->out);
    return f->text;
}

static void end(Fixture *f) {
    fclose(f->out);
    free(f->text);
    arena_free(&f->arena);
}

static void source_places(void **state) {
    (void)state;
    Fixture f;
    begin(&f, false);
    char *text = malloc(10000);
    for (int i = 0; i < 10000; i++) {
        text[i] = i % 7 == 6 ? '\n' : i % 3 ? 'a' : '\xbc'; // some go on with a character
    }
    const SourceFile *first = source_add(&f.sources, "a", text, 10000, (Span){0});
    const SourceFile *second = source_add(&f.sources, "b", "x\n\xc3\xa9y", 5, (Span){0});
    const SourceFile *empty = source_add(&f.sources, "c", "", 0, (Span){0});
    first = source_of(&f.sources, first->base);
    assert_null(source_of(&f.sources, 0));
    uint32_t line = 1, column = 1;
    for (uint32_t i = 0; i <= 10000; i++) {
        SourcePlace place = source_place(&f.sources, first->base + i);
        assert_ptr_equal(place.file, first);
        assert_int_equal(place.line, line);
        assert_int_equal(place.column, column);
        column += text[i % 10000] != '\xbc';
        if (text[i % 10000] == '\n') {
            line++;
            column = 1;
        }
    }
    SourcePlace place = source_place(&f.sources, second->base + 4);
    assert_string_equal(place.file->path, "b");
    assert_int_equal(place.line, 2);
    assert_int_equal(place.column, 2);
    place = source_place(&f.sources, empty->base);
    assert_string_equal(place.file->path, "c");
    assert_null(source_of(&f.sources, empty->base + 1));
    free(text);
    end(&f);
}

static void symbols_are_unique(void **state) {
    (void)state;
    Arena arena = {0};
    Symbols *symbols = symbols_new(&arena);
    Symbol *known = malloc(20000 * sizeof *known);
    for (int round = 0; round < 2; round++) {
        for (int i = 0; i < 20000; i++) {
            char text[32];
            int n = sprintf(text, "name%d", i);
            Symbol symbol = symbol_of(symbols, text, (size_t)n);
            assert_int_not_equal(symbol, 0);
            assert_string_equal(symbol_text(symbols, symbol), text);
            assert_int_equal(symbol_size(symbols, symbol), n);
            assert_true(round == 0 || symbol == known[i]);
            assert_true(round == 1 || i == 0 || symbol != known[i - 1]);
            known[i] = symbol;
        }
    }
    Symbol nul = symbol_of(symbols, "a\0b", 3), empty = symbol_of(symbols, "", 0);
    assert_int_not_equal(nul, symbol_of(symbols, "a", 1));
    assert_int_equal(symbol_size(symbols, nul), 3);
    assert_int_not_equal(empty, 0);
    free(known);
    arena_free(&arena);
}

static void diag_shows_one_per_statement(void **state) {
    (void)state;
    Fixture f;
    begin(&f, false);
    source_add(&f.sources, "a.st4", "one two\n\tthree", 14, (Span){0});
    diag_error(f.diag, (Span){1, 4}, NULL, "first");
    diag_error(f.diag, (Span){5, 8}, NULL, "a consequence");
    diag_note(f.diag, (Span){5, 8}, "of what is not shown");
    diag_next_statement(f.diag);
    diag_error(f.diag, (Span){1, 4}, NULL, "first"); // the same place and message
    diag_error(f.diag, (Span){10, 15}, "a hint", "second %d", 2);
    diag_note(f.diag, (Span){1, 4}, "here before");
    diag_next_statement(f.diag);
    diag_error(f.diag, (Span){0}, "a hint", "nowhere");
    assert_string_equal(written(&f), "a.st4:1:1: error: first\n"
                                     "    1 | one two\n"
                                     "      | ^~~\n"
                                     "a.st4:2:2: error: second 2\n"
                                     "    2 |     three\n"
                                     "      |     ^~~~~ a hint\n"
                                     "a.st4:1:1: note: here before\n"
                                     "    1 | one two\n"
                                     "      | ^~~\n"
                                     "st4: error: nowhere\n"
                                     "      | a hint\n");
    assert_int_equal(diag_n_errors(f.diag), 3);
    end(&f);
}

static void diag_shows_twenty(void **state) {
    (void)state;
    Fixture f;
    begin(&f, false);
    for (int i = 0; i < 23; i++) {
        diag_next_statement(f.diag);
        diag_error(f.diag, (Span){0}, NULL, "number %d", i);
    }
    diag_note(f.diag, (Span){0}, "of a hidden one");
    diag_finish(f.diag);
    assert_int_equal(diag_n_errors(f.diag), 23);
    assert_non_null(strstr(written(&f), "number 19\nst4: 3 more errors, not shown\n"));
    end(&f);
}

static void diag_sets_warnings(void **state) {
    (void)state;
    Fixture f;
    begin(&f, false);
    diag_warn(f.diag, WARN_UNUSED_LET, (Span){0}, NULL, "a");
    diag_warn(f.diag, WARN_UNUSED_LET, (Span){0}, NULL, "a");
    assert_true(diag_set_warning(f.diag, "no-unused-let"));
    diag_warn(f.diag, WARN_UNUSED_LET, (Span){0}, NULL, "b");
    assert_true(diag_set_warning(f.diag, "error=empty"));
    diag_warn(f.diag, WARN_EMPTY, (Span){0}, NULL, "c");
    assert_true(diag_set_warning(f.diag, "no-all"));
    diag_warn(f.diag, WARN_EMPTY, (Span){0}, NULL, "d");
    assert_true(diag_set_warning(f.diag, "all"));
    assert_true(diag_set_warning(f.diag, "error"));
    diag_warn(f.diag, WARN_DEGENERATE, (Span){0}, NULL, "e");
    assert_false(diag_set_warning(f.diag, "no-such"));
    assert_false(diag_set_warning(f.diag, ""));
    assert_int_equal(diag_n_warnings(f.diag), 1);
    assert_int_equal(diag_n_errors(f.diag), 2);
    assert_string_equal(written(&f), "st4: warning: a [-Wunused-let]\n"
                                     "st4: error: c [-Werror=empty]\n"
                                     "st4: error: e [-Werror=degenerate]\n");
    end(&f);
}

static void diag_shows_include_chains(void **state) {
    (void)state;
    Fixture f;
    begin(&f, false);
    source_add(&f.sources, "a", "include \"b\"\n", 12, (Span){0});     // 1..13
    source_add(&f.sources, "b", "include \"c\"\n", 12, (Span){9, 12}); // 14..26
    source_add(&f.sources, "c", "x = 1\n", 6, (Span){22, 25});         // 27..33
    diag_error(f.diag, (Span){31, 32}, NULL, "bad");
    diag_next_statement(f.diag);
    diag_error(f.diag, (Span){27, 28}, NULL, "worse");
    assert_string_equal(written(&f), "a:1:9: in the file included here:\n"
                                     "b:1:9: in the file included here:\n"
                                     "c:1:5: error: bad\n"
                                     "    1 | x = 1\n"
                                     "      |     ^\n"
                                     "c:1:1: error: worse\n"
                                     "    1 | x = 1\n"
                                     "      | ^\n");
    end(&f);
    begin(&f, true);
    source_add(&f.sources, "a\"", "include \"b\"\n", 12, (Span){0});
    source_add(&f.sources, "b", "\n x = 1\n", 8, (Span){9, 12});
    diag_error(f.diag, (Span){16, 17}, "do\tthis", "bad \"%s\"", "\x1b");
    diag_next_statement(f.diag);
    diag_warn(f.diag, WARN_EMPTY, (Span){0}, NULL, "nothing");
    assert_string_equal(
        written(&f),
        "{\"version\":1,\"severity\":\"error\",\"file\":\"b\",\"line\":2,\"column\":2,"
        "\"end_line\":2,\"end_column\":3,\"name\":null,\"message\":\"bad \\\"\\u001b\\\"\","
        "\"hint\":\"do\\u0009this\",\"included_from\":[{\"file\":\"a\\\"\",\"line\":1,"
        "\"column\":9}]}\n"
        "{\"version\":1,\"severity\":\"warning\",\"file\":null,\"line\":0,\"column\":0,"
        "\"end_line\":0,\"end_column\":0,\"name\":\"empty\",\"message\":\"nothing\","
        "\"hint\":null}\n");
    end(&f);
}

static void diag_finds_nearest_names(void **state) {
    (void)state;
    static const char *const names[] = {"radius", "center", "material", "at", "to", "from", "fov"};
    static const struct {
        const char *name, *nearest;
    } cases[] = {
        {"raduis", "radius"},
        {"radus", "radius"},
        {"Radius", "radius"},
        {"centre", "center"},
        {"matreial", "material"},
        {"form", "from"},
        {"fvo", "fov"},
        {"ta", NULL},
        {"colour", NULL},
        {"x", NULL},
        {"", NULL},
        {"At", "at"},
        {"fromm", "from"},
        {"materialmaterialmaterialmaterialmaterialmaterialmaterialmaterialmaterial", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *found = diag_nearest(cases[i].name, names, sizeof names / sizeof names[0]);
        const char *expected = cases[i].nearest;
        if (!found != !expected || (found && strcmp(found, expected) != 0)) {
            fail_msg("%s: %s, expected %s", cases[i].name, found ? found : "nothing",
                     expected ? expected : "nothing");
        }
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(source_places),
    cmocka_unit_test(symbols_are_unique),
    cmocka_unit_test(diag_shows_one_per_statement),
    cmocka_unit_test(diag_shows_twenty),
    cmocka_unit_test(diag_sets_warnings),
    cmocka_unit_test(diag_shows_include_chains),
    cmocka_unit_test(diag_finds_nearest_names),
};

SUITE(diag, tests)
