// SPDX-License-Identifier: Apache-2.0
// The files of one execution. An input is a scene; a line "//@ NAME" ends it and begins the file
// NAME beside it, up to the next such line: what is included, a mesh, a table. Three names are no
// files: "eval" is an expression to be evaluated, "-D" a parameter, "shutter" what --shutter says.
// Besides, there is the standard library.
#ifndef TESTS_FUZZ_FUZZ_FILES_H
#define TESTS_FUZZ_FUZZ_FILES_H

#include <stdbool.h>
#include <stddef.h>

enum { FUZZ_MAX_FILES = 16, FUZZ_MAX_NAME = 48 };

#define FUZZ_SCRIPT "f.st4"

typedef struct {
    char name[FUZZ_MAX_NAME]; // "f.st4": the scene
    const char *text;         // not ended by a NUL
    size_t size;
} FuzzFile;

// Cuts the input, which is borrowed until the next call. Returns how many files there are; the
// scene is the first.
size_t fuzz_files_begin(const char *data, size_t size, const FuzzFile **files);

// Reads the standard library, once; folder: where it is. False: it is not there.
bool fuzz_files_library(const char *folder);

// Gives back what was allocated or opened and not closed since the last call; the number of these.
size_t fuzz_files_end(void);

#endif
