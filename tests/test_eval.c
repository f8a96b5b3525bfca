// SPDX-License-Identifier: Apache-2.0
// The language: scripts under tests/lang/ that say what comes of them.
//
// Comments in the scripts:
//   // error: TEXT      on the line of an error whose message or hint holds TEXT
//   // warning: TEXT    likewise
//   // expect: EXPR -> VALUE [at T]    numbers, to a relative 1e-12; else the text that is printed
//   // shapes: N        so many shapes are lowered (batched loops count once)
// A script without errors must load; every error and warning reported must be expected.
#include "lang/scene_load.h"
#include "tests/suite.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_MARKS = 256, MAX_LINE = 1024 };

typedef struct {
    char kind[16];
    char text[512];
    unsigned line;
    bool is_met;
} Mark;

typedef struct {
    const char *path;
    Mark marks[MAX_MARKS];
    unsigned n_marks, n_failures;
} Script;

static void complain(Script *script, unsigned line, const char *what, const char *text) {
    print_error("%s:%u: %s: %s\n", script->path, line, what, text);
    script->n_failures++;
}

static void read_marks(Script *script) {
    static const char *const kinds[] = {"error", "warning", "expect", "shapes"};
    char line[MAX_LINE];
    FILE *file = fopen(script->path, "r");
    assert_non_null(file);
    for (unsigned n = 1; fgets(line, sizeof line, file); n++) {
        line[strcspn(line, "\n")] = '\0';
        for (char *at = line; (at = strstr(at, "// ")); at += 3) {
            for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
                size_t size = strlen(kinds[k]);
                if (strncmp(at + 3, kinds[k], size) == 0 && at[3 + size] == ':') {
                    assert_true(script->n_marks < MAX_MARKS);
                    Mark *mark = &script->marks[script->n_marks++];
                    snprintf(mark->kind, sizeof mark->kind, "%s", kinds[k]);
                    snprintf(mark->text, sizeof mark->text, "%s", at + 5 + size);
                    char *next = strstr(mark->text, " // ");
                    if (next) {
                        *next = '\0';
                    }
                    mark->line = n;
                }
            }
        }
    }
    fclose(file);
}

// The value of a string or number field of a line of JSON, as it stands there.
static bool json_field(const char *line, const char *name, char *value, size_t size) {
    char key[64];
    snprintf(key, sizeof key, "\"%s\":", name);
    const char *at = strstr(line, key);
    if (!at) {
        return false;
    }
    at += strlen(key);
    bool is_string = *at == '"';
    at += is_string;
    size_t n = 0;
    while (*at && n + 1 < size && (is_string ? *at != '"' : *at != ',' && *at != '}')) {
        at += *at == '\\' && at[1];
        value[n++] = *at++;
    }
    value[n] = '\0';
    return true;
}

static void match_report(Script *script, const char *line) {
    char severity[16] = "", number[16] = "", message[512] = "", hint[512] = "";
    json_field(line, "severity", severity, sizeof severity);
    json_field(line, "line", number, sizeof number);
    json_field(line, "message", message, sizeof message);
    json_field(line, "hint", hint, sizeof hint);
    unsigned at = (unsigned)strtoul(number, NULL, 10);
    if (strcmp(severity, "note") == 0) {
        return;
    }
    for (unsigned i = 0; i < script->n_marks; i++) {
        Mark *mark = &script->marks[i];
        if (!mark->is_met && strcmp(mark->kind, severity) == 0 && mark->line == at &&
            (strstr(message, mark->text) || strstr(hint, mark->text))) {
            mark->is_met = true;
            return;
        }
    }
    char text[1100];
    snprintf(text, sizeof text, "%s (hint: %s)", message, hint);
    complain(script, at, severity, text);
}

static bool expects_errors(const Script *script) {
    for (unsigned i = 0; i < script->n_marks; i++) {
        if (strcmp(script->marks[i].kind, "error") == 0) {
            return true;
        }
    }
    return false;
}

