// SPDX-License-Identifier: Apache-2.0
// The command line: a reader driven by the option table.
#include "lang/options.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "lang/diag.h"
#include "lang/layers.h"

const CommandInfo command_infos[COMMAND_COUNT] = {
#define COMMAND(id, name, operands, least, most, help) {name, operands, least, most, help},
#include "lang/commands.def"
#undef COMMAND
};

const OptionInfo option_infos[OPTION_COUNT] = {
#define OPTION(id, letter, name, argument, kind, least, most, fallback, commands, help)            \
    {letter, name, argument, OPTION_KIND_##kind, least, most, fallback, commands, help},
#include "lang/options.def"
#undef OPTION
};

typedef struct {
    Arena *arena;
    int argc;
    char *const *argv;
    int at; // the argument being read
    Options *options;
    OptionUse *uses;
    FILE *err;
} Reader;

static bool fail(const Reader *reader, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static bool fail(const Reader *reader, const char *format, ...) {
    va_list args;
    va_start(args, format);
    fputs("st4: error: ", reader->err);
    vfprintf(reader->err, format, args);
    fputc('\n', reader->err);
    va_end(args);
    return false;
}

const char *option_spelling(Arena *arena, OptionId option) {
    const OptionInfo *info = &option_infos[option];
    return info->name ? arena_printf(arena, "--%s", info->name)
                      : arena_printf(arena, "-%c", info->letter);
}

// Values. Each function reads all of text, or says what it expected instead.

static bool expected(const Reader *reader, OptionId option, const char *text, const char *what) {
    return fail(reader, "%s: '%s' is not %s", option_spelling(reader->arena, option), text, what);
}

static bool check_range(const Reader *reader, OptionId option, const char *text, double number) {
    const OptionInfo *info = &option_infos[option];
    if (number >= info->least && number <= info->most) {
        return true;
    }
    return fail(reader, "%s: '%s' is out of range: %.15g to %.15g is expected",
                option_spelling(reader->arena, option), text, info->least, info->most);
}

static bool read_integer(const char **at, uint64_t *integer) {
    if (!isdigit((unsigned char)**at)) {
        return false;
    }
    char *end;
    errno = 0;
    unsigned long long value = strtoull(*at, &end, 10);
    *integer = value;
    *at = end;
    return errno == 0;
}

// Decimal only: strtod alone would take "inf", "0x1p3" and leading spaces.
static bool read_number(const char **at, double *number) {
    const char *c = *at;
    c += *c == '-' || *c == '+';
    c += *c == '.';
    if (!isdigit((unsigned char)*c) || (c[0] == '0' && (c[1] == 'x' || c[1] == 'X'))) {
        return false;
    }
    char *end;
    *number = strtod(*at, &end);
    *at = end;
    return isfinite(*number);
}

static bool parse_integer(const Reader *reader, OptionId option, const char *text,
                          OptionValue *value) {
    const char *at = text;
    if (!isdigit((unsigned char)*text) || text[strspn(text, "0123456789")]) {
        return expected(reader, option, text, "a whole number");
    }
    bool fits = read_integer(&at, &value->integer);
    return check_range(reader, option, text, fits ? (double)value->integer : HUGE_VAL);
}

static bool parse_number(const Reader *reader, OptionId option, const char *text,
                         OptionValue *value) {
    const char *at = text;
    if (!read_number(&at, &value->number) || *at) {
        return expected(reader, option, text, "a number");
    }
    value->integer = value->number > 0 && value->number < 0x1p53 ? (uint64_t)value->number : 0;
    return check_range(reader, option, text, value->number);
}

static bool parse_bytes(const Reader *reader, OptionId option, const char *text,
                        OptionValue *value) {
    static const char suffixes[] = "KMGT";
    const char *at = text;
    double bytes;
    if (!read_number(&at, &bytes)) {
        return expected(reader, option, text, "a number of bytes such as 4G");
    }
    const char *suffix = *at ? strchr(suffixes, toupper((unsigned char)*at)) : NULL;
    if (suffix) {
        bytes = ldexp(bytes, 10 * (int)(suffix - suffixes + 1));
        at++;
    }
    if (*at) {
        return expected(reader, option, text, "a number of bytes such as 4G");
    }
    value->integer = bytes >= 0 && bytes < 1.8e19 ? (uint64_t)bytes : 0;
    return check_range(reader, option, text, bytes);
}

static bool parse_range(const Reader *reader, OptionId option, const char *text,
                        OptionValue *value) {
    const char *at = text;
    uint64_t first, last;
    if (!read_integer(&at, &first) || *at++ != '-' || !read_integer(&at, &last) || *at) {
        return expected(reader, option, text, "a range such as 1-32");
    }
    if (!check_range(reader, option, text, (double)first) ||
        !check_range(reader, option, text, (double)last)) {
        return false;
    }
    value->first = (uint32_t)first;
    value->last = (uint32_t)last;
    return first <= last || expected(reader, option, text, "a range: its end is before its start");
}

static bool parse_size(const Reader *reader, OptionId option, const char *text,
                       OptionValue *value) {
    const OptionInfo *info = &option_infos[option];
    const char *at = text;
    uint64_t width, height;
    bool is_read = read_integer(&at, &width) && (*at == 'x' || *at == 'X') &&
                   (at++, read_integer(&at, &height)) && !*at;
    if (!is_read) {
        return expected(reader, option, text, "a size such as 640x480");
    }
    if (width < info->least || height < info->least || width > info->most || height > info->most) {
        return fail(reader, "--size: '%s' is out of range: each side is %g to %g pixels", text,
                    info->least, info->most);
    }
    value->width = (uint32_t)width;
    value->height = (uint32_t)height;
    return true;
}

static bool parse_crop(const Reader *reader, OptionId option, const char *text,
                       OptionValue *value) {
    const char *at = text;
    uint64_t crop[4];
    bool is_read = true;
    for (int i = 0; i < 4 && is_read; i++) {
        is_read = read_integer(&at, &crop[i]) && crop[i] <= option_infos[option].most &&
                  *at == (i < 3 ? ',' : '\0');
        at++;
    }
    if (!is_read || crop[0] >= crop[1] || crop[2] >= crop[3]) {
        return expected(reader, option, text,
                        "X0,X1,Y0,Y1 with X0 below X1 and Y0 below Y1, such as 0,320,0,240");
    }
    for (int i = 0; i < 4; i++) {
        value->crop[i] = (uint32_t)crop[i];
    }
    return true;
}

static bool parse_layers(const Reader *reader, OptionId option, const char *text,
                         OptionValue *value) {
    value->integer = 0;
    for (const char *at = strcmp(text, "none") == 0 ? "" : text; *at; at += *at == ',') {
        size_t n = strcspn(at, ",");
        Layer layer;
        if (!layer_find(at, n, &layer)) {
            const char *name = arena_string(reader->arena, at, n);
            const char *near = diag_nearest(name, layer_names, LAYER_COUNT);
            return near ? fail(reader, "%s: there is no layer '%s'; did you mean '%s'?",
                               option_spelling(reader->arena, option), name, near)
                        : fail(reader, "%s: there is no layer '%s': they are%s",
                               option_spelling(reader->arena, option), name, layer_words);
        }
        value->integer |= 1u << layer;
        at += n;
    }
    return true;
}

static bool parse_shutter(const Reader *reader, OptionId option, const char *text,
                          OptionValue *value) {
    static const char *const units[] = {"deg", "turn", "rad", "f", "s", "ms", "us"};
    const char *at = text;
    if (read_number(&at, &value->number)) {
        bool is_whole = !*at && value->number == 0;
        for (size_t i = 0; !is_whole && i < sizeof units / sizeof *units; i++) {
            is_whole = !strcmp(at, units[i]);
        }
        if (is_whole) {
            return check_range(reader, option, text, value->number);
        }
    }
    return expected(reader, option, text, "a shutter such as 180deg, 4f, 10ms or 0");
}

static bool parse_frames(const Reader *reader, OptionId option, const char *text,
                         OptionValue *value) {
    char message[160];
    if (frame_list_parse(reader->arena, text, &value->frames, message, sizeof message)) {
        return true;
    }
    return fail(reader, "%s: %s", option_spelling(reader->arena, option), message);
}

// The words of "a|b|c", and how many.
static size_t choice_words(Arena *arena, const char *choice, const char **words, size_t most) {
    size_t n = 0;
    while (n < most) {
        size_t length = strcspn(choice, "|");
        words[n++] = arena_string(arena, choice, length);
        if (!choice[length]) {
            break;
        }
        choice += length + 1;
    }
    return n;
}

static bool parse_choice(const Reader *reader, OptionId option, const char *text,
                         OptionValue *value) {
    const char *words[16];
    size_t n = choice_words(reader->arena, option_infos[option].argument, words, 16);
    for (size_t i = 0; i < n; i++) {
        if (!strcmp(text, words[i])) {
            value->integer = i;
            return true;
        }
    }
    const char *near = diag_nearest(text, words, n);
    return fail(reader, "%s: '%s' is none of %s%s%s%s", option_spelling(reader->arena, option),
                text, option_infos[option].argument, near ? "; did you mean '" : "",
                near ? near : "", near ? "'?" : "");
}

static bool parse_text(const Reader *reader, OptionId option, const char *text) {
    if (!*text) {
        return fail(reader, "%s: the argument is empty", option_spelling(reader->arena, option));
    }
    if (option == OPTION_DEFINE && (*text == '=' || !strchr(text, '='))) {
        return expected(reader, option, text, "a param and its value, such as rpm=2400");
    }
    return true;
}

static bool parse_value(const Reader *reader, OptionId option, const char *text,
                        OptionValue *value) {
    value->text = text;
    switch (option_infos[option].kind) {
    case OPTION_KIND_INTEGER:
        return parse_integer(reader, option, text, value);
    case OPTION_KIND_NUMBER:
        return parse_number(reader, option, text, value);
    case OPTION_KIND_BYTES:
        return parse_bytes(reader, option, text, value);
    case OPTION_KIND_SIZE:
        return parse_size(reader, option, text, value);
    case OPTION_KIND_RANGE:
        return parse_range(reader, option, text, value);
    case OPTION_KIND_CROP:
        return parse_crop(reader, option, text, value);
    case OPTION_KIND_LAYERS:
        return parse_layers(reader, option, text, value);
    case OPTION_KIND_SHUTTER:
        return parse_shutter(reader, option, text, value);
    case OPTION_KIND_FRAMES:
        return parse_frames(reader, option, text, value);
    case OPTION_KIND_CHOICE:
        return parse_choice(reader, option, text, value);
    case OPTION_KIND_TEXT:
    case OPTION_KIND_LIST:
        return parse_text(reader, option, text);
    case OPTION_KIND_FLAG:
        break;
    }
    return true;
}

// Takes an option whose argument may stand in the same word (attached) or be the next one.
static bool take_option(Reader *reader, OptionId option, const char *attached) {
    const OptionInfo *info = &option_infos[option];
    Options *options = reader->options;
    const char *text = NULL;
    if (info->argument) {
        text = attached ? attached : reader->at < reader->argc ? reader->argv[reader->at++] : NULL;
        if (!text) {
            return fail(reader, "%s needs an argument, %s", option_spelling(reader->arena, option),
                        info->argument);
        }
    } else if (attached) {
        return fail(reader, "%s takes no argument", option_spelling(reader->arena, option));
    }
    reader->uses[options->n_uses++] = (OptionUse){option, text};
    OptionValue value = {.is_set = true};
    if (text && !parse_value(reader, option, text, &value)) {
        return false;
    }
    options->values[option] = value;
    return true;
}

static bool unknown_option(const Reader *reader, const char *name, size_t length) {
    const char *names[OPTION_COUNT];
    size_t n = 0;
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (option_infos[i].name) {
            names[n++] = option_infos[i].name;
        }
    }
    const char *word = arena_string(reader->arena, name, length);
    const char *near = diag_nearest(word, names, n);
    return near ? fail(reader, "unknown option '--%s'; did you mean '--%s'?", word, near)
                : fail(reader, "unknown option '--%s'; 'st4 help' lists all", word);
}

static bool read_long(Reader *reader, const char *word) {
    size_t length = strcspn(word, "=");
    for (int i = 0; i < OPTION_COUNT; i++) {
        const char *name = option_infos[i].name;
        if (name && strlen(name) == length && !strncmp(name, word, length)) {
            return take_option(reader, (OptionId)i, word[length] ? word + length + 1 : NULL);
        }
    }
    return unknown_option(reader, word, length);
}

static bool read_letters(Reader *reader, const char *letters) {
    for (; *letters; letters++) {
        int option = 0;
        while (option < OPTION_COUNT && option_infos[option].letter != *letters) {
            option++;
        }
        if (option == OPTION_COUNT) {
            return fail(reader, "unknown option '-%c'; 'st4 help' lists all", *letters);
        }
        bool takes_rest = option_infos[option].argument && letters[1];
        if (!take_option(reader, (OptionId)option, takes_rest ? letters + 1 : NULL)) {
            return false;
        }
        if (takes_rest) {
            return true;
        }
    }
    return true;
}

// '-', or an expression that begins with one: no option is a digit or a bracket.
static bool is_operand(const char *word) {
    return word[0] != '-' || !word[1] || strchr("0123456789.(<[", word[1]);
}

static bool read_words(Reader *reader, const char **operands, size_t *n_operands) {
    bool only_operands = false;
    reader->at = 1;
    while (reader->at < reader->argc) {
        const char *word = reader->argv[reader->at++];
        if (only_operands || is_operand(word)) {
            operands[(*n_operands)++] = word;
        } else if (!strcmp(word, "--")) {
            only_operands = true;
        } else if (word[1] == '-' ? !read_long(reader, word + 2)
                                  : !read_letters(reader, word + 1)) {
            return false;
        }
    }
    return true;
}

// The first operand as a command. A plain word that names no command and no file is taken for a
// mistyped command, so that `st4 rendr x.st4` does not complain about a missing scene.
static bool find_command(const Reader *reader, const char *word, bool *is_command) {
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++) {
        names[i] = command_infos[i].name;
        if (!strcmp(word, names[i])) {
            reader->options->command = (Command)i;
            *is_command = true;
            return true;
        }
    }
    reader->options->command = COMMAND_RENDER;
    *is_command = false;
    struct stat status;
    if (strpbrk(word, "./-") || stat(word, &status) == 0) {
        return true;
    }
    const char *near = diag_nearest(word, names, COMMAND_COUNT);
    return near ? fail(reader, "'%s' is neither a command nor a file; did you mean '%s'?", word,
                       near)
                : fail(reader,
                       "'%s' is neither a command nor a file; 'st4 help' lists the commands", word);
}

