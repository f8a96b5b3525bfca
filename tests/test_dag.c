// SPDX-License-Identifier: Apache-2.0
// The graph of scalars: random expressions against plain programs of the same operations, rates
// against finite differences, substitution, breaks, depth.
#include "tests/expression.h"
#include "tests/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

static void dag_keeps_every_bit(void **state) {
    (void)state;
    Op ops[OP_COUNT];
    uint32_t n_ops = expression_ops(ops, false), n_compared = 0;
    expression_seed = 1;
    for (int round = 0; round < 3000; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Expression e;
        expression_random(&e, ops, n_ops, 10 + (int)expression_int(MAX_STEPS - 10));
        Ref ref = expression_build(dag, &e);
        for (int k = 0; k < 3; k++) {
            double in[N_INPUTS] = {expression_real(-3, 3), expression_real(-3, 3),
                                   expression_real(-3, 3)};
            if (k == 2) { // p may be anything
                in[2] = round % 2 ? NAN : INFINITY;
            }
            double expected, got = expression_run(dag, &arena, ref, in);
            if (expression_evaluate(&e, in, true, &expected)) {
                n_compared++;
                if (!same(got, expected)) {
                    expression_print(&e);
                    fail_msg("round %d: %.17g, expected %.17g at %g %g %g", round, got, expected,
                             in[0], in[1], in[2]);
                }
            }
        }
        arena_free(&arena);
    }
    assert_true(n_compared > 6000);
}

static double ulps(double x, double y) {
    return fabs(x - y) / fmax(fabs(y) * 0x1p-52, 0x1p-1040);
}

// One operation at a time, against the C library.
static void dag_agrees_with_libm(void **state) {
    (void)state;
    expression_seed = 2;
    for (int op = 0; op < OP_COUNT; op++) {
        if (op_operands[op] == 0 || op == OP_IMAGE) {
            continue;
        }
        for (int k = 0; k < 40; k++) {
            Arena arena = {0};
            Dag *dag = dag_new(&arena);
            Expression e = {.n = 0};
            double in[N_INPUTS] = {expression_real(-3, 3), expression_real(-3, 3),
                                   expression_real(-3, 3)};
            for (int i = 0; i < N_INPUTS; i++) {
                e.steps[e.n++] = (Step){.op = OP_INPUT, .input = i};
            }
            e.steps[e.n++] = (Step){.op = (Op)op, .a = 0, .b = 1, .c = 2};
            double expected, got = expression_run(dag, &arena, expression_build(dag, &e), in);
            expression_evaluate(&e, in, false, &expected);
            if (!same(got, expected) && !(ulps(got, expected) <= 2)) {
                fail_msg("%s: %.17g, expected %.17g", op_names[op], got, expected);
            }
            arena_free(&arena);
        }
    }
}

static void dag_folds_and_shares(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T), p = dag_input(dag, IN_PX);
    Ref zero = dag_const(dag, 0), one = dag_const(dag, 1), two = dag_const(dag, 2);
