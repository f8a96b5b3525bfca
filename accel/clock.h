// SPDX-License-Identifier: Apache-2.0
// The time that passes, for statistics and deadlines.
#ifndef ACCEL_CLOCK_H
#define ACCEL_CLOCK_H

#include <time.h>

// Seconds since some moment, on a clock that is never set.
static inline double clock_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
