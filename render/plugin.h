// SPDX-License-Identifier: Apache-2.0
// Shared objects of our own that are loaded at first use, since what they link would slow every
// start. They lie beside the program, or in ../lib/st4 from there.
#ifndef RENDER_PLUGIN_H
#define RENDER_PLUGIN_H

#include <stdbool.h>
#include <stddef.h>

// The symbol of the shared object `file` ("st4-image.so"), which stays in memory from then on. NULL
// with one sentence in message[n] when either cannot be had. From any thread.
void *plugin_symbol(const char *file, const char *symbol, char *message, size_t n);

bool plugin_is_loaded(const char *file);

#endif
