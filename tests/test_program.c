// SPDX-License-Identifier: Apache-2.0
// Programs: every operation against the C library, batches against single elements, kernels against
// one another, what is uniform is computed once.
#include "accel/cpu.h"
#include "render/program.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

enum { N = 1003 };

static double number(uint32_t *seed) {
    static const double special[] = {0,     -0.0,  1,         -1,  0.5, -2.5, 3,        1e-300,
                                     1e300, -7.25, 1e6 + 0.1, 720, 1e9, NAN,  INFINITY, -INFINITY};
    *seed = *seed * 1664525u + 1013904223u;
    if ((*seed >> 24) % 5 == 0) {
        return special[(*seed >> 16) % (sizeof special / sizeof *special)];
    }
    return ((double)(*seed >> 8) * 0x1p-24 - 0.5) * ((*seed & 64) ? 4 : 400);
}

static const double table_values[] = {-3, -1, -1, 0.25, 2, 17};
static const ProgramTable table = {table_values, 6};

static Program *one_op(Arena *arena, Op op) {
    Instr code[4] = {{.op = OP_INPUT, .table = IN_U},
                     {.op = OP_INPUT, .table = IN_V},
                     {.op = OP_INPUT, .table = IN_T},
                     {.op = (uint8_t)op, .a = 0, .b = 1, .c = 2}};
    uint32_t out = 3;
    return program_new(arena, code, 4, &out, 1, &table, 1);
}

static bool same_bits(double a, double b) {
    return (isnan(a) && isnan(b)) || memcmp(&a, &b, sizeof a) == 0;
}

static void program_kernels_agree(void **state) {
    (void)state;
    static double u[N], v[N], t[N], scalar[N], wide[N];
    Arena arena = {0};
    uint32_t seed = 1;
    for (int i = 0; i < N; i++) {
        u[i] = number(&seed);
        v[i] = number(&seed);
        t[i] = number(&seed);
    }
    for (int op = OP_ADD; op < OP_COUNT; op++) {
        Program *p = one_op(&arena, (Op)op);
        ProgramInputs in = {.varying = 1u << IN_U | 1u << IN_V | 1u << IN_T};
        in.at[IN_U] = u;
        in.at[IN_V] = v;
        in.at[IN_T] = t;
        double *out = scalar;
        assert_true(cpu_set("scalar"));
        program_run(p, &in, N, &out);
        for (int cpu = CPU_SCALAR + 1; cpu < CPU_COUNT; cpu++) {
            if (!cpu_set(cpu_names[cpu])) {
                continue;
            }
            // As many that the last vector is whole, half and nearly empty.
            for (size_t n = N - 8; n <= N; n++) {
                out = wide;
                program_run(p, &in, n, &out);
                for (size_t i = 0; i < n; i++) {
                    if (!same_bits(scalar[i], wide[i])) {
                        fail_msg("%s(%a, %a, %a): scalar %a, %s %a", op_names[op], u[i], v[i], t[i],
                                 scalar[i], cpu_names[cpu], wide[i]);
                    }
                }
            }
        }
        for (int i = 0; i < N; i++) {
            double at[IN_COUNT] = {[IN_U] = u[i], [IN_V] = v[i], [IN_T] = t[i]}, single;
            program_run1(p, at, &single);
            if (!same_bits(scalar[i], single)) {
                fail_msg("%s(%a, %a, %a): scalar %a, single %a", op_names[op], u[i], v[i], t[i],
                         scalar[i], single);
            }
        }
    }
    cpu_set(NULL);
    arena_free(&arena);
}

