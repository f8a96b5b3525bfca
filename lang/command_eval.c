// SPDX-License-Identifier: Apache-2.0
// st4 eval: expressions over time as a table, one line for each instant, columns between tabs.
#include "lang/command.h"

#include <string.h>

#include "lang/session.h"

typedef struct {
    const char *text; // as asked for
    SceneMotion motion;
    double **columns; // [n_columns][n]
    double unit;      // what a column's number is divided by
} Asked;

typedef struct {
    const double *times;
    size_t n;
} Instants;

// One digit less than doubles have: 0.15, not 0.15000000000000002.
static void print_number(double x) {
    printf("%.15g", x == 0 ? 0 : x);
}

// Text within a cell: what would end the cell becomes a space.
static void print_cell(const char *text) {
    for (; *text; text++) {
        putchar((unsigned char)*text < ' ' ? ' ' : *text);
    }
}

static bool is_type(const SceneMotion *motion, const char *type) {
    return strncmp(motion->type, type, strlen(type)) == 0;
}

// What a component can be asked of: a name, a call, something in brackets.
static void print_operand(const char *text) {
    bool is_plain = true;
    int depth = 0;
    for (const char *c = text; *c; c++) {
        depth += (strchr("([", *c) != NULL) - (strchr(")]", *c) != NULL);
        is_plain &= depth || !strchr(" +-*/%^<>=?:", *c);
    }
    fputs(is_plain ? "" : "(", stdout);
    print_cell(text);
    fputs(is_plain ? "" : ")", stdout);
}

static void print_component(const SceneMotion *motion, uint32_t k) {
    if (is_type(motion, "transform")) {
        printf("[%u][%u]", k / 4, k % 4);
    } else if (is_type(motion, "color")) {
        printf(".%c", "rgb"[k]);
    } else {
        printf(".%c", "xyzw"[k]);
    }
}

static void print_header(const Asked *asked, size_t n_asked) {
    putchar('t');
    for (size_t i = 0; i < n_asked; i++) {
        const SceneMotion *motion = &asked[i].motion;
        for (uint32_t k = 0; k < (motion->program ? motion->n_columns : 1); k++) {
            putchar('\t');
            if (motion->program && motion->n_columns > 1) {
                print_operand(asked[i].text);
                print_component(motion, k);
            } else {
                print_cell(asked[i].text);
            }
            fputs(is_type(motion, "angle") ? " [deg]" : "", stdout);
        }
    }
    putchar('\n');
}

static void print_line(const Asked *asked, size_t n_asked, const Instants *instants, size_t line) {
    print_number(instants->times[line]);
    for (size_t i = 0; i < n_asked; i++) {
        const SceneMotion *motion = &asked[i].motion;
        for (uint32_t k = 0; motion->program && k < motion->n_columns; k++) {
            putchar('\t');
            if (is_type(motion, "bool")) {
                fputs(asked[i].columns[k][line] != 0 ? "true" : "false", stdout);
            } else {
                print_number(asked[i].columns[k][line] / asked[i].unit);
            }
        }
        if (!motion->program) {
            putchar('\t');
            print_cell(motion->text);
        }
    }
    putchar('\n');
}

static void run(Arena *arena, Asked *asked, const Instants *instants) {
    const SceneMotion *motion = &asked->motion;
    ProgramInputs in = {.varying = 1u << IN_T | 1u << IN_FILM_T};
    in.at[IN_T] = in.at[IN_FILM_T] = instants->times;
    asked->unit = is_type(motion, "angle") ? 3.141592653589793 / 180 : 1;
    asked->columns = ARENA_ARRAY(arena, motion->n_columns, double *);
    for (uint32_t k = 0; k < motion->n_columns; k++) {
        asked->columns[k] = ARENA_ARRAY(arena, instants->n, double);
    }
    if (motion->program) {
        program_run(motion->program, &in, instants->n, asked->columns);
    }
}

// As asked for, else the beginning of each frame.
static bool find_instants(Session *session, LoadedScene *loaded, Instants *instants) {
    const char *at = session->options->values[OPTION_AT].text;
    if (at) {
        return scene_eval_times(loaded, session->arena, "--at", at, &instants->times, &instants->n);
    }
    const FilmSettings *film = &session->scene->film;
    double *times = NULL;
    size_t capacity = 0;
    instants->n = 0;
    for (int64_t f = film->first_frame; f <= film->last_frame && instants->n < FRAME_LIST_MAX;
         f++) {
        times = arena_grow(session->arena, times, instants->n, &capacity, sizeof *times);
        times[instants->n++] = (double)(f - 1) / film->fps;
    }
    instants->times = times;
    return true;
}

static int eval(Session *session, LoadedScene *loaded) {
    size_t n_asked = session->options->n_operands - 1;
    Asked *asked = ARENA_ARRAY(session->arena, n_asked, Asked);
    Instants instants;
    bool is_fine = find_instants(session, loaded, &instants);
    for (size_t i = 0; i < n_asked; i++) {
        asked[i].text = session->options->operands[i + 1];
        is_fine &= scene_eval(loaded, session->arena, asked[i].text, &asked[i].motion);
    }
    if (!is_fine) {
        return STATUS_SCENE;
    }
    for (size_t i = 0; i < n_asked; i++) {
        run(session->arena, &asked[i], &instants);
    }
    print_header(asked, n_asked);
    for (size_t line = 0; line < instants.n; line++) {
        print_line(asked, n_asked, &instants, line);
    }
    return STATUS_OK;
}

int command_eval(Arena *arena, const Options *options) {
    Session session;
    LoadedScene loaded;
    int status = session_load(&session, arena, options, &loaded);
    status = status ? status : session_close(&session, eval(&session, &loaded));
    scene_load_free(&loaded);
    return status;
}
