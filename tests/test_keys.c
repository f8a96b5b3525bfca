// SPDX-License-Identifier: Apache-2.0
// `keys` tables against a plain implementation (tests/keys_plain.h), rotations about one axis
// against tables of angles; exactness, rates, breaks, cost.
#include "lang/keys.h"
#include "tests/keys_plain.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

static Keys keys_of(const Plain *p) {
    return (Keys){p->n, p->times, p->modes, p->before, p->after};
}

static Ref build(Dag *dag, const Plain *p) {
    Keys keys = keys_of(p);
    Ref values[MAX_KEYS], out;
    for (uint32_t k = 0; k < p->n; k++) {
        values[k] = dag_const(dag, p->values[k]);
    }
    keys_values(dag, &keys, dag_input(dag, IN_T), values, 1, &out);
    return out;
}

static double run(const Program *program, double t) {
    double in[IN_COUNT] = {[IN_T] = t}, out;
    program_run1(program, in, &out);
    return out;
}

static void keys_match_plain(void **state) {
    (void)state;
    plain_seed = 1;
    for (int round = 0; round < 600; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Plain p = plain_random(round);
        Ref ref = build(dag, &p);
        Program *program = dag_compile(dag, &arena, &ref, 1);
        for (int i = 0; i < 6; i++) {
            double margin = i < 3 ? 0 : 3 * (p.times[p.n - 1] - p.times[0]);
            double t = plain_real(p.times[0] - margin, p.times[p.n - 1] + margin);
            double expected = plain_value(&p, t), got = run(program, t);
            // Continued ends: the oracle's difference quotient.
            bool is_early = t < p.times[0], is_late = t >= p.times[p.n - 1];
            bool is_continued = (is_early && p.before == KEYS_END_LINEAR) ||
                                (is_late && p.after == KEYS_END_LINEAR);
            double bound = is_continued ? 2e-5 * (1 + fabs(t)) * (1 + fabs(expected)) : 1e-8;
            if (!(fabs(got - expected) <= bound)) {
                plain_print(&p);
                fail_msg("round %d: at %.17g: %.17g, expected %.17g", round, t, got, expected);
            }
        }
        arena_free(&arena);
    }
}

static bool starts_again(const Plain *p) {
    return p->after == KEYS_END_LOOP || p->after == KEYS_END_OFFSET;
}

static void keys_are_exact(void **state) {
    (void)state;
    plain_seed = 2;
    for (int round = 0; round < 400; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Plain p = plain_random(round);
        Ref ref = build(dag, &p);
        Program *program = dag_compile(dag, &arena, &ref, 1);
        for (uint32_t k = 0; k < p.n; k++) {
            bool is_passed = k + 1 == p.n && starts_again(&p);
            double expected = is_passed && p.after == KEYS_END_LOOP ? p.values[0] : p.values[k];
            double got = run(program, p.times[k]);
            bool is_exact = p.after != KEYS_END_OFFSET || !is_passed;
            if (is_exact ? got != expected : fabs(got - expected) > 1e-14) {
                plain_print(&p);
                fail_msg("round %d: key %u: %.17g, expected %.17g", round, k, got, expected);
            }
            if (k > 0 && p.modes[k - 1].curve == KEYS_STEP) { // just before it jumps
                double before = run(program, nextafter(p.times[k], -INFINITY));
                assert_true(before == p.values[k - 1]);
            }
        }
        arena_free(&arena);
    }
}

static void keys_move_with_values(void **state) {
    (void)state;
    plain_seed = 3;
    for (int round = 0; round < 150; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Plain p = plain_random(round);
        Keys keys = keys_of(&p);
        Ref t = dag_input(dag, IN_T), values[MAX_KEYS][2], out[2];
        for (uint32_t k = 0; k < p.n; k++) { // one component moves, the other does not
            Ref moving = dag_op(dag, OP_MUL, t, dag_const(dag, k), REF_NONE);
            values[k][0] = dag_op(dag, OP_ADD, dag_const(dag, p.values[k]), moving, REF_NONE);
            values[k][1] = dag_const(dag, p.values[k]);
        }
        keys_values(dag, &keys, t, &values[0][0], 2, out);
        Program *program = dag_compile(dag, &arena, out, 2);
        double at = plain_real(p.times[0], p.times[p.n - 1]);
        double in[IN_COUNT] = {[IN_T] = at}, got[2];
        program_run1(program, in, got);
        // Moving ends are not equal, so a loop through equal keys is not smooth for them together.
        Plain now = p;
        for (uint32_t k = 0; k < p.n; k++) {
            now.values[k] += at * k;
        }
        if (now.values[0] != now.values[p.n - 1] && p.values[0] != p.values[p.n - 1]) {
            assert_near(got[0], plain_value(&now, at), 1e-7);
            assert_near(got[1], plain_value(&p, at), 1e-8);
        }
        arena_free(&arena);
    }
}

