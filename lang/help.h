// SPDX-License-Identifier: Apache-2.0
// What --help prints, made from the tables of commands and options.
#ifndef LANG_HELP_H
#define LANG_HELP_H

#include <stdio.h>

#include "lang/options.h"

// Of one command, or of all where command is COMMAND_HELP.
void help_print(FILE *out, Command command);

#endif
