// SPDX-License-Identifier: Apache-2.0
// The canonical layout: what it looks like, that it formats to itself, and that the tree stays.
#include "lang/format.h"

#include <glob.h>
#include <stdlib.h>
#include <string.h>

#include "tests/suite.h"
#include "tests/syntax_helpers.h"

// NULL: does not parse. free() it.
static char *formatted(const char *text, size_t size) {
    Arena arena = {0};
    Sources sources = {.arena = &arena};
    char *result = NULL, *report = NULL;
    size_t n, n_report;
    FILE *out = open_memstream(&result, &n), *reports = open_memstream(&report, &n_report);
    const SourceFile *file = source_add(&sources, "t.st4", text, size, (Span){0});
    Diag *diag = diag_new(&arena, &sources, reports, false, false);
    bool is_done = format_source(&arena, symbols_new(&arena), file, diag, out);
    fclose(out);
    fclose(reports);
    assert_int_equal(is_done, n_report == 0);
    assert_true(is_done || n == 0);
    free(report);
    arena_free(&arena);
    if (!is_done) {
        free(result);
        return NULL;
    }
    return result;
}

static char *tree_of(const char *text, size_t size) {
    Parsed parsed;
    parse_text(&parsed, "t.st4", text, size, false);
    char *tree = parsed_dump(&parsed);
    parsed_free(&parsed);
    return tree;
}

// False: does not parse.
static bool check_stays(const char *text, size_t size) {
    char *once = formatted(text, size);
    if (!once) {
        return false;
    }
    char *twice = formatted(once, strlen(once));
    if (!twice || strcmp(once, twice) != 0) {
        fail_msg("%.*s\nbecomes\n%s\nand then\n%s", (int)size, text, once, twice ? twice : "-");
    }
    char *tree = tree_of(text, size), *tree_after = tree_of(once, strlen(once));
    if (strcmp(tree, tree_after) != 0) {
        fail_msg("%.*s\nbecomes\n%s\nwhich is another tree", (int)size, text, once);
    }
    free(tree_after);
    free(tree);
    free(twice);
    free(once);
    return true;
}

static const struct {
    const char *text, *layout;
} layouts[] = {
    {"", ""},
    {"\n\n  \n", ""},
    {"x=1", "x = 1\n"},
    {"x  = 1 y=2;z=3\r\n", "x = 1  y = 2; z = 3\n"},
    {"\xef\xbb\xbf#!/bin/st4  \n\n st4 1\nx=1", "#!/bin/st4\n\nst4 1\nx = 1\n"},
    {"x=-1+ - a - -b*2/ 3 % 4", "x = -1 + -a - -b*2 / 3 % 4\n"},
    {"x=a<b y=< -1,(2) ,c>", "x = a < b  y = <-1, (2), c>\n"},
    {"x=<1,2>==v", "x = <1, 2> == v\n"},
    {"x = f (a , b=1,) [ 2 ] . c", "x = f(a, b = 1,)[2].c\n"},
    {"x=a?b:c?(d):[e]", "x = a ? b : c ? (d) : [e]\n"},
    {"x=[for i in(a)if(b):c]", "x = [for i in (a) if (b): c]\n"},
    {"x = 0 .. 1 by(2) y=2 ^ -a", "x = 0..1 by (2)  y = 2^-a\n"},
    {"x=not(a)and(b)or(c)", "x = not (a) and (b) or (c)\n"},
    {"print(a),(b) scale(2) assert(a)", "print (a), (b)  scale (2)  assert (a)\n"},
    {"k=keys loop ease(1,2){0s:a?b:c,}", ""},
    {"k=keys loop ease(1,2){0s:-1 step,1s : 2}",
     "k = keys loop ease(1, 2) { 0s: -1 step, 1s: 2 }\n"},
    {"sphere{}box { ; }", "sphere {}  box { ; }\n"},
    {"A(1)L[2]{x'=1}", "A(1) L[2] { x' = 1 }\n"},
    {"if(a){x=1}else if b{}else{}", "if (a) { x = 1 } else if b {} else {}\n"},
    {"group{\nsphere{\nradius=1\n\n\n\n}\n\n\nx=1\n}\n",
     "group {\n  sphere {\n    radius = 1\n  }\n\n  x = 1\n}\n"},
    {"group\n{\nx=1 y=2\n}", "group\n{\n  x = 1  y = 2\n}\n"},
    {"x = f(1,\n<2,\n3>,\n)\ny = a +\nb", "x = f(1,\n  <2,\n    3>,\n)\ny = a +\n  b\n"},
    {"if a {\n}\nelse {\n}", "if a {\n}\nelse {\n}\n"},
    {"k = keys {\n0s: 1,\n1s: 2\n}", "k = keys {\n  0s: 1,\n  1s: 2\n}\n"},
    {"//a  \n\n\nx=1//b\nyy=2 // c\n\nz=3   //d",
     "//a\n\nx = 1   //b\nyy = 2  // c\n\nz = 3  //d\n"},
    {"g {// a\n// b\nx=1 /*c*/\n// d\n}", "g {  // a\n  // b\n  x = 1 /*c*/\n  // d\n}\n"},
    {"x /*a*/ = /*b*/1\n/* c  \n  d */ y=2", "x /*a*/ = /*b*/ 1\n/* c\n  d */  y = 2\n"},
    // What stood in one column does so again, where it is a neighbour's '=' or '{'.
    {"let a  =1\nlet bcd=22\nlet e = 3", "let a   = 1\nlet bcd = 22\nlet e = 3\n"},
    {"film      {x=1}\nshutter   { y=1}\n\nsky       {}\n",
     "film    { x = 1 }\nshutter { y = 1 }\n\nsky {}\n"},
    {"l=[\nkeys ease   {0s:1},\nkeys        {0s:2},\n]",
     "l = [\n  keys ease { 0s: 1 },\n  keys      { 0s: 2 },\n]\n"},
    {"x  = f(1,\n       2)\nyyy = 3", "x = f(1,\n      2)\nyyy = 3\n"},
    {"x   = f(1,\n        2)\nyyy = g( \n 1)", "x = f(1,\n      2)\nyyy = g(\n  1)\n"},
    {"box    { a=1\n         b=<1,\n            2> } // c",
     "box { a = 1\n      b = <1,\n           2> }  // c\n"},
    {"s=\"\xc3\xa9\"//a\nt=\"e\"//b", "s = \"\xc3\xa9\"  //a\nt = \"e\"  //b\n"},
};

