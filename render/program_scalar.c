// SPDX-License-Identifier: Apache-2.0
// The operations for one element, and the batch kernels for any x86-64 processor.
#include "render/program_exec.h"

#include <sleef.h>

#define MAP1(name, ulp) EACH(Sleef_cinz_##name##d1_##ulp##purec(a[i]))
#define MAP2(name, ulp) EACH(Sleef_cinz_##name##d1_##ulp##purec(a[i], b[i]))
#define MAP_SIN()       EACH(Sleef_cinz_sincosd1_u10purec(a[i]).x)
#define MAP_COS()       EACH(Sleef_cinz_sincosd1_u10purec(a[i]).y)
#define KERNEL_NAME     program_kernel_scalar
#include "render/program_kernels.h"

double op_scalar(Op op, double a, double b, double c, const ProgramTable *table) {
    double r = 0;
    program_kernel_scalar(op, 1, &r, &a, &b, &c, table);
    return r;
}

void program_sincos_scalar(size_t n, double *sine, double *cosine, const double *a) {
    for (size_t i = 0; i < n; i++) {
        Sleef_double_2 both = Sleef_cinz_sincosd1_u10purec(a[i]);
        sine[i] = both.x;
        cosine[i] = both.y;
    }
}
