// SPDX-License-Identifier: Apache-2.0
// The commands: each gets what was asked for and returns an exit status.
#ifndef LANG_COMMAND_H
#define LANG_COMMAND_H

#include "lang/options.h"

enum {
    STATUS_OK = 0,
    STATUS_SCENE = 1, // an error of the scene; for compare: more different than allowed; for
                      // fmt --check: it would change
    STATUS_USAGE = 2,
    STATUS_FILES = 3, // input or output, memory included
    STATUS_INTERRUPTED = 130
};

int command_render(Arena *arena, const Options *options);
int command_check(Arena *arena, const Options *options);
int command_info(Arena *arena, const Options *options);
int command_eval(Arena *arena, const Options *options);
int command_sim(Arena *arena, const Options *options);
int command_mesh(Arena *arena, const Options *options);
int command_fmt(Arena *arena, const Options *options);
int command_depends(Arena *arena, const Options *options);
int command_compare(Arena *arena, const Options *options);
int command_merge(Arena *arena, const Options *options);
int command_measure(Arena *arena, const Options *options);

#endif