// --- Bezier curves ---

static Ref one_span(Dag *dag, KeysMode mode) {
    const double times[2] = {0, 1};
    const KeysMode modes[2] = {mode, mode};
    Keys keys = {2, times, modes, KEYS_END_HOLD, KEYS_END_HOLD};
    Ref values[2] = {dag_const(dag, 0), dag_const(dag, 1)}, out;
    keys_values(dag, &keys, dag_input(dag, IN_T), values, 1, &out);
    return out;
}

// With y as x, progress is x of what was found for s: how far it is from s is the error itself.
static void keys_solve_bezier(void **state) {
    (void)state;
    static const double special[] = {0, 1, 0.5, 1e-3, 1 - 1e-3, 1e-9, 1 - 1e-9, 1e-14, 1 - 0x1p-53};
    enum { N_SPECIAL = sizeof special / sizeof *special };
    double worst = 0;
    plain_seed = 4;
    for (int round = 0; round < N_SPECIAL * N_SPECIAL + 200; round++) {
        bool is_random = round >= N_SPECIAL * N_SPECIAL;
        double x1 = is_random ? plain_real(0, 1) : special[round / N_SPECIAL];
        double x2 = is_random ? plain_real(0, 1) : special[round % N_SPECIAL];
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Ref ref = one_span(dag, (KeysMode){KEYS_BEZIER, {x1, x1, x2, x2}});
        Program *program = dag_compile(dag, &arena, &ref, 1);
        for (int i = 0; i < 300; i++) {
            double s = i < 60 ? ldexp(1, -i) * 0.999 : plain_real(0, 1);
            s = i % 3 == 1 ? 1 - s : s;
            s = i % 7 == 2 ? fabs(0.5 + (s - 0.5) * ldexp(1, -(i % 50))) : s;
            double error = fabs(run(program, s) - s);
            worst = fmax(worst, error);
            if (!(error <= 0x1p-46)) {
                fail_msg("x1 = %.17g, x2 = %.17g, s = %.17g: off by %g", x1, x2, s, error);
            }
        }
        arena_free(&arena);
    }
    assert_true(worst > 0);
}

// --- Rates and breaks ---

static void keys_have_rates(void **state) {
    (void)state;
    plain_seed = 5;
    uint32_t n_compared = 0;
    for (int round = 0; round < 300; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Plain p = plain_random(round);
        Ref ref = build(dag, &p), rate = dag_diff(dag, ref, IN_T, 1e-4, NULL);
        Program *program = dag_compile(dag, &arena, &ref, 1);
        Program *rates = dag_compile(dag, &arena, &rate, 1);
        double length = p.times[p.n - 1] - p.times[0], h = 1e-5;
        for (int i = 0; i < 6; i++) {
            double t = plain_real(p.times[0] - length, p.times[p.n - 1] + length);
            double f[4] = {run(program, t - 2 * h), run(program, t - h), run(program, t + h),
                           run(program, t + 2 * h)};
            double near = (f[2] - f[1]) / (2 * h), far = (f[3] - f[0]) / (4 * h);
            if (fabs(near - far) < 1e-6 * (1 + fabs(near))) { // no key between
                n_compared++;
                assert_near(run(rates, t), near, 1e-5 * (1 + fabs(near)));
            }
        }
        arena_free(&arena);
    }
    assert_true(n_compared > 1500);
}

static int changes(Dag *dag, Arena *arena, Ref ref, double from, double to) {
    enum { MAX = 64, STEPS = 4001 };
    Ref breaks[MAX];
    double before[MAX], out[MAX];
    uint32_t n = dag_breaks(dag, &ref, 1, breaks, MAX);
    assert_true(n <= MAX);
    Program *program = dag_compile(dag, arena, breaks, n);
    int count = 0;
    for (int i = 0; i < STEPS; i++) {
        double in[IN_COUNT] = {[IN_T] = from + (to - from) * i / (STEPS - 1)};
        program_run1(program, in, out);
        bool changed = false;
        for (uint32_t k = 0; k < n; k++) {
            changed = changed || (i > 0 && floor(out[k]) != floor(before[k]));
        }
        count += changed;
        memcpy(before, out, sizeof before);
    }
    return count;
}

