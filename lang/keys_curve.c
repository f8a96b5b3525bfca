// SPDX-License-Identifier: Apache-2.0
// Progress within a span of a `keys` table: eases, Bezier curves, springs.
//
// One formula for each kind of curve that the table has; its parameters are looked up by segment
// (and are plain constants where all spans have the same).
//
// Bezier curves: x(q) = s is solved by Newton's method from a chord of x. The chords' ends are
// graded by powers of two towards 0, 1 and the flattest point of x, where the inverse may have
// a vertical tangent, so that five steps reach full precision on every chord; chords on which x is
// so flat that steps would be noise are shorter than rounding, and are taken as they are. Nothing
// is compared on the way but in one search, so the result can be differentiated, and has no breaks.
#include "lang/keys_table.h"

#include <math.h>
#include <string.h>

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref add(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_ADD, a, b, REF_NONE);
}

static Ref sub(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_SUB, a, b, REF_NONE);
}

static Ref mul(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_MUL, a, b, REF_NONE);
}

static Ref divide(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_DIV, a, b, REF_NONE);
}

// The mode that a segment needs; NULL: it rests, any will do.
static const KeysMode *mode_of(const KeysTable *table, uint32_t segment) {
    static const KeysMode straight = {KEYS_LINEAR, {0}};
    const Keys *keys = table->keys;
    if (segment == 0) {
        return keys->before == KEYS_END_LINEAR ? &straight : NULL;
    }
    if (segment == keys->n) {
        return keys->after == KEYS_END_LINEAR ? &straight : NULL;
    }
    const KeysMode *mode = &keys->modes[segment - 1];
    if (mode->curve == KEYS_SMOOTH) { // its cubic comes from the values
        return &straight;
    }
    return mode->curve == KEYS_STEP ? NULL : mode;
}

// Looks up a parameter that only segments with this curve have: the others get the first one's, so
// that one curve in a table costs no table.
static Ref parameter(const KeysTable *table, KeysCurve curve, const double *values) {
    double *all = ARENA_ARRAY(table->scratch, table->n, double);
    bool is_found = false;
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        bool has_it = mode && mode->curve == curve;
        if (has_it && !is_found) {
            is_found = true;
            for (uint32_t j = 0; j < i; j++) {
                all[j] = values[i];
            }
        }
        all[i] = has_it || i == 0 ? values[i] : all[i - 1];
    }
    return keys_pick_number(table, all);
}

static Ref argument(const KeysTable *table, KeysCurve curve, int which) {
    double *values = ARENA_ARRAY(table->scratch, table->n, double);
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        values[i] = mode ? mode->arguments[which] : 0;
    }
    return parameter(table, curve, values);
}

// --- Eases ---

static Ref ease(Dag *dag, Ref s) {
    Ref slope = sub(dag, dag_const(dag, 3), mul(dag, dag_const(dag, 2), s));
    return mul(dag, mul(dag, s, s), slope);
}

// Speed rises to v during a, stays, falls during b; the way is v (1 - a/2 - b/2) = 1.
static Ref ease_in_out(const KeysTable *table) {
    Dag *dag = table->dag;
    Ref s = table->s, one = dag_const(dag, 1), half = dag_const(dag, 0.5);
    Ref a = argument(table, KEYS_EASE_IN_OUT, 0), b = argument(table, KEYS_EASE_IN_OUT, 1);
    Ref v = divide(dag, one, sub(dag, one, mul(dag, half, add(dag, a, b))));
    Ref rest = sub(dag, one, s);
    Ref rising = divide(dag, mul(dag, mul(dag, half, v), mul(dag, s, s)), a);
    Ref steady = mul(dag, v, sub(dag, s, mul(dag, half, a)));
    Ref falling = divide(dag, mul(dag, mul(dag, half, v), mul(dag, rest, rest)), b);
    Ref is_steady = dag_op(dag, OP_LE, b, rest, REF_NONE);
    Ref late = dag_op(dag, OP_SELECT, is_steady, steady, sub(dag, one, falling));
    return dag_op(dag, OP_SELECT, dag_op(dag, OP_LT, s, a, REF_NONE), rising, late);
}

// --- Springs ---

// g(u) = exp(-k u) (p cos(w u) + q sin(w u) + r u) + (1 - p) exp(-l u): under-damped with p = 1, at
// the limit with w = 0 and r = k, over-damped with w = 0 and two exponentials.
typedef struct {
    double k, l, w, p, q, r;
} Spring;

enum { SPRING_NUMBERS = 6 };

static const double two_pi = 6.28318530717958647693;

