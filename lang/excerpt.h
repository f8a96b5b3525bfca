// SPDX-License-Identifier: Apache-2.0
// The two lines under a report: the source's line and the carets.
#ifndef LANG_EXCERPT_H
#define LANG_EXCERPT_H

#include <stdio.h>

#include "lang/source.h"

// place is where.lo's; without a file only the hint is printed, and nothing if that is NULL too.
// A span over several lines is marked to the end of its first. Long lines are cut around the
// place. color, off: ANSI codes around the carets and the hint, or "".
void excerpt_print(FILE *out, SourcePlace place, Span where, const char *hint, const char *color,
                   const char *off);

// A message or a hint is ours, but may quote the user's text or the name of a file, and be cut
// within a character: nothing steers a terminal, and all is UTF-8.
void excerpt_text(FILE *out, const char *text);

#endif
