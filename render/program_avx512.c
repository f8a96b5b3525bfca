// SPDX-License-Identifier: Apache-2.0
// The batch kernels for processors with AVX-512: eight elements at once, the last four of a batch
// by AVX. SLEEF's functions without FMA, as in program_avx2.c and for the same reason.
#include "render/program_exec.h"

#include <immintrin.h>
#include <sleef.h>

#define EACH8(of_eight, of_four)                                                                   \
    do {                                                                                           \
        size_t i = 0;                                                                              \
        for (; i + 8 <= n; i += 8) {                                                               \
            _mm512_storeu_pd(r + i, (of_eight));                                                   \
        }                                                                                          \
        if (i < n) {                                                                               \
            _mm256_storeu_pd(r + i, (of_four));                                                    \
        }                                                                                          \
    } while (0);                                                                                   \
    break

#define MAP1(name, ulp)                                                                            \
    EACH8(Sleef_cinz_##name##d8_##ulp##avx512fnofma(_mm512_loadu_pd(a + i)),                       \
          Sleef_cinz_##name##d4_##ulp##avx(_mm256_loadu_pd(a + i)))
#define MAP2(name, ulp)                                                                            \
    EACH8(                                                                                         \
        Sleef_cinz_##name##d8_##ulp##avx512fnofma(_mm512_loadu_pd(a + i), _mm512_loadu_pd(b + i)), \
        Sleef_cinz_##name##d4_##ulp##avx(_mm256_loadu_pd(a + i), _mm256_loadu_pd(b + i)))
#define SINCOS8(at) Sleef_cinz_sincosd8_u10avx512fnofma(_mm512_loadu_pd(at))
#define SINCOS4(at) Sleef_cinz_sincosd4_u10avx(_mm256_loadu_pd(at))
#define MAP_SIN()   EACH8(SINCOS8(a + i).x, SINCOS4(a + i).x)
#define MAP_COS()   EACH8(SINCOS8(a + i).y, SINCOS4(a + i).y)
#define KERNEL_NAME program_kernel_avx512
#include "render/program_kernels.h"

void program_sincos_avx512(size_t n, double *sine, double *cosine, const double *a) {
    size_t i = 0;
    for (; i + 8 <= n; i += 8) {
        Sleef___m512d_2 both = SINCOS8(a + i);
        _mm512_storeu_pd(sine + i, both.x);
        _mm512_storeu_pd(cosine + i, both.y);
    }
    if (i < n) {
        Sleef___m256d_2 both = SINCOS4(a + i);
        _mm256_storeu_pd(sine + i, both.x);
        _mm256_storeu_pd(cosine + i, both.y);
    }
}
