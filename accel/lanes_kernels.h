// SPDX-License-Identifier: Apache-2.0
// Sixteen floats at once: the type that the wide kernels are written over. The backend is chosen by
// what the including file is compiled for; the plain C one is the specification of the others.
//
// Masks hold lane i in bit i. All of it rounds once per operation, as written.
#ifndef ACCEL_LANES_KERNELS_H
#define ACCEL_LANES_KERNELS_H

#include <stdint.h>

// lanes_sort() one by one: by insertion.
static inline uint32_t lanes_insert(const float t[16], uint32_t mask, const uint32_t *child,
                                    float *to_t, uint32_t *to_child) {
    uint32_t count = 0;
    for (; mask; mask &= mask - 1, count++) {
        uint32_t lane = (uint32_t)__builtin_ctz(mask), at = count;
        for (; at > 0 && to_t[at - 1] < t[lane]; at--) {
            to_t[at] = to_t[at - 1];
            to_child[at] = to_child[at - 1];
        }
        to_t[at] = t[lane];
        to_child[at] = child[lane];
    }
    return to_child[count - 1];
}

// Two lanes, as most often.
static inline uint32_t lanes_two(float a, float b, uint32_t child_a, uint32_t child_b, float *to_t,
                                 uint32_t *to_child) {
    int is_a = a <= b;
    *to_t = is_a ? b : a;
    *to_child = is_a ? child_b : child_a;
    return is_a ? child_a : child_b;
}

#if defined __AVX512F__
#include "accel/lanes_avx512_kernels.h"
#elif defined __AVX2__
#include "accel/lanes_avx2_kernels.h"
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

// The children of the lanes in `mask`, side by side; up to 16 places of `to` may be written.
static inline void lanes_pack(const uint32_t *child, uint32_t mask, uint32_t *to) {
    for (; mask; mask &= mask - 1) {
        *to++ = child[__builtin_ctz(mask)];
    }
}

// The lanes in `mask`, at least one, farthest first: their distances and their children. Up to 16
// places may be written. Distances may come out up to 16 units in the last place away, which the
// caller allows for. Returns the child of the nearest.
static inline uint32_t lanes_sort(Lanes t, uint32_t mask, const uint32_t *child, float *to_t,
                                  uint32_t *to_child) {
    return lanes_insert(t.v, mask, child, to_t, to_child);
}

#endif
#endif
