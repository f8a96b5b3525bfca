// SPDX-License-Identifier: Apache-2.0
// Sixteen floats at once: the type that the wide kernels are written over. The backend is chosen by
// what the including file is compiled for; the plain C one is the specification of the others.
//
// Masks hold lane i in bit i. All of it rounds once per operation, as written.
#ifndef ACCEL_LANES_KERNELS_H
#define ACCEL_LANES_KERNELS_H

#include <stdint.h>

#ifdef __AVX2__
#include <immintrin.h>

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

#else

#define LANES_EACH(expression)                                                                     \
    Lanes r;                                                                                       \
    for (int i = 0; i < 16; i++) {                                                                 \
        r.v[i] = (expression);                                                                     \
    }                                                                                              \
    return r

typedef struct {
    float v[16];
} Lanes;

typedef struct {
    uint8_t v[16];
} LaneIndex;

static inline Lanes lanes_load(const float *p) {
    LANES_EACH(p[i]);
}

static inline void lanes_store(float *p, Lanes x) {
    for (int i = 0; i < 16; i++) {
        p[i] = x.v[i];
    }
}

static inline Lanes lanes_all(float x) {
    LANES_EACH(x);
}

static inline Lanes lanes_add(Lanes x, Lanes y) {
    LANES_EACH(x.v[i] + y.v[i]);
}

static inline Lanes lanes_sub(Lanes x, Lanes y) {
    LANES_EACH(x.v[i] - y.v[i]);
}

static inline Lanes lanes_mul(Lanes x, Lanes y) {
    LANES_EACH(x.v[i] * y.v[i]);
}

static inline Lanes lanes_fma(Lanes x, Lanes y, Lanes z) {
    LANES_EACH(__builtin_fmaf(x.v[i], y.v[i], z.v[i]));
}

static inline Lanes lanes_fnma(Lanes x, Lanes y, Lanes z) {
    LANES_EACH(__builtin_fmaf(-x.v[i], y.v[i], z.v[i]));
}

static inline Lanes lanes_fms(Lanes x, Lanes y, Lanes z) {
    LANES_EACH(__builtin_fmaf(x.v[i], y.v[i], -z.v[i]));
}

static inline Lanes lanes_abs(Lanes x) {
    LANES_EACH(__builtin_fabsf(x.v[i]));
}

static inline Lanes lanes_min(Lanes x, Lanes y) {
    LANES_EACH(x.v[i] < y.v[i] ? x.v[i] : y.v[i]);
}

static inline Lanes lanes_max(Lanes x, Lanes y) {
    LANES_EACH(x.v[i] > y.v[i] ? x.v[i] : y.v[i]);
}

static inline uint32_t lanes_le(Lanes x, Lanes y) {
    uint32_t mask = 0;
    for (int i = 0; i < 16; i++) {
        mask |= (uint32_t)(x.v[i] <= y.v[i]) << i;
    }
    return mask;
}

static inline uint32_t lanes_one_sign(Lanes x, Lanes y, Lanes z) {
    Lanes zero = lanes_all(0);
    uint32_t up = lanes_le(zero, x) & lanes_le(zero, y) & lanes_le(zero, z);
    return up | (lanes_le(x, zero) & lanes_le(y, zero) & lanes_le(z, zero));
}

static inline LaneIndex lanes_index(const uint8_t *index) {
    LaneIndex r;
    for (int i = 0; i < 16; i++) {
        r.v[i] = index[i];
    }
    return r;
}

static inline Lanes lanes_pick(Lanes x, LaneIndex index) {
    LANES_EACH(x.v[index.v[i]]);
}

#endif
#endif
