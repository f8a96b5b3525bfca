// SPDX-License-Identifier: Apache-2.0
// Vectors, rotations and maps of graphs, against matrices of doubles.
#include "lang/spatial.h"
#include "tests/near.h"
#include "tests/suite.h"

#include <math.h>
#include <string.h>

static uint64_t seed;

static double real(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 33) / 0x1p31;
}

// --- The oracle: 3x3 matrices in plain doubles ---

typedef struct {
    double m[3][3];
} Mat;

static Mat mat_mul(Mat a, Mat b) {
    Mat r = {{{0}}};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            for (int l = 0; l < 3; l++) {
                r.m[i][j] += a.m[i][l] * b.m[l][j];
            }
        }
    }
    return r;
}

// exp of the cross-product matrix, by its series for 1/64 of the angle and six squarings: shares
// nothing with the closed forms.
static Mat mat_rotation(const double axis[3], double angle) {
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    double f = angle / length / 64, k[3] = {axis[0] * f, axis[1] * f, axis[2] * f};
    Mat cross = {{{0, -k[2], k[1]}, {k[2], 0, -k[0]}, {-k[1], k[0], 0}}};
    Mat sum = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, term = sum;
    for (int n = 1; n < 20; n++) {
        term = mat_mul(term, cross);
        for (int i = 0; i < 9; i++) {
            term.m[i / 3][i % 3] /= n;
            sum.m[i / 3][i % 3] += term.m[i / 3][i % 3];
        }
    }
    for (int n = 0; n < 6; n++) {
        sum = mat_mul(sum, sum);
    }
    return sum;
}

static void mat_apply(Mat a, const double v[3], double out[3]) {
    for (int i = 0; i < 3; i++) {
        out[i] = a.m[i][0] * v[0] + a.m[i][1] * v[1] + a.m[i][2] * v[2];
    }
}

// --- Values that are either constants or inputs, so that both ways of building are tried ---

typedef struct {
    Arena arena;
    Dag *dag;
    double in[IN_COUNT];
    int n_inputs;
    bool is_motion;
} Case;

static Case case_new(bool is_motion) {
    Case c = {.is_motion = is_motion};
    return c;
}

static Ref scalar(Case *c, double x) {
    if (!c->is_motion || c->n_inputs == IN_COUNT) {
        return dag_const(c->dag, x);
    }
    c->in[c->n_inputs] = x;
    return dag_input(c->dag, (Input)c->n_inputs++);
}

static Ref3 vector(Case *c, const double v[3]) {
    return ref3(scalar(c, v[0]), scalar(c, v[1]), scalar(c, v[2]));
}

static void values(Case *c, const Ref *refs, uint32_t n, double *out) {
    program_run1(dag_compile(c->dag, &c->arena, refs, n), c->in, out);
}

static void values3(Case *c, Ref3 v, double out[3]) {
    values(c, (Ref[]){v.x, v.y, v.z}, 3, out);
}

static void assert_near3(const double a[3], const double b[3], double bound) {
    for (int k = 0; k < 3; k++) {
        assert_near(a[k], b[k], bound);
    }
}

static void random_vector(double v[3]) {
    for (int k = 0; k < 3; k++) {
        v[k] = real(-2, 2);
    }
}

static void random_axis(int round, double axis[3]) {
    random_vector(axis);
    if (round % 3 == 0) { // an axis of the world
        int k = round / 3 % 3;
        double size = round % 2 ? 2.5 : -0.5;
        memset(axis, 0, 3 * sizeof *axis);
        axis[k] = size;
    }
}

static void map_values(Case *c, const RefMap *map, double out[3][4]) {
    values(c, &map->m[0][0], 12, &out[0][0]);
}

static void spatial_turns(void **state) {
    (void)state;
    seed = 1;
    for (int round = 0; round < 400; round++) {
        Case c = case_new(round % 4 == 1);
        c.dag = dag_new(&c.arena);
        double axis[3], v[3], expected[3], got[3], angle = real(-7, 7);
        random_axis(round, axis);
        random_vector(v);
        mat_apply(mat_rotation(axis, angle), v, expected);
        Ref3 a = vector(&c, axis), p = vector(&c, v);
        Ref by = scalar(&c, angle);
        values3(&c, spatial_turned(c.dag, p, a, by), got);
        assert_near3(got, expected, 1e-13);
        values3(&c, spatial_quat_rotate(c.dag, spatial_quat(c.dag, a, by), p), got);
        assert_near3(got, expected, 1e-13);
        RefMap map = spatial_map_rotate(c.dag, a, by);
        values3(&c, spatial_map_point(c.dag, &map, p), got);
        assert_near3(got, expected, 1e-13);
        map = spatial_map_quat(c.dag, spatial_quat(c.dag, a, by));
        values3(&c, spatial_map_vector(c.dag, &map, p), got);
        assert_near3(got, expected, 1e-13);
        arena_free(&c.arena);
    }
}

