// SPDX-License-Identifier: Apache-2.0
// Conversion between 32-bit and 16-bit floating point (IEEE 754 binary16), in integers, so that the
// bits are the same on every CPU: F16C instructions and tables differ in their NaNs.
#ifndef RENDER_HALF_H
#define RENDER_HALF_H

#include <stdint.h>
#include <string.h>

// Round to nearest, ties to even; 65520 and above give infinity; a NaN stays a NaN and keeps the
// upper bits of its payload.
static inline uint16_t half_from_float(float value) {
    uint32_t bits;
    memcpy(&bits, &value, 4);
    uint32_t sign = bits >> 16 & 0x8000, magnitude = bits & 0x7fffffff;
    if (magnitude > 0x7f800000) {
        uint32_t payload = magnitude >> 13 & 0x3ff;
        return (uint16_t)(sign | 0x7c00 | (payload ? payload : 1));
    }
    if (magnitude >= 0x477ff000) {
        return (uint16_t)(sign | 0x7c00);
    }
    if (magnitude < 0x38800000) { // below 2^-14: subnormal, in units of 2^-24
        uint32_t exponent = magnitude >> 23, mantissa = (magnitude & 0x7fffff) | 0x800000;
        uint32_t shift = 126 - exponent;
        if (shift > 24) {
            return (uint16_t)sign;
        }
        uint32_t units = mantissa >> shift, rest = mantissa & ((1u << shift) - 1);
        uint32_t middle = 1u << (shift - 1);
        units += rest > middle || (rest == middle && (units & 1));
        return (uint16_t)(sign | units);
    }
    uint32_t odd = magnitude >> 13 & 1;
    return (uint16_t)(sign | ((magnitude - (112u << 23) + 0xfff + odd) >> 13));
}

// Exact.
static inline float half_to_float(uint16_t half) {
    uint32_t sign = (uint32_t)(half & 0x8000) << 16, exponent = half >> 10 & 0x1f;
    uint32_t mantissa = half & 0x3ff, bits;
    if (exponent == 0) {
        float value = (float)mantissa * 0x1p-24f;
        memcpy(&bits, &value, 4);
    } else if (exponent == 0x1f) {
        bits = 0x7f800000 | mantissa << 13;
    } else {
        bits = (exponent + 112) << 23 | mantissa << 13;
    }
    bits |= sign;
    float value;
    memcpy(&value, &bits, 4);
    return value;
}

#endif
