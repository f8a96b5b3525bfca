// SPDX-License-Identifier: Apache-2.0
// The command line: what is read, what is refused with what words, and that the tables are sound.
#include "lang/options.h"
#include "render/film_settings.h"
#include "tests/suite.h"

#include <string.h>

enum { MOST_WORDS = 20 };

// Splits line at spaces and parses it; messages go to said[n].
static bool parse(Arena *arena, const char *line, Options *options, char *said, size_t n) {
    char *words[MOST_WORDS + 1] = {(char[]){"st4"}};
    int n_words = 1;
    char *copy = arena_string(arena, line, strlen(line));
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " ")) {
        assert_true(n_words < MOST_WORDS);
        words[n_words++] = word;
    }
    FILE *err = tmpfile();
    assert_non_null(err);
    bool is_fine = options_parse(arena, n_words, words, options, err);
    rewind(err);
    size_t length = fread(said, 1, n - 1, err);
    said[length] = 0;
    fclose(err);
    return is_fine;
}

static Options parse_well(Arena *arena, const char *line) {
    Options options;
    char said[400];
    if (!parse(arena, line, &options, said, sizeof said)) {
        fail_msg("%s: %s", line, said);
    }
    assert_string_equal(said, "");
    return options;
}

static void options_reads_all_spellings(void **state) {
    (void)state;
    static const char *const lines[] = {
        "render a.st4 -s 9 -f 3",    "render -s9 a.st4 -f3",       "a.st4 --spp=9 --frames=3",
        "--spp 9 --frames 3 a.st4",  "-qs9 a.st4 -f 1 -f 3",       "-f3 -s 2 -s 9 -- a.st4",
        "-s 9 render -f 3 -- a.st4", "--frames 3 -s 09 -qv a.st4",
    };
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        Arena arena = {0};
        Options options = parse_well(&arena, lines[i]);
        assert_int_equal(options.command, COMMAND_RENDER);
        assert_int_equal(options.n_operands, 1);
        assert_string_equal(options.operands[0], "a.st4");
        assert_int_equal(options.values[OPTION_SPP].integer, 9);
        assert_int_equal(options.values[OPTION_FRAMES].frames.spans[0].first, 3);
        arena_free(&arena);
    }
}

static void options_reads_values(void **state) {
    (void)state;
    Arena arena = {0};
    Options o = parse_well(&arena, "a.st4 --size 640x480 --memory 1.5G --seed 18446744073709551615 "
                                   "--tolerance .5 --progress json --kappa=1e1 "
                                   "--crop 0,320,10,11 --aov z,motion");
    assert_true(o.values[OPTION_AOV].integer == (1u << LAYER_Z | 1u << LAYER_MOTION));
    assert_int_equal(o.values[OPTION_SIZE].width, 640);
    assert_int_equal(o.values[OPTION_SIZE].height, 480);
    assert_int_equal(o.values[OPTION_CROP].crop[1], 320);
    assert_int_equal(o.values[OPTION_CROP].crop[2], 10);
    assert_true(o.values[OPTION_MEMORY].integer == 1610612736);
    assert_true(o.values[OPTION_SEED].integer == UINT64_MAX);
    assert_true(o.values[OPTION_TOLERANCE].number == 0.5);
    assert_int_equal(o.values[OPTION_PROGRESS].integer, 1);
    assert_true(o.values[OPTION_KAPPA].number == 10);
    assert_false(o.values[OPTION_SPP].is_set);
    assert_int_equal(o.values[OPTION_SPP].integer, 64);
    arena_free(&arena);
}

static void options_keeps_lists_in_order(void **state) {
    (void)state;
    Arena arena = {0};
    Options options = parse_well(&arena, "check -Da=1 a.st4 -I x -D b=2");
    size_t n;
    const char *const *list = options_list(&arena, &options, OPTION_DEFINE, &n);
    assert_int_equal(n, 2);
    assert_string_equal(list[0], "a=1");
    assert_string_equal(list[1], "b=2");
    arena_free(&arena);
}

static void options_recipe_names_what_counts(void **state) {
    (void)state;
    Arena arena = {0};
    Options options = parse_well(&arena, "-j 5 a.st4 -Dx=1 -f 2 --memory 1M -q --spp=4 -o b.exr");
    assert_string_equal(options.recipe, "st4 render a.st4 -D x=1");
    arena_free(&arena);
}