#define OP2(op, a, b) dag_op(dag, OP_##op, a, b, REF_NONE)
#define OP1(op, a)    dag_op(dag, OP_##op, a, REF_NONE, REF_NONE)
    assert_int_equal(OP2(ADD, t, p), OP2(ADD, p, t));
    assert_int_equal(OP2(ADD, t, zero), t);
    assert_int_equal(OP2(MUL, one, t), t);
    assert_int_equal(OP2(MUL, t, zero), zero);
    assert_int_equal(OP2(SUB, t, t), zero);
    assert_int_equal(OP2(SUB, zero, t), OP1(NEG, t));
    assert_int_equal(OP1(NEG, OP1(NEG, t)), t);
    assert_int_equal(OP2(POW, p, two), OP2(MUL, p, p));
    assert_int_equal(OP2(MUL, OP1(SIN, t), zero), zero);
    assert_int_equal(OP1(FLOOR, OP1(FLOOR, p)), OP1(FLOOR, p));
    // What may be infinite or NaN keeps its product with 0.
    assert_int_not_equal(OP2(MUL, p, zero), zero);
    assert_int_not_equal(OP2(SUB, p, p), zero);
    assert_int_not_equal(OP2(MUL, OP2(DIV, one, t), zero), zero);
    assert_int_not_equal(OP2(MUL, OP1(EXP, t), zero), zero);
    assert_int_equal(dag_op(dag, OP_SELECT, one, t, p), t);
    assert_int_equal(dag_op(dag, OP_SELECT, OP2(LT, t, p), two, two), two);
    assert_int_equal(OP2(AND, zero, p), zero);
    assert_int_equal(dag_const(dag, NAN), OP2(DIV, zero, zero));
    assert_int_equal(dag_inputs(dag, OP2(ADD, t, p)), 1u << IN_T | 1u << IN_PX);
    double value;
    assert_true(dag_is_const(dag, OP1(SIN, two), &value));
    assert_true(value == program_fold(OP_SIN, 2, 0, 0));
    assert_false(dag_is_const(dag, t, NULL));
    // A table is one node however often it is written.
    double copy[5];
    memcpy(copy, expression_search, sizeof copy);
    assert_int_equal(dag_table_op(dag, OP_SEARCH, t, expression_search, 5),
                     dag_table_op(dag, OP_SEARCH, t, copy, 5));
    assert_true(dag_is_const(dag, dag_table_op(dag, OP_SEARCH, one, copy, 5), &value));
    assert_true(value == 3);
    arena_free(&arena);
}

// --- Rates ---

static const Op smooth_ops[] = {
    OP_ADD, OP_SUB, OP_MUL,    OP_DIV,  OP_NEG,  OP_SQRT,  OP_EXP,   OP_LOG,    OP_SIN,
    OP_COS, OP_TAN, OP_ASIN,   OP_ACOS, OP_ATAN, OP_ATAN2, OP_HYPOT, OP_POW,    OP_MIN,
    OP_MAX, OP_ABS, OP_SELECT, OP_LT,   OP_MOD,  OP_FLOOR, OP_TABLE, OP_SEARCH, OP_NOISE};

// Central difference with Richardson extrapolation; false where it does not settle.
static bool numeric_rate(const Expression *e, const double in[N_INPUTS], double *rate) {
    double estimate[3];
    for (int k = 0; k < 3; k++) {
        double h = 4e-4 / (1 << k), lo[N_INPUTS], hi[N_INPUTS], f[4];
        memcpy(lo, in, sizeof lo);
        memcpy(hi, in, sizeof hi);
        for (int j = 0; j < 2; j++) {
            lo[0] = in[0] - h * (j + 1);
            hi[0] = in[0] + h * (j + 1);
            expression_evaluate(e, lo, false, &f[2 * j]);
            expression_evaluate(e, hi, false, &f[2 * j + 1]);
        }
        estimate[k] = (8 * (f[1] - f[0]) - (f[3] - f[2])) / (12 * h);
    }
    double spread = fmax(fabs(estimate[0] - estimate[1]), fabs(estimate[1] - estimate[2]));
    *rate = estimate[1];
    return isfinite(*rate) && fabs(*rate) < 1e6 && spread < 1e-7 * (1 + fabs(*rate));
}

static void dag_rates_match_differences(void **state) {
    (void)state;
    uint32_t n_ops = sizeof smooth_ops / sizeof *smooth_ops, n_compared = 0, n_moving = 0;
    expression_seed = 3;
    for (int round = 0; round < 6000; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Expression e;
        expression_random(&e, smooth_ops, n_ops, 9 + (int)expression_int(10));
        double in[N_INPUTS] = {expression_real(-3, 3), expression_real(-3, 3),
                               expression_real(-3, 3)};
        double expected;
        bool is_opaque = false;
        Ref rate = dag_diff(dag, expression_build(dag, &e), IN_T, 1e-5, &is_opaque);
        double got = expression_run(dag, &arena, rate, in);
        double value;
        if (expression_evaluate(&e, in, false, &value) && numeric_rate(&e, in, &expected)) {
            n_compared++;
            n_moving += expected != 0;
            if (!(fabs(got - expected) <= 2e-5 * (1 + fabs(expected)))) {
                expression_print(&e);
                fail_msg("round %d: rate %.17g, expected %.17g at %.17g %.17g %.17g", round, got,
                         expected, in[0], in[1], in[2]);
            }
        }
        arena_free(&arena);
    }
    assert_true(n_compared > 2000);
    assert_true(n_moving > 600);
}