static void format_lays_out(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof layouts / sizeof layouts[0]; i++) {
        const char *text = layouts[i].text;
        char *layout = formatted(text, strlen(text));
        const char *expected = layouts[i].layout;
        bool is_refused = strncmp(text, "k=", 2) == 0 && !expected[0];
        if (is_refused ? layout != NULL : !layout || strcmp(layout, expected) != 0) {
            fail_msg("%s\nbecomes\n%s\nexpected\n%s", text, layout ? layout : "-", expected);
        }
        free(layout);
        assert_true(is_refused || check_stays(text, strlen(text)));
    }
}

static void format_keeps_scenes(void **state) {
    (void)state;
    glob_t found;
    assert_int_equal(glob("tests/golden/grammar.st4", 0, NULL, &found), 0);
    glob("examples/*.st4", GLOB_APPEND, NULL, &found);
    glob("stdlib/*.st4", GLOB_APPEND, NULL, &found);
    for (size_t i = 0; i < found.gl_pathc; i++) {
        size_t size;
        char *text = read_test_file(found.gl_pathv[i], &size);
        if (!check_stays(text, size)) {
            fail_msg("%s does not parse", found.gl_pathv[i]);
        }
        free(text);
    }
    globfree(&found);
}

// White space and comments wherever there is a blank, more or less of it.
static void format_keeps_trees(void **state) {
    (void)state;
    static const char *const blanks[] = {
        " ", "\n", "\n\n\n  ", "\t", "// c\n", "/* c */", "/* c\n d */", " /*/**/", "  // \"{\n"};
    size_t size;
    char *text = read_test_file("tests/golden/grammar.st4", &size);
    uint64_t seed = 1;
    unsigned n_parsed = 0;
    for (int i = 0; i < 500; i++) {
        char *other = NULL;
        size_t n;
        FILE *out = open_memstream(&other, &n);
        for (size_t j = 0; j < size; j++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            fputc(text[j], out);
            if (j > 30 && text[j] == ' ' && (seed >> 40) % 64 < 3) {
                fputs(blanks[(seed >> 33) % (sizeof blanks / sizeof blanks[0])], out);
            }
        }
        fclose(out);
        n_parsed += check_stays(other, n);
        free(other);
    }
    assert_true(n_parsed > 20); // a line break before a label, and such, is refused
    free(text);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(format_lays_out),
    cmocka_unit_test(format_keeps_scenes),
    cmocka_unit_test(format_keeps_trees),
};

SUITE(format, tests)
