// SPDX-License-Identifier: Apache-2.0
// The kernels for any machine, and the choice of a set.
#define TRACE_KERNELS trace_scalar
#define TRACE_NAME    "scalar"
#include "accel/trace_body.h"

#include "accel/cpu.h"

#include <string.h>

// The one mutable global of this folder: set at the start of the program.
static const TraceKernels *chosen;

static bool is_supported(const TraceKernels *kernels) {
    return kernels == &trace_scalar || cpu_has_avx2();
}

// Best first.
static const TraceKernels *const all[] = {&trace_avx2, &trace_scalar};

bool accel_set_cpu(const char *name) {
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if ((!name || strcmp(name, all[i]->name) == 0) && is_supported(all[i])) {
            chosen = all[i];
            return true;
        }
    }
    return false;
}

const TraceKernels *trace_kernels(void) {
    if (chosen) {
        return chosen;
    }
    return is_supported(&trace_avx2) ? &trace_avx2 : &trace_scalar;
}

const char *accel_cpu(void) {
    return trace_kernels()->name;
}
