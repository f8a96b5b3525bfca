// SPDX-License-Identifier: Apache-2.0
// Child processes for code that may crash, loop or take all memory: what they may do.
#ifndef RENDER_CHILD_H
#define RENDER_CHILD_H

#include <stddef.h>

// To be called in the child. No files, no terminal, default signals, so many bytes of address space
// beyond what it was born with (not in builds with the address sanitizer, which reserves
// terabytes), so many seconds of processor time; 0 seconds: any number.
void child_confine(size_t memory, unsigned seconds);

#endif