static void keys_break_at_keys(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Plain p = {.n = 4, .times = {1.01, 2.02, 3.53, 5.04}, .values = {1, 3, 2, 5}};
    const KeysCurve curves[] = {KEYS_STEP, KEYS_LINEAR, KEYS_SMOOTH,
                                KEYS_EASE, KEYS_BEZIER, KEYS_SPRING};
    for (size_t c = 0; c < sizeof curves / sizeof *curves; c++) {
        for (int k = 0; k < 4; k++) {
            p.modes[k] = (KeysMode){curves[c], {0.3, 0.1, 0.2, 0.9}};
        }
        assert_int_equal(changes(dag, &arena, build(dag, &p), 0, 10), 4);
    }
    // Beyond the ends: keys at 1.01 + 4.03 n, 2.02 + 4.03 n, 3.53 + 4.03 n.
    p.after = KEYS_END_LOOP;
    assert_int_equal(changes(dag, &arena, build(dag, &p), 0, 10), 3 + 4);
    p.before = KEYS_END_LOOP;
    assert_int_equal(changes(dag, &arena, build(dag, &p), -3, 1), 2 + 0);
    arena_free(&arena);
}

static void keys_cost_little(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Plain p = {.n = 4, .times = {0, 0.9, 1.1, 2}, .values = {0, 7, 7, 0}};
    for (int k = 0; k < 4; k++) {
        p.modes[k].curve = KEYS_EASE;
    }
    Ref ref = build(dag, &p);
    // t, search; start, length, s; 3 - 2 s, s s; value, rise, product, sum and constants
    assert_true(program_n_instr(dag_compile(dag, &arena, &ref, 1)) <= 16);
    arena_free(&arena);
}

// --- Rotations ---

static Plain random_turns(int round) {
    Plain p = plain_random(round);
    for (uint32_t k = 1; k < p.n; k++) { // less than half a turn each, so the shorter way is meant
        p.values[k] = p.values[k - 1] + plain_real(-2, 2);
    }
    double total = p.values[p.n - 1] - p.values[0];
    bool offsets = p.before == KEYS_END_OFFSET || p.after == KEYS_END_OFFSET;
    if (offsets && fabs(total) > 3) { // the same for a repetition
        for (uint32_t k = 0; k < p.n; k++) {
            p.values[k] *= 3 / fabs(total);
        }
    }
    return p;
}

static void keys_turn_about_an_axis(void **state) {
    (void)state;
    plain_seed = 6;
    for (int round = 0; round < 300; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        Plain p = random_turns(round);
        Keys keys = keys_of(&p);
        Ref t = dag_input(dag, IN_T);
        Ref3 axis = spatial_const(dag, plain_real(-1, 1), plain_real(-1, 1), 1);
        Ref3 v = spatial_const(dag, 1, -2, 0.5);
        RefQuat turns[MAX_KEYS];
        for (uint32_t k = 0; k < p.n; k++) {
            turns[k] = spatial_quat(dag, axis, dag_const(dag, p.values[k]));
            turns[k] = plain_int(2) ? turns[k] : spatial_quat_negate(dag, turns[k]);
        }
        RefQuat q = keys_rotation(dag, &keys, t, turns);
        Ref3 got = spatial_quat_rotate(dag, q, v);
        Ref3 expected = spatial_turned(dag, v, axis, build(dag, &p));
        Ref out[7] = {
            got.x, got.y, got.z, expected.x, expected.y, expected.z, spatial_quat_dot(dag, q, q)};
        Program *program = dag_compile(dag, &arena, out, 7);
        double length = p.times[p.n - 1] - p.times[0];
        for (int i = 0; i < 8; i++) {
            double at = plain_real(p.times[0] - 2 * length, p.times[p.n - 1] + 2 * length), x[7];
            double in[IN_COUNT] = {[IN_T] = at};
            program_run1(program, in, x);
            for (int k = 0; k < 3; k++) {
                if (!(fabs(x[k] - x[k + 3]) < 1e-10)) {
                    plain_print(&p);
                    fail_msg("round %d: at %.17g: %.17g, expected %.17g", round, at, x[k],
                             x[k + 3]);
                }
            }
            assert_near(x[6], 1, 1e-12);
        }
        arena_free(&arena);
    }
}

static void keys_turn_smoothly(void **state) {
    (void)state;
    plain_seed = 7;
    for (int round = 0; round < 100; round++) {
        Arena arena = {0};
        Dag *dag = dag_new(&arena);
        enum { N = 5 };
        double times[N], at[N][4];
        KeysMode modes[N];
        RefQuat turns[N];
        for (int k = 0; k < N; k++) {
            times[k] = k ? times[k - 1] + plain_real(0.3, 2) : 0;
            modes[k] = (KeysMode){KEYS_SMOOTH, {0}};
            Ref3 axis = spatial_const(dag, plain_real(-1, 1), plain_real(-1, 1), plain_real(-1, 1));
            turns[k] = spatial_quat(dag, axis, dag_const(dag, plain_real(-3, 3)));
            const Ref parts[4] = {turns[k].x, turns[k].y, turns[k].z, turns[k].w};
            for (int i = 0; i < 4; i++) {
                dag_is_const(dag, parts[i], &at[k][i]);
            }
        }
        Keys keys = {N, times, modes, KEYS_END_LINEAR, KEYS_END_LINEAR};
        RefQuat q = keys_rotation(dag, &keys, dag_input(dag, IN_T), turns);
        Program *program = dag_compile(dag, &arena, &q.x, 4);
        for (int k = 0; k < N; k++) {
            double x[3][4], h = 1e-6, sign;
            for (int i = 0; i < 3; i++) {
                double in[IN_COUNT] = {[IN_T] = times[k] + (i - 1) * h};
                program_run1(program, in, x[i]);
            }
            sign = x[1][0] == at[k][0] ? 1 : -1;
            for (int i = 0; i < 4; i++) {
                assert_true(x[1][i] == sign * at[k][i]);             // exact at the key,
                double bend = (x[2][i] - 2 * x[1][i] + x[0][i]) / h; // and without a corner
                assert_near(bend, 0, 2e-3);
            }
        }
        arena_free(&arena);
    }
}

