// SPDX-License-Identifier: Apache-2.0
// The kernels for any machine, and the choice of a set.
#define TRACE_KERNELS trace_scalar
#include "accel/cpu.h"
#include "accel/trace_body.h"

const TraceKernels *trace_kernels(void) {
    static const TraceKernels *const all[CPU_COUNT] = {
        [CPU_SCALAR] = &trace_scalar, [CPU_AVX2] = &trace_avx2, [CPU_AVX512] = &trace_avx512};
    return all[cpu_now()];
}
