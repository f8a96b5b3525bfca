// SPDX-License-Identifier: Apache-2.0
// Functions of the language as graphs.
#include "lang/functions.h"

#include <math.h>

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref number(Dag *dag, double x) {
    return dag_const(dag, x);
}

Ref functions_clamp(Dag *dag, Ref x, Ref lo, Ref hi) {
    return op2(dag, OP_MIN, op2(dag, OP_MAX, x, lo), hi);
}

Ref functions_mix(Dag *dag, Ref a, Ref b, Ref w) {
    Ref rest = op2(dag, OP_SUB, number(dag, 1), w);
    return op2(dag, OP_ADD, op2(dag, OP_MUL, a, rest), op2(dag, OP_MUL, b, w));
}

Ref functions_step(Dag *dag, Ref edge, Ref x) {
    return op2(dag, OP_LE, edge, x);
}

Ref functions_smoothstep(Dag *dag, Ref lo, Ref hi, Ref x) {
    Ref s = op2(dag, OP_DIV, op2(dag, OP_SUB, x, lo), op2(dag, OP_SUB, hi, lo));
    s = functions_clamp(dag, s, number(dag, 0), number(dag, 1));
    Ref slope = op2(dag, OP_SUB, number(dag, 3), op2(dag, OP_MUL, number(dag, 2), s));
    return op2(dag, OP_MUL, op2(dag, OP_MUL, s, s), slope);
}

// --- Random numbers ---

// The number of arguments goes first, so that (1) and (1, 0) differ.
static Ref hash_all(Dag *dag, const Ref *k, uint32_t n) {
    Ref h = number(dag, n);
    for (uint32_t i = 0; i < n; i++) {
        h = op2(dag, OP_HASH, h, k[i]);
    }
    return h;
}

// Further numbers from one hash; salts are no integers, as arguments mostly are.
static Ref derived(Dag *dag, Ref hash, int i) {
    return op2(dag, OP_HASH, hash, number(dag, 0.375 + i));
}

Ref functions_rand(Dag *dag, const Ref *k, uint32_t n) {
    return hash_all(dag, k, n);
}

static Ref turn_of(Dag *dag, Ref x) {
    return op2(dag, OP_MUL, x, number(dag, 6.28318530717958647693));
}

// Box and Muller, "A Note on the Generation of Random Normal Deviates", 1958.
Ref functions_randn(Dag *dag, const Ref *k, uint32_t n) {
    Ref h = hash_all(dag, k, n);
    Ref above_zero = op2(dag, OP_SUB, number(dag, 1), derived(dag, h, 0));
    Ref square = op2(dag, OP_MUL, number(dag, -2), op1(dag, OP_LOG, above_zero));
    Ref angle = turn_of(dag, derived(dag, h, 1));
    return op2(dag, OP_MUL, op1(dag, OP_SQRT, square), op1(dag, OP_COS, angle));
}

// Height and longitude are uniform (Archimedes).
Ref3 functions_randdir(Dag *dag, const Ref *k, uint32_t n) {
    Ref h = hash_all(dag, k, n);
    Ref u = derived(dag, h, 0), angle = turn_of(dag, derived(dag, h, 1));
    Ref rest = op2(dag, OP_SUB, number(dag, 1), u);
    Ref z = op2(dag, OP_SUB, rest, u);
    Ref radius = op1(dag, OP_SQRT, op2(dag, OP_MUL, u, rest));
    radius = op2(dag, OP_MUL, number(dag, 2), radius);
    return ref3(op2(dag, OP_MUL, radius, op1(dag, OP_COS, angle)),
                op2(dag, OP_MUL, radius, op1(dag, OP_SIN, angle)), z);
}

// --- Patterns ---

Ref functions_noise(Dag *dag, Ref3 p) {
    return dag_op(dag, OP_NOISE, p.x, p.y, p.z);
}

Ref functions_fbm(Dag *dag, Ref3 p, uint32_t octaves, double lacunarity, double gain) {
    Ref sum = number(dag, 0);
    double scale = 1, weight = 1;
    for (uint32_t k = 0; k < octaves; k++) {
        Ref3 q = spatial_scale(dag, p, number(dag, scale));
        q = spatial_add(dag, q, spatial_const(dag, 0.618 * k, 0.414 * k, 0.732 * k));
        Ref part = op2(dag, OP_MUL, number(dag, weight), functions_noise(dag, q));
        sum = op2(dag, OP_ADD, sum, part);
        scale *= lacunarity;
        weight *= gain;
    }
    return sum;
}

static Ref cell(Dag *dag, Ref x, Ref size) {
    Ref place = op2(dag, OP_ADD, op2(dag, OP_DIV, x, size), number(dag, 0x1p-20));
    return op1(dag, OP_FLOOR, place);
}

Ref functions_checker(Dag *dag, Ref3 p, Ref size) {
    Ref sum = op2(dag, OP_ADD, cell(dag, p.x, size), cell(dag, p.y, size));
    sum = op2(dag, OP_ADD, sum, cell(dag, p.z, size));
    return op2(dag, OP_MOD, sum, number(dag, 2));
}
