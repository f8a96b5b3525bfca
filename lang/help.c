// SPDX-License-Identifier: Apache-2.0
// What --help prints, made from the tables of commands and options.
#include "lang/help.h"

#include <string.h>

enum { HELP_WIDTH = 80, HELP_COLUMN = 26 };

// Prints text from column HELP_COLUMN on, broken between words.
static void print_wrapped(FILE *out, const char *text) {
    int column = HELP_COLUMN;
    for (const char *before = ""; *text; before = " ") {
        int length = (int)strcspn(text, " ");
        if (column + 1 + length > HELP_WIDTH) {
            fprintf(out, "\n%*s", HELP_COLUMN, "");
            column = HELP_COLUMN;
            before = "";
        }
        column += fprintf(out, "%s%.*s", before, length, text);
        text += length;
        text += strspn(text, " ");
    }
    fputc('\n', out);
}

static void print_entry(FILE *out, const char *left, const char *help) {
    int column = fprintf(out, "%s", left);
    if (column > HELP_COLUMN - 2) {
        fputc('\n', out);
        column = 0;
    }
    fprintf(out, "%*s", HELP_COLUMN - column, "");
    print_wrapped(out, help);
}

static void print_option(FILE *out, const OptionInfo *info) {
    char letter[8] = "    ", left[80], help[200];
    if (info->letter) {
        snprintf(letter, sizeof letter, "-%c%s", info->letter, info->name ? ", " : "");
    }
    snprintf(left, sizeof left, "  %s%s%s%s%s", letter, info->name ? "--" : "",
             info->name ? info->name : "", info->argument ? " " : "",
             info->argument ? info->argument : "");
    snprintf(help, sizeof help, "%s%s%s%s", info->help, info->fallback ? " (default " : "",
             info->fallback ? info->fallback : "", info->fallback ? ")" : "");
    print_entry(out, left, help);
}

static void print_commands(FILE *out) {
    fputs("usage: st4 [COMMAND] [OPTIONS] OPERANDS\n\n"
          "Renders scenes over continuous time: what moves while the shutter is open blurs.\n"
          "'st4 SCENE' is short for 'st4 render SCENE'; '-' reads the scene from standard\n"
          "input.\n\nCommands:\n",
          out);
    for (int i = 0; i < COMMAND_COUNT; i++) {
        char left[80];
        snprintf(left, sizeof left, "  %s %s", command_infos[i].name, command_infos[i].operands);
        print_entry(out, left, command_infos[i].help);
    }
}

void help_print(FILE *out, Command command) {
    if (command == COMMAND_HELP) {
        print_commands(out);
    } else {
        const CommandInfo *info = &command_infos[command];
        fprintf(out, "usage: st4 %s [OPTIONS] %s\n\nTo %s.\n", info->name, info->operands,
                info->help);
    }
    fputs("\nOptions:\n", out);
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (command == COMMAND_HELP || option_infos[i].commands >> command & 1) {
            print_option(out, &option_infos[i]);
        }
    }
    fputs("\nExit status: 0 fine, 1 an error in the scene, 2 in the command line, 3 in a file\n"
          "or for want of memory, 130 interrupted. The manuals: st4(1), st4(5).\n",
          out);
}
