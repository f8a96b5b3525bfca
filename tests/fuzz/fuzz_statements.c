// SPDX-License-Identifier: Apache-2.0
// Properties, statements and files, as lang/parse.c reads them.
#include <string.h>

#include "tests/fuzz/fuzz_grammar.h"

// ---- Properties

static void write_word_of(Writer *w, const char *words) {
    size_t n = strlen(words);
    const char *word = words + fuzz_random(w, (uint32_t)n + 1);
    while (word > words && word[-1] != ' ') {
        word--;
    }
    fuzz_put(w, "%.*s", (int)strcspn(word, " "), word);
}

static void write_value(Writer *w, const PropertyInfo *info, int depth) {
    static const WriteType types[] = {[PROPERTY_TYPE_NUMBER] = WRITE_NUMBER,
                                      [PROPERTY_TYPE_COUNT] = WRITE_NUMBER,
                                      [PROPERTY_TYPE_ANGLE] = WRITE_ANGLE,
                                      [PROPERTY_TYPE_BOOL] = WRITE_BOOL,
                                      [PROPERTY_TYPE_STRING] = WRITE_STRING,
                                      [PROPERTY_TYPE_STRINGS] = WRITE_STRING,
                                      [PROPERTY_TYPE_VEC2] = WRITE_VEC2,
                                      [PROPERTY_TYPE_VEC3] = WRITE_VEC3,
                                      [PROPERTY_TYPE_COLOR] = WRITE_COLOR,
                                      [PROPERTY_TYPE_RANGE] = WRITE_RANGE,
                                      [PROPERTY_TYPE_MATERIAL] = WRITE_MATERIAL,
                                      [PROPERTY_TYPE_FUNCTION] = WRITE_VEC3,
                                      [PROPERTY_TYPE_LIST] = WRITE_LIST,
                                      [PROPERTY_TYPE_NUMBER_OR_LIST] = WRITE_NUMBER,
                                      [PROPERTY_TYPE_WORD] = WRITE_STRING,
                                      [PROPERTY_TYPE_WORD_OR_NUMBER] = WRITE_NUMBER,
                                      [PROPERTY_TYPE_WORD_OR_FUNCTION] = WRITE_STRING,
                                      [PROPERTY_TYPE_ANY] = WRITE_NUMBER};
    if (schema_takes_words(info) && !fuzz_one_in(w, 4)) {
        write_word_of(w, info->names);
    } else if (*info->default_text && fuzz_one_in(w, 3)) {
        fuzz_put(w, "%s", info->default_text);
    } else if (info->dimension && types[info->type] == WRITE_NUMBER && fuzz_one_in(w, 2)) {
        fuzz_write_scalar(w, info->dimension);
    } else if (info->type == PROPERTY_TYPE_COUNT && fuzz_one_in(w, 2)) {
        fuzz_put(w, "%u", fuzz_random(w, 5));
    } else {
        fuzz_write(w, types[info->type], depth - 1);
    }
}

void fuzz_write_property_value(Writer *w, const char *property, int depth) {
    uint32_t k = fuzz_random(w, PROPERTY_COUNT);
    for (uint32_t i = 0; i < PROPERTY_COUNT; i++, k = (k + 1) % PROPERTY_COUNT) {
        if (strcmp(property_infos[k].name, property) == 0) {
            write_value(w, &property_infos[k], depth);
            return;
        }
    }
    fuzz_write_expression(w, depth);
}

static void write_property(Writer *w, const PropertyInfo *info, int depth) {
    if (info->type == PROPERTY_TYPE_FUNCTION) {
        fuzz_put(w, "fn %s(", info->name);
        fuzz_put(w, "%.*s", (int)strcspn(info->names, " "), info->names);
        const char *second = strchr(info->names, ' ');
        if (second && fuzz_one_in(w, 2)) {
            fuzz_put(w, ", %.*s", (int)strcspn(second + 1, " "), second + 1);
        }
        fuzz_put(w, ") = ");
    } else {
        fuzz_put(w, "%s = ", info->name);
    }
    write_value(w, info, depth);
    fuzz_put(w, fuzz_one_in(w, 3) ? "\n" : "  ");
}

void fuzz_write_properties(Writer *w, ObjectKind kind, int depth) {
    uint32_t first = node_infos[kind].first, n = schema_end(kind) - first;
    for (uint32_t i = 0, wanted = n ? fuzz_random(w, 4) : 0; i < wanted; i++) {
        write_property(w, &property_infos[first + fuzz_random(w, n)], depth);
    }
}

// ---- Statements

static void write_block(Writer *w, int depth) {
    fuzz_put(w, "{\n");
    for (uint32_t i = 0, n = fuzz_random(w, 4); i < n; i++) {
        fuzz_write_statement(w, depth - 1);
    }
    fuzz_put(w, "}\n");
}

