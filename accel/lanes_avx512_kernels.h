// SPDX-License-Identifier: Apache-2.0
// Sixteen floats as one AVX-512 register; what each function does is in accel/lanes_kernels.h.
#ifndef ACCEL_LANES_AVX512_KERNELS_H
#define ACCEL_LANES_AVX512_KERNELS_H

#include "accel/lanes_sort_kernels.h"

typedef __m512 Lanes;
typedef __m512i LaneIndex;

static inline Lanes lanes_load(const float *p) { // 64-byte aligned
    return _mm512_load_ps(p);
}

static inline void lanes_store(float *p, Lanes x) { // 64-byte aligned
    _mm512_store_ps(p, x);
}

static inline Lanes lanes_all(float x) {
    return _mm512_set1_ps(x);
}

static inline Lanes lanes_add(Lanes x, Lanes y) {
    return _mm512_add_ps(x, y);
}

static inline Lanes lanes_sub(Lanes x, Lanes y) {
    return _mm512_sub_ps(x, y);
}

static inline Lanes lanes_mul(Lanes x, Lanes y) {
    return _mm512_mul_ps(x, y);
}

// x*y + z
static inline Lanes lanes_fma(Lanes x, Lanes y, Lanes z) {
    return _mm512_fmadd_ps(x, y, z);
}

// z - x*y
static inline Lanes lanes_fnma(Lanes x, Lanes y, Lanes z) {
    return _mm512_fnmadd_ps(x, y, z);
}

// x*y - z
static inline Lanes lanes_fms(Lanes x, Lanes y, Lanes z) {
    return _mm512_fmsub_ps(x, y, z);
}

static inline Lanes lanes_abs(Lanes x) {
    return _mm512_abs_ps(x);
}

// The second operand where either is NaN.
static inline Lanes lanes_min(Lanes x, Lanes y) {
    return _mm512_min_ps(x, y);
}

static inline Lanes lanes_max(Lanes x, Lanes y) {
    return _mm512_max_ps(x, y);
}

// x <= y; false where either is NaN.
static inline uint32_t lanes_le(Lanes x, Lanes y) {
    return _mm512_cmp_ps_mask(x, y, _CMP_LE_OQ);
}

// Lanes in which x, y, z are all >= 0 or all <= 0. Where one of them is NaN a lane may come out
// either way: the kernels' own test rejects it later.
static inline uint32_t lanes_one_sign(Lanes x, Lanes y, Lanes z) {
    Lanes zero = _mm512_setzero_ps();
    Lanes lo = _mm512_min_ps(_mm512_min_ps(x, y), z), hi = _mm512_max_ps(_mm512_max_ps(x, y), z);
    return lanes_le(zero, lo) | lanes_le(hi, zero);
}

static inline LaneIndex lanes_index(const uint8_t *index) {
    return _mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)(const void *)index));
}

static inline Lanes lanes_pick(Lanes x, LaneIndex index) {
    return _mm512_permutexvar_ps(index, x);
}

static inline void lanes_pack(const uint32_t *child, uint32_t mask, uint32_t *to) {
    __m512i all = _mm512_load_si512(child);
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32((__mmask16)mask, all));
}

static inline uint32_t lanes_sort(Lanes t, uint32_t mask, const uint32_t *child, float *to_t,
                                  uint32_t *to_child) {
    uint32_t n = (uint32_t)__builtin_popcount(mask), more = mask & (mask - 1);
    if (n == 2) {
        __m128 two = _mm512_castps512_ps128(_mm512_maskz_compress_ps((__mmask16)mask, t));
        return lanes_two(_mm_cvtss_f32(two), _mm_cvtss_f32(_mm_movehdup_ps(two)),
                         child[__builtin_ctz(mask)], child[__builtin_ctz(more)], to_t, to_child);
    }
    if (n > 8) {
        float all[16] __attribute__((aligned(64)));
        lanes_store(all, t);
        return lanes_insert(all, mask, child, to_t, to_child);
    }
    // The four lowest bits of a distance give way to its lane's number: key & ~15 | lane.
    __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    __m512i key = _mm512_castps_si512(t);
    key = _mm512_ternarylogic_epi32(key, _mm512_set1_epi32(15), lane, 0xba);
    key = _mm512_maskz_compress_epi32((__mmask16)mask, key);
    __m256i k = float_order(_mm512_castsi512_si256(key));
    k = _mm256_mask_mov_epi32(_mm256_set1_epi32(INT32_MIN), (__mmask8)((1u << n) - 1), k);
    k = n <= 4 ? _mm256_castsi128_si256(sort_4(_mm256_castsi256_si128(k))) : sort_8(k);
    k = float_order(k);
    __m512i children = _mm512_load_si512(child);
    children = _mm512_permutexvar_epi32(_mm512_castsi256_si512(k), children);
    _mm256_storeu_ps(to_t, _mm256_castsi256_ps(k));
    _mm256_storeu_si256((__m256i *)(void *)to_child, _mm512_castsi512_si256(children));
    // From the register: the stack would answer later.
    __m256i nearest = _mm256_permutevar8x32_epi32(k, _mm256_set1_epi32((int)n - 1));
    return child[_mm256_cvtsi256_si32(nearest) & 15];
}

#endif
