// SPDX-License-Identifier: Apache-2.0
// What this processor has, of what files are compiled for (ISA_... in the Makefile).
#ifndef ACCEL_CPU_H
#define ACCEL_CPU_H

#include <stdbool.h>

static inline bool cpu_has_avx2(void) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}

#endif
