// SPDX-License-Identifier: Apache-2.0
// What this processor has, and which kernels were chosen.
#include "accel/cpu.h"

#include <stdatomic.h>
#include <string.h>

const char *const cpu_names[CPU_COUNT] = {
    [CPU_SCALAR] = "scalar", [CPU_AVX2] = "avx2", [CPU_AVX512] = "avx512"};

// One more than the choice; 0: none yet.
static _Atomic int chosen;

bool cpu_has(Cpu cpu) {
    switch (cpu) {
    case CPU_AVX512:
        return cpu_has(CPU_AVX2) && __builtin_cpu_supports("avx512f") &&
               __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw");
    case CPU_AVX2:
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
               __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    default:
        return cpu == CPU_SCALAR;
    }
}

bool cpu_set(const char *name) {
    for (int cpu = CPU_COUNT - 1; cpu >= 0; cpu--) {
        if ((!name || strcmp(name, cpu_names[cpu]) == 0) && cpu_has((Cpu)cpu)) {
            chosen = cpu + 1;
            return true;
        }
    }
    return false;
}

Cpu cpu_now(void) {
    if (!chosen) {
        cpu_set(NULL);
    }
    return (Cpu)(chosen - 1);
}