static double rate_at(Dag *dag, Arena *arena, Ref ref, double t) {
    double in[N_INPUTS] = {t, 0, 0};
    return expression_run(dag, arena, dag_diff(dag, ref, IN_T, 1e-4, NULL), in);
}

static void dag_rates_from_the_right(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T), zero = dag_const(dag, 0), back = OP1(NEG, t);
    assert_true(rate_at(dag, &arena, OP1(ABS, t), 0) == 1);
    assert_true(rate_at(dag, &arena, OP1(ABS, OP2(SUB, zero, t)), 0) == 1);
    assert_true(rate_at(dag, &arena, OP2(MAX, back, t), 0) == 1);
    assert_true(rate_at(dag, &arena, OP2(MIN, t, zero), 0) == 0);
    assert_true(rate_at(dag, &arena, OP2(MOD, t, dag_const(dag, 2)), 2) == 1);
    assert_true(rate_at(dag, &arena, OP2(HYPOT, t, OP2(MUL, t, dag_const(dag, 0.75))), 0) == 1.25);
    assert_true(rate_at(dag, &arena, OP1(FLOOR, t), 1) == 0);
    // 0^t and t^2 written with a variable exponent
    assert_true(rate_at(dag, &arena, OP2(POW, zero, OP2(ADD, t, dag_const(dag, 1))), 1) == 0);
    bool is_opaque = false;
    dag_diff(dag, dag_op(dag, OP_HASH, OP1(FLOOR, t), zero, REF_NONE), IN_T, 1e-4, &is_opaque);
    assert_false(is_opaque);
    dag_diff(dag, dag_op(dag, OP_NOISE, t, zero, zero), IN_T, 1e-4, &is_opaque);
    assert_true(is_opaque);
    arena_free(&arena);
}

// --- Substitution ---

static void dag_substitutes(void **state) {
    (void)state;
    Op ops[OP_COUNT];
    uint32_t n_ops = expression_ops(ops, true), n_compared = 0;
    expression_seed = 4;
    for (int round = 0; round < 1000; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Expression f, g, h;
        expression_random(&f, ops, n_ops, 8 + (int)expression_int(20));
        expression_random(&g, ops, n_ops, 12);
        expression_random(&h, ops, n_ops, 12);
        Ref with[2] = {expression_build(dag, &g), expression_build(dag, &h)};
        Input inputs[2] = {IN_T, IN_U};
        Ref whole = dag_substitute_all(dag, expression_build(dag, &f), inputs, with, 2);
        double in[N_INPUTS] = {expression_real(-3, 3), expression_real(-3, 3),
                               expression_real(-3, 3)};
        double inner[N_INPUTS] = {expression_run(dag, &arena, with[0], in),
                                  expression_run(dag, &arena, with[1], in), in[2]};
        double unused;
        bool is_certain = expression_evaluate(&g, in, true, &unused) &&
                          expression_evaluate(&h, in, true, &unused) &&
                          expression_evaluate(&f, inner, true, &unused);
        // t and T are taken to be finite, so t*0 was 0 before it was replaced.
        if (is_certain && isfinite(inner[0]) && inner[0] != 0 && inner[1] != 0) {
            n_compared++;
            double got = expression_run(dag, &arena, whole, in);
            double expected = expression_run(dag, &arena, expression_build(dag, &f), inner);
            if (!same(got, expected)) {
                expression_print(&f);
                fail_msg("round %d: %.17g, expected %.17g", round, got, expected);
            }
        }
        arena_free(&arena);
    }
    assert_true(n_compared > 300);
}