// "EXPR -> VALUE at T"; the value's numbers are separated by spaces.
static void check_value(Script *script, LoadedScene *loaded, Arena *arena, Mark *mark) {
    char *value = strstr(mark->text, " -> "), *time = strstr(mark->text, " at ");
    double t = time ? strtod(time + 4, NULL) : 0, in[IN_COUNT] = {0}, out[16];
    assert_non_null(value);
    if (time) {
        *time = '\0';
    }
    *value = '\0';
    value += 4;
    mark->is_met = true;
    SceneMotion motion;
    if (!scene_eval(loaded, arena, mark->text, &motion)) {
        complain(script, mark->line, "cannot be evaluated", mark->text);
        return;
    }
    if (!motion.program) {
        if (strcmp(motion.text, value) != 0) {
            complain(script, mark->line, "is another text", motion.text);
        }
        return;
    }
    in[IN_T] = in[IN_FILM_T] = t;
    program_run1(motion.program, in, out);
    for (unsigned k = 0; k < motion.n_columns; k++) {
        char *end;
        double expected = strtod(value, &end);
        if (end == value || !(fabs(out[k] - expected) <= 1e-12 * fmax(1, fabs(expected)))) {
            char text[64];
            snprintf(text, sizeof text, "%.17g", out[k]);
            complain(script, mark->line, mark->text, text);
            return;
        }
        value = end;
    }
}

static void check_marks(Script *script, LoadedScene *loaded, Arena *arena) {
    for (unsigned i = 0; i < script->n_marks; i++) {
        Mark *mark = &script->marks[i];
        if (strcmp(mark->kind, "expect") == 0) {
            check_value(script, loaded, arena, mark);
        } else if (strcmp(mark->kind, "shapes") == 0 && loaded->scene) {
            mark->is_met = loaded->scene->n_shapes == strtoul(mark->text, NULL, 10);
            if (!mark->is_met) {
                print_error("%u shapes, ", loaded->scene->n_shapes);
            }
        }
        if (!mark->is_met) {
            complain(script, mark->line, "was not reported", mark->text);
        }
    }
}

static void run_script(Script *script) {
    Arena arena = {0};
    Sources sources = {.arena = &arena, .end = 1};
    FILE *reports = tmpfile();
    assert_non_null(reports);
    read_marks(script);
    Diag *diag = diag_new(&arena, &sources, reports, true, false);
    LoadedScene loaded;
    LoadOptions options = {.max_steps = 1 << 20};
    scene_load(&arena, &sources, diag, script->path, NULL, 0, &options, &loaded);
    bool has_errors = expects_errors(script);
    if (has_errors ? loaded.status == 0 || loaded.scene : loaded.status != 0 || !loaded.scene) {
        complain(script, 1, "status", loaded.status ? "not 0" : "0");
    }
    rewind(reports);
    char line[4096];
    while (fgets(line, sizeof line, reports)) {
        match_report(script, line);
    }
    check_marks(script, &loaded, &arena);
    fclose(reports);
    scene_load_free(&loaded);
    arena_free(&arena);
}

static int by_name(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static void scripts_do_as_they_say(void **state) {
    (void)state;
    char *names[256];
    unsigned n = 0, n_failures = 0;
    DIR *folder = opendir("tests/lang");
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder)) && n < 256;) {
        const char *ending = strrchr(entry->d_name, '.');
        if (ending && strcmp(ending, ".st4") == 0) {
            names[n++] = strdup(entry->d_name);
        }
    }
    closedir(folder);
    assert_true(n > 10);
    qsort(names, n, sizeof *names, by_name);
    for (unsigned i = 0; i < n; i++) {
        char path[512];
        snprintf(path, sizeof path, "tests/lang/%s", names[i]);
        Script *script = calloc(1, sizeof *script);
        assert_non_null(script);
        script->path = path;
        run_script(script);
        n_failures += script->n_failures;
        free(script);
        free(names[i]);
    }
    assert_int_equal(n_failures, 0);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(scripts_do_as_they_say),
};

SUITE(eval, tests)
