// SPDX-License-Identifier: Apache-2.0
// The batch kernels for processors with AVX2. SLEEF's AVX functions without FMA are taken, since
// they are those that agree with its plain C ones in every bit.
#include "render/program_exec.h"

#include <immintrin.h>
#include <sleef.h>

#define EACH4(vector)                                                                              \
    do {                                                                                           \
        for (size_t i = 0; i < n; i += 4) {                                                        \
            _mm256_storeu_pd(r + i, (vector));                                                     \
        }                                                                                          \
    } while (0);                                                                                   \
    break

#define MAP1(name, ulp) EACH4(Sleef_cinz_##name##d4_##ulp##avx(_mm256_loadu_pd(a + i)))
#define MAP2(name, ulp)                                                                            \
    EACH4(Sleef_cinz_##name##d4_##ulp##avx(_mm256_loadu_pd(a + i), _mm256_loadu_pd(b + i)))
#define KERNEL_NAME program_kernel_avx2
#include "render/program_kernels.h"
