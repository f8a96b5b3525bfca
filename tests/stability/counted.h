// SPDX-License-Identifier: Apache-2.0
// The counting allocator: the linker leads malloc() and its kin here (--wrap), for this program.
#ifndef TESTS_STABILITY_COUNTED_H
#define TESTS_STABILITY_COUNTED_H

#include <stddef.h>

// From now on what is allocated is counted to the byte, on all threads.
void counted_begin(void);
// What was allocated since at the worst moment, and is now. While realloc() lasts both count.
typedef struct {
    size_t peak, live;
} Counted;
Counted counted_end(void);

#endif