// A sine and a cosine of one angle are computed together: with the bits that each has alone.
static void program_pairs_sines_and_cosines(void **state) {
    (void)state;
    static double u[N], results[4][N];
    double *const out[4] = {results[0], results[1], results[2], results[3]};
    // The cosine comes first and is used before the sine is; a second angle has a sine alone.
    const Instr code[] = {{.op = OP_INPUT, .table = IN_U}, {.op = OP_COS, .a = 0},
                          {.op = OP_NEG, .a = 1},          {.op = OP_SIN, .a = 2},
                          {.op = OP_SIN, .a = 0},          {.op = OP_MUL, .a = 4, .b = 2}};
    const uint32_t outs[4] = {1, 3, 4, 5};
    Arena arena = {0};
    uint32_t seed = 11;
    for (int i = 0; i < N; i++) {
        u[i] = number(&seed);
    }
    Program *p = program_new(&arena, code, 6, outs, 4, NULL, 0);
    ProgramInputs in = {.varying = 1u << IN_U};
    in.at[IN_U] = u;
    for (int cpu = 0; cpu < CPU_COUNT; cpu++) {
        if (!cpu_set(cpu_names[cpu])) {
            continue;
        }
        program_run(p, &in, N, out);
        for (int i = 0; i < N; i++) {
            double c = program_fold(OP_COS, u[i], 0, 0), s = program_fold(OP_SIN, u[i], 0, 0);
            assert_true(same_bits(results[0][i], c));
            assert_true(same_bits(results[1][i], program_fold(OP_SIN, -c, 0, 0)));
            assert_true(same_bits(results[2][i], s));
            assert_true(same_bits(results[3][i], s * -c));
        }
    }
    cpu_set(NULL);
    arena_free(&arena);
}

static double reference(Op op, double a, double b) {
    switch (op) {
    case OP_POW:
        return pow(a, b);
    case OP_EXP:
        return exp(a);
    case OP_LOG:
        return log(a);
    case OP_SIN:
        return sin(a);
    case OP_COS:
        return cos(a);
    case OP_TAN:
        return tan(a);
    case OP_ASIN:
        return asin(a);
    case OP_ACOS:
        return acos(a);
    case OP_ATAN:
        return atan(a);
    case OP_ATAN2:
        return atan2(a, b);
    case OP_HYPOT:
        return hypot(a, b);
    case OP_SQRT:
        return sqrt(a);
    default:
        return NAN;
    }
}

static void program_functions_match_libm(void **state) {
    (void)state;
    static const Op ops[] = {OP_POW,  OP_EXP,  OP_LOG,  OP_SIN,   OP_COS,   OP_TAN,
                             OP_ASIN, OP_ACOS, OP_ATAN, OP_ATAN2, OP_HYPOT, OP_SQRT};
    uint32_t seed = 2;
    for (size_t k = 0; k < sizeof ops / sizeof *ops; k++) {
        for (int i = 0; i < 20000; i++) {
            double a = number(&seed), b = number(&seed);
            if (ops[k] == OP_ASIN || ops[k] == OP_ACOS) {
                a = fmod(a, 1);
            }
            double want = reference(ops[k], a, b), got = program_fold(ops[k], a, b, 0);
            if (isnan(want) || isinf(want)) {
                assert_true(isnan(want) ? isnan(got) : got == want);
            } else if (!(fabs(got - want) <= 1.5 * 2.3e-16 * fabs(want) + 1e-307)) {
                fail_msg("%s(%a, %a) = %a, the C library says %a", op_names[ops[k]], a, b, got,
                         want);
            }
        }
    }
}

static void program_modulo_is_floored(void **state) {
    (void)state;
    assert_true(program_fold(OP_MOD, -1, 3, 0) == 2);
    assert_true(program_fold(OP_MOD, 7.5, 2, 0) == 1.5);
    assert_true(program_fold(OP_MOD, 5, -3, 0) == -1);
    assert_true(isnan(program_fold(OP_MOD, 5, 0, 0)));
    uint32_t seed = 3;
    for (int i = 0; i < 100000; i++) {
        double a = number(&seed), b = fabs(number(&seed));
        if (isfinite(a) && isfinite(b) && b > 0 && fabs(a / b) < 1e15) {
            double r = program_fold(OP_MOD, a, b, 0);
            assert_true(r >= 0 && r < b);
        }
    }
}

static void program_searches_tables(void **state) {
    (void)state;
    Arena arena = {0};
    Program *search = one_op(&arena, OP_SEARCH), *look = one_op(&arena, OP_TABLE);
    static const double cases[][2] = {{-9, 0},   {-3, 0}, {-1, 2}, {0, 2},
                                      {0.25, 3}, {16, 4}, {99, 5}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double in[IN_COUNT] = {[IN_U] = cases[i][0]}, out;
        program_run1(search, in, &out);
        assert_true(out == cases[i][1]);
    }
    static const double looks[][2] = {{-1, -3}, {0, -3},    {3.9, 0.25},
                                      {5, 17},  {1e18, 17}, {NAN, -3}};
    for (size_t i = 0; i < sizeof looks / sizeof *looks; i++) {
        double in[IN_COUNT] = {[IN_U] = looks[i][0]}, out;
        program_run1(look, in, &out);
        assert_true(out == looks[i][1]);
    }
    arena_free(&arena);
}

