// SPDX-License-Identifier: Apache-2.0
// Names, numbers, and expressions by their types.
#include "tests/fuzz/fuzz_grammar.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "lang/builtins.h"

static const char *const punctuation[] = {
#define TOKEN(id, text) text,
#include "lang/tokens.def"
#undef TOKEN
};
static const char *const keywords[] = {
#define KEYWORD(id, text) text,
#include "lang/keywords.def"
#undef KEYWORD
};
static const struct {
    const char *name;
    int n_arguments;
} modes[] = {
#define MODE(id, name, n_arguments, help) {name, n_arguments},
#include "lang/keys.def"
#undef MODE
};
static const char *const ends[] = {
#define END(id, name, help) name,
#include "lang/keys.def"
#undef END
};
static const char *const foreign_words[] = {
#define WORD(word, instead) word,
#include "lang/words.def"
#undef WORD
};

static const char *const variables[] = {"t", "T", "x",  "y", "z", "p", "n",       "P",
                                        "N", "u", "uv", "v", "i", "j", "film.fps"};
static const char *const file_names[] = {"b.st4", "c.st4", "m.obj", "m.stl",
                                         "m.ply", "t.csv", "w.pc2", "s.%d.obj"};

// ---- Chance

uint32_t fuzz_random(Writer *w, uint32_t n) {
    w->state = w->state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((w->state >> 33) * (uint64_t)n >> 31);
}

bool fuzz_one_in(Writer *w, uint32_t n) {
    return fuzz_random(w, n) == 0;
}

void fuzz_put(Writer *w, const char *format, ...) {
    char text[256];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    fuzz_put_text(w, text, n > 0 && (size_t)n < sizeof text ? (size_t)n : 0);
}

void fuzz_put_text(Writer *w, const char *text, size_t n) {
    if (n <= w->max - w->n) {
        memcpy(w->text + w->n, text, n);
        w->n += n;
    }
}

static const char *result_of(int builtin) {
    return builtin_infos[builtin].result;
}

void fuzz_write_given_name(Writer *w) {
    // Few, so that they meet.
    static const char *const names[] = {"a", "b", "c", "i", "j", "f", "g", "D", "E", "m"};
    PUT_ONE_OF(w, names);
}

void fuzz_write_punctuation(Writer *w) {
    PUT_ONE_OF(w, punctuation);
}

void fuzz_write_name(Writer *w) {
    switch (fuzz_random(w, 8)) {
    case 0:
        fuzz_put(w, "%s", node_infos[fuzz_random(w, OBJECT_KINDS)].name);
        break;
    case 1:
    case 2:
        fuzz_put(w, "%s", property_infos[fuzz_random(w, PROPERTY_COUNT)].name);
        break;
    case 3:
        fuzz_put(w, "%s", builtin_infos[fuzz_random(w, BUILTIN_COUNT)].name);
        break;
    case 4:
        PUT_ONE_OF(w, variables);
        break;
    case 5:
        PUT_ONE_OF(w, keywords);
        break;
    case 6:
        if (fuzz_one_in(w, 8)) {
            PUT_ONE_OF(w, foreign_words);
            break;
        }
        fuzz_put(w, "%s",
                 fuzz_one_in(w, 2) ? modes[fuzz_random(w, N_OF(modes))].name
                                   : ends[fuzz_random(w, N_OF(ends))]);
        break;
    default:
        fuzz_write_given_name(w);
    }
}

void fuzz_write_number(Writer *w) {
    static const char *const special[] = {
        "0",     "1",     "2",          "0.5",        "1e-9",     "1e9",   "1e18",
        "1e300", "1e308", "2147483648", "4294967295", "16777217", "65536", "9007199254740993",
        "255",   "1e-30", "0.0",        "1_000",      "1e400",    "5e-324"};
    if (fuzz_one_in(w, 4)) {
        PUT_ONE_OF(w, special);
    } else if (fuzz_one_in(w, 2)) {
        fuzz_put(w, "%u", fuzz_random(w, 8));
    } else {
        fuzz_put(w, "%u.%u", fuzz_random(w, 10), fuzz_random(w, 100));
    }
}

// ---- Expressions

static const char *const type_names[WRITE_TYPES] = {[WRITE_NUMBER] = "number",
                                                    [WRITE_ANGLE] = "angle",
                                                    [WRITE_BOOL] = "bool",
                                                    [WRITE_STRING] = "string",
                                                    [WRITE_VEC2] = "vec",
                                                    [WRITE_VEC3] = "vec3",
                                                    [WRITE_VEC4] = "vec",
                                                    [WRITE_COLOR] = "color",
                                                    [WRITE_ROTATION] = "rotation",
                                                    [WRITE_LIST] = "list",
                                                    [WRITE_TRANSFORM] = "transform",
                                                    [WRITE_MATERIAL] = "material",
                                                    [WRITE_RANGE] = "range"};