static Spring spring_of(double frequency, double damping) {
    double omega = two_pi * frequency, d = damping;
    if (fabs(d - 1) < 1e-10) {
        return (Spring){.k = omega, .p = 1, .r = omega};
    }
    if (d < 1) {
        double root = sqrt((1 - d) * (1 + d));
        return (Spring){.k = d * omega, .w = omega * root, .p = 1, .q = d / root};
    }
    double l = omega * (d + sqrt((d - 1) * (d + 1))), k = omega * omega / l;
    return (Spring){.k = k, .l = l, .p = l / (l - k)};
}

static Ref spring_fall(Dag *dag, const Ref n[SPRING_NUMBERS], Ref u) {
    Ref k = n[0], l = n[1], w = n[2], p = n[3], q = n[4], r = n[5];
    Ref angle = mul(dag, w, u);
    Ref swing =
        add(dag, mul(dag, p, op1(dag, OP_COS, angle)), mul(dag, q, op1(dag, OP_SIN, angle)));
    swing = add(dag, swing, mul(dag, r, u));
    Ref fast = op1(dag, OP_EXP, op1(dag, OP_NEG, mul(dag, l, u)));
    Ref slow = op1(dag, OP_EXP, op1(dag, OP_NEG, mul(dag, k, u)));
    Ref rest = mul(dag, sub(dag, dag_const(dag, 1), p), fast);
    return add(dag, mul(dag, slow, swing), rest);
}

static void spring_constants(Dag *dag, const Spring *spring, Ref n[SPRING_NUMBERS]) {
    const double numbers[SPRING_NUMBERS] = {spring->k, spring->l, spring->w,
                                            spring->p, spring->q, spring->r};
    for (int i = 0; i < SPRING_NUMBERS; i++) {
        n[i] = dag_const(dag, numbers[i]);
    }
}

static double spring_rest(Dag *dag, const Spring *spring, double seconds) {
    Ref n[SPRING_NUMBERS];
    spring_constants(dag, spring, n);
    double rest = 0;
    dag_is_const(dag, spring_fall(dag, n, dag_const(dag, seconds)), &rest);
    return rest;
}

static Ref spring(const KeysTable *table) {
    Dag *dag = table->dag;
    double *numbers[SPRING_NUMBERS + 2];
    for (int i = 0; i < SPRING_NUMBERS + 2; i++) {
        numbers[i] = ARENA_ARRAY(table->scratch, table->n, double);
    }
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        if (mode && mode->curve == KEYS_SPRING) {
            Spring s = spring_of(mode->arguments[0], mode->arguments[1]);
            double seconds = keys_span(table->keys, i - 1);
            const double all[SPRING_NUMBERS + 2] = {
                s.k, s.l, s.w, s.p, s.q, s.r, seconds, spring_rest(dag, &s, seconds)};
            for (int j = 0; j < SPRING_NUMBERS + 2; j++) {
                numbers[j][i] = all[j];
            }
        }
    }
    Ref n[SPRING_NUMBERS + 2];
    for (int j = 0; j < SPRING_NUMBERS + 2; j++) {
        n[j] = parameter(table, KEYS_SPRING, numbers[j]);
    }
    Ref u = mul(dag, table->s, n[SPRING_NUMBERS]);
    Ref made_up = mul(dag, n[SPRING_NUMBERS + 1], ease(dag, table->s));
    return add(dag, sub(dag, dag_const(dag, 1), spring_fall(dag, n, u)), made_up);
}

// --- Bezier curves ---

enum { NEWTON_STEPS = 5, LEVELS = 26, MAX_CHORDS = 4 * LEVELS + 8 };

// Below this slope of x a chord is not refined: it spans less than 2^-48 of s.
static const double flat_slope = 0x1p-30;

typedef struct {
    double a, b, c; // ((a q + b) q + c) q
} Cubic;

static Cubic cubic_of(double p1, double p2) {
    return (Cubic){1 + 3 * p1 - 3 * p2, 3 * p2 - 6 * p1, 3 * p1};
}

static double cubic_at(Cubic p, double q) {
    return ((p.a * q + p.b) * q + p.c) * q;
}

static double cubic_slope(Cubic p, double q) {
    return (3 * p.a * q + 2 * p.b) * q + p.c;
}

// From lo to hi, finest at both ends; without hi itself.
static uint32_t grade(double lo, double hi, double *q, uint32_t n) {
    double half = (hi - lo) / 2;
    q[n++] = lo;
    for (int k = LEVELS; k > 0; k--) {
        q[n++] = lo + ldexp(half, -k);
    }
    q[n++] = lo + half;
    for (int k = 1; k <= LEVELS; k++) {
        q[n++] = hi - ldexp(half, -k);
    }
    return n;
}

