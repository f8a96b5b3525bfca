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
#define SINCOS(angle) Sleef_cinz_sincosd4_u10avx(angle)
#define MAP_SIN()     EACH4(SINCOS(_mm256_loadu_pd(a + i)).x)
#define MAP_COS()     EACH4(SINCOS(_mm256_loadu_pd(a + i)).y)
#define KERNEL_NAME   program_kernel_avx2
#include "render/program_kernels.h"

void program_sincos_avx2(size_t n, double *sine, double *cosine, const double *a) {
    for (size_t i = 0; i < n; i += 4) {
        Sleef___m256d_2 both = SINCOS(_mm256_loadu_pd(a + i));
        _mm256_storeu_pd(sine + i, both.x);
        _mm256_storeu_pd(cosine + i, both.y);
    }
}
