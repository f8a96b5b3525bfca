// SPDX-License-Identifier: Apache-2.0
// The canonical layout of a file, for `st4 fmt`.
//
// Tokens and line breaks stay, so the meaning does; spaces, indentation (2 per bracket that is
// open at the line's beginning), empty lines (at most one at a time) and the columns of comments
// become canonical. Where neighbouring lines begin with statements whose '=' or '{' stand in one
// column they still do, and what goes on under the first of what a bracket holds stays there. '*',
// '/' and '%' stay tight where they were, so that a term can look like one.
// The result formats to itself.
#ifndef LANG_FORMAT_H
#define LANG_FORMAT_H

#include "lang/syntax.h"

// Writes the whole file. False: it does not parse (reported), and nothing is written.
bool format_source(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag, FILE *out);

#endif