static bool take_operands(const Reader *reader, const char *const *operands, size_t n) {
    Options *options = reader->options;
    bool is_command = false;
    if (n && !find_command(reader, operands[0], &is_command)) {
        return false;
    }
    const CommandInfo *info = &command_infos[options->command];
    operands += is_command;
    n -= is_command;
    if (options->values[OPTION_HELP].is_set || options->values[OPTION_VERSION].is_set) {
        return true;
    }
    if (n < info->least || n > info->most) {
        const char *what = n < info->least ? "is missing an operand" : "has an operand too many";
        return fail(reader, "%s %s; usage: st4 %s [options] %s", info->name, what, info->name,
                    info->operands);
    }
    options->operands = operands;
    options->n_operands = n;
    return true;
}

static bool check_uses(const Reader *reader) {
    const Options *options = reader->options;
    for (size_t i = 0; i < options->n_uses; i++) {
        OptionId option = options->uses[i].option;
        if (!(option_infos[option].commands >> options->command & 1)) {
            return fail(reader, "'st4 %s' takes no %s", command_infos[options->command].name,
                        option_spelling(reader->arena, option));
        }
    }
    return true;
}

const char *const *options_list(Arena *arena, const Options *options, OptionId option, size_t *n) {
    const char **list = ARENA_ARRAY(arena, options->n_uses, const char *);
    *n = 0;
    for (size_t i = 0; i < options->n_uses; i++) {
        if (options->uses[i].option == option) {
            list[(*n)++] = options->uses[i].text;
        }
    }
    return list;
}

