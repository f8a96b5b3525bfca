// SPDX-License-Identifier: Apache-2.0
// The operations for one element, and the batch kernels for any x86-64 processor.
#include "render/program_exec.h"

#include <sleef.h>

#define MAP1(name, ulp) EACH(Sleef_cinz_##name##d1_##ulp##purec(a[i]))
#define MAP2(name, ulp) EACH(Sleef_cinz_##name##d1_##ulp##purec(a[i], b[i]))
#define KERNEL_NAME     program_kernel_scalar
#include "render/program_kernels.h"

double op_scalar(Op op, double a, double b, double c, const ProgramTable *table) {
    switch (op) {
    case OP_ADD:
        return a + b;
    case OP_SUB:
        return a - b;
    case OP_MUL:
        return a * b;
    case OP_DIV:
        return a / b;
    case OP_SELECT:
        return a != 0 ? b : c;
    case OP_SIN:
        return Sleef_cinz_sind1_u10purec(a);
    case OP_COS:
        return Sleef_cinz_cosd1_u10purec(a);
    default: {
        double r = 0;
        program_kernel_scalar(op, 1, &r, &a, &b, &c, table);
        return r;
    }
    }
}
