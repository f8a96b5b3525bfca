// SPDX-License-Identifier: Apache-2.0
// The parser: trees of the whole grammar, extents of nodes, reports, hostile input.
#include "lang/syntax.h"

#include <stdlib.h>
#include <string.h>

#include "tests/suite.h"
#include "tests/syntax_helpers.h"

static const struct {
    const char *text, *tree;
} trees[] = {
    {"", ""},
    {"// nothing", ""},
    {"x = 1", "(= x 1)\n"},
    {"x = 1 y = 2; z=3", "(= x 1)\n(= y 2)\n(= z 3)\n"},
    {"x = 1 - 2 - 3", "(= x (- (- 1 2) 3))\n"},
    {"x = 1 + 2 * 3 % 4", "(= x (+ 1 (% (* 2 3) 4)))\n"},
    {"x = -2 ^ -3 ^ 2", "(= x (- (^ 2 (- (^ 3 2)))))\n"},
    {"x = a.b[1](2, c = 3,).d", "(= x (. (call (index (. a b) 1) 2 c=3) d))\n"},
    {"x = not a and b or c", "(= x (or (and (not a) b) c))\n"},
    {"x = not not a == b", "(= x (not (not (== a b))))\n"},
    {"x = a ? b : c ? d : e", "(= x (? a b (? c d e)))\n"},
    {"x = a ? b ? 1 : 2 : 3", "(= x (? a (? b 1 2) 3))\n"},
    {"x = a < b ? 0..1 : 2", ""}, // a range is no part of a conditional
    {"x = 0..1", "(= x (.. 0 1))\n"},
    {"x = 0...5 by .25", "(= x (.. 0 0.5 0.25))\n"},
    {"x = -1turn..0.5turn v = 3", "(= x (.. (- 1turn) 0.5turn))\n(= v 3)\n"},
    {"x = 1..2 by = 3", "(= x (.. 1 2))\n(= by 3)\n"},
    {"x = a or = 3 and = 4", "(= x a)\n(= or 3)\n(= and 4)\n"},
    {"x = <1, -2, a*b>", "(= x (vector 1 (- 2) (* a b)))\n"},
    {"x = <1>", "(= x (vector 1))\n"},
    {"x = <1, 2>==<3, 4>", "(= x (== (vector 1 2) (vector 3 4)))\n"},
    {"x = <1, 2> < <3, 4>", "(= x (< (vector 1 2) (vector 3 4)))\n"},
    {"x = <(a < b), <1, 2>.x>", "(= x (vector (< a b) (. (vector 1 2) x)))\n"},
    {"x = a <b", "(= x (< a b))\n"},
    {"x = [] y = [1,]", "(= x (list))\n(= y (list 1))\n"},
    {"x = [for i in 0..3: i]", "(= x (each i (.. 0 3) _ i))\n"},
    {"x = [for i in a if i > 1: [i]]", "(= x (each i a (> i 1) (list i)))\n"},
    {"x = [for, in]", "(= x (list for in))\n"},
    {"x = keys { 0s: 1 }", "(= x (keys () (0s 1)))\n"},
    {"x = keys loop ease(1, b = 2) { 0s: -1 step, 2s: a[1] spring(3, 4), }",
     "(= x (keys (loop (ease 1 b=2)) (0s (- 1) step) (2s (index a 1) (spring 3 4))))\n"},
    {"x = keys { 0s: 1, 1s: keys { 0s: 2 } }", "(= x (keys () (0s 1) (1s (keys () (0s 2)))))\n"},
    {"x = \"a\\\"\\\\\\n\\tb\"", "(= x \"a\\\"\\\\\\n\\tb\")\n"},
    {"x = (a\n - b) y = [1\n -2] z = f(a\n(b))",
     "(= x (- a b))\n(= y (list (- 1 2)))\n(= z (call f (call a b)))\n"},
    {"x = a +\n b *\n -c", "(= x (+ a (* b (- c))))\n"},
    {"x = a\n + b", "(= x (+ a b))\n"},
    {"let a = 1 param b = 2 clip c = 0s..1s", "(let a 1)\n(param b 2)\n(clip c (.. 0s 1s))\n"},
    {"let let = let", "(let let let)\n"},
    {"let = 1 if = 2 for = 3 sim = 4 rotate = 5", "(= let 1)\n(= if 2)\n(= for 3)\n(= sim 4)\n"
                                                  "(= rotate 5)\n"},
    {"fn f(x, y = 2) = x fn g() = 1", "(fn f (x y=2) x)\n(fn g () 1)\n"},
    {"fn at(u, v,) = u", "(fn at (u v) u)\n"},
    {"def A { } def B(r = 1) { ; }", "(def A (block))\n(def B (r=1) (block))\n"},
    {"for i in 0..2 { A { } }", "(for i (.. 0 2) (block (object A (block))))\n"},
    {"if a { } else if b { } else { x = 1 }", "(if a (block) (if b (block) (block (= x 1))))\n"},
    {"if a { } else = 1", "(if a (block))\n(= else 1)\n"},
    {"include \"a.st4\" include \"b.st4\" as b", "(include \"a.st4\")\n(include \"b.st4\" b)\n"},
    {"assert a > 1 assert a, \"m\"", "(assert (> a 1))\n(assert a \"m\")\n"},
    {"print a, \"b\", <1, 2>", "(print a \"b\" (vector 1 2))\n"},
    {"translate <1, 2, 3> rotate y, 90deg, p scale 2 matrix m",
     "(translate (vector 1 2 3))\n(rotate y 90deg p)\n(scale 2)\n(matrix m)\n"},
    {"x = rotate(y, a) * translate(v)", "(= x (* (call rotate y a) (call translate v)))\n"},
    {"sim state S { x' = -x when x < 0 { x = 1 } }",
     "(sim state S (block (rate x (- x)) (when (< x 0) (block (= x 1)))))\n"},
    {"joint hinge Door { }", "(joint hinge Door (block))\n"},
    {"joint ball Pin[i] { }", "(joint ball Pin i (block))\n"},
    {"joint slider { }", "(joint slider (block))\n"},
    {"sphere { }", "(object sphere (block))\n"},
    {"sphere\n{\n}", "(object sphere (block))\n"},
    {"a.b.c(1, r = 2) Left[i + 1] { x = 1 }",
     "(object (. (. a b) c) (args 1 r=2) (label Left (+ i 1)) (block (= x 1)))\n"},
    {"instance Car Red { } instance = 3", "(instance Car (label Red) (block))\n(= instance 3)\n"},
    {"\xef\xbb\xbfx = 1\r\ny = 2\r\n", "(= x 1)\n(= y 2)\n"},
    {"#!/usr/bin/st4\nst4 1 x = 1", "(= x 1)\n"},
    {"x /* a\n// b */ = // c\n 1", "(= x 1)\n"},
    {"x = 1_000.5e-1_0", ""}, // no underscores in exponents
    {"x = 9007199254740993 y = 1e23 z = 4.9e-324",
     "(= x 9007199254740992)\n(= y 9.9999999999999992e+22)\n(= z 4.9406564584124654e-324)\n"},
    {"x = 0.1e1 y = 1_0.2_5 z = 00012345678901234567890",
     "(= x 1)\n(= y 10.25)\n(= z 1.2345678901234567e+19)\n"},
    {"x = 2f y = 3fps z = 1e3ms w = 5Hz", "(= x 2f)\n(= y 3fps)\n(= z 1000ms)\n(= w 5Hz)\n"},
};

