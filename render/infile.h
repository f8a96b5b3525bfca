// SPDX-License-Identifier: Apache-2.0
// Files that are read whole or in parts, of any origin: only regular ones, and never blocking.
#ifndef RENDER_INFILE_H
#define RENDER_INFILE_H

#include <stdbool.h>
#include <stddef.h>

// A descriptor to be closed by close(); -1: message[n] says why ("cannot read: No such file or
// directory", "the file is empty").
int infile_open(const char *path, size_t *size, char *message, size_t n);

// Reads `size` bytes from `offset` on. Returns how many were read; less at the end of the file
// (then errno is 0) or on an error, which is in errno.
size_t infile_read(int fd, void *to, size_t offset, size_t size);

#endif
