// SPDX-License-Identifier: Apache-2.0
// Runs of statements that differ in their numbers, against the same statements with a ';' between
// them, which are no run: the same shapes and the same reports. What is not used costs nothing.
#include "lang/run.h"
#include "lang/scene_load.h"
#include "render/snapshot.h"
#include "tests/suite.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = 450, LINE = 256 };

static const char brick[] = "def Brick(w) { sphere { center = <w, -w, 2> } }";

typedef struct {
    Arena arena;
    Sources sources;
    Diag *diag;
    FILE *reports;
    LoadedScene loaded;
} Loaded;

static void load(Loaded *l, const char *text, const LoadOptions *options) {
    *l = (Loaded){.sources = {.end = 1}};
    l->sources.arena = &l->arena;
    l->reports = tmpfile();
    assert_non_null(l->reports);
    l->diag = diag_new(&l->arena, &l->sources, l->reports, false, false);
    scene_load(&l->arena, &l->sources, l->diag, "test.st4", text, strlen(text), options,
               &l->loaded);
    scene_load_free(&l->loaded);
}

static void unload(Loaded *l) {
    fclose(l->reports);
    arena_free(&l->arena);
}

// Writes statement i of a scene.
typedef int StatementWriter(char *line, int i);

// N statements, one a line; with ';' behind each they are parsed one by one.
static char *make_text(StatementWriter *write, const char *before, const char *between) {
    char *text = calloc(N + 2, LINE);
    size_t n = (size_t)snprintf(text, LINE, "%s\n", before);
    for (int i = 0; i < N; i++) {
        n += (size_t)write(text + n, i);
        n += (size_t)snprintf(text + n, LINE, "%s\n", between);
    }
    return text;
}

static double number(int i, int k) {
    return sin(i * 12.9898 + k * 78.233) * 10;
}

// ---- Shapes

static int write_sphere(char *line, int i) {
    return snprintf(line, LINE,
                    "sphere { center = <%.17g, %8.3f, %g> radius = %g material = matte(<%.2f, "
                    "0.25, %.3f>) }",
                    number(i, 0), number(i, 1), floor(number(i, 2)), fabs(number(i, 3)),
                    fabs(number(i, 4)) / 10, fabs(number(i, 5)) / 10);
}

static int write_moving(char *line, int i) {
    return snprintf(line, LINE,
                    "box { size = <%.3fcm, 1, 2> rotate y, %gdeg * t  translate <%g, 0, -1> * "
                    "sin(%gturn * t) visible = t < %gs }%s",
                    fabs(number(i, 0)) + 1, number(i, 1), number(i, 2), number(i, 3),
                    fabs(number(i, 4)), i % 7 == 0 ? " // a comment, 12" : "");
}

static int write_plain(char *line, int i) {
    return snprintf(line, LINE, "box { size = <%g, 1, %g> }", 1.0 + i, 2.0 + i);
}

static int write_named(char *line, int i) {
    return snprintf(line, LINE, "sphere Ball%d { radius = %d }", i, i + 1);
}

// Digits that are no number, numbers that are none of the label's, an index behind digits.
static int write_odd_names(char *line, int i) {
    return i % 3 == 0   ? snprintf(line, LINE, "sphere B%03d { radius = 2 }", i)
           : i % 3 == 1 ? snprintf(line, LINE, "sphere B2x%d_ { radius = %d }", i, i)
                        : snprintf(line, LINE, "sphere B_%d[%d] { }", i % 7, i);
}

static int write_named_group(char *line, int i) {
    return snprintf(line, LINE, "group Car%d { sphere Wheel%d { radius = %d } }", i, i % 4, i + 1);
}

static int write_labelled(char *line, int i) {
    return snprintf(line, LINE, "sphere Ball[%d] { radius = -2 ^ 2 + %g }", 3 * i % 17, 5.0 + i);
}

static int write_copy(char *line, int i) {
    return snprintf(line, LINE, "Brick(%g) { translate <%g, %g, 0> }", number(i, 0), number(i, 1),
                    i % 2 ? 1.0 : -1.0);
}

