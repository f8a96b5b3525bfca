// SPDX-License-Identifier: Apache-2.0
// The batch kernels behind the executor, one for each instruction set.
#ifndef RENDER_PROGRAM_EXEC_H
#define RENDER_PROGRAM_EXEC_H

#include "render/program.h"

typedef void ProgramKernel(Op op, size_t n, double *r, const double *a, const double *b,
                           const double *c, const ProgramTable *table);

ProgramKernel program_kernel_scalar, program_kernel_avx2, program_kernel_avx512;

// The sine and the cosine of the same angles, with the bits that each operation by itself gives.
typedef void ProgramSinCos(size_t n, double *sine, double *cosine, const double *a);

ProgramSinCos program_sincos_scalar, program_sincos_avx2, program_sincos_avx512;

typedef struct {
    ProgramKernel *run;
    ProgramSinCos *sincos;
} ProgramCpu;

#endif