static void syntax_trees(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof trees / sizeof trees[0]; i++) {
        Parsed parsed;
        parse_text(&parsed, "t.st4", trees[i].text, strlen(trees[i].text), false);
        bool is_refused = !trees[i].tree[0] && trees[i].text[0] && trees[i].text[0] != '/';
        if (parsed.syntax->has_errors != is_refused) {
            fail_msg("%s\n%s", trees[i].text, parsed.report);
        }
        if (!is_refused) {
            char *tree = parsed_dump(&parsed);
            if (strcmp(tree, trees[i].tree) != 0) {
                fail_msg("%s\ngives     %s\nexpected  %s", trees[i].text, tree, trees[i].tree);
            }
            free(tree);
        }
        assert_int_equal(diag_n_errors(parsed.diag) > 0, is_refused);
        parsed_free(&parsed);
    }
}

// Numbers of every length against the C library, which the lexer's quick path must equal.
static void syntax_numbers(void **state) {
    (void)state;
    unsigned seed = 1;
    for (int i = 0; i < 20000; i++) {
        char text[64] = "";
        size_t n = 0;
        for (int part = 0; part < 2; part++) {
            unsigned digits = 1 + (seed = seed * 1664525 + 1013904223) % 12;
            for (unsigned j = 0; j < digits; j++) {
                seed = seed * 1664525 + 1013904223;
                text[n++] = (char)('0' + (seed >> 20) % 10);
            }
            if (part == 0) {
                text[n++] = '.';
            }
        }
        seed = seed * 1664525 + 1013904223;
        sprintf(text + n, "e%d", (int)((seed >> 16) % 80) - 40);
        Parsed parsed;
        parse_expr_text(&parsed, text);
        assert_int_not_equal(parsed.expr, 0);
        double number = syntax_number(syntax_node(parsed.syntax, parsed.expr));
        double expected = strtod(text, NULL);
        if (memcmp(&number, &expected, sizeof number) != 0) {
            fail_msg("%s is %a, expected %a", text, number, expected);
        }
        parsed_free(&parsed);
    }
}

