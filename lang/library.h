// SPDX-License-Identifier: Apache-2.0
// Where the standard library lies: st4 files that every script may include.
#ifndef LANG_LIBRARY_H
#define LANG_LIBRARY_H

#include "accel/arena.h"

// Its folder, links resolved, from arena: that of the tree that the program was built in, or the
// one installed with it. NULL: there is none. From any thread.
const char *library_folder(Arena *arena);

#endif