static void program_computes_uniforms_once(void **state) {
    (void)state;
    Arena arena = {0};
    // sin(t) * u: the sine is uniform.
    Instr code[] = {{.op = OP_INPUT, .table = IN_T},
                    {.op = OP_SIN, .a = 0},
                    {.op = OP_INPUT, .table = IN_U},
                    {.op = OP_COS, .a = 2}, // dead
                    {.op = OP_MUL, .a = 1, .b = 2}};
    uint32_t out_index = 4;
    Program *p = program_new(&arena, code, 5, &out_index, 1, NULL, 0);
    assert_int_equal(program_n_instr(p), 4);
    assert_int_equal(program_inputs(p), 1u << IN_T | 1u << IN_U);
    static double u[N], r[N];
    for (int i = 0; i < N; i++) {
        u[i] = i;
    }
    double t = 0.7, *out = r;
    ProgramInputs in = {.varying = 1u << IN_U};
    in.at[IN_T] = &t;
    in.at[IN_U] = u;
    ProgramCounters before = program_counters();
    program_run(p, &in, N, &out);
    uint64_t batches = (N + 255) / 256;
    assert_int_equal(program_counters().instructions - before.instructions, 2 * batches);
    for (int i = 0; i < N; i++) {
        assert_true(r[i] == program_fold(OP_SIN, t, 0, 0) * i);
    }
    arena_free(&arena);
}

// A long chain needs few registers; a wide sum needs many and more than the stack's scratch.
static void program_reuses_registers(void **state) {
    (void)state;
    enum { WIDE = 3000 };
    Arena arena = {0};
    static Instr code[2 * WIDE + 2];
    code[0] = (Instr){.op = OP_INPUT, .table = IN_U};
    for (uint32_t i = 1; i <= WIDE; i++) {
        code[i] = (Instr){.op = OP_ADD, .a = i - 1, .b = 0}; // (i + 1) u
    }
    for (uint32_t i = 1; i <= WIDE; i++) {
        code[WIDE + i] = (Instr){.op = OP_ADD, .a = WIDE + i - 1, .b = i};
    }
    uint32_t out_index = 2 * WIDE;
    Program *p = program_new(&arena, code, 2 * WIDE + 1, &out_index, 1, NULL, 0);
    double u[100], r[100], *out = r;
    for (int i = 0; i < 100; i++) {
        u[i] = i;
    }
    ProgramInputs in = {.varying = 1u << IN_U};
    in.at[IN_U] = u;
    program_run(p, &in, 100, &out);
    for (int i = 0; i < 100; i++) {
        double want = (WIDE + 1.0) * i;
        for (int k = 1; k <= WIDE; k++) {
            want += (k + 1.0) * i;
        }
        assert_true(r[i] == want);
    }
    arena_free(&arena);
}

static void program_noise_is_smooth_and_bounded(void **state) {
    (void)state;
    assert_true(program_fold(OP_NOISE, 3, -4, 5) == 0);
    double sum = 0, square = 0;
    for (int i = 0; i < 20000; i++) {
        double x = i * 0.137, y = i * 0.071 - 9, z = i * 0.0137;
        double n = program_fold(OP_NOISE, x, y, z);
        double m = program_fold(OP_NOISE, x + 1e-6, y, z);
        assert_true(fabs(n) <= 1 && fabs(m - n) < 1e-5);
        sum += n;
        square += n * n;
    }
    assert_true(fabs(sum / 20000) < 0.02 && square / 20000 > 0.03);
    double mean = 0;
    for (int i = 0; i < 20000; i++) {
        double h = program_fold(OP_HASH, 7, i, 0);
        assert_true(h >= 0 && h < 1);
        mean += h / 20000;
    }
    assert_true(fabs(mean - 0.5) < 0.01);
    assert_true(program_fold(OP_HASH, 0.0, 1, 0) == program_fold(OP_HASH, -0.0, 1, 0));
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(program_kernels_agree),
    cmocka_unit_test(program_pairs_sines_and_cosines),
    cmocka_unit_test(program_functions_match_libm),
    cmocka_unit_test(program_modulo_is_floored),
    cmocka_unit_test(program_searches_tables),
    cmocka_unit_test(program_computes_uniforms_once),
    cmocka_unit_test(program_reuses_registers),
    cmocka_unit_test(program_noise_is_smooth_and_bounded),
};

SUITE(program, tests)