static int write_group(char *line, int i) {
    return snprintf(line, LINE,
                    "group { translate <%d, 0, 0> for k in 0..%d { sphere { center = <k, %g, 0> } "
                    "} }",
                    i, 3, number(i, 1));
}

static int write_choice(char *line, int i) {
    return snprintf(line, LINE, "group { if %d > 75 { sphere { radius = %g } } }", i,
                    fabs(number(i, 0)));
}

// Signs that are operators, names that end where numbers begin.
static int write_signs(char *line, int i) {
    return snprintf(line, LINE,
                    "sphere { let a = %d - 1 let b = (%s2) ^ 2 center = <a, b, -%d ^ 2> radius = "
                    "1e-3 * %d.5 + .25 }",
                    i, i % 2 ? "-" : "", i, i);
}

static double value_of(const Program *program, uint32_t k, const double *loops, uint32_t n,
                       double t, double otherwise) {
    double in[IN_COUNT] = {[IN_T] = t, [IN_FILM_T] = t, [IN_PX] = 0.3, [IN_PY] = 0.7}, out[16];
    if (!program) {
        return otherwise;
    }
    for (uint32_t i = 0; i < n; i++) {
        in[IN_LOOP0 + i] = loops[i];
    }
    program_run1(program, in, out);
    return k < program_n_out(program) ? out[k] : otherwise;
}

static void compare_copies(const Scene *a, const Shape *s, uint32_t i, const Scene *b,
                           const Shape *r, uint32_t j) {
    const double *loops = s->loops + (size_t)i * s->n_loops;
    const double *plain = r->loops + (size_t)j * r->n_loops;
    const Program *programs[][2] = {
        {s->geometry, r->geometry},
        {s->transform, r->transform},
        {s->visible, r->visible},
        {a->materials[s->material].program, b->materials[r->material].program}};
    assert_int_equal(s->kind, r->kind);
    for (int p = 0; p < 4; p++) {
        for (uint32_t k = 0; k < 12; k++) {
            double otherwise = p == 1 ? k % 5 == 0 : p == 2 ? 1 : 0;
            for (double t = 0; t < 3; t += 0.7) {
                double x = value_of(programs[p][0], k, loops, s->n_loops, t, otherwise);
                double y = value_of(programs[p][1], k, plain, r->n_loops, t, otherwise);
                assert_true(x == y);
            }
        }
    }
}

// A copy of a shape.
typedef struct {
    const Shape *shape;
    uint32_t instance;
} Copy;

// By object: each of them must be there once.
static Copy *copies_of(const Scene *scene, uint32_t *n) {
    uint32_t base = 0;
    *n = 0;
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        *n += scene->shapes[s].n_instances;
    }
    Copy *copies = calloc(*n, sizeof *copies);
    for (uint32_t s = 0; s < scene->n_shapes; s++) {
        const Shape *shape = &scene->shapes[s];
        for (uint32_t i = 0; i < shape->n_instances; i++) {
            uint32_t object = shape->objects ? shape->objects[i] : base + i;
            assert_in_range(object, 0, *n - 1);
            assert_null(copies[object].shape);
            copies[object] = (Copy){shape, i};
        }
        base += shape->n_instances;
    }
    return copies;
}

// All copies of all shapes, in order; `most`: shapes of the run besides the first RUN_MIN.
static void check_shapes(StatementWriter *write, const char *before, uint32_t most) {
    Loaded run, plain;
    char *text = make_text(write, before, ""), *text_plain = make_text(write, before, " ;");
    load(&run, text, NULL);
    load(&plain, text_plain, NULL);
    assert_non_null(run.loaded.scene);
    assert_non_null(plain.loaded.scene);
    const Scene *a = run.loaded.scene, *b = plain.loaded.scene;
    assert_in_range(a->n_shapes, 1, RUN_MIN + most);
    uint32_t n, n_plain;
    Copy *copies = copies_of(a, &n), *copies_plain = copies_of(b, &n_plain);
    assert_int_equal(n, n_plain);
    for (uint32_t i = 0; i < n; i++) {
        char name[64], name_plain[64];
        shape_name(copies[i].shape, copies[i].instance, name, sizeof name);
        shape_name(copies_plain[i].shape, copies_plain[i].instance, name_plain, sizeof name_plain);
        assert_true(strchr(name, '@') || strcmp(name, name_plain) == 0);
        compare_copies(a, copies[i].shape, copies[i].instance, b, copies_plain[i].shape,
                       copies_plain[i].instance);
    }
    free(copies);
    free(copies_plain);
    unload(&run);
    unload(&plain);
    free(text);
    free(text_plain);
}

