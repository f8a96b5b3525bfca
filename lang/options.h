// SPDX-License-Identifier: Apache-2.0
// The command line: what was asked for, read by the tables lang/commands.def and lang/options.def.
//
// `--name=value`, `--name value`, `-n3`, `-n 3`; letters without argument may be joined (`-qv`);
// after `--` everything is an operand; options and operands may be mixed. Names are not
// abbreviated. The last of several wins, except where they add up (LIST).
#ifndef LANG_OPTIONS_H
#define LANG_OPTIONS_H

#include <limits.h>
#include <stdio.h>

#include "accel/arena.h"
#include "lang/frame_list.h"

#define ST4_VERSION "0.1"

typedef enum {
#define COMMAND(id, name, operands, least, most, help) COMMAND_##id,
#include "lang/commands.def"
#undef COMMAND
    COMMAND_COUNT
} Command;

enum { MANY = INT_MAX }; // operands, without a bound

typedef struct {
    const char *name, *operands;
    unsigned least, most; // operands
    const char *help;
} CommandInfo;

extern const CommandInfo command_infos[COMMAND_COUNT];

// Sets of commands, for options.def.
enum {
    ON_RENDER = 1 << COMMAND_RENDER,
    ON_CHECK = 1 << COMMAND_CHECK,
    ON_INFO = 1 << COMMAND_INFO,
    ON_SIM = 1 << COMMAND_SIM,
    ON_EVAL = 1 << COMMAND_EVAL,
    ON_MESH = 1 << COMMAND_MESH,
    ON_FMT = 1 << COMMAND_FMT,
    ON_DEPENDS = 1 << COMMAND_DEPENDS,
    ON_COMPARE = 1 << COMMAND_COMPARE,
    ON_MERGE = 1 << COMMAND_MERGE,
    ON_MEASURE = 1 << COMMAND_MEASURE,
    ON_SCENE = ON_RENDER | ON_CHECK | ON_MEASURE,
    ON_LOAD =
        ON_SCENE | ON_INFO | ON_EVAL | ON_MESH | ON_DEPENDS | ON_SIM, // those that read a scene
    ON_ALL = (1 << COMMAND_COUNT) - 1,
    SETS_PICTURE = 1 << COMMAND_COUNT
};

typedef enum {
#define OPTION(id, letter, name, argument, kind, least, most, fallback, commands, help) OPTION_##id,
#include "lang/options.def"
#undef OPTION
    OPTION_COUNT
} OptionId;

typedef enum {
    OPTION_KIND_FLAG,
    OPTION_KIND_INTEGER, // integer
    OPTION_KIND_NUMBER,  // number; integer: that rounded down, 0 where it is negative
    OPTION_KIND_BYTES,   // integer
    OPTION_KIND_SIZE,    // width, height
    OPTION_KIND_RANGE,   // first, last
    OPTION_KIND_CROP,    // crop
    OPTION_KIND_LAYERS,  // integer: a set
    OPTION_KIND_SHUTTER, // text, known to be a number and a unit
    OPTION_KIND_FRAMES,  // frames
    OPTION_KIND_CHOICE,  // integer: index of the word
    OPTION_KIND_TEXT,    // text alone
    OPTION_KIND_LIST     // in uses, in order
} OptionKind;

typedef struct {
    char letter;      // 0: none
    const char *name; // without dashes; NULL: a letter only
    const char *argument;
    OptionKind kind;
    double least, most;
    const char *fallback;
    unsigned commands;
    const char *help;
} OptionInfo;

extern const OptionInfo option_infos[OPTION_COUNT];

// What stands after an option, or its default.
typedef struct {
    bool is_set;      // on the command line
    const char *text; // as given; NULL: neither given nor a default
    uint64_t integer;
    double number;
    uint32_t width, height;
    uint32_t first, last; // first <= last
    uint32_t crop[4];     // x0, x1, y0, y1; x0 < x1, y0 < y1
    FrameList frames;
} OptionValue;

typedef struct {
    OptionId option;
    const char *text; // NULL: a flag
} OptionUse;

typedef struct {
    Command command;
    const char *const *operands;
    size_t n_operands;
    OptionValue values[OPTION_COUNT];
    const OptionUse *uses; // in order
    size_t n_uses;
    const char
        *recipe; // a command line that makes the same pictures: what cannot change them, such
                 // as -j, is left out
} Options;

// Reads the command line. The first operand is the command, or a scene to render. On failure one
// message goes to `err` and false is returned (the exit status is STATUS_USAGE). Operands are not
// counted where --help or --version was given. Borrows argv.
bool options_parse(Arena *arena, int argc, char *const *argv, Options *options, FILE *err);

// The arguments of a LIST option, in order, in the arena; *n gets how many.
const char *const *options_list(Arena *arena, const Options *options, OptionId option, size_t *n);

// "--name" or "-n", for messages.
const char *option_spelling(Arena *arena, OptionId option);

static inline bool option_flag(const Options *options, OptionId option) {
    return options->values[option].is_set;
}

#endif