static uint32_t chord_ends(Cubic x, double *q) {
    double flattest = -x.b / (3 * x.a);
    bool is_inside = flattest > 0x1p-20 && flattest < 1 - 0x1p-20;
    uint32_t n = grade(0, is_inside ? flattest : 1, q, 0);
    n = is_inside ? grade(flattest, 1, q, n) : n;
    q[n++] = 1;
    return n;
}

// Tables over the chords of all different Bezier curves, one curve's after the other's; curve m's
// begin at 2 m, so that one search finds the chord.
typedef struct {
    double *from, *x, *q, *chord, *gain, *still;
    size_t n;
} Chords;

static void add_chords(Chords *c, Cubic x, double base) {
    double q[MAX_CHORDS + 1];
    uint32_t n = chord_ends(x, q);
    for (uint32_t i = 0; i < n; i++) {
        size_t at = c->n++;
        bool is_last = i + 1 == n;
        double here = i > 0 ? fmax(cubic_at(x, q[i]), c->x[at - 1]) : 0;
        double next = is_last ? here : cubic_at(x, q[i + 1]);
        double slope = fmin(cubic_slope(x, q[i]), is_last ? 1 : cubic_slope(x, q[i + 1]));
        bool is_flat = slope < flat_slope;
        c->x[at] = here;
        c->from[at] = base + here;
        c->q[at] = q[i];
        c->chord[at] = next > here ? (q[i + 1] - q[i]) / (next - here) : 0;
        c->gain[at] = !is_flat;
        c->still[at] = is_flat; // keeps the quotient finite
    }
}

static Chords chords_new(Arena *scratch, uint32_t n_curves) {
    size_t n = (size_t)n_curves * (MAX_CHORDS + 1);
    return (Chords){
        .from = ARENA_ARRAY(scratch, n, double),
        .x = ARENA_ARRAY(scratch, n, double),
        .q = ARENA_ARRAY(scratch, n, double),
        .chord = ARENA_ARRAY(scratch, n, double),
        .gain = ARENA_ARRAY(scratch, n, double),
        .still = ARENA_ARRAY(scratch, n, double),
    };
}

// Numbers the different Bezier curves by their x; fills which[segment]. Spans that follow one
// another mostly share it, so that the last few are compared.
static Chords collect(const KeysTable *table, double *which) {
    uint32_t n_curves = 0;
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        n_curves += mode && mode->curve == KEYS_BEZIER;
    }
    Chords chords = chords_new(table->scratch, n_curves);
    const KeysMode *last = NULL;
    double m = -1;
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        if (mode && mode->curve == KEYS_BEZIER) {
            if (!last || memcmp(last->arguments, mode->arguments, sizeof last->arguments) != 0) {
                m++;
                add_chords(&chords, cubic_of(mode->arguments[0], mode->arguments[2]), 2 * m);
            }
            last = mode;
            which[i] = m;
        }
    }
    return chords;
}

static Ref chord_number(const KeysTable *table, Ref chord, const Chords *chords,
                        const double *numbers) {
    return dag_table_op(table->dag, OP_TABLE, chord, numbers, (uint32_t)chords->n);
}

typedef struct {
    Ref a, b, c;
} CubicRefs;

// Coefficients by segment; 0: x, 1: y.
static CubicRefs coefficients(const KeysTable *table, int axis) {
    double *numbers[3];
    for (int j = 0; j < 3; j++) {
        numbers[j] = ARENA_ARRAY(table->scratch, table->n, double);
    }
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        if (mode && mode->curve == KEYS_BEZIER) {
            Cubic p = cubic_of(mode->arguments[axis], mode->arguments[axis + 2]);
            numbers[0][i] = p.a;
            numbers[1][i] = p.b;
            numbers[2][i] = p.c;
        }
    }
    return (CubicRefs){parameter(table, KEYS_BEZIER, numbers[0]),
                       parameter(table, KEYS_BEZIER, numbers[1]),
                       parameter(table, KEYS_BEZIER, numbers[2])};
}

static Ref cubic_ref(Dag *dag, CubicRefs p, Ref q) {
    Ref sum = add(dag, mul(dag, p.a, q), p.b);
    return mul(dag, add(dag, mul(dag, sum, q), p.c), q);
}

static Ref slope_ref(Dag *dag, CubicRefs p, Ref q) {
    Ref a3 = mul(dag, dag_const(dag, 3), p.a), b2 = mul(dag, dag_const(dag, 2), p.b);
    return add(dag, mul(dag, add(dag, mul(dag, a3, q), b2), q), p.c);
}