static int write_mixed(char *line, int i) {
    static StatementWriter *const writers[] = {write_sphere, write_moving, write_copy, write_group,
                                               write_plain};
    return writers[(7 * i + i / 5) % 5](line, i);
}

// Some must be walked one by one, some are like no other.
static int write_medley(char *line, int i) {
    static StatementWriter *const writers[] = {write_sphere, write_choice, write_plain,
                                               write_labelled, write_named};
    return writers[i % 11 == 3 ? 4 : i % 4](line, i);
}

static int write_between(char *line, int i) {
    int n = i % 3 ? 0 : snprintf(line, LINE, "let r%d = %g ", i, 1.0 + i);
    return n +
           snprintf(line + n, LINE, "sphere { radius = r%d center = <%d, 0, 0> }", i / 30 * 30, i);
}

static void runs_are_their_statements(void **state) {
    (void)state;
    check_shapes(write_sphere, "", 1);
    check_shapes(write_moving, "", 1);
    check_shapes(write_copy, brick, 1);
    check_shapes(write_signs, "", N);
    check_shapes(write_group, "", 1);
}

static void runs_go_past_each_other(void **state) {
    (void)state;
    check_shapes(write_mixed, brick, 5);
    check_shapes(write_medley, "", N);
    check_shapes(write_between, "", 13);
    check_shapes(write_named, "", 1);
    check_shapes(write_labelled, "", 1);
    check_shapes(write_odd_names, "", N);
    check_shapes(write_named_group, "", N);
}

static void runs_are_walked_where_numbers_must_be_known(void **state) {
    (void)state;
    check_shapes(write_choice, "", N);
}

static void short_runs_keep_their_labels(void **state) {
    (void)state;
    Loaded l;
    load(&l, "sphere { radius = 1 }\nsphere { radius = 2 }\n", NULL);
    assert_non_null(l.loaded.scene);
    assert_int_equal(l.loaded.scene->n_shapes, 2);
    assert_string_equal(l.loaded.scene->shapes[1].label, "sphere@2");
    unload(&l);
}

// ---- Reports

static int write_typo(char *line, int i) {
    return snprintf(line, LINE, "sphere { raduis = %d }", i + 1);
}

static int write_bounds_of(char *line, int i, bool is_bad) {
    return snprintf(line, LINE, "sphere { center = <%d, 0, 0> radius = %s%d }", i,
                    is_bad ? "-" : "", i + 1);
}

static int write_bounds(char *line, int i) {
    return write_bounds_of(line, i, i % 150 == 117);
}

static int write_unit(char *line, int i) {
    return snprintf(line, LINE, "sphere { radius = %d%s }", i + 1, i == 90 ? "s" : "cm");
}

static int write_unknown(char *line, int i) {
    return snprintf(line, LINE, "sphere { radius = %d translate <%d, %s, 0> }", i + 1, i,
                    i == 120 ? "nothing" : "7");
}

static int write_broken(char *line, int i) {
    return snprintf(line, LINE, "sphere { center = <%d, 2, 3%s radius = 1 }", i,
                    i == 80 ? "" : ">");
}

// Kinds of mistakes that are found when runs are walked, and one by one.
static int write_mixed_mistakes(char *line, int i) {
    return i % 5 == 2   ? write_typo(line, i)
           : i % 5 == 3 ? write_bounds_of(line, i, i / 5 % 30 == 7)
                        : write_sphere(line, i);
}