static void spatial_turning_is_cheap(void **state) {
    (void)state;
    Arena arena = {0};
    Dag *dag = dag_new(&arena);
    Ref t = dag_input(dag, IN_T);
    Ref3 p = ref3(dag_input(dag, IN_PX), dag_input(dag, IN_PY), dag_input(dag, IN_PZ));
    Ref3 y = spatial_const(dag, 0, 3, 0);
    Ref3 turned = spatial_turned(dag, p, y, t);
    assert_int_equal(turned.y, p.y);
    // 4 inputs, sin, cos, 4 products, 2 sums
    Program *program = dag_compile(dag, &arena, (Ref[]){turned.x, turned.y, turned.z}, 3);
    assert_int_equal(program_n_instr(program), 12);
    RefMap map = spatial_map_rotate(dag, y, t);
    program = dag_compile(dag, &arena, &map.m[0][0], 12);
    assert_int_equal(program_n_instr(program), 6); // t, sin, cos, -sin, 0, 1
    // An axis that is zero turns nothing, and vectors of any size have a direction.
    double v[3];
    Case c = {.dag = dag};
    values3(&c, spatial_turned(dag, spatial_const(dag, 1, 2, 3), spatial_const(dag, 0, 0, 0), t),
            v);
    assert_near3(v, (double[]){1, 2, 3}, 0);
    values3(&c, spatial_normalize(dag, spatial_const(dag, 3e-200, 0, 4e-200)), v);
    assert_near3(v, (double[]){0.6, 0, 0.8}, 1e-15);
    values3(&c, spatial_normalize(dag, spatial_const(dag, 3e300, 4e300, 0)), v);
    assert_near3(v, (double[]){0.6, 0.8, 0}, 1e-15);
    arena_free(&c.arena);
    arena_free(&arena);
}

static void spatial_composes(void **state) {
    (void)state;
    seed = 2;
    for (int round = 0; round < 200; round++) {
        Case c = case_new(round % 2);
        c.dag = dag_new(&c.arena);
        double a[3], b[3], v[3], got[3], expected[3], x = real(-4, 4), y = real(-4, 4);
        random_axis(round, a);
        random_axis(round + 1, b);
        random_vector(v);
        mat_apply(mat_mul(mat_rotation(a, x), mat_rotation(b, y)), v, expected);
        RefQuat qa = spatial_quat(c.dag, vector(&c, a), scalar(&c, x));
        RefQuat qb = spatial_quat(c.dag, vector(&c, b), scalar(&c, y));
        Ref3 p = vector(&c, v);
        RefQuat both = spatial_quat_mul(c.dag, qa, qb);
        values3(&c, spatial_quat_rotate(c.dag, both, p), got);
        assert_near3(got, expected, 1e-13);
        RefMap ma = spatial_map_quat(c.dag, qa), mb = spatial_map_quat(c.dag, qb);
        RefMap m = spatial_map_compose(c.dag, &ma, &mb);
        values3(&c, spatial_map_point(c.dag, &m, p), got);
        assert_near3(got, expected, 1e-13);
        Ref3 back = spatial_quat_rotate(c.dag, spatial_quat_inverse(c.dag, both),
                                        spatial_quat_rotate(c.dag, both, p));
        values3(&c, back, got);
        assert_near3(got, v, 1e-13);
        RefQuat again = spatial_quat_exp(c.dag, spatial_quat_log(c.dag, both), dag_const(c.dag, 1));
        values3(&c, spatial_quat_rotate(c.dag, again, p), got);
        assert_near3(got, expected, 1e-13);
        arena_free(&c.arena);
    }
}

static void random_map(Case *c, RefMap *map, bool is_singular) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            map->m[i][j] = scalar(c, is_singular && j == 1 ? 0 : real(-2, 2));
        }
    }
}

static void spatial_inverts(void **state) {
    (void)state;
    seed = 3;
    for (int round = 0; round < 200; round++) {
        Case c = case_new(round % 2);
        c.dag = dag_new(&c.arena);
        RefMap map;
        random_map(&c, &map, false);
        RefMap inverse = spatial_map_inverse(c.dag, &map);
        RefMap product = spatial_map_compose(c.dag, &map, &inverse);
        double determinant, m[3][4];
        Ref det = spatial_map_determinant(c.dag, &map);
        values(&c, &det, 1, &determinant);
        map_values(&c, &product, m);
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 4; j++) {
                assert_near(m[i][j], i == j, 1e-12 / fmin(1, fabs(determinant)));
            }
        }
        // A normal stays across what lies in the surface.
        double n[3], u[3], across;
        random_vector(n);
        random_vector(u);
        double along =
            (n[0] * u[0] + n[1] * u[1] + n[2] * u[2]) / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++) {
            u[k] -= along * n[k];
        }
        Ref3 normal = spatial_map_normal(c.dag, &map, vector(&c, n));
        Ref3 tangent = spatial_map_vector(c.dag, &map, vector(&c, u));
        Ref product_dot = spatial_dot(c.dag, normal, tangent);
        values(&c, &product_dot, 1, &across);
        assert_near(across, 0, 1e-12);
        // The pivot stays where it is, but for the map's own translation.
        double pivot[3], at[3];
        random_vector(pivot);
        RefMap linear = map;
        for (int i = 0; i < 3; i++) {
            linear.m[i][3] = dag_const(c.dag, 0);
        }
        Ref3 p = vector(&c, pivot);
        RefMap pivoted = spatial_map_pivot(c.dag, &linear, p);
        values3(&c, spatial_map_point(c.dag, &pivoted, p), at);
        assert_near3(at, pivot, 1e-14);
        arena_free(&c.arena);
    }
}

