// SPDX-License-Identifier: Apache-2.0
// Lock files of frames.
#include "render/frame_lock.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    HOST = 256,
    TEXT = HOST + 64,
    ATTEMPTS = 100, // while others take the file away or look at it
    PAUSE = 20, // milliseconds; after ATTEMPTS of them a file that is still empty is a dead one's
};

// What a lock file says.
typedef struct {
    char host[HOST];
    long pid;
    char time[32];
    bool is_empty;
} Holder;

static void host_name(char host[HOST]) {
    if (gethostname(host, HOST) != 0 || !host[0]) {
        snprintf(host, HOST, "localhost");
    }
    host[HOST - 1] = '\0';
    for (char *c = host; *c; c++) { // one word in the file
        *c = *c <= ' ' ? '-' : *c;
    }
}

static void read_holder(int fd, Holder *holder) {
    char text[TEXT + 1];
    ssize_t n = pread(fd, text, TEXT, 0);
    text[n > 0 ? n : 0] = '\0';
    *holder = (Holder){.is_empty = n <= 0};
    if (sscanf(text, "%255s %ld %31s", holder->host, &holder->pid, holder->time) < 3) {
        snprintf(holder->host, sizeof holder->host, "%s", "?");
    }
}

static bool write_holder(int fd) {
    char text[TEXT], host[HOST], when[32] = "";
    time_t now = time(NULL);
    struct tm date;
    host_name(host);
    if (gmtime_r(&now, &date)) {
        strftime(when, sizeof when, "%Y-%m-%dT%H:%M:%SZ", &date);
    }
    int n = snprintf(text, sizeof text, "%s %ld %s\n", host, (long)getpid(), when);
    return ftruncate(fd, 0) == 0 && pwrite(fd, text, (size_t)n, 0) == n && fsync(fd) == 0;
}

static FrameLockOutcome held_by(const Holder *holder, const char *path, char *message, size_t n) {
    if (holder->is_empty) {
        snprintf(message, n, "someone who is just making '%s'", path);
    } else {
        snprintf(message, n, "process %ld on %s since %s, by '%s'", holder->pid, holder->host,
                 holder->time, path);
    }
    return FRAME_LOCK_HELD;
}

static FrameLockOutcome fail_with(char *message, size_t n, const char *path, int code) {
    snprintf(message, n, "cannot lock '%s': %s", path, strerror(code));
    return FRAME_LOCK_FAILED;
}

// 0, or an errno.
static int lock_file(int fd) {
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    return fcntl(fd, F_SETLK, &whole) == 0 ? 0 : errno;
}

static bool is_busy(int code) {
    return code == EACCES || code == EAGAIN;
}

// Whether the open file is still the one under the path: its owner may have removed it.
static bool is_in_place(int fd, const char *path) {
    struct stat ours, there;
    return fstat(fd, &ours) == 0 && stat(path, &there) == 0 && ours.st_ino == there.st_ino &&
           ours.st_dev == there.st_dev;
}

static void pause_briefly(void) {
    nanosleep(&(struct timespec){.tv_nsec = PAUSE * 1000000}, NULL);
}

// A file that was there before, and that no living process of this machine holds any more once we
// have locked it.
static bool may_take_over(const Holder *holder, bool is_last) {
    char host[HOST];
    host_name(host);
    return holder->is_empty ? is_last : !strcmp(holder->host, host);
}

// One attempt; with *again set, another is worth it, unless this is the last.
static FrameLockOutcome attempt(const char *path, int *fd, bool is_last, bool *again, char *message,
                                size_t n) {
    *fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    bool is_new = *fd >= 0;
    if (!is_new && errno == EEXIST) {
        *fd = open(path, O_RDWR | O_CLOEXEC);
    }
    if (*fd < 0 && errno == EACCES && access(path, F_OK) == 0) {
        snprintf(message, n, "another user, by '%s'", path);
        return FRAME_LOCK_HELD;
    }
    if (*fd < 0) {
        *again = errno == ENOENT; // gone between the two, or there is no folder
        return fail_with(message, n, path, errno);
    }
    int code = lock_file(*fd);
    // Where there is nothing like fcntl's locks, whoever made the file has it.
    bool is_locked = code == 0 || (is_new && !is_busy(code));
    for (int i = 0; is_new && !is_locked && i < ATTEMPTS; i++) { // someone looks at the new file
        pause_briefly();
        is_locked = lock_file(*fd) == 0;
    }
    Holder holder;
    read_holder(*fd, &holder);
    if (!is_locked || (!is_new && !may_take_over(&holder, is_last))) {
        *again = is_locked && holder.is_empty;
        return held_by(&holder, path, message, n);
    }
    if (!is_in_place(*fd, path)) {
        *again = true;
        return FRAME_LOCK_HELD;
    }
    return write_holder(*fd) ? FRAME_LOCK_TAKEN : fail_with(message, n, path, errno);
}

static char *lock_path(const char *picture) {
    static const char ending[] = ".lock";
    size_t n = strlen(picture);
    char *path = malloc(n + sizeof ending);
    if (path) {
        memcpy(path, picture, n);
        memcpy(path + n, ending, sizeof ending);
    }
    return path;
}

FrameLockOutcome frame_lock_take(FrameLock *lock, const char *picture, char *message, size_t n) {
    FrameLockOutcome outcome = FRAME_LOCK_FAILED;
    bool again = true;
    *lock = (FrameLock){-1, lock_path(picture)};
    if (!lock->path) {
        return fail_with(message, n, picture, ENOMEM);
    }
    for (int i = 0; i < ATTEMPTS && again; i++) {
        again = false;
        outcome = attempt(lock->path, &lock->fd, i + 1 == ATTEMPTS, &again, message, n);
        if (outcome != FRAME_LOCK_TAKEN && lock->fd >= 0) {
            close(lock->fd);
            lock->fd = -1;
        }
        if (again && outcome == FRAME_LOCK_HELD) {
            pause_briefly();
        }
    }
    if (outcome != FRAME_LOCK_TAKEN) {
        free(lock->path);
        *lock = (FrameLock){-1, NULL};
    }
    return outcome;
}

void frame_lock_release(FrameLock *lock) {
    if (lock->fd >= 0) {
        unlink(lock->path); // before others can lock it
        close(lock->fd);
    }
    free(lock->path);
    *lock = (FrameLock){-1, NULL};
}

bool frame_lock_holder(const char *picture, char *message, size_t n) {
    char *path = lock_path(picture);
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd >= 0) {
        Holder holder;
        read_holder(fd, &holder);
        held_by(&holder, path, message, n);
        close(fd);
    }
    free(path);
    return fd >= 0;
}

bool frame_lock_is_held(const char *picture, char *message, size_t n) {
    FrameLock lock;
    char *path = lock_path(picture);
    bool is_there = path && access(path, F_OK) == 0;
    free(path);
    bool is_held = is_there && frame_lock_take(&lock, picture, message, n) == FRAME_LOCK_HELD;
    if (is_there && !is_held) {
        frame_lock_release(&lock);
    }
    return is_held;
}