// What all of them use is reported where the first of them stands.
static int write_late(char *line, int i) {
    return snprintf(line, LINE, "%s { translate <%d, 0, 0> %s }%s", i % 2 ? "sphere" : "box", i,
                    i >= N / 2 ? "scale r" : "scale 2", i == N - 1 ? "\nlet r = nothing" : "");
}

// The lines that say what is wrong and where.
static void read_reports(Loaded *l, char *text, size_t size) {
    char line[1024];
    size_t n = 0;
    rewind(l->reports);
    text[0] = '\0';
    while (fgets(line, sizeof line, l->reports)) {
        if (strncmp(line, "test.st4:", 9) == 0 && n + strlen(line) < size) {
            n += (size_t)snprintf(text + n, size - n, "%s", line);
        }
    }
}

static void check_reports(StatementWriter *write, const char *before, unsigned n_errors) {
    static char reports[2][65536];
    Loaded run, plain;
    char *text = make_text(write, before, ""), *text_plain = make_text(write, before, " ;");
    load(&run, text, NULL);
    load(&plain, text_plain, NULL);
    read_reports(&run, reports[0], sizeof reports[0]);
    read_reports(&plain, reports[1], sizeof reports[1]);
    assert_null(run.loaded.scene);
    assert_string_equal(reports[0], reports[1]);
    assert_int_equal(diag_n_errors(run.diag), n_errors);
    assert_int_equal(diag_n_errors(plain.diag), n_errors);
    unload(&run);
    unload(&plain);
    free(text);
    free(text_plain);
}

static void mistakes_in_runs_are_told_one_by_one(void **state) {
    (void)state;
    check_reports(write_typo, "", N);
    check_reports(write_bounds, "", 3);
    check_reports(write_unit, "", 1);
    check_reports(write_unknown, "", 1);
    check_reports(write_broken, "", 1);
    check_reports(write_copy, "", N); // there is no Brick
    check_reports(write_mixed_mistakes, "", 3 + N / 5);
    check_reports(write_late, "", 1);
}

// ---- What costs nothing

static const char unused[] = "let a = [for i in 0..100000: i * i]\n"
                             "fn f(x) = [for i in 0..100000: i * x]\n"
                             "def D(k) { for i in 0..100000 { sphere Ball[k * i] { } } }\n"
                             "let b = f(2)\n";

static bool loads_within(const char *more, uint64_t max_steps) {
    static char text[1024];
    Loaded l;
    const LoadOptions options = {.max_steps = max_steps};
    snprintf(text, sizeof text, "%s%s", unused, more);
    load(&l, text, &options);
    bool is_loaded = l.loaded.scene != NULL;
    unload(&l);
    return is_loaded;
}

static void what_is_not_used_is_not_evaluated(void **state) {
    (void)state;
    enum { STEPS = 1000 };
    assert_true(loads_within("sphere { }\n", STEPS));
    assert_true(loads_within("def E { D(1) { } } let c = b sphere { }\n", STEPS));
    assert_false(loads_within("sphere { radius = a[3] }\n", STEPS));
    assert_false(loads_within("sphere { radius = b[3] }\n", STEPS));
    assert_false(loads_within("D(2) { }\n", STEPS));
}

static void endless_loops_are_refused(void **state) {
    (void)state;
    Loaded l;
    static char reports[4096];
    load(&l, "for i in 0..1e18 { sphere { } }\n", NULL);
    read_reports(&l, reports, sizeof reports);
    assert_null(l.loaded.scene);
    assert_non_null(strstr(reports, "test.st4:1:10: error: this range has 1e+18 values"));
    unload(&l);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(runs_are_their_statements),
    cmocka_unit_test(runs_go_past_each_other),
    cmocka_unit_test(runs_are_walked_where_numbers_must_be_known),
    cmocka_unit_test(short_runs_keep_their_labels),
    cmocka_unit_test(mistakes_in_runs_are_told_one_by_one),
    cmocka_unit_test(what_is_not_used_is_not_evaluated),
    cmocka_unit_test(endless_loops_are_refused),
};

SUITE(runs, tests)
