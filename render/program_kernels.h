// SPDX-License-Identifier: Apache-2.0
// One operation over a batch, once per instruction set: the including file defines KERNEL_NAME, and
// MAP1, MAP2 for the functions that the hardware does not have. Sines and cosines are halves of
// SLEEF's sincos, alone too: its sin and cos differ from that by a bit here and there.
//
// n is a multiple of 4; arrays do not overlap unless equal.
#include "render/program_ops.h"

#define LOOP(expression)                                                                           \
    do {                                                                                           \
        _Pragma("omp simd") for (size_t i = 0; i < n; i++) {                                       \
            r[i] = (expression);                                                                   \
        }                                                                                          \
    } while (0);                                                                                   \
    break

// The same, for what does not vectorise.
#define EACH(expression)                                                                           \
    do {                                                                                           \
        for (size_t i = 0; i < n; i++) {                                                           \
            r[i] = (expression);                                                                   \
        }                                                                                          \
    } while (0);                                                                                   \
    break

void KERNEL_NAME(Op op, size_t n, double *r, const double *a, const double *b, const double *c,
                 const ProgramTable *table) {
    switch (op) {
#define OP_PLAIN(name, result)                                                                     \
    case OP_##name:                                                                                \
        LOOP(op_plain_##name(a[i], b[i], c[i]));
        OPS_PLAIN
#undef OP_PLAIN
    case OP_EXP:
        MAP1(exp, u10);
    case OP_LOG:
        MAP1(log, u10);
    case OP_SIN:
        MAP_SIN();
    case OP_COS:
        MAP_COS();
    case OP_TAN:
        MAP1(tan, u10);
    case OP_ASIN:
        MAP1(asin, u10);
    case OP_ACOS:
        MAP1(acos, u10);
    case OP_ATAN:
        MAP1(atan, u10);
    case OP_POW:
        MAP2(pow, u10);
    case OP_ATAN2:
        MAP2(atan2, u10);
    case OP_HYPOT:
        MAP2(hypot, u05);
    case OP_SEARCH:
        EACH(op_search(a[i], table));
    case OP_TABLE:
        EACH(op_table(a[i], table));
    case OP_IMAGE:
        EACH(op_image(a[i], b[i], (const double[2]){0}, (const double[2]){0}, table));
    case OP_HASH:
        EACH(op_hash(a[i], b[i]));
    case OP_NOISE:
        EACH(op_noise(a[i], b[i], c[i]));
    case OP_CONST:
    case OP_INPUT:
    case OP_COUNT:
        break;
    }
}