static void dag_substitutes_at_once(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T), u = dag_input(dag, IN_U);
    Ref swapped = dag_substitute_all(dag, OP2(SUB, t, u), (Input[]){IN_T, IN_U}, (Ref[]){u, t}, 2);
    assert_int_equal(swapped, OP2(SUB, u, t));
    assert_int_equal(dag_substitute(dag, u, IN_T, u), u);
    Ref folded = dag_substitute(dag, OP1(SIN, t), IN_T, dag_const(dag, 2));
    assert_true(dag_is_const(dag, folded, NULL));
    arena_free(&arena);
}

// --- Breaks ---

enum { MAX_BREAKS = 64 };

static uint32_t compile_breaks(Dag *dag, Arena *arena, Ref root, Program **program) {
    Ref breaks[MAX_BREAKS];
    uint32_t n = dag_breaks(dag, &root, 1, breaks, MAX_BREAKS);
    assert_true(n <= MAX_BREAKS);
    *program = dag_compile(dag, arena, breaks, n);
    return n;
}

static const Op bent_ops[] = {OP_ADD, OP_SUB, OP_FLOOR, OP_CEIL, OP_ROUND,  OP_MOD,  OP_ABS,
                              OP_MIN, OP_MAX, OP_LT,    OP_LE,   OP_SELECT, OP_SIGN, OP_NOT,
                              OP_AND, OP_OR,  OP_EQ,    OP_NEG,  OP_SEARCH, OP_TABLE};

// With these operations every motion is piecewise linear, provided that divisors are constant: so
// between two breaks it must be straight.
static void random_bent(Expression *e) {
    expression_random(e, bent_ops, sizeof bent_ops / sizeof *bent_ops, 9 + (int)expression_int(12));
    for (int i = 0; i < e->n; i++) {
        Step *s = &e->steps[i];
        if (s->op == OP_INPUT) {
            s->input = 0;
        } else if (s->op == OP_MOD) {
            s->b = 3 + (int)expression_int(4);
        }
    }
}

static void dag_breaks_are_complete(void **state) {
    (void)state;
    expression_seed = 5;
    uint32_t n_straight = 0, n_bent = 0;
    for (int round = 0; round < 1500; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Expression e;
        random_bent(&e);
        Program *program, *value;
        Ref ref = expression_build(dag, &e);
        uint32_t n = compile_breaks(dag, &arena, ref, &program);
        value = dag_compile(dag, &arena, &ref, 1);
        double f[3] = {0}, floors[3][MAX_BREAKS];
        for (int k = 0; k < 400; k++) {
            double in[IN_COUNT] = {[IN_T] = -4.01371828 + k * 0.02009173}, out[MAX_BREAKS];
            program_run1(program, in, out);
            for (uint32_t i = 0; i < n; i++) {
                floors[k % 3][i] = floor(out[i]);
            }
            program_run1(value, in, &f[k % 3]);
            bool unbroken = k >= 2;
            for (uint32_t i = 0; i < n && unbroken; i++) {
                unbroken = floors[0][i] == floors[1][i] && floors[0][i] == floors[2][i];
            }
            double bend = f[k % 3] - 2 * f[(k + 2) % 3] + f[(k + 1) % 3];
            n_bent += k >= 2 && fabs(bend) > 1e-9;
            if (unbroken && isfinite(f[0])) {
                n_straight++;
                if (!(fabs(bend) <= 1e-9)) {
                    expression_print(&e);
                    fail_msg("round %d: unknown break near t = %.17g", round, in[IN_T]);
                }
            }
        }
        arena_free(&arena);
    }
    assert_true(n_straight > 100000);
    assert_true(n_bent > 1000);
}