static void spatial_splits(void **state) {
    (void)state;
    seed = 4;
    for (int round = 0; round < 300; round++) {
        Case c = case_new(round % 5 == 0);
        c.dag = dag_new(&c.arena);
        double axis[3], move[3], size[3], angle = real(-7, 7);
        random_axis(round, axis);
        random_vector(move);
        for (int k = 0; k < 3; k++) {
            size[k] = (round >> k & 1) && round % 3 ? 0 : real(0.1, 3);
        }
        size[round % 3] *= round % 4 == 3 ? -1 : 1;
        if (round % 11 == 0) { // half a turn, where the real part vanishes
            angle = 3.14159265358979323846;
        }
        RefMap turn = spatial_map_rotate(c.dag, vector(&c, axis), scalar(&c, angle));
        RefMap shift = spatial_map_translate(c.dag, vector(&c, move));
        RefMap grow = spatial_map_scale(c.dag, vector(&c, size));
        RefMap map = spatial_map_compose(c.dag, &turn, &grow);
        map = spatial_map_compose(c.dag, &shift, &map);
        RefParts parts = spatial_map_split(c.dag, &map);
        RefMap joined = spatial_map_join(c.dag, &parts);
        double a[3][4], b[3][4], q[4];
        map_values(&c, &map, a);
        map_values(&c, &joined, b);
        for (int i = 0; i < 12; i++) {
            assert_near(b[i / 4][i % 4], a[i / 4][i % 4], 1e-13);
        }
        values(&c, (Ref[]){parts.rotation.x, parts.rotation.y, parts.rotation.z, parts.rotation.w},
               4, q);
        assert_near(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-14);
        arena_free(&c.arena);
    }
}

static void quat_values(Case *c, RefQuat q, double out[4]) {
    values(c, (Ref[]){q.x, q.y, q.z, q.w}, 4, out);
}

static void spatial_slerps(void **state) {
    (void)state;
    seed = 5;
    for (int round = 0; round < 200; round++) {
        Case c = case_new(round % 2);
        c.dag = dag_new(&c.arena);
        double axis[3], v[3], expected[3], got[3], angle = real(-3.1, 3.1), s = real(-0.5, 1.5);
        if (round % 7 == 0) {
            angle *= 1e-9;
        }
        random_axis(round, axis);
        random_vector(v);
        Ref3 p = vector(&c, v);
        RefQuat a = spatial_quat(c.dag, spatial_const(c.dag, 1, 2, 3), dag_const(c.dag, 0.7));
        RefQuat turn = spatial_quat(c.dag, vector(&c, axis), scalar(&c, angle));
        RefQuat b = spatial_quat_mul(c.dag, turn, a);
        b = round % 3 ? b : spatial_quat_negate(c.dag, b); // the same rotation
        // From a to b is one turn about the axis, at constant speed.
        double start[3];
        mat_apply(mat_rotation((double[]){1, 2, 3}, 0.7), v, start);
        mat_apply(mat_rotation(axis, angle * s), start, expected);
        RefQuat q = spatial_slerp(c.dag, a, b, scalar(&c, s));
        values3(&c, spatial_quat_rotate(c.dag, q, p), got);
        assert_near3(got, expected, 1e-13);
        double qa[4], qb[4], ends[4];
        quat_values(&c, a, qa);
        quat_values(&c, b, qb);
        quat_values(&c, spatial_slerp(c.dag, a, b, dag_const(c.dag, 0)), ends);
        assert_memory_equal(qa, ends, sizeof qa);
        quat_values(&c, spatial_slerp(c.dag, a, b, dag_const(c.dag, 1)), ends);
        double sign = ends[3] * qb[3] < 0 ? -1 : 1;
        for (int k = 0; k < 4; k++) {
            assert_true(ends[k] == sign * qb[k]);
        }
        arena_free(&c.arena);
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(spatial_turns),    cmocka_unit_test(spatial_turning_is_cheap),
    cmocka_unit_test(spatial_composes), cmocka_unit_test(spatial_inverts),
    cmocka_unit_test(spatial_splits),   cmocka_unit_test(spatial_slerps),
};

SUITE(spatial, tests)
