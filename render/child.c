// SPDX-License-Identifier: Apache-2.0
// Child processes: their limits, and the pipe from them.
#include "render/child.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "accel/clock.h"

// ---- In the child

static void limit(int what, rlim_t soft, rlim_t hard) {
    struct rlimit now;
    if (getrlimit(what, &now) == 0) {
        now.rlim_cur = soft < now.rlim_max ? soft : now.rlim_max;
        now.rlim_max = hard < now.rlim_max ? hard : now.rlim_max;
        setrlimit(what, &now);
    }
}

// What the child inherits counts towards its limit of address space.
static size_t address_space(void) {
    size_t pages = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    if (f) {
        pages = fscanf(f, "%zu", &pages) == 1 ? pages : 0;
        fclose(f);
    }
    return pages * (size_t)sysconf(_SC_PAGESIZE);
}

static void confine(size_t memory, unsigned seconds) {
    // No handler of the parent's may run here: it would go on as if it were the parent.
    static const int signals[] = {SIGINT, SIGTERM, SIGPIPE, SIGSEGV, SIGBUS,
                                  SIGFPE, SIGILL,  SIGABRT, SIGXCPU};
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        signal(signals[i], SIG_DFL);
    }
    // A crash is reported by the parent, in one sentence; not by libraries on the way down.
    int null = open("/dev/null", O_RDWR);
    if (null >= 0) {
        dup2(null, 0);
        dup2(null, 1);
        dup2(null, 2);
    }
    limit(RLIMIT_CORE, 0, 0);
    limit(RLIMIT_FSIZE, 0, 0);
    if (seconds) {
        limit(RLIMIT_CPU, seconds, seconds + 1);
    }
#ifndef __SANITIZE_ADDRESS__
    size_t space = address_space() + memory;
    limit(RLIMIT_AS, space, space);
#else
    (void)address_space;
    (void)memory;
#endif
}

// ---- In the parent

bool child_start(Child *child, ChildBody *body, const void *argument, const ChildLimits *limits) {
    int ends[2];
    if (pipe(ends) != 0) {
        return false;
    }
    child->deadline = limits->wait > 0 ? clock_seconds() + limits->wait : INFINITY;
    child->fd = ends[0];
    child->is_late = false;
    child->at = child->end = 0;
    child->pid = fork();
    if (child->pid == 0) {
        close(ends[0]);
        confine(limits->memory, limits->seconds);
        body(argument, ends[1]);
        _exit(0);
    }
    close(ends[1]);
    if (child->pid < 0) {
        int code = errno;
        close(ends[0]);
        errno = code;
        return false;
    }
    return true;
}

// Waits until there is something to read; false: too long.
static bool wait_for(Child *child) {
    struct pollfd p = {.fd = child->fd, .events = POLLIN};
    while (isfinite(child->deadline)) {
        double left = child->deadline - clock_seconds();
        int ready = left > 0 ? poll(&p, 1, (int)(left * 1000) + 1) : 0;
        if (ready > 0) {
            break;
        }
        if (ready == 0) {
            child->is_late = true;
            return false;
        }
        if (errno != EINTR) {
            return false;
        }
    }
    return true;
}

// Some bytes, n at most; 0: the end, or too late.
static size_t receive_some(Child *child, void *to, size_t n) {
    ssize_t got = -1;
    while (got < 0) {
        if (!wait_for(child)) {
            return 0;
        }
        got = read(child->fd, to, n);
        if (got < 0 && errno != EINTR) {
            return 0;
        }
    }
    return (size_t)got;
}

bool child_receive(Child *child, void *to, size_t n) {
    unsigned char *out = to;
    while (n > 0) {
        size_t there = child->end - child->at;
        if (there > 0) {
            size_t part = there < n ? there : n;
            memcpy(out, child->buffer + child->at, part);
            child->at += part;
            out += part;
            n -= part;
            continue;
        }
        bool is_much = n >= sizeof child->buffer; // goes where it is wanted at once
        size_t got =
            receive_some(child, is_much ? out : child->buffer, is_much ? n : sizeof child->buffer);
        if (got == 0) {
            return false;
        }
        child->at = 0;
        child->end = is_much ? 0 : got;
        out += is_much ? got : 0;
        n -= is_much ? got : 0;
    }
    return true;
}

int child_stop(Child *child, bool is_over) {
    int status = 0;
    close(child->fd);
    if (!is_over || child->is_late) {
        kill(child->pid, SIGKILL);
    }
    while (waitpid(child->pid, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
}
