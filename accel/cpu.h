// SPDX-License-Identifier: Apache-2.0
// The instruction sets that kernels exist for, what of them this processor has, and the choice.
// Which one runs changes no bit of any result.
#ifndef ACCEL_CPU_H
#define ACCEL_CPU_H

#include <stdbool.h>

// Each includes those before it; files are compiled for them by their names (ISA_... in the
// Makefile).
typedef enum { CPU_SCALAR, CPU_AVX2, CPU_AVX512, CPU_COUNT } Cpu;

extern const char *const cpu_names[CPU_COUNT]; // as users write them

bool cpu_has(Cpu cpu);

// What runs from now on; structures keep what was chosen when they were built. NULL: the best that
// the processor has, as without a call. False: unknown, or not here. For the start of the program
// and for tests: not while other threads run kernels.
bool cpu_set(const char *name);
Cpu cpu_now(void);

#endif
