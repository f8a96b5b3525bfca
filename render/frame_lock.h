// SPDX-License-Identifier: Apache-2.0
// Locks by which several processes, on several machines, share out the frames of a folder: a file
// beside the picture, of its name and ".lock", that says who renders it.
//
// The file is created exclusively, which holds everywhere, and locked by fcntl() as long as its
// process lives. So the lock of a process of this machine that has died, however, is taken over.
// Of another machine nothing is known but what the file says: its locks are respected until someone
// removes the file.
#ifndef RENDER_FRAME_LOCK_H
#define RENDER_FRAME_LOCK_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    int fd; // -1: none
    char *path;
} FrameLock;

typedef enum { FRAME_LOCK_TAKEN, FRAME_LOCK_HELD, FRAME_LOCK_FAILED } FrameLockOutcome;

// Within a process each lock is taken once at a time. HELD: message[n] says by whom; FAILED: why it
// cannot be made.
FrameLockOutcome frame_lock_take(FrameLock *lock, const char *picture, char *message, size_t n);

// Removes the file. Safe on one that was not taken.
void frame_lock_release(FrameLock *lock);

// What the picture's lock file says, whether it holds or not. False: there is none.
bool frame_lock_holder(const char *picture, char *message, size_t n);

// Whether another process holds the picture's lock now; message as above.
bool frame_lock_is_held(const char *picture, char *message, size_t n);

#endif
