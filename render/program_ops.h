// SPDX-License-Identifier: Apache-2.0
// What each operation means, for one element. This text is the specification: the batch kernels
// (render/program_kernels.h) must give the same bits, and a test compares them.
#ifndef RENDER_PROGRAM_OPS_H
#define RENDER_PROGRAM_OPS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "render/program.h"

// Written as the SSE minimum and maximum are, so that both give the same for NaN and -0.
static inline double op_min(double a, double b) {
    return a < b ? a : b;
}

static inline double op_max(double a, double b) {
    return a > b ? a : b;
}

// Floored modulo. The product can round to either side of a; the result is kept in [0, |b|), at the
// end where it belongs: a hair below 0 is a hair below b.
static inline double op_mod(double a, double b) {
    double r = a - b * floor(a / b);
    double below = b > 0 ? r < 0 : r > 0, beyond = b > 0 ? r >= b : r <= b;
    r = below && b != 0 ? 0 : r;
    return beyond && b != 0 ? b * 0x1.fffffffffffffp-1 : r;
}

static inline double op_sign(double a) {
    return a > 0 ? 1.0 : a < 0 ? -1.0 : a;
}

static inline uint64_t op_mix(uint64_t x) { // splitmix64's finaliser (Steele, Lea, Flood 2014)
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static inline uint64_t op_bits(double a) {
    uint64_t bits;
    a += 0.0; // -0 and 0 are one number
    memcpy(&bits, &a, sizeof bits);
    return bits;
}

static inline double op_hash(double a, double b) {
    uint64_t h = op_mix(op_bits(a) + 0x9e3779b97f4a7c15u);
    h = op_mix(h ^ (op_bits(b) + 0xd1b54a32d192ed03u));
    return (double)(h >> 11) * 0x1p-53;
}

static inline double op_search(double a, const ProgramTable *table) {
    uint32_t lo = 0, hi = table->n; // the answer is in [lo, hi)
    while (hi - lo > 1) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (table->values[middle] <= a) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    return lo;
}

static inline double op_table(double a, const ProgramTable *table) {
    if (!(a > 0)) { // NaN too
        return table->values[0];
    }
    return table->values[a < table->n ? (uint32_t)a : table->n - 1];
}

// Without a picture: 0.
static inline double op_image(double s, double t, const double dx[2], const double dy[2],
                              const ProgramTable *table) {
    float rgba[4] = {0};
    const double st[2] = {s, t};
    if (table && table->image && isfinite(s) && isfinite(t)) {
        table->image->look_up(table->image, st, dx, dy, rgba);
    }
    return table ? rgba[table->n & 3] : 0;
}

// Gradient noise at one point (render/program_noise.c).
double op_noise(double x, double y, double z);

// The operations that every processor has: OP_PLAIN(name, result).
#define OPS_PLAIN                                                                                  \
    OP_PLAIN(ADD, a + b)                                                                           \
    OP_PLAIN(SUB, a - b)                                                                           \
    OP_PLAIN(MUL, a *b)                                                                            \
    OP_PLAIN(DIV, a / b)                                                                           \
    OP_PLAIN(MOD, op_mod(a, b))                                                                    \
    OP_PLAIN(NEG, -a)                                                                              \
    OP_PLAIN(ABS, fabs(a))                                                                         \
    OP_PLAIN(SIGN, op_sign(a))                                                                     \
    OP_PLAIN(FLOOR, floor(a))                                                                      \
    OP_PLAIN(CEIL, ceil(a))                                                                        \
    OP_PLAIN(ROUND, floor(a + 0.5))                                                                \
    OP_PLAIN(SQRT, sqrt(a))                                                                        \
    OP_PLAIN(MIN, op_min(a, b))                                                                    \
    OP_PLAIN(MAX, op_max(a, b))                                                                    \
    OP_PLAIN(LT, a < b ? 1.0 : 0.0)                                                                \
    OP_PLAIN(LE, a <= b ? 1.0 : 0.0)                                                               \
    OP_PLAIN(EQ, a == b ? 1.0 : 0.0)                                                               \
    OP_PLAIN(NOT, a == 0 ? 1.0 : 0.0)                                                              \
    OP_PLAIN(AND, (a != 0) & (b != 0) ? 1.0 : 0.0)                                                 \
    OP_PLAIN(OR, (a != 0) | (b != 0) ? 1.0 : 0.0)                                                  \
    OP_PLAIN(SELECT, a != 0 ? b : c)

#define OP_PLAIN(name, result)                                                                     \
    static inline double op_plain_##name(double a, double b, double c) {                           \
        (void)a, (void)b, (void)c;                                                                 \
        return result;                                                                             \
    }
OPS_PLAIN
#undef OP_PLAIN

double op_scalar(Op op, double a, double b, double c, const ProgramTable *table);

#endif