static void keys_move_maps(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    // Grows out of nothing while it turns and moves.
    Ref3 axis = spatial_const(dag, 0, 0, 1);
    RefMap turn = spatial_map_rotate(dag, axis, dag_const(dag, 2)), maps[2];
    RefMap grow = spatial_map_scale(dag, spatial_const(dag, 2, 4, 6));
    RefMap shift = spatial_map_translate(dag, spatial_const(dag, 1, 2, 3));
    maps[0] = spatial_map_scale(dag, spatial_const(dag, 0, 0, 0));
    maps[1] = spatial_map_compose(dag, &turn, &grow);
    maps[1] = spatial_map_compose(dag, &shift, &maps[1]);
    double times[2] = {0, 4};
    KeysMode modes[2] = {{KEYS_LINEAR, {0}}, {KEYS_LINEAR, {0}}};
    Keys keys = {2, times, modes, KEYS_END_HOLD, KEYS_END_HOLD};
    RefMap map = keys_map(dag, &keys, dag_input(dag, IN_T), maps);
    double in[IN_COUNT] = {[IN_T] = 1}, m[3][4];
    program_run1(dag_compile(dag, &arena, &map.m[0][0], 12), in, &m[0][0]);
    double c = cos(0.5), s = sin(0.5);
    const double expected[3][4] = {
        {0.5 * c, -1 * s, 0, 0.25}, {0.5 * s, 1 * c, 0, 0.5}, {0, 0, 1.5, 0.75}};
    for (int i = 0; i < 12; i++) {
        assert_near(m[i / 4][i % 4], expected[i / 4][i % 4], 1e-14);
    }
    arena_free(&arena);
}

static void keys_know_their_words(void **state) {
    (void)state;
    assert_int_equal(keys_find_curve("smooth", 0), KEYS_SMOOTH);
    assert_int_equal(keys_find_curve("ease", 0), KEYS_EASE);
    assert_int_equal(keys_find_curve("ease", 2), KEYS_EASE_IN_OUT);
    assert_int_equal(keys_find_curve("ease", 1), KEYS_CURVES);
    assert_int_equal(keys_find_curve("bezier", 4), KEYS_BEZIER);
    assert_int_equal(keys_find_end("pingpong"), KEYS_END_PINGPONG);
    assert_int_equal(keys_find_end("smooth"), KEYS_ENDS);
    assert_null(keys_check_mode(&(KeysMode){KEYS_BEZIER, {0, -5, 1, 7}}));
    assert_non_null(keys_check_mode(&(KeysMode){KEYS_BEZIER, {-0.1, 0, 1, 1}}));
    assert_non_null(keys_check_mode(&(KeysMode){KEYS_BEZIER, {0.1, NAN, 1, 1}}));
    assert_non_null(keys_check_mode(&(KeysMode){KEYS_EASE_IN_OUT, {0.6, 0.6}}));
    assert_non_null(keys_check_mode(&(KeysMode){KEYS_SPRING, {0, 1}}));
    assert_non_null(keys_check_mode(&(KeysMode){KEYS_SPRING, {1, -1}}));
    assert_int_equal(keys_disorder((double[]){0, 1, 1, 2}, 4), 2);
    assert_int_equal(keys_disorder((double[]){0, 1, NAN}, 3), 2);
    assert_int_equal(keys_disorder((double[]){0, 1, 3}, 3), 3);
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(keys_match_plain),      cmocka_unit_test(keys_are_exact),
    cmocka_unit_test(keys_move_with_values), cmocka_unit_test(keys_solve_bezier),
    cmocka_unit_test(keys_have_rates),       cmocka_unit_test(keys_break_at_keys),
    cmocka_unit_test(keys_cost_little),      cmocka_unit_test(keys_turn_about_an_axis),
    cmocka_unit_test(keys_turn_smoothly),    cmocka_unit_test(keys_move_maps),
    cmocka_unit_test(keys_know_their_words),
};

SUITE(keys, tests)