// A type that a word of lang/builtins.def names; those that name several: one of them.
static WriteType type_of_word(Writer *w, const char *word) {
    for (int type = 0; type < WRITE_TYPES; type++) {
        size_t n = strlen(type_names[type]);
        if (strncmp(word, type_names[type], n) == 0 && !(word[n] >= '0' && word[n] <= 'z')) {
            return (WriteType)type;
        }
    }
    static const WriteType values[] = {WRITE_NUMBER, WRITE_ANGLE,    WRITE_VEC3,     WRITE_VEC2,
                                       WRITE_COLOR,  WRITE_ROTATION, WRITE_TRANSFORM};
    return strncmp(word, "scalar", 6) == 0 ? (WriteType)fuzz_random(w, 2)
                                           : values[fuzz_random(w, N_OF(values))];
}

static bool may_give(const char *result, WriteType type) {
    size_t n = strlen(type_names[type]);
    return (strncmp(result, type_names[type], n) == 0 && !(result[n] >= '0' && result[n] <= '9')) ||
           strncmp(result, "the same", 8) == 0 || strncmp(result, "value", 5) == 0;
}

void fuzz_write_scalar(Writer *w, Dimension dimension) {
    fuzz_write_number(w);
    uint32_t k = fuzz_random(w, UNIT_COUNT);
    for (int i = 0; dimension && i < UNIT_COUNT; i++, k = (k + 1) % UNIT_COUNT) {
        if (unit_infos[k].dimension == dimension) {
            fuzz_put(w, "%s", unit_infos[k].text);
            return;
        }
    }
    if (fuzz_one_in(w, 40)) {
        fuzz_put(w, "%s", unit_infos[k].text);
    }
}

static void write_components(Writer *w, int n, int depth) {
    fuzz_put(w, "<");
    for (int i = 0; i < n; i++) {
        fuzz_put(w, i ? ", " : "");
        fuzz_write(w, WRITE_NUMBER, depth - 1);
    }
    fuzz_put(w, ">");
}

void fuzz_write_file_name(Writer *w) {
    if (fuzz_one_in(w, 8)) {
        fuzz_put(w, "\"motion.st4\"");
    } else {
        fuzz_put(w, "\"%s\"", file_names[fuzz_random(w, N_OF(file_names))]);
    }
}

static void write_list(Writer *w, WriteType item, int depth) {
    if (fuzz_one_in(w, 4)) {
        fuzz_put(w, "[for i in ");
        fuzz_write(w, fuzz_one_in(w, 4) ? WRITE_LIST : WRITE_RANGE, depth - 1);
        if (fuzz_one_in(w, 3)) {
            fuzz_put(w, " if ");
            fuzz_write(w, WRITE_BOOL, depth - 1);
        }
        fuzz_put(w, ": ");
        fuzz_write(w, item, depth - 1);
        fuzz_put(w, "]");
        return;
    }
    fuzz_put(w, "[");
    for (uint32_t i = 0, n = fuzz_random(w, 5); i < n; i++) {
        fuzz_put(w, i ? ", " : "");
        fuzz_write(w, item, depth - 1);
    }
    fuzz_put(w, "]");
}