// The marked text is the extent of one node of the kind: [[...]].
static const struct {
    NodeKind kind;
    const char *marked;
} spans[] = {
    {NODE_NUMBER, "x = ([[1_0.5deg]] )"},
    {NODE_STRING, "x = [[\"a\\\"b\"]] // c"},
    {NODE_NAME, "x = ((( [[abc]] ) ))"},
    {NODE_VECTOR, "x = [[<1, (2 /*,*/ ) >]]"},
    {NODE_VECTOR, "x = [[<1, 2>]]==y"},
    {NODE_LIST, "x = f([[[ ]]], 3)"},
    {NODE_LIST, "x = ([[[1, (a), ]]])"},
    {NODE_COMPREHENSION, "x = [[[for i in a if b: (c) ]]]"},
    {NODE_KEYS, "x = [[keys linear { 0s: (1) , }]] y = 1"},
    {NODE_KEYS, "x = [[keys { 0s: 1 ease(1, 2) }]] y = 1"},
    {NODE_MODE, "x = keys { 0s: 1 [[ease(1, (2))]] } y = 1"},
    {NODE_MODE, "x = keys [[loop]] { 0s: 1 }"},
    {NODE_CALL, "x = 1 + [[(f)(a, b = ((c)), )]] * 2"},
    {NODE_CALL, "x = [[f( )]] y = 2"},
    {NODE_MEMBER, "x = [[(a). b]] + c"},
    {NODE_INDEX, "x = ([[a[(1) ]]])"},
    {NODE_UNARY, "x = 1 + [[- (2)]] y = 2"},
    {NODE_BINARY, "x = ( [[(a) * ((b))]] ) y = 2"},
    {NODE_COND, "x = [[(a) ? b : (c)]] y = 2"},
    {NODE_RANGE, "x = [[(0)..1 by (2)]] y = 2"},
    {NODE_RANGE, "x = [[0..(1)]] y = 2"},
    {NODE_LET, "x = 1 [[let y = (2)]] z = 3"},
    {NODE_PARAM, "x = 1 [[param y = f(2)]] z = 3"},
    {NODE_FN, "[[fn f(x, y = (1)) = (x)]] z = 3"},
    {NODE_DEF, "[[def A(x) { y = 1; }]] z = 3"},
    {NODE_FOR, "[[for i in 0..3 { }]] z = 3"},
    {NODE_IF, "[[if (a) { x = 1 } else { y = 1 }]] z = 3"},
    {NODE_INCLUDE, "[[include \"a\"]] z = 3"},
    {NODE_INCLUDE, "[[include \"a\" as b]] z = 3"},
    {NODE_ASSERT, "[[assert (a), \"b\"]] z = 3"},
    {NODE_ASSERT, "[[assert (a)]] z = 3"},
    {NODE_PRINT, "[[print a, (b)]] z = 3"},
    {NODE_TRANSFORM, "[[rotate y, (90deg)]] z = 3"},
    {NODE_SIM, "[[sim rigid A { x = 1 }]] z = 3"},
    {NODE_JOINT, "[[joint hinge A { x = 1 }]] z = 3"},
    {NODE_WHEN, "[[when a { x = 1 }]] z = 3"},
    {NODE_CLIP, "[[clip a = (1)]] z = 3"},
    {NODE_RATE, "[[a ' = (1)]] z = 3"},
    {NODE_PROPERTY, "[[a = ((1))]] z = 3"},
    {NODE_OBJECT, "x = 1 [[instance a.b(1) L[2] { x = (1) }]] z = 3"},
    {NODE_BLOCK, "sphere [[{ x = (1) ; }]] z = 3"},
    {NODE_BLOCK, "sphere [[{ // }\n x = ) }]] z = 3"},
    {NODE_PARAMS, "fn f [[(x, y = (1) , )]] = 2"},
    {NODE_PARAMS, "fn f [[( )]] = 2"},
};

