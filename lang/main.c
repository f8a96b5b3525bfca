// SPDX-License-Identifier: Apache-2.0
// The program st4: reads the command line and calls the command.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "lang/command.h"
#include "lang/diag.h"
#include "lang/help.h"

// Allocation fails on whatever thread it likes: say so, and leave without running anything that
// could allocate. Pictures are renamed into place when complete, so none is left half-written.
static void report_exhausted(size_t wanted, size_t limit) {
    char text[200];
    int n = limit
                ? snprintf(text, sizeof text,
                           "st4: error: out of memory: %zu bytes more would pass the bound of %zu; "
                           "see --memory\n",
                           wanted, limit)
                : snprintf(text, sizeof text,
                           "st4: error: out of memory: the system does not give %zu bytes more; "
                           "a lower --memory makes smaller blocks\n",
                           wanted);
    if (write(STDERR_FILENO, text, (size_t)n) < 0) {
        _exit(STATUS_FILES);
    }
    _exit(STATUS_FILES);
}

static int command_help(const Options *options) {
    if (!options->n_operands) {
        help_print(stdout, COMMAND_HELP);
        return STATUS_OK;
    }
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++) {
        names[i] = command_infos[i].name;
        if (!strcmp(options->operands[0], names[i])) {
            help_print(stdout, (Command)i);
            return STATUS_OK;
        }
    }
    const char *near = diag_nearest(options->operands[0], names, COMMAND_COUNT);
    fprintf(stderr, "st4: error: there is no command '%s'%s%s%s\n", options->operands[0],
            near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    return STATUS_USAGE;
}

static int run(Arena *arena, const Options *options) {
    switch (options->command) {
    case COMMAND_RENDER:
        return command_render(arena, options);
    case COMMAND_CHECK:
        return command_check(arena, options);
    case COMMAND_INFO:
        return command_info(arena, options);
    case COMMAND_EVAL:
        return command_eval(arena, options);
    case COMMAND_SIM:
        return command_sim(arena, options);
    case COMMAND_MESH:
        return command_mesh(arena, options);
    case COMMAND_FMT:
        return command_fmt(arena, options);
    case COMMAND_DEPENDS:
        return command_depends(arena, options);
    case COMMAND_COMPARE:
        return command_compare(arena, options);
    case COMMAND_MERGE:
        return command_merge(arena, options);
    case COMMAND_MEASURE:
        return command_measure(arena, options);
    case COMMAND_HELP:
    case COMMAND_COUNT:
        break;
    }
    return command_help(options);
}

int main(int argc, char **argv) {
    arena_on_exhausted(report_exhausted);
    signal(SIGXFSZ, SIG_IGN); // a limit of file sizes then shows as a write that fails
    Arena arena = {0};
    Options options;
    int status = STATUS_OK;
    if (argc < 2) {
        help_print(stderr, COMMAND_HELP);
        status = STATUS_USAGE;
    } else if (!options_parse(&arena, argc, argv, &options, stderr)) {
        status = STATUS_USAGE;
    } else if (option_flag(&options, OPTION_VERSION)) {
        printf("st4 %s\n", ST4_VERSION);
    } else if (option_flag(&options, OPTION_HELP)) {
        help_print(stdout, options.command);
    } else {
        status = run(&arena, &options);
    }
    arena_free(&arena);
    // A full disk or a closed pipe shows at the last flush; it must not look like success.
    if ((fflush(stdout) || ferror(stdout)) && status == STATUS_OK) {
        perror("st4: error: standard output");
        status = STATUS_FILES;
    }
    return status;
}
