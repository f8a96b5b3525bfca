// SPDX-License-Identifier: Apache-2.0
// A mesh file in memory, and how its text is taken apart: numbers, words and lines, whatever the
// locale, with messages that name the line.
#ifndef RENDER_MESH_TEXT_H
#define RENDER_MESH_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    const char *at, *end; // *end is a NUL that is not part of the file
    size_t line;          // of at, from 1; 0 where the file is binary
    char *message;
    size_t n;
} MeshText;

// Always false: "line 12: " and the formatted sentence become the message.
bool mesh_text_fail(MeshText *text, const char *format, ...) __attribute__((format(printf, 2, 3)));

// A number as C writes decimal ones, also inf and nan, rounded to the nearest double; what follows
// must end the word. false, with at unmoved and no message, where none stands.
bool mesh_text_number(MeshText *text, double *value);

// A decimal integer, saturated at 64 bits; what follows is the caller's matter.
bool mesh_text_integer(MeshText *text, int64_t *value);

// Length of the word at at: up to a blank, the end of the line or of the file.
size_t mesh_text_word(const MeshText *text);
bool mesh_text_is_word(const MeshText *text, const char *word);

void mesh_text_skip_blanks(MeshText *text);
bool mesh_text_at_line_end(const MeshText *text);

// To the start of the next line, whether it ends in LF, CR LF or CR.
void mesh_text_next_line(MeshText *text);

// Skips blanks and line ends.
void mesh_text_skip_space(MeshText *text);

// For messages: at most 24 bytes of the word at at, unprintable ones as '?'.
typedef struct {
    char text[32];
} MeshWord;
MeshWord mesh_text_quote(const MeshText *text);

#endif