// Marks lie outside of brackets that double by chance: the first [[ and the last ]].
static char *unmark(const char *marked, uint32_t *lo, uint32_t *hi) {
    const char *open = strstr(marked, "[["), *close = NULL;
    for (const char *at = open; (at = strstr(at, "]]")); at++) {
        close = at;
    }
    assert_non_null(close);
    char *text = calloc(1, strlen(marked) + 1);
    size_t n = (size_t)(open - marked), inner = (size_t)(close - open - 2);
    memcpy(text, marked, n);
    memcpy(text + n, open + 2, inner);
    strncpy(text + n + inner, close + 2, strlen(marked) - n - inner - 4);
    *lo = 1 + (uint32_t)n;
    *hi = *lo + (uint32_t)inner;
    return text;
}

static void syntax_spans(void **state) {
    (void)state;
    bool has_kind[NODE_KINDS] = {false};
    for (size_t i = 0; i < sizeof spans / sizeof spans[0]; i++) {
        uint32_t lo, hi;
        char *text = unmark(spans[i].marked, &lo, &hi);
        Parsed parsed;
        parse_text(&parsed, "t.st4", text, strlen(text), false);
        bool is_found = false;
        for (NodeId id = 1; id < parsed.syntax->n_nodes; id++) {
            Span span = syntax_span(parsed.syntax, id);
            assert_true(span.lo >= 1 && span.hi <= 1 + strlen(text) && span.lo <= span.hi);
            is_found |= syntax_node(parsed.syntax, id)->kind == spans[i].kind && span.lo == lo &&
                        span.hi == hi;
        }
        if (!is_found) {
            fail_msg("no node of kind %d is so long: %s\n%s", spans[i].kind, spans[i].marked,
                     parsed.report);
        }
        has_kind[spans[i].kind] = true;
        parsed_free(&parsed);
        free(text);
    }
    for (int kind = NODE_NONE + 1; kind < NODE_KINDS; kind++) {
        if (!has_kind[kind]) {
            fail_msg("node kind %d has no test of its extent", kind);
        }
    }
}

static void syntax_names(void **state) {
    (void)state;
    static const struct {
        const char *text, *name;
    } cases[] = {
        {"let /* a */ abc = 1", "abc"},
        {"param abc = 1", "abc"},
        {"fn abc(x) = 1", "abc"},
        {"def abc { }", "abc"},
        {"for abc in 1..2 { }", "abc"},
        {"clip abc = 1", "abc"},
        {"abc' = 1", "abc"},
        {"abc = 1", "abc"},
        {"instance a.bc L { }", "a.bc"},
        {"sim rigid abc { }", "abc"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Parsed parsed;
        parse_text(&parsed, "t.st4", cases[i].text, strlen(cases[i].text), false);
        const Node *root = syntax_node(parsed.syntax, parsed.syntax->root);
        assert_int_equal(root->b, 1);
        Span span = syntax_name_span(parsed.syntax, parsed.syntax->extra[root->a]);
        assert_int_equal(span.hi - span.lo, strlen(cases[i].name));
        assert_memory_equal(cases[i].text + span.lo - 1, cases[i].name, span.hi - span.lo);
        parsed_free(&parsed);
    }
}

static void syntax_single_expressions(void **state) {
    (void)state;
    Parsed parsed;
    parse_expr_text(&parsed, "a\n- 2*b");
    assert_int_not_equal(parsed.expr, 0);
    char *tree = parsed_dump(&parsed);
    assert_string_equal(tree, "(- a (* 2 b))\n");
    free(tree);
    parsed_free(&parsed);
    static const char *const bad[] = {"", "1 2", "a = 1", "(1", "5 deg", "1 +", "$"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        parse_expr_text(&parsed, bad[i]);
        assert_int_equal(parsed.expr, 0);
        assert_int_equal(diag_n_errors(parsed.diag), 1);
        parsed_free(&parsed);
    }
}

static const char *const goldens[] = {"grammar", "traps",   "tokens", "statements", "open",
                                      "many",    "headers", "povray", "habits"};

static void syntax_golden_reports(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof goldens / sizeof goldens[0]; i++) {
        char path[64];
        size_t size, expected_size;
        snprintf(path, sizeof path, "tests/golden/%s.txt", goldens[i]);
        char *expected = read_test_file(path, &expected_size);
        snprintf(path, sizeof path, "tests/golden/%s.st4", goldens[i]);
        char *text = read_test_file(path, &size);
        Parsed parsed;
        parse_text(&parsed, path, text, size, false);
        if (strcmp(parsed.report, expected) != 0) {
            fail_msg("%s reports\n%s\nexpected\n%s", path, parsed.report, expected);
        }
        parsed_free(&parsed);
        free(text);
        free(expected);
    }
}

