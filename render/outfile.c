// SPDX-License-Identifier: Apache-2.0
// Output files: temporary name, sync, rename.
#include "render/outfile.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// How many temporary names are tried when others hold them (left behind by a killed run, say), and
// how many links are followed.
enum { ATTEMPTS = 1000, SUFFIX = 40, LINKS = 40 };

static bool fail_with(char *message, size_t n, const char *what, int code) {
    snprintf(message, n, "%s: %s", what, strerror(code));
    return false;
}

// What a chain of links ends in, so that the rename replaces the file and not the link. (realpath
// does not know targets that are yet to be made.)
static char *follow_links(const char *path) {
    char *current = strdup(path), target[PATH_MAX];
    for (int i = 0; current && i < LINKS; i++) {
        ssize_t length = readlink(current, target, sizeof target - 1);
        if (length < 0) {
            return current;
        }
        target[length] = '\0';
        char *slash = target[0] == '/' ? NULL : strrchr(current, '/');
        size_t folder = slash ? (size_t)(slash + 1 - current) : 0;
        char *next = malloc(folder + (size_t)length + 1);
        if (next) {
            memcpy(next, current, folder);
            memcpy(next + folder, target, (size_t)length + 1);
        }
        free(current);
        current = next;
    }
    int code = current ? ELOOP : ENOMEM;
    free(current);
    errno = code;
    return NULL;
}

// NULL with a message where the target cannot be replaced by a rename.
static char *resolve_target(const char *path, char *message, size_t n) {
    struct stat s;
    size_t length = strlen(path);
    if (length == 0 || path[length - 1] == '/') {
        snprintf(message, n, "cannot create: the name of a file is missing");
        return NULL;
    }
    if (stat(path, &s) != 0) {
        if (errno == ENAMETOOLONG) { // of which the shorter temporary name would know nothing
            fail_with(message, n, "cannot create", errno);
            return NULL;
        }
        return follow_links(path);
    }
    if (S_ISDIR(s.st_mode)) {
        snprintf(message, n, "cannot write: it is a folder");
        return NULL;
    }
    if (!S_ISREG(s.st_mode)) {
        snprintf(message, n, "cannot write: it exists and is not a regular file");
        return NULL;
    }
    if (access(path, W_OK) != 0) {
        fail_with(message, n, "cannot replace", errno);
        return NULL;
    }
    return follow_links(path);
}

static int create_temporary(OutFile *file) {
    const char *slash = strrchr(file->path, '/');
    const char *base = slash ? slash + 1 : file->path;
    size_t folder = (size_t)(base - file->path), room = folder + NAME_MAX + SUFFIX;
    file->temporary = malloc(room);
    if (!file->temporary) {
        errno = ENOMEM;
        return -1;
    }
    for (unsigned i = 0; i < ATTEMPTS; i++) {
        // The dot hides it from listings; a long base name is cut so that the whole stays legal.
        snprintf(file->temporary, room, "%.*s.%.*s.%ld-%u.tmp", (int)folder, file->path,
                 NAME_MAX - SUFFIX, base, (long)getpid(), i);
        int fd = open(file->temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0 || errno != EEXIST) {
            return fd;
        }
    }
    return -1;
}

// Who may read a file that is replaced stays as it was; the owner too, where that is allowed.
static void keep_mode(int fd, const char *path) {
    struct stat s;
    if (stat(path, &s) == 0) {
        bool is_owned = fchown(fd, s.st_uid, s.st_gid) == 0;
        // Rights of a user whom the file does not belong to are not handed on.
        mode_t rights = is_owned ? 07777 : 0777;
        if (fchmod(fd, s.st_mode & rights) != 0) {
            return; // a file system without modes
        }
    }
}

bool outfile_open(OutFile *file, const char *path, char *message, size_t n) {
    *file = (OutFile){.fd = -1};
    message[0] = '\0';
    file->path = resolve_target(path, message, n);
    if (!file->path) {
        return message[0] ? false : fail_with(message, n, "cannot create", errno);
    }
    file->fd = create_temporary(file);
    if (file->fd < 0) {
        fail_with(message, n, "cannot create", errno);
        outfile_abandon(file);
        return false;
    }
    keep_mode(file->fd, file->path);
    return true;
}

bool outfile_write(OutFile *file, const void *bytes, size_t size, char *message, size_t n) {
    const char *at = bytes;
    while (size > 0) {
        ssize_t done = write(file->fd, at, size);
        if (done < 0 && errno != EINTR) {
            fail_with(message, n, "cannot write", errno);
            outfile_abandon(file);
            return false;
        }
        at += done > 0 ? done : 0;
        size -= done > 0 ? (size_t)done : 0;
    }
    return true;
}

// The name is the folder's content. Some file systems cannot sync a folder, and need not.
static void sync_folder(char *path) {
    char *slash = strrchr(path, '/');
    int fd = -1;
    if (slash) {
        slash[slash == path] = '\0'; // "/a" lies in "/"
        fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    } else {
        fd = open(".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    }
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
}

bool outfile_commit(OutFile *file, char *message, size_t n) {
    int code = fsync(file->fd) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno;
    // Some file systems report a full disk only when the file is closed.
    if (close(file->fd) != 0 && !code) {
        code = errno;
    }
    file->fd = -1;
    if (!code && rename(file->temporary, file->path) != 0) {
        code = errno;
    }
    if (code) {
        fail_with(message, n, "cannot write", code);
        outfile_abandon(file);
        return false;
    }
    sync_folder(file->path);
    free(file->temporary);
    free(file->path);
    *file = (OutFile){.fd = -1};
    return true;
}

void outfile_abandon(OutFile *file) {
    if (file->fd >= 0) {
        close(file->fd);
    }
    if (file->temporary) {
        unlink(file->temporary);
    }
    free(file->temporary);
    free(file->path);
    *file = (OutFile){.fd = -1};
}
