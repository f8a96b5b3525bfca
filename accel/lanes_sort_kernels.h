// SPDX-License-Identifier: Apache-2.0
// Sorting up to eight keys in AVX2 registers, for the vector forms of lanes_sort().
#ifndef ACCEL_LANES_SORT_KERNELS_H
#define ACCEL_LANES_SORT_KERNELS_H

#include <immintrin.h>
#include <stdint.h>

// Integers in the order of floats, and back.
static inline __m256i float_order(__m256i bits) {
    return _mm256_xor_si256(bits, _mm256_srli_epi32(_mm256_srai_epi32(bits, 31), 1));
}

// One step of a sorting network: each place and its partner, the greater comes first. `keep` has
// the bits of the places that take the lesser.
#define SORT_STEP_4(k, partner, keep)                                                              \
    {                                                                                              \
        __m128i other = _mm_shuffle_epi32(k, partner);                                             \
        k = _mm_blend_epi32(_mm_max_epi32(k, other), _mm_min_epi32(k, other), keep);               \
    }

#define SORT_STEP_8(k, keep, ...)                                                                  \
    {                                                                                              \
        __m256i other = _mm256_permutevar8x32_epi32(k, _mm256_setr_epi32(__VA_ARGS__));            \
        k = _mm256_blend_epi32(_mm256_max_epi32(k, other), _mm256_min_epi32(k, other), keep);      \
    }

static inline __m128i sort_4(__m128i k) {
    SORT_STEP_4(k, _MM_SHUFFLE(2, 3, 0, 1), 0xa);
    SORT_STEP_4(k, _MM_SHUFFLE(1, 0, 3, 2), 0xc);
    SORT_STEP_4(k, _MM_SHUFFLE(3, 1, 2, 0), 0x4);
    return k;
}

// Batcher's merge exchange sort of eight.
static inline __m256i sort_8(__m256i k) {
    SORT_STEP_8(k, 0xaa, 1, 0, 3, 2, 5, 4, 7, 6);
    SORT_STEP_8(k, 0xcc, 2, 3, 0, 1, 6, 7, 4, 5);
    SORT_STEP_8(k, 0x44, 0, 2, 1, 3, 4, 6, 5, 7);
    SORT_STEP_8(k, 0xf0, 4, 5, 6, 7, 0, 1, 2, 3);
    SORT_STEP_8(k, 0x30, 0, 1, 4, 5, 2, 3, 6, 7);
    SORT_STEP_8(k, 0x54, 0, 2, 1, 4, 3, 6, 5, 7);
    return k;
}

#endif
