// SPDX-License-Identifier: Apache-2.0
// Limits of child processes.
#include "render/child.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <sys/resource.h>
#include <unistd.h>

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

void child_confine(size_t memory, unsigned seconds) {
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