// The number of changes that a scan of [0, 10] finds.
static int count_changes(Dag *dag, Ref ref) {
    Arena arena = {0};
    Program *program;
    uint32_t n = compile_breaks(dag, &arena, ref, &program);
    double before[MAX_BREAKS], out[MAX_BREAKS];
    int changes = 0;
    for (int k = 0; k < 5000; k++) {
        double in[IN_COUNT] = {[IN_T] = 0.001 + k * 0.002};
        program_run1(program, in, out);
        for (uint32_t i = 0; i < n; i++) {
            changes += k > 0 && floor(out[i]) != floor(before[i]);
        }
        memcpy(before, out, sizeof before);
    }
    arena_free(&arena);
    return changes;
}

static void dag_breaks_are_few(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T), p = dag_input(dag, IN_PX), ref;
    double times[3] = {-INFINITY, 3, 6};
    assert_int_equal(count_changes(dag, OP1(SIN, OP2(MUL, t, dag_const(dag, 9)))), 0);
    assert_int_equal(count_changes(dag, OP2(MOD, t, dag_const(dag, 2.5))), 3);
    assert_int_equal(count_changes(dag, OP1(ABS, OP2(SUB, t, dag_const(dag, 5)))), 1);
    assert_int_equal(count_changes(dag, dag_table_op(dag, OP_SEARCH, t, times, 3)), 2);
    assert_int_equal(count_changes(dag, OP2(LT, p, t)), 0); // not of t alone
    ref = OP1(FLOOR, OP2(ADD, t, dag_input(dag, IN_LOOP0)));
    assert_int_equal(dag_breaks(dag, &ref, 1, &ref, 1), 1);
    assert_int_equal(dag_breaks(dag, &p, 1, &ref, 1), 0);
    ref = OP2(ADD, OP1(FLOOR, t), OP2(MOD, t, dag_const(dag, 3)));
    assert_int_equal(dag_breaks(dag, &ref, 1, NULL, 0), 2); // counted, not written
    arena_free(&arena);
}

// --- Size ---

static void dag_is_deep(void **state) {
    (void)state;
    enum { DEPTH = 1000000 };
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T), x = t, half = dag_const(dag, 0.5);
    for (int i = 0; i < DEPTH / 2; i++) {
        x = OP2(ADD, OP2(MUL, x, half), t);
    }
    double in[N_INPUTS] = {3, 0, 0};
    Ref roots[3] = {x, dag_diff(dag, x, IN_T, 1e-4, NULL),
                    dag_substitute(dag, x, IN_T, dag_input(dag, IN_U))};
    double inputs[IN_COUNT] = {[IN_T] = 3, [IN_U] = 5}, out[3];
    program_run1(dag_compile(dag, &arena, roots, 3), inputs, out);
    assert_true(out[0] == 6 && out[1] == 2 && out[2] == 10);
    assert_int_equal(dag_breaks(dag, roots, 3, NULL, 0), 0);
    assert_true(expression_run(dag, &arena, half, in) == 0.5);
    arena_free(&arena);
}

static void dag_is_shared(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref x = dag_input(dag, IN_T);
    for (int i = 0; i < 50; i++) { // a tree of 2^50 leaves
        x = OP1(SIN, OP2(ADD, x, OP2(MUL, x, x)));
    }
    uint32_t before = dag_n_nodes(dag);
    assert_int_equal(before, 151);
    Ref roots[2] = {x, dag_diff(dag, x, IN_T, 1e-4, NULL)};
    assert_true(dag_n_nodes(dag) < before + 500);
    assert_true(program_n_instr(dag_compile(dag, &arena, roots, 2)) <= dag_n_nodes(dag));
    arena_free(&arena);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(dag_keeps_every_bit),
    cmocka_unit_test(dag_agrees_with_libm),
    cmocka_unit_test(dag_folds_and_shares),
    cmocka_unit_test(dag_rates_match_differences),
    cmocka_unit_test(dag_rates_from_the_right),
    cmocka_unit_test(dag_substitutes),
    cmocka_unit_test(dag_substitutes_at_once),
    cmocka_unit_test(dag_breaks_are_complete),
    cmocka_unit_test(dag_breaks_are_few),
    cmocka_unit_test(dag_is_deep),
    cmocka_unit_test(dag_is_shared),
};

SUITE(dag, tests)
