// SPDX-License-Identifier: Apache-2.0
// Opening and reading files.
#include "render/infile.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// O_NONBLOCK: a pipe that nobody writes to must not hold the program.
int infile_open(const char *path, size_t *size, char *message, size_t n) {
    struct stat s;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0 || fstat(fd, &s) != 0) {
        snprintf(message, n, "cannot read: %s", strerror(errno));
    } else if (!S_ISREG(s.st_mode)) {
        snprintf(message, n, "it is %s", S_ISDIR(s.st_mode) ? "a folder" : "not a regular file");
    } else if (s.st_size == 0) {
        snprintf(message, n, "the file is empty");
    } else {
        *size = (size_t)s.st_size;
        return fd;
    }
    if (fd >= 0) {
        close(fd);
    }
    return -1;
}

size_t infile_read(int fd, void *to, size_t offset, size_t size) {
    size_t done = 0;
    errno = 0;
    while (done < size) {
        ssize_t got = pread(fd, (char *)to + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) {
            errno = 0;
            continue;
        }
        if (got <= 0) {
            break;
        }
        done += (size_t)got;
    }
    return done;
}
