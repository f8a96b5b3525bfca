// SPDX-License-Identifier: Apache-2.0
// st4 depends: the files that a scene reads, as a list or as a rule for make.
#include "lang/command.h"

#include <string.h>

#include "lang/session.h"

// A name as make reads it.
static void print_for_make(const char *name) {
    for (; *name; name++) {
        if (*name == '$') {
            putchar('$');
        } else if (strchr(" \t#:\\%", *name)) {
            putchar('\\');
        }
        putchar(*name);
    }
}

static void print_rule(const char *target, const LoadedScene *loaded) {
    print_for_make(target);
    putchar(':');
    for (size_t i = 0; i < loaded->n_files; i++) {
        if (strcmp(loaded->files[i], "-") != 0) {
            fputs(" \\\n  ", stdout);
            print_for_make(loaded->files[i]);
        }
    }
    putchar('\n');
    // Rules without a recipe: a file that is gone is no error, but makes the target anew.
    for (size_t i = 0; i < loaded->n_files; i++) {
        if (strcmp(loaded->files[i], "-") != 0) {
            print_for_make(loaded->files[i]);
            puts(":");
        }
    }
}

static void print_list(const LoadedScene *loaded) {
    for (size_t i = 0; i < loaded->n_files; i++) {
        if (strcmp(loaded->files[i], "-") != 0) {
            puts(loaded->files[i]);
        }
    }
}

int command_depends(Arena *arena, const Options *options) {
    Session session;
    LoadedScene loaded;
    int status = session_load(&session, arena, options, &loaded);
    if (status == STATUS_OK) {
        const char *target = options->values[OPTION_MAKE].text;
        if (target) {
            print_rule(target, &loaded);
        } else {
            print_list(&loaded);
        }
        status = session_close(&session, STATUS_OK);
    }
    scene_load_free(&loaded);
    return status;
}