static void options_refuses(void **state) {
    (void)state;
    static const struct {
        const char *line, *said;
    } cases[] = {
        {"a.st4 --frmes 3", "unknown option '--frmes'; did you mean '--frames'?"},
        {"a.st4 -Z", "unknown option '-Z'"},
        {"rendr", "'rendr' is neither a command nor a file; did you mean 'render'?"},
        {"render", "render is missing an operand; usage: st4 render [options] SCENE"},
        {"compare a.exr", "compare is missing an operand"},
        {"a.st4 b.st4", "render has an operand too many"},
        {"a.st4 -s", "--spp needs an argument, N"},
        {"a.st4 -D rpm", "-D: 'rpm' is not a param and its value, such as rpm=2400"},
        {"a.st4 -D =1", "-D: '=1' is not a param and its value"},
        {"a.st4 -s 0", "--spp: '0' is out of range: 1 to 16777216"},
        {"a.st4 -s 99999999999999999999", "--spp: '99999999999999999999' is out of range"},
        {"a.st4 -s 1.5x", "--spp: '1.5x' is not a number"},
        {"a.st4 -s -1", "--spp: '-1' is out of range: 1 to 16777216"},
        {"a.st4 --fps inf", "--fps: 'inf' is not a number"},
        {"a.st4 --fps 0x10", "--fps: '0x10' is not a number"},
        {"a.st4 --fps 1e999", "--fps: '1e999' is not a number"},
        {"a.st4 --size 640", "--size: '640' is not a size such as 640x480"},
        {"a.st4 --size 0x5", "out of range"},
        {"a.st4 --aov z,motoin", "--aov: there is no layer 'motoin'; did you mean 'motion'?"},
        {"a.st4 --aov z,,x", "--aov: there is no layer ''"},
        {"a.st4 --crop 1,2,3", "is not X0,X1,Y0,Y1"},
        {"a.st4 --crop 1,2,3,4,5", "is not X0,X1,Y0,Y1"},
        {"a.st4 --crop 2,2,3,4", "is not X0,X1,Y0,Y1"},
        {"a.st4 --crop -1,2,3,4", "is not X0,X1,Y0,Y1"},
        {"a.st4 --size 70000x5", "out of range"},
        {"a.st4 --memory 4Q", "--memory: '4Q' is not a number of bytes such as 4G"},
        {"a.st4 --memory 1", "--memory: '1' is out of range"},
        {"a.st4 --shutter 180", "--shutter: '180' is not a shutter such as 180deg"},
        {"a.st4 --shutter -4f", "out of range"},
        {"a.st4 --progress bra", "--progress: 'bra' is none of bar|json|none; did you mean 'bar'?"},
        {"a.st4 --quiet=yes", "--quiet takes no argument"},
        {"a.st4 -f 3-1", "--frames: 3-1 runs backwards"},
        {"a.st4 --stats=", "--stats: the argument is empty"},
        {"check a.st4 -o b.exr", "'st4 check' takes no --out"},
        {"compare a.exr b.exr -D x=1", "'st4 compare' takes no -D"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Arena arena = {0};
        Options options;
        char said[400];
        if (parse(&arena, cases[i].line, &options, said, sizeof said)) {
            fail_msg("taken: %s", cases[i].line);
        }
        if (!strstr(said, cases[i].said) || strchr(said, '\n') != said + strlen(said) - 1) {
            fail_msg("%s: %s", cases[i].line, said);
        }
        arena_free(&arena);
    }
}

static void options_table_is_sound(void **state) {
    (void)state;
    for (int i = 0; i < OPTION_COUNT; i++) {
        const OptionInfo *a = &option_infos[i];
        assert_true(a->letter || a->name);
        assert_true((a->argument == NULL) == (a->kind == OPTION_KIND_FLAG));
        assert_true(a->commands & ON_ALL);
        for (int k = 0; k < i; k++) {
            const OptionInfo *b = &option_infos[k];
            assert_false(a->letter && a->letter == b->letter);
            assert_false(a->name && b->name && !strcmp(a->name, b->name));
        }
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(options_reads_all_spellings),
    cmocka_unit_test(options_reads_values),
    cmocka_unit_test(options_keeps_lists_in_order),
    cmocka_unit_test(options_recipe_names_what_counts),
    cmocka_unit_test(options_refuses),
    cmocka_unit_test(options_table_is_sound),
};

SUITE(options, tests)
