// SPDX-License-Identifier: Apache-2.0
// Output files that are there whole or not at all: written under a temporary name in the folder of
// the target, synced, then renamed over it. A link is followed, so that its target is replaced and
// the link stays. Targets that exist but are no regular file (folders, devices) are refused, since
// the rename would replace them.
#ifndef RENDER_OUTFILE_H
#define RENDER_OUTFILE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    int fd;          // open for writing, also at any offset; -1 once committed or abandoned
    char *path;      // the target, links resolved
    char *temporary; // where the bytes are now
} OutFile;

// false with one sentence in message[n], which does not name the file; nothing is left open then.
bool outfile_open(OutFile *file, const char *path, char *message, size_t n);

// Appends; false with a sentence, and the file abandoned.
bool outfile_write(OutFile *file, const void *bytes, size_t size, char *message, size_t n);

// Makes the file appear under its name, and stay there through a loss of power. On failure the
// temporary file is gone and the target is as it was.
bool outfile_commit(OutFile *file, char *message, size_t n);

// Forgets the file: the temporary one is removed, the target stays as it was.
void outfile_abandon(OutFile *file);

#endif
