// SPDX-License-Identifier: Apache-2.0
// What the words of lang/words.def are answered with: all that it tells to write exists.
#include "lang/builtins.h"
#include "lang/schema.h"
#include "tests/suite.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    const char *nodes, *word, *instead; // nodes NULL: anywhere
} Word;

static const Word words[] = {
#define WORD(word, instead)           {NULL, word, instead},
#define WORD_IN(nodes, word, instead) {nodes, word, instead},
#include "lang/words.def"
#undef WORD
};

// Names that a reader puts their own in the place of, besides single letters.
static bool is_placeholder(const char *name) {
    return strlen(name) == 1 || schema_has_word("NAME Wheel height", name);
}

static bool is_keyword(const char *name) {
    static const char *const keywords[] = {
#define KEYWORD(id, text) text,
#include "lang/keywords.def"
#undef KEYWORD
    };
    for (size_t i = 0; i < sizeof keywords / sizeof keywords[0]; i++) {
        if (strcmp(keywords[i], name) == 0) {
            return true;
        }
    }
    return false;
}

static bool is_function(const char *name) {
    const char *names[256];
    size_t n = builtins_names(names, 256);
    for (size_t i = 0; i < n; i++) {
        if (strcmp(names[i], name) == 0) {
            return true;
        }
    }
    return false;
}

// A property of a node of the list, or of any if that is NULL.
static bool is_property(const char *nodes, const char *name) {
    for (int kind = 0; kind < OBJECT_KINDS; kind++) {
        if ((!nodes || schema_has_word(nodes, node_infos[kind].name)) &&
            schema_property((ObjectKind)kind, name) != PROPERTY_COUNT) {
            return true;
        }
    }
    return false;
}

// `name(`, `name =`, `name {`. node: whose block it stands in, or NULL.
static bool exists(const Word *word, const char *node, const char *name, char next) {
    if (is_placeholder(name) || is_keyword(name)) {
        return true;
    }
    if (next == '{') {
        return schema_node(name) != OBJECT_KINDS;
    }
    const char *nodes = node ? node : word->nodes;
    bool is_statement = !node && nodes && strcmp(nodes, "statement") == 0;
    return (next == '(' && is_function(name)) || is_property(is_statement ? NULL : nodes, name);
}

static unsigned check_hint(const Word *word) {
    char name[64] = "", node[64] = "";
    unsigned n_failures = 0;
    for (const char *at = word->instead; *at;) {
        size_t n = 0;
        while (isalnum((unsigned char)at[n]) || at[n] == '_') {
            n++;
        }
        if (!n) {
            node[0] = *at == '}' ? '\0' : node[0];
            at++;
            continue;
        }
        assert_true(n < sizeof name);
        snprintf(name, sizeof name, "%.*s", (int)n, at);
        at += n;
        const char *next = *at == '(' ? at : at + strspn(at, " ");
        bool is_name = !isdigit((unsigned char)name[0]) && *next && strchr("(={", *next);
        if (is_name && !exists(word, node[0] ? node : NULL, name, *next)) {
            print_error("%s: \"%s\": there is no '%s'\n", word->word, word->instead, name);
            n_failures++;
        }
        if (is_name && *next == '{') {
            snprintf(node, sizeof node, "%s", schema_node(name) == OBJECT_KINDS ? "" : name);
        }
    }
    return n_failures;
}

static void words_name_what_exists(void **state) {
    (void)state;
    unsigned n_failures = 0;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        n_failures += check_hint(&words[i]);
    }
    assert_int_equal(n_failures, 0);
    // It would be seen.
    assert_int_equal(check_hint(&(Word){NULL, "a", "write material = matt(<r, g, b>)"}), 1);
    assert_int_equal(check_hint(&(Word){NULL, "a", "write lamp { size = 1 }"}), 1);
    assert_int_equal(check_hint(&(Word){"sun", "a", "write from = <x, y, z>"}), 1);
    assert_int_equal(check_hint(&(Word){NULL, "a", "write bulb { power = 1 }"}), 1);
}

// Each is found, in its node before anywhere else; none is a name that the node knows itself.
static void words_are_found(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        const Word *word = &words[i];
        if (!word->nodes) {
            assert_string_equal(schema_foreign_word(NULL, word->word), word->instead);
            continue;
        }
        char nodes[100];
        snprintf(nodes, sizeof nodes, "%s", word->nodes);
        for (char *node = strtok(nodes, " "); node; node = strtok(NULL, " ")) {
            assert_string_equal(schema_foreign_word(node, word->word), word->instead);
            ObjectKind kind = schema_node(node);
            if (kind != OBJECT_KINDS) {
                assert_int_equal(schema_property(kind, word->word), PROPERTY_COUNT);
            } else {
                assert_string_equal(node, "statement");
            }
        }
    }
    assert_null(schema_foreign_word(NULL, "sphere"));
    assert_null(schema_foreign_word("sphere", "<"));
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(words_name_what_exists),
    cmocka_unit_test(words_are_found),
};

SUITE(words, tests)