static void write_node(Writer *w, int depth) {
    ObjectKind kind = (ObjectKind)fuzz_random(w, OBJECT_KINDS);
    if (node_infos[kind].class == NODE_CLASS_COMMON ||
        (node_infos[kind].status == SCHEMA_LATER && !fuzz_one_in(w, 8))) {
        kind = OBJECT_GROUP;
    }
    fuzz_put(w, "%s ", node_infos[kind].name);
    if (fuzz_one_in(w, 10)) {
        fuzz_write_given_name(w);
    }
    fuzz_put(w, "{ ");
    fuzz_write_properties(w, kind, depth);
    const ObjectKind *common = schema_common(kind);
    for (; *common != OBJECT_KINDS; common++) {
        if (fuzz_one_in(w, 3)) {
            fuzz_write_properties(w, *common, depth);
        }
    }
    for (uint32_t i = 0, n = fuzz_random(w, kind == OBJECT_GROUP ? 4 : 2); i < n; i++) {
        fuzz_write_statement(w, depth - 1);
    }
    fuzz_put(w, "}\n");
}

static void write_transform(Writer *w, int depth) {
    switch (fuzz_random(w, 4)) {
    case 0:
        fuzz_put(w, "translate ");
        fuzz_write(w, WRITE_VEC3, depth);
        break;
    case 1:
        fuzz_put(w, "scale ");
        fuzz_write(w, fuzz_one_in(w, 2) ? WRITE_NUMBER : WRITE_VEC3, depth);
        break;
    case 2:
        fuzz_put(w, "rotate ");
        fuzz_write(w, WRITE_VEC3, depth);
        fuzz_put(w, ", ");
        fuzz_write(w, WRITE_ANGLE, depth);
        break;
    default:
        fuzz_put(w, "matrix ");
        fuzz_write(w, fuzz_one_in(w, 2) ? WRITE_TRANSFORM : WRITE_VEC4, depth);
        if (fuzz_one_in(w, 2)) {
            fuzz_put(w, ", ");
            fuzz_write(w, WRITE_VEC4, depth);
            fuzz_put(w, ", ");
            fuzz_write(w, WRITE_VEC4, depth);
        }
    }
    fuzz_put(w, "\n");
}

static void write_binding(Writer *w, int depth) {
    static const char *const words[] = {"let", "param", "let", "clip"};
    if (fuzz_one_in(w, 3)) {
        fuzz_put(w, "fn ");
        fuzz_write_given_name(w);
        fuzz_put(w, fuzz_one_in(w, 3) ? "(a, b = 1) = " : "(a) = ");
    } else {
        PUT_ONE_OF(w, words);
        fuzz_put(w, " ");
        fuzz_write_given_name(w);
        fuzz_put(w, " = ");
    }
    fuzz_write_expression(w, depth);
    fuzz_put(w, fuzz_one_in(w, 5) ? "; " : "\n");
}

static void write_copy(Writer *w, int depth) {
    if (fuzz_one_in(w, 2)) {
        fuzz_put(w, "def ");
        fuzz_write_given_name(w);
        fuzz_put(w, fuzz_one_in(w, 2) ? "(a, b = 1) " : " ");
    } else {
        fuzz_put(w, fuzz_one_in(w, 12) ? "instance " : "");
        fuzz_write_given_name(w);
        fuzz_put(w, fuzz_one_in(w, 12) ? ".a" : "");
        if (fuzz_one_in(w, 2)) {
            fuzz_put(w, "(");
            fuzz_write_expression(w, depth);
            fuzz_put(w, ")");
        }
        fuzz_put(w, " ");
    }
    write_block(w, depth);
}

static void write_span(Writer *w, int depth) {
    if (fuzz_one_in(w, 4)) {
        fuzz_write(w, WRITE_RANGE, depth);
    } else {
        fuzz_put(w, "%us..%us", fuzz_random(w, 3), 1 + fuzz_random(w, 3));
    }
}

static void write_play(Writer *w, int depth) {
    static const char *const names[] = {"at", "fade", "speed", "parts"};
    static const char *const clips[] = {"a", "b", "K.b", "i < 1 ? a : b", "[K.b, a][i]"};
    fuzz_put(w, "play(");
    PUT_ONE_OF(w, clips);
    for (int k = 0; k < 4; k++) {
        if (fuzz_one_in(w, 2)) {
            fuzz_put(w, ", %s = ", names[k]);
            fuzz_write(w, WRITE_NUMBER, depth);
        }
    }
    fuzz_put(w, fuzz_one_in(w, 4) ? ", once = true)" : ")");
}

// A def with clips, and an instance that plays them, perhaps many.
static void write_clips(Writer *w, int depth) {
    fuzz_put(w, "def J { surface { fn at(u, v) = <u, v, t> } }\ndef K { clip a = ");
    write_span(w, depth);
    fuzz_put(w, "  clip b = ");
    write_span(w, depth);
    fuzz_put(w, "\n%s", fuzz_one_in(w, 4) ? "instance J { speed = 2  cycle = 1.5s }\n" : "");
    fuzz_write_statement(w, depth - 1);
    fuzz_write_statement(w, depth - 1);
    fuzz_put(w, "}\nfor i in 0..%u { instance K { clips = %s[a", fuzz_random(w, 4),
             fuzz_one_in(w, 4) ? "i < 2 ? [b] : " : "");
    for (uint32_t k = 0, n = fuzz_random(w, 4); k < n; k++) {
        fuzz_put(w, ", ");
        write_play(w, depth - 1);
    }
    fuzz_put(w, "]\n");
    write_transform(w, depth - 1);
    fuzz_put(w, "} }\n");
}

