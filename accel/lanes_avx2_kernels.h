// SPDX-License-Identifier: Apache-2.0
// Sixteen floats as two AVX2 registers; what each function does is in accel/lanes_kernels.h.
#ifndef ACCEL_LANES_AVX2_KERNELS_H
#define ACCEL_LANES_AVX2_KERNELS_H

#include "accel/lanes_sort_kernels.h"

typedef struct {
    __m256 a, b;
} Lanes;

// Sixteen indices 0..15, made ready for lanes_pick().
typedef struct {
    __m256i a, b;
} LaneIndex;

static inline Lanes lanes_load(const float *p) { // 64-byte aligned
    return (Lanes){_mm256_load_ps(p), _mm256_load_ps(p + 8)};
}

static inline void lanes_store(float *p, Lanes x) { // 64-byte aligned
    _mm256_store_ps(p, x.a);
    _mm256_store_ps(p + 8, x.b);
}

static inline Lanes lanes_all(float x) {
    return (Lanes){_mm256_set1_ps(x), _mm256_set1_ps(x)};
}

static inline Lanes lanes_add(Lanes x, Lanes y) {
    return (Lanes){_mm256_add_ps(x.a, y.a), _mm256_add_ps(x.b, y.b)};
}

static inline Lanes lanes_sub(Lanes x, Lanes y) {
    return (Lanes){_mm256_sub_ps(x.a, y.a), _mm256_sub_ps(x.b, y.b)};
}

static inline Lanes lanes_mul(Lanes x, Lanes y) {
    return (Lanes){_mm256_mul_ps(x.a, y.a), _mm256_mul_ps(x.b, y.b)};
}

// x*y + z
static inline Lanes lanes_fma(Lanes x, Lanes y, Lanes z) {
    return (Lanes){_mm256_fmadd_ps(x.a, y.a, z.a), _mm256_fmadd_ps(x.b, y.b, z.b)};
}

// z - x*y
static inline Lanes lanes_fnma(Lanes x, Lanes y, Lanes z) {
    return (Lanes){_mm256_fnmadd_ps(x.a, y.a, z.a), _mm256_fnmadd_ps(x.b, y.b, z.b)};
}

// x*y - z
static inline Lanes lanes_fms(Lanes x, Lanes y, Lanes z) {
    return (Lanes){_mm256_fmsub_ps(x.a, y.a, z.a), _mm256_fmsub_ps(x.b, y.b, z.b)};
}

static inline Lanes lanes_abs(Lanes x) {
    __m256 sign = _mm256_set1_ps(-0.0f);
    return (Lanes){_mm256_andnot_ps(sign, x.a), _mm256_andnot_ps(sign, x.b)};
}

// The second operand where either is NaN.
static inline Lanes lanes_min(Lanes x, Lanes y) {
    return (Lanes){_mm256_min_ps(x.a, y.a), _mm256_min_ps(x.b, y.b)};
}

static inline Lanes lanes_max(Lanes x, Lanes y) {
    return (Lanes){_mm256_max_ps(x.a, y.a), _mm256_max_ps(x.b, y.b)};
}

// x <= y; false where either is NaN.
static inline uint32_t lanes_le(Lanes x, Lanes y) {
    uint32_t a = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ));
    uint32_t b = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ));
    return a | b << 8;
}

// Lanes in which x, y, z are all >= 0 or all <= 0. Where one of them is NaN a lane may come out
// either way: the kernels' own test rejects it later.
static inline uint32_t lanes_one_sign(Lanes x, Lanes y, Lanes z) {
    Lanes lo = {_mm256_min_ps(_mm256_min_ps(x.a, y.a), z.a),
                _mm256_min_ps(_mm256_min_ps(x.b, y.b), z.b)};
    Lanes hi = {_mm256_max_ps(_mm256_max_ps(x.a, y.a), z.a),
                _mm256_max_ps(_mm256_max_ps(x.b, y.b), z.b)};
    Lanes zero = lanes_all(0);
    return lanes_le(zero, lo) | lanes_le(hi, zero);
}

static inline LaneIndex lanes_index(const uint8_t *index) {
    __m128i bytes = _mm_loadu_si128((const __m128i *)(const void *)index);
    return (LaneIndex){_mm256_cvtepu8_epi32(bytes), _mm256_cvtepu8_epi32(_mm_srli_si128(bytes, 8))};
}

static inline __m256 lanes_pick8(Lanes x, __m256i index) {
    __m256 low = _mm256_permutevar8x32_ps(x.a, index), high = _mm256_permutevar8x32_ps(x.b, index);
    return _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32(index, 28)));
}

static inline Lanes lanes_pick(Lanes x, LaneIndex index) {
    return (Lanes){lanes_pick8(x, index.a), lanes_pick8(x, index.b)};
}

// The k-th set bit of m, from a byte to eight places of a table.
#define PACK_IS(m, k, i) (((m) >> (i)&1) && __builtin_popcount((m) & ((1 << (i)) - 1)) == (k))
#define PACK_BIT(m, k)                                                                             \
    (PACK_IS(m, k, 1)   ? 1                                                                        \
     : PACK_IS(m, k, 2) ? 2                                                                        \
     : PACK_IS(m, k, 3) ? 3                                                                        \
     : PACK_IS(m, k, 4) ? 4                                                                        \
     : PACK_IS(m, k, 5) ? 5                                                                        \
     : PACK_IS(m, k, 6) ? 6                                                                        \
     : PACK_IS(m, k, 7) ? 7                                                                        \
                        : 0)
