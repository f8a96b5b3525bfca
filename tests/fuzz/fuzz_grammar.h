// SPDX-License-Identifier: Apache-2.0
// Writes scenes by chance, from the grammar and the tables of the language: a node, a property, a
// function or a unit that is new there is written here without more ado.
#ifndef TESTS_FUZZ_FUZZ_GRAMMAR_H
#define TESTS_FUZZ_FUZZ_GRAMMAR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lang/schema.h"
#include "lang/units.h"

// Text of at most max bytes; what does not fit is dropped.
typedef struct {
    char *text;
    size_t n, max;
    uint64_t state; // of the random numbers
} Writer;

// Types of expressions; a VEC has so many components.
typedef enum {
    WRITE_NUMBER,
    WRITE_ANGLE,
    WRITE_BOOL,
    WRITE_STRING,
    WRITE_VEC2,
    WRITE_VEC3,
    WRITE_VEC4,
    WRITE_COLOR,
    WRITE_ROTATION,
    WRITE_TRANSFORM,
    WRITE_MATERIAL,
    WRITE_LIST,
    WRITE_RANGE,
    WRITE_TYPES
} WriteType;

uint32_t fuzz_random(Writer *w, uint32_t n); // 0..n-1
bool fuzz_one_in(Writer *w, uint32_t n);

void fuzz_put(Writer *w, const char *format, ...)
    __attribute__((format(printf, 2, 3))); // short ones
void fuzz_put_text(Writer *w, const char *text, size_t n);

#define N_OF(array)          (sizeof(array) / sizeof *(array))
#define PUT_ONE_OF(w, array) fuzz_put(w, "%s", (array)[fuzz_random(w, N_OF(array))])

// Mostly of the kind that is named, at times of another. depth: of the expressions within.
void fuzz_write_number(Writer *w);
void fuzz_write_name(Writer *w);       // of a node, property, function, variable, word...
void fuzz_write_given_name(Writer *w); // that scripts give
void fuzz_write_file_name(Writer *w);  // in quotes
void fuzz_write_punctuation(Writer *w);
void fuzz_write_scalar(Writer *w, Dimension dimension); // with a unit
void fuzz_write(Writer *w, WriteType type, int depth);
void fuzz_write_expression(Writer *w, int depth);
void fuzz_write_property_value(Writer *w, const char *property, int depth);
void fuzz_write_properties(Writer *w, ObjectKind kind, int depth); // a few of its own
void fuzz_write_statement(Writer *w, int depth);
void fuzz_write_sim(Writer *w, int depth);
void fuzz_write_sim_member(Writer *w); // of one of them
void fuzz_write_scene(Writer *w);
// "//@ NAME" and its text: a script, a mesh, a table, an expression to be evaluated.
void fuzz_write_file(Writer *w);

#endif