static void write_leaf(Writer *w, WriteType type) {
    switch (type) {
    case WRITE_NUMBER:
        if (fuzz_one_in(w, 3)) {
            PUT_ONE_OF(w, variables);
        } else {
            fuzz_write_scalar(w, DIMENSION_NONE);
        }
        break;
    case WRITE_ANGLE:
        fuzz_write_scalar(w, DIMENSION_ANGLE);
        fuzz_put(w, fuzz_one_in(w, 3) ? "*t" : "");
        break;
    case WRITE_BOOL:
        fuzz_put(w, fuzz_one_in(w, 2) ? "true" : "t < 1");
        break;
    case WRITE_STRING:
        if (fuzz_one_in(w, 3)) {
            fuzz_write_file_name(w);
        } else {
            fuzz_put(w, fuzz_one_in(w, 2) ? "\"#c83\"" : "\"a\\n\"");
        }
        break;
    case WRITE_VEC2:
    case WRITE_VEC3:
    case WRITE_VEC4:
        if (type == WRITE_VEC3 && fuzz_one_in(w, 3)) {
            static const char *const vectors[] = {"x", "y", "z", "p", "n", "P", "N"};
            PUT_ONE_OF(w, vectors);
        } else {
            write_components(w, type == WRITE_VEC2 ? 2 : type == WRITE_VEC3 ? 3 : 4, 0);
        }
        break;
    case WRITE_COLOR:
        fuzz_put(w, fuzz_one_in(w, 2) ? "srgb(\"#c83\")" : "<0.7, 0.2, t>");
        break;
    case WRITE_ROTATION:
        fuzz_put(w, "rotate(y, 1turn*t)");
        break;
    case WRITE_TRANSFORM:
        fuzz_put(w, fuzz_one_in(w, 2) ? "translate(x)" : "scale(2)");
        break;
    case WRITE_MATERIAL:
        fuzz_put(w, "matte(<1, 1, 1>)");
        break;
    case WRITE_LIST:
        fuzz_put(w, fuzz_one_in(w, 2) ? "[<0, 0, 0>, <1, 0, 0>, <0, 1, t>]"
                                      : "[[0, 1, 2], [2, 1, 0]]");
        break;
    default:
        fuzz_write_number(w);
        fuzz_put(w, "..");
        fuzz_write_number(w);
        if (fuzz_one_in(w, 6)) {
            fuzz_put(w, " by ");
            fuzz_write_number(w);
        }
    }
}

// The comma behind a parameter, whose default may be a vector; NULL: it is the last.
static const char *end_of(const char *param) {
    for (int depth = 0; *param; param++) {
        depth += (*param == '<') - (*param == '>');
        if (*param == ',' && depth == 0) {
            return param;
        }
    }
    return NULL;
}

static void write_call(Writer *w, WriteType type, int depth) {
    int k = (int)fuzz_random(w, BUILTIN_COUNT);
    for (int i = 0; i < BUILTIN_COUNT && !may_give(result_of(k), type); i++) {
        k = (k + 1) % BUILTIN_COUNT;
    }
    fuzz_put(w, "%s(", builtin_infos[k].name);
    bool is_same = strncmp(result_of(k), "the same", 8) == 0 || result_of(k)[0] == 'v';
    const char *param = builtin_infos[k].params;
    for (bool is_first = true; param; is_first = false) {
        const char *word = strchr(param, ' '), *comma = end_of(param);
        bool is_left = strchr(param, '=') && (!comma || strchr(param, '=') < comma);
        if (is_left && fuzz_one_in(w, 2)) {
            break;
        }
        fuzz_put(w, is_first ? "" : ", ");
        if (fuzz_one_in(w, 12)) {
            fuzz_put(w, "%.*s = ", (int)(word - param), param);
        }
        bool is_any = strncmp(word + 1, "any", 3) == 0 || strncmp(word + 1, "value", 5) == 0;
        WriteType wanted = is_any && is_same ? type : type_of_word(w, word + 1);
        uint32_t n = strstr(word, "...") ? 1 + fuzz_random(w, 3) : 1;
        for (uint32_t i = 0; i < n; i++) {
            fuzz_put(w, i ? ", " : "");
            fuzz_write(w, wanted, depth - 1);
        }
        param = comma ? comma + 2 : NULL;
    }
    fuzz_put(w, ")");
}

static void write_pair(Writer *w, WriteType a, const char *op, WriteType b, int depth) {
    fuzz_put(w, "(");
    fuzz_write(w, a, depth - 1);
    fuzz_put(w, " %s ", op);
    fuzz_write(w, b, depth - 1);
    fuzz_put(w, ")");
}

static void write_operation(Writer *w, WriteType type, int depth) {
    static const char *const sums[] = {"+", "-", "*", "/", "%", "^"};
    static const char *const comparisons[] = {"<", "<=", ">", ">=", "==", "!=", "and", "or"};
    uint32_t k;
    switch (type) {
    case WRITE_NUMBER:
        k = fuzz_random(w, N_OF(sums));
        write_pair(w, WRITE_NUMBER, sums[k], WRITE_NUMBER, depth);
        break;
    case WRITE_BOOL:
        k = fuzz_random(w, N_OF(comparisons));
        write_pair(w,
                   k < 4   ? WRITE_NUMBER
                   : k < 6 ? (WriteType)fuzz_random(w, WRITE_TYPES)
                           : WRITE_BOOL,
                   comparisons[k],
                   k < 4   ? WRITE_NUMBER
                   : k < 6 ? (WriteType)fuzz_random(w, WRITE_TYPES)
                           : WRITE_BOOL,
                   depth);
        break;
    case WRITE_STRING:
        write_pair(w, WRITE_STRING, "+", WRITE_STRING, depth);
        break;
    case WRITE_ROTATION:
    case WRITE_TRANSFORM:
        write_pair(w, fuzz_one_in(w, 2) ? WRITE_ROTATION : type, "*", type, depth);
        break;
    case WRITE_LIST:
        write_list(w, fuzz_one_in(w, 3) ? (WriteType)fuzz_random(w, WRITE_TYPES) : WRITE_VEC3,
                   depth);
        break;
    case WRITE_RANGE:
        write_pair(w, WRITE_NUMBER, "..", WRITE_NUMBER, depth);
        break;
    default:
        k = fuzz_random(w, 4);
        write_pair(w, k == 2 ? WRITE_NUMBER : type, sums[k], k < 2 || k == 2 ? type : WRITE_NUMBER,
                   depth);
    }
}