static void write_condition(Writer *w, int depth) {
    fuzz_put(w, fuzz_one_in(w, 8) ? "when " : "if ");
    fuzz_write(w, WRITE_BOOL, depth);
    fuzz_put(w, " ");
    write_block(w, depth);
    if (fuzz_one_in(w, 3)) {
        fuzz_put(w, "else ");
        write_block(w, depth);
    }
}

static void write_loop(Writer *w, int depth) {
    fuzz_put(w, "for %c in ", "ij"[fuzz_random(w, 2)]);
    if (fuzz_one_in(w, 2)) {
        fuzz_put(w, "0..%u", fuzz_random(w, 5));
    } else {
        fuzz_write(w, fuzz_one_in(w, 2) ? WRITE_RANGE : WRITE_LIST, depth);
    }
    fuzz_put(w, " ");
    write_block(w, depth);
}

static void write_rare(Writer *w, int depth) {
    switch (fuzz_random(w, 5)) {
    case 0:
        fuzz_put(w, "include ");
        fuzz_write_file_name(w);
        fuzz_put(w, fuzz_one_in(w, 2) ? " as m\n" : "\n");
        break;
    case 1:
        fuzz_put(w, "assert ");
        fuzz_write(w, WRITE_BOOL, depth);
        fuzz_put(w, ", \"no\"\n");
        break;
    case 2:
        fuzz_write_given_name(w);
        fuzz_put(w, "' = ");
        fuzz_write_expression(w, depth);
        fuzz_put(w, "\n");
        break;
    case 3:
        fuzz_put(w, fuzz_one_in(w, 2) ? "sim " : "joint ");
        fuzz_write_given_name(w);
        fuzz_put(w, " ");
        fuzz_write_given_name(w);
        fuzz_put(w, " ");
        write_block(w, depth);
        break;
    default:
        fuzz_put(w, fuzz_one_in(w, 2) ? "// a comment\n" : "/* another */ ");
    }
}

void fuzz_write_statement(Writer *w, int depth) {
    if (depth <= 0 || w->n + 64 > w->max) {
        fuzz_put(w, "sphere { }\n");
        return;
    }
    switch (fuzz_random(w, 16)) {
    case 15:
        write_clips(w, depth);
        break;
    case 14:
        fuzz_write_sim(w, depth);
        break;
    case 0:
    case 1:
        write_binding(w, depth);
        break;
    case 2:
        write_copy(w, depth);
        break;
    case 3:
        write_condition(w, depth);
        break;
    case 4:
    case 5:
        write_loop(w, depth);
        break;
    case 6:
    case 7:
        write_transform(w, depth);
        break;
    case 8:
        fuzz_put(w, "print ");
        fuzz_write_expression(w, depth);
        fuzz_put(w, "\n");
        break;
    case 9:
        write_rare(w, depth);
        break;
    default:
        write_node(w, depth);
    }
}

// ---- Files

static void write_mesh(Writer *w) {
    uint32_t n = 3 + fuzz_random(w, 4);
    for (uint32_t i = 0; i < n; i++) {
        fuzz_put(w, "v %u %u %u\n", fuzz_random(w, 3), fuzz_random(w, 3), fuzz_random(w, 3));
    }
    for (uint32_t i = 0; i < 3; i++) {
        fuzz_put(w, "f %u %u %d\n", 1 + fuzz_random(w, n), 1 + fuzz_random(w, n),
                 (int)fuzz_random(w, n) - 2);
    }
}

void fuzz_write_file(Writer *w) {
    switch (fuzz_random(w, 6)) {
    case 0:
        fuzz_put(w, "\n//@ m.obj\n");
        write_mesh(w);
        break;
    case 1:
        fuzz_put(w, "\n//@ t.csv\n");
        for (uint32_t i = 0, n = fuzz_random(w, 5); i < n; i++) {
            fuzz_put(w, "%u, %u.5\n", i, fuzz_random(w, 9));
        }
        break;
    case 2:
        fuzz_put(w, "\n//@ -D\n");
        fuzz_write_given_name(w);
        fuzz_put(w, "=");
        fuzz_write_expression(w, 2);
        break;
    case 3:
        fuzz_put(w, "\n//@ %s.st4\n", fuzz_one_in(w, 2) ? "b" : "c");
        fuzz_write_statement(w, 3);
        fuzz_write_statement(w, 2);
        break;
    default:
        fuzz_put(w, "\n//@ %s\n", fuzz_one_in(w, 8) ? "shutter" : "eval");
        fuzz_write_expression(w, 3);
    }
}

void fuzz_write_scene(Writer *w) {
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 6); i < n; i++) {
        fuzz_write_statement(w, 4);
    }
    if (fuzz_one_in(w, 3)) {
        fuzz_write_file(w);
    }
}
