// SPDX-License-Identifier: Apache-2.0
// Child processes for code that may crash, loop or take all memory, which send what they come to
// through a pipe. A child has no files, no terminal, default signals, and limits.
#ifndef RENDER_CHILD_H
#define RENDER_CHILD_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

typedef struct {
    // Bytes of address space beyond what it is born with; not in builds with the address sanitizer,
    // which reserves terabytes.
    size_t memory;
    unsigned seconds; // of processor time; 0: any number
    double wait;      // seconds that the parent waits for the whole; 0: for ever
} ChildLimits;

// Runs in the child: writes to fd.
typedef void ChildBody(const void *argument, int fd);

// The parent's end.
typedef struct {
    pid_t pid;
    int fd;
    double deadline; // seconds of the monotonic clock; INFINITY: none
    bool is_late;    // it was passed
    size_t at, end;  // what is in the buffer and not yet asked for
    unsigned char buffer[1 << 16];
} Child;

// False: errno says why.
bool child_start(Child *child, ChildBody *body, const void *argument, const ChildLimits *limits);

// The next n bytes. False: the stream has ended before, or it takes too long.
bool child_receive(Child *child, void *to, size_t n);

// To be called once after child_start. is_over: the stream has ended, so that the child ends by
// itself; else, or where it was late, it is killed. Returns how it ended, as waitpid has it.
int child_stop(Child *child, bool is_over);

#endif