static void write_mode(Writer *w, int depth) {
    size_t k = fuzz_random(w, N_OF(modes));
    fuzz_put(w, " %s", modes[k].name);
    for (int i = 0; i < modes[k].n_arguments; i++) {
        fuzz_put(w, i ? ", " : "(");
        fuzz_write(w, WRITE_NUMBER, depth - 1);
    }
    fuzz_put(w, modes[k].n_arguments ? ")" : "");
}

static void write_keys(Writer *w, WriteType type, int depth) {
    fuzz_put(w, "keys");
    if (fuzz_one_in(w, 2)) {
        write_mode(w, depth);
    }
    if (fuzz_one_in(w, 3)) {
        fuzz_put(w, " %s(%s)", fuzz_one_in(w, 2) ? "before" : "after",
                 ends[fuzz_random(w, N_OF(ends))]);
    }
    fuzz_put(w, " { ");
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 4); i < n; i++) {
        fuzz_put(w, i ? ", " : "");
        if (fuzz_one_in(w, 12)) {
            fuzz_write_scalar(w, DIMENSION_TIME);
        } else {
            fuzz_put(w, "%us", i);
        }
        fuzz_put(w, ": ");
        fuzz_write(w, type, depth - 1);
        if (fuzz_one_in(w, 4)) {
            write_mode(w, depth);
        }
    }
    fuzz_put(w, " }");
}

static void write_taken(Writer *w, WriteType type, int depth) {
    switch (fuzz_random(w, 5)) {
    case 4:
        fuzz_write_sim_member(w);
        break;
    case 0: // an item
        write_list(w, type, depth - 1);
        fuzz_put(w, "[");
        fuzz_write(w, WRITE_NUMBER, depth - 1);
        fuzz_put(w, "]");
        break;
    case 1: // a component
        fuzz_write(w, type == WRITE_NUMBER ? WRITE_VEC3 : type, depth - 1);
        fuzz_put(w, ".%c", "xyzwrgb"[fuzz_random(w, 7)]);
        break;
    case 2: // of the script
        fuzz_write_given_name(w);
        fuzz_put(w, "(");
        fuzz_write(w, type, depth - 1);
        fuzz_put(w, ")");
        break;
    default:
        fuzz_write_given_name(w);
    }
}

void fuzz_write(Writer *w, WriteType type, int depth) {
    if (fuzz_one_in(w, 60)) {
        type = (WriteType)fuzz_random(w, WRITE_TYPES);
    }
    if (depth <= 0 || w->n + 64 > w->max) {
        write_leaf(w, type);
        return;
    }
    switch (fuzz_random(w, 12)) {
    case 0:
    case 1:
    case 2:
    case 3:
        write_call(w, type, depth);
        break;
    case 4:
    case 5:
        write_operation(w, type, depth);
        break;
    case 6:
        fuzz_put(w, "(");
        fuzz_write(w, WRITE_BOOL, depth - 1);
        fuzz_put(w, " ? ");
        fuzz_write(w, type, depth - 1);
        fuzz_put(w, " : ");
        fuzz_write(w, type, depth - 1);
        fuzz_put(w, ")");
        break;
    case 7:
        write_keys(w, type, depth);
        break;
    case 8:
        write_taken(w, type, depth);
        break;
    case 9:
        fuzz_put(w, type == WRITE_BOOL ? "not " : "-");
        fuzz_write(w, type, depth - 1);
        break;
    default:
        write_leaf(w, type);
    }
}

void fuzz_write_expression(Writer *w, int depth) {
    fuzz_write(w, (WriteType)fuzz_random(w, WRITE_TYPES), depth);
}