static Ref bezier(const KeysTable *table) {
    Dag *dag = table->dag;
    double *which = ARENA_ARRAY(table->scratch, table->n, double);
    Chords chords = collect(table, which);
    Ref base = mul(dag, dag_const(dag, 2), parameter(table, KEYS_BEZIER, which));
    Ref chord = dag_search_unseen(dag, add(dag, base, table->s), chords.from, (uint32_t)chords.n);
    Ref ahead = sub(dag, table->s, chord_number(table, chord, &chords, chords.x));
    Ref q = chord_number(table, chord, &chords, chords.q);
    q = add(dag, q, mul(dag, ahead, chord_number(table, chord, &chords, chords.chord)));
    Ref gain = chord_number(table, chord, &chords, chords.gain);
    Ref still = chord_number(table, chord, &chords, chords.still);
    CubicRefs x = coefficients(table, 0);
    for (int i = 0; i < NEWTON_STEPS; i++) {
        Ref miss = mul(dag, gain, sub(dag, cubic_ref(dag, x, q), table->s));
        q = sub(dag, q, divide(dag, miss, add(dag, slope_ref(dag, x, q), still)));
    }
    return cubic_ref(dag, coefficients(table, 1), q);
}

// --- All of them ---

static Ref progress_by(const KeysTable *table, KeysCurve curve) {
    switch (curve) {
    case KEYS_EASE:
        return ease(table->dag, table->s);
    case KEYS_EASE_IN_OUT:
        return ease_in_out(table);
    case KEYS_BEZIER:
        return bezier(table);
    case KEYS_SPRING:
        return spring(table);
    default:
        return table->s;
    }
}

Ref keys_progress(const KeysTable *table) {
    Dag *dag = table->dag;
    double *kinds = ARENA_ARRAY(table->scratch, table->n, double);
    bool is_used[KEYS_CURVES] = {false};
    double any = KEYS_LINEAR;
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        if (mode) {
            is_used[mode->curve] = true;
            any = mode->curve;
        }
    }
    for (uint32_t i = 0; i < table->n; i++) {
        const KeysMode *mode = mode_of(table, i);
        kinds[i] = mode ? (double)mode->curve : any;
    }
    Ref kind = keys_pick_number(table, kinds), progress = REF_NONE;
    for (KeysCurve curve = 0; curve < KEYS_CURVES; curve++) {
        if (is_used[curve]) {
            Ref f = progress_by(table, curve);
            Ref is_it = dag_op(dag, OP_EQ, kind, dag_const(dag, curve), REF_NONE);
            progress = progress == REF_NONE ? f : dag_op(dag, OP_SELECT, is_it, f, progress);
        }
    }
    return progress == REF_NONE ? table->s : progress;
}

// dy/dx where x may stand still at the end: the next control point gives the direction then.
static double bezier_slope(const double p[4], bool is_end) {
    double x1 = is_end ? 1 - p[2] : p[0], y1 = is_end ? 1 - p[3] : p[1];
    double x2 = is_end ? 1 - p[0] : p[2], y2 = is_end ? 1 - p[1] : p[3];
    if (x1 == 0 && y1 == 0) {
        x1 = x2;
        y1 = y2;
    }
    if (x1 == 0 && y1 == 0) {
        return 1;
    }
    return x1 > 0 ? y1 / x1 : 0;
}

static double spring_slope(Dag *dag, const KeysMode *mode, double seconds) {
    Ref n[SPRING_NUMBERS], x = dag_input(dag, IN_X);
    Spring s = spring_of(mode->arguments[0], mode->arguments[1]);
    spring_constants(dag, &s, n);
    Ref rate = dag_diff(dag, spring_fall(dag, n, x), IN_X, 1, NULL);
    double slope = 0;
    dag_is_const(dag, dag_substitute(dag, rate, IN_X, dag_const(dag, seconds)), &slope);
    return -slope * seconds;
}

double keys_slope(Dag *dag, const Keys *keys, uint32_t span, bool is_end) {
    const KeysMode *mode = &keys->modes[span];
    double in = mode->arguments[0], out = mode->arguments[1];
    switch (mode->curve) {
    case KEYS_LINEAR:
        return 1;
    case KEYS_EASE_IN_OUT:
        return (is_end ? out : in) == 0 ? 1 / (1 - (in + out) / 2) : 0;
    case KEYS_BEZIER:
        return bezier_slope(mode->arguments, is_end);
    case KEYS_SPRING:
        return is_end ? spring_slope(dag, mode, keys_span(keys, span)) : 0;
    default:
        return 0;
    }
}