// Carets stand under what a terminal shows: tabs, wide and combining characters, CR LF, control
// characters, and lines too long to be shown whole.
static void syntax_aligns_carets(void **state) {
    (void)state;
    static const struct {
        const char *text, *report;
    } cases[] = {
        {"let a = \"\xe6\xbc\xa2\xe5\xad\x97\" 3",
         "t.st4:1:14: error: expected a statement, found '3'\n"
         "    1 | let a = \"\xe6\xbc\xa2\xe5\xad\x97\" 3\n"
         "      |                ^ properties are written name = value\n"},
        {"\tlet a = \"e\xcc\x81\" 3\r\n",
         "t.st4:1:15: error: expected a statement, found '3'\n"
         "    1 |     let a = \"e\xcc\x81\" 3\n"
         "      |                 ^ properties are written name = value\n"},
        {"let a = \"\x1b[31m\" )", "t.st4:1:17: error: expected a statement, found ')'\n"
                                   "    1 | let a = \"\xef\xbf\xbd[31m\" )\n"
                                   "      |                 ^\n"},
        {"let a = [0000000000, 1111111111, 2222222222, 3333333333, 4444444444, 5555555555 x, "
         "6666666666, 7777777777, 8888888888, 9999999999]",
         "t.st4:1:81: error: expected ']' after '5555555555', found 'x'\n"
         "    1 | ... 1111111111, 2222222222, 3333333333, 4444444444, 5555555555 x, 6666666666, "
         "7777777777, 8888888888, 9...\n"
         "      |                                                                ^\n"
         "t.st4:1:9: note: to close this '['\n"
         "    1 | let a = [0000000000, 1111111111, 2222222222, 3333333333, 4444444444, "
         "5555555555 x, 6666666666, 77777...\n"
         "      |         ^\n"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Parsed parsed;
        parse_text(&parsed, "t.st4", cases[i].text, strlen(cases[i].text), false);
        assert_string_equal(parsed.report, cases[i].report);
        parsed_free(&parsed);
    }
}

static unsigned errors_of(const char *text, size_t size) {
    Parsed parsed;
    parse_text(&parsed, "t.st4", text, size, false);
    unsigned n = diag_n_errors(parsed.diag);
    parsed_free(&parsed);
    return n;
}

static void syntax_refuses_what_is_no_text(void **state) {
    (void)state;
    static const struct {
        const char *text;
        size_t size;
        unsigned n_errors;
    } cases[] = {
        {"x = 1\0y = 2", 11, 1},                 // NUL
        {"// \xff\xfe, \xc0\x80\nx = 1", 15, 1}, // said once
        {"x = \"\xed\xa0\x80\"", 9, 1},          // a surrogate
        {"x = \"\xf4\x8f\xbf\xbf\"", 10, 0},     // the last character
        {"x = \"\xf4\x90\x80\x80\"", 10, 1},
        {"x = \"\xe6\xbc", 7, 1}, // cut off; that the string is open follows from it
        {"\xef\xbb\xbf", 3, 0},
        {"\xff\xfex\0", 4, 1}, // UTF-16
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        unsigned n = errors_of(cases[i].text, cases[i].size);
        if (n != cases[i].n_errors) {
            fail_msg("case %zu: %u errors, expected %u", i, n, cases[i].n_errors);
        }
    }
}

// n copies of open, middle, n copies of close
static char *nested(const char *begin, const char *open, const char *middle, const char *close,
                    unsigned n) {
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    fputs(begin, out);
    for (unsigned i = 0; i < n; i++) {
        fputs(open, out);
    }
    fputs(middle, out);
    for (unsigned i = 0; i < n; i++) {
        fputs(close, out);
    }
    fclose(out);
    return text;
}

static void syntax_bounds_nesting(void **state) {
    (void)state;
    static const struct {
        const char *begin, *open, *middle, *close;
        unsigned levels; // of each; 0: 1
    } cases[] = {
        {"x = ", "(", "1", ")"},
        {"x = ", "[", "1", "]"},
        {"x = ", "<", "1", ">"},
        {"x = ", "-", "1", ""},
        {"x = ", "not ", "a", ""},
        {"x = ", "2^", "1", ""},
        {"x = ", "a ? ", "1", ": 2"},
        {"x = ", "a ? 1 : ", "1", ""},
        {"x = ", "f(", "1", ")"},
        {"x = ", "f(a=", "1", ")"},
        {"x = a", "[a", "[1]", "]"},
        {"x = ", "keys{0s:", "1", "}"},
        {"x = ", "keys m(", "1", "){0:1}", 2},
        {"x = ", "[for i in ", "a", ":i]"},
        {"", "group {", "", "}"},
        {"", "if a { } else ", "{ }", ""},

        {"", "for i in a {", "", "}"},
        {"", "def A {", "", "}"},
        {"", "when a {", "", "}"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (unsigned n = 0; n < 3; n++) {
            // 255 levels leave one for the middle; the deepest has no end.
            unsigned levels = cases[i].levels ? cases[i].levels : 1;
            unsigned depth = n == 0 ? 255 / levels : n == 1 ? 257 / levels + 1 : 100000;
            char *text = nested(cases[i].begin, cases[i].open, n == 2 ? "" : cases[i].middle,
                                n == 2 ? "" : cases[i].close, depth);
            unsigned n_errors = errors_of(text, strlen(text));
            if (n_errors != (n > 0)) {
                fail_msg("%s%s..., %u deep: %u errors", cases[i].begin, cases[i].open, depth,
                         n_errors);
            }
            free(text);
        }
    }
}

static void syntax_bounds_height(void **state) {
    (void)state;
    static const char *const more[] = {"+1", "*a", " and b", "[1]", ".x", "()", " or c", "-1"};
    for (size_t i = 0; i < sizeof more / sizeof more[0]; i++) {
        char *text = nested("x = a", more[i], "", "", 999);
        assert_int_equal(errors_of(text, strlen(text)), 0);
        free(text);
        text = nested("x = a", more[i], "", "", 100000);
        assert_int_equal(errors_of(text, strlen(text)), 1);
        free(text);
    }
}

// No text makes the parser crash, hang or leave a node with an impossible extent.
static void check_survives(const char *text, size_t size) {
    Parsed parsed;
    parse_text(&parsed, "t.st4", text, size, false);
    assert_int_equal(parsed.syntax->has_errors, diag_n_errors(parsed.diag) > 0);
    for (NodeId id = 1; id < parsed.syntax->n_nodes; id += 7) {
        Span span = syntax_span(parsed.syntax, id);
        if (!(span.lo >= 1 && span.hi <= 1 + size && span.lo <= span.hi)) {
            fail_msg("node %u has the extent %u to %u in %.*s", id, span.lo, span.hi, (int)size,
                     text);
        }
    }
    free(parsed_dump(&parsed));
    parsed_free(&parsed);
}

static void syntax_survives_mutations(void **state) {
    (void)state;
    size_t size;
    char *text = read_test_file("tests/golden/grammar.st4", &size);
    char *mutated = malloc(size);
    uint64_t seed = 1;
    for (int i = 0; i < 20000; i++) {
        memcpy(mutated, text, size);
        size_t n = size;
        for (int change = 0; change <= i % 3; change++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            size_t at = (size_t)(seed >> 33) % n;
            switch (seed >> 29 & 3) {
            case 0: // another byte
                mutated[at] = (char)(seed >> 20);
                break;
            case 1: // a byte from elsewhere
                mutated[at] = text[(seed >> 12) % size];
                break;
            case 2: // one less
                memmove(mutated + at, mutated + at + 1, --n - at);
                break;
            default: // the end
                n = i % 5 ? n : at + 1;
                break;
            }
        }
        check_survives(mutated, n);
    }
    free(mutated);
    free(text);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(syntax_trees),
    cmocka_unit_test(syntax_numbers),
    cmocka_unit_test(syntax_spans),
    cmocka_unit_test(syntax_names),
    cmocka_unit_test(syntax_single_expressions),
    cmocka_unit_test(syntax_golden_reports),
    cmocka_unit_test(syntax_aligns_carets),
    cmocka_unit_test(syntax_refuses_what_is_no_text),
    cmocka_unit_test(syntax_bounds_nesting),
    cmocka_unit_test(syntax_bounds_height),
    cmocka_unit_test(syntax_survives_mutations),
};

SUITE(syntax, tests)