#define PACK_8(m)                                                                                  \
    PACK_BIT(m, 0), PACK_BIT(m, 1), PACK_BIT(m, 2), PACK_BIT(m, 3), PACK_BIT(m, 4),                \
        PACK_BIT(m, 5), PACK_BIT(m, 6), PACK_BIT(m, 7)
#define PACK_ROW(m)                                                                                \
    { 0, 0, 0, 0, 0, 0, 0, 0, PACK_8(m) }
#define PACK_ROWS_4(m) PACK_ROW(m), PACK_ROW((m) + 1), PACK_ROW((m) + 2), PACK_ROW((m) + 3)
#define PACK_ROWS_16(m)                                                                            \
    PACK_ROWS_4(m), PACK_ROWS_4((m) + 4), PACK_ROWS_4((m) + 8), PACK_ROWS_4((m) + 12)
#define PACK_ROWS_64(m)                                                                            \
    PACK_ROWS_16(m), PACK_ROWS_16((m) + 16), PACK_ROWS_16((m) + 32), PACK_ROWS_16((m) + 48)

// [m] lists the set bits of m, lowest first, from its ninth byte on: read k bytes earlier, they
// come k places later.
static const uint8_t pack_table[256][16] = {PACK_ROWS_64(0), PACK_ROWS_64(64), PACK_ROWS_64(128),
                                            PACK_ROWS_64(192)};

static inline __m256i pack_index(uint32_t mask, uint32_t later) {
    const uint8_t *row = &pack_table[mask][8 - later];
    return _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)row));
}

// The lanes of `mask`, at most eight, side by side from place 0 on.
static inline __m256i pack_lanes(__m256i a, __m256i b, uint32_t mask) {
    uint32_t low = mask & 255, n_low = (uint32_t)__builtin_popcount(low);
    __m256i from_a = _mm256_permutevar8x32_epi32(a, pack_index(low, 0));
    __m256i from_b = _mm256_permutevar8x32_epi32(b, pack_index(mask >> 8, n_low));
    __m256i place = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    __m256i is_a = _mm256_cmpgt_epi32(_mm256_set1_epi32((int)n_low), place);
    return _mm256_blendv_epi8(from_b, from_a, is_a);
}

static inline void lanes_pack(const uint32_t *child, uint32_t mask, uint32_t *to) {
    __m256i a = _mm256_load_si256((const __m256i *)(const void *)child);
    __m256i b = _mm256_load_si256((const __m256i *)(const void *)(child + 8));
    uint32_t low = mask & 255, n_low = (uint32_t)__builtin_popcount(low);
    a = _mm256_permutevar8x32_epi32(a, pack_index(low, 0));
    b = _mm256_permutevar8x32_epi32(b, pack_index(mask >> 8, 0));
    _mm256_storeu_si256((__m256i *)(void *)to, a);
    _mm256_storeu_si256((__m256i *)(void *)(to + n_low), b);
}

static inline uint32_t lanes_sort(Lanes t, uint32_t mask, const uint32_t *child, float *to_t,
                                  uint32_t *to_child) {
    uint32_t n = (uint32_t)__builtin_popcount(mask), more = mask & (mask - 1);
    float all[16] __attribute__((aligned(64)));
    if (n == 2) {
        lanes_store(all, t);
        int i = __builtin_ctz(mask), j = __builtin_ctz(more);
        return lanes_two(all[i], all[j], child[i], child[j], to_t, to_child);
    }
    if (n > 8) {
        lanes_store(all, t);
        return lanes_insert(all, mask, child, to_t, to_child);
    }
    // The four lowest bits of a distance give way to its lane's number.
    __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), rest = _mm256_set1_epi32(15);
    __m256i a = _mm256_or_si256(_mm256_andnot_si256(rest, _mm256_castps_si256(t.a)), lane);
    __m256i b = _mm256_or_si256(_mm256_andnot_si256(rest, _mm256_castps_si256(t.b)),
                                _mm256_add_epi32(lane, _mm256_set1_epi32(8)));
    __m256i k = float_order(pack_lanes(a, b, mask));
    k = _mm256_blendv_epi8(_mm256_set1_epi32(INT32_MIN), k,
                           _mm256_cmpgt_epi32(_mm256_set1_epi32((int)n), lane));
    k = n <= 4 ? _mm256_castsi128_si256(sort_4(_mm256_castsi256_si128(k))) : sort_8(k);
    k = float_order(k);
    __m256i low = _mm256_load_si256((const __m256i *)(const void *)child);
    __m256i high = _mm256_load_si256((const __m256i *)(const void *)(child + 8));
    low = _mm256_permutevar8x32_epi32(low, k);
    high = _mm256_permutevar8x32_epi32(high, k);
    __m256i is_high = _mm256_slli_epi32(k, 28);
    __m256 picked = _mm256_blendv_ps(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high),
                                     _mm256_castsi256_ps(is_high));
    _mm256_storeu_ps(to_t, _mm256_castsi256_ps(k));
    _mm256_storeu_ps((float *)(void *)to_child, picked);
    return to_child[n - 1];
}

#endif