static const char *write_recipe(Arena *arena, const Options *options) {
    const char *line = arena_printf(arena, "st4 %s", command_infos[options->command].name);
    for (size_t i = 0; i < options->n_operands; i++) {
        line = arena_printf(arena, "%s %s", line, options->operands[i]);
    }
    for (size_t i = 0; i < options->n_uses; i++) {
        const OptionUse *use = &options->uses[i];
        if (option_infos[use->option].commands & SETS_PICTURE) {
            line = arena_printf(arena, "%s %s%s%s", line, option_spelling(arena, use->option),
                                use->text ? " " : "", use->text ? use->text : "");
        }
    }
    return line;
}

bool options_parse(Arena *arena, int argc, char *const *argv, Options *options, FILE *err) {
    *options = (Options){.command = COMMAND_HELP};
    size_t most = 0; // uses: at most one for each character
    for (int i = 1; i < argc; i++) {
        most += strlen(argv[i]);
    }
    OptionUse *uses = ARENA_ARRAY(arena, most, OptionUse);
    options->uses = uses;
    Reader reader = {arena, argc, argv, 1, options, uses, err};
    for (int i = 0; i < OPTION_COUNT; i++) {
        const char *fallback = option_infos[i].fallback;
        if (fallback && !parse_value(&reader, (OptionId)i, fallback, &options->values[i])) {
            return false;
        }
    }
    const char **operands = ARENA_ARRAY(arena, (size_t)argc + 1, const char *);
    size_t n_operands = 0;
    if (!read_words(&reader, operands, &n_operands) ||
        !take_operands(&reader, operands, n_operands) || !check_uses(&reader)) {
        return false;
    }
    options->recipe = write_recipe(arena, options);
    return true;
}
