// SPDX-License-Identifier: Apache-2.0
// `keys` tables of rotations.
//
// Within a segment q = from exp(in f1) exp(turn f2) exp(out f3), all in the body's frame. Slerp has
// the second factor alone, f2 being the progress. A smooth span of h seconds with angular
// velocities a, b (half of them, as logarithms are) has in = h a / 3, out = h b / 3, the turn that
// remains between them, and Bernstein's cumulative cubics f1 = 1 - (1 - s)^3, f2 = s s (3 - 2 s),
// f3 = s^3. A continued end turns on by its velocity, f2 = s.
#include "lang/keys_table.h"

typedef struct {
    const KeysTable *table;
    const RefQuat *keys; // each in the half of the sphere of the one before
    const Ref3 *logs;    // of spans: log(a^-1 b)
} Rotations;

static RefQuat nearer(Dag *dag, RefQuat to, RefQuat q) {
    Ref is_far = dag_op(dag, OP_LT, spatial_quat_dot(dag, to, q), dag_const(dag, 0), REF_NONE);
    RefQuat other = spatial_quat_negate(dag, q);
    return (RefQuat){
        dag_op(dag, OP_SELECT, is_far, other.x, q.x), dag_op(dag, OP_SELECT, is_far, other.y, q.y),
        dag_op(dag, OP_SELECT, is_far, other.z, q.z), dag_op(dag, OP_SELECT, is_far, other.w, q.w)};
}

static Ref3 scaled(Dag *dag, Ref3 v, double k) {
    return spatial_scale(dag, v, dag_const(dag, k));
}

// The angular velocity at a key, times `seconds`.
static Ref3 way(const Rotations *r, uint32_t key, bool is_out, double seconds) {
    Dag *dag = r->table->dag;
    const Keys *keys = r->table->keys;
    KeysNeighbours n = keys_neighbours(r->table, key, is_out);
    double before = n.weight_before * (seconds / keys_span(keys, n.before));
    double after = n.weight_after * (seconds / keys_span(keys, n.after));
    return spatial_add(dag, scaled(dag, r->logs[n.before], before),
                       scaled(dag, r->logs[n.after], after));
}

// What a continued end turns by in its span.
static Ref3 continued(const Rotations *r, bool is_last) {
    Dag *dag = r->table->dag;
    const Keys *keys = r->table->keys;
    uint32_t span = is_last ? keys->n - 2 : 0, key = is_last ? keys->n - 1 : 0;
    double seconds = keys_end_span(keys, is_last);
    if (keys->modes[span].curve == KEYS_SMOOTH) {
        return way(r, key, !is_last, seconds);
    }
    double slope = keys_slope(dag, keys, span, is_last) * (seconds / keys_span(keys, span));
    return scaled(dag, r->logs[span], slope);
}

// Of each segment; is_smooth: 1 where f2 is the cubic.
typedef struct {
    RefQuat *from;
    Ref3 *in, *turn, *out;
    double *is_smooth;
    bool has_smooth;
} Segments;

static RefQuat whole(Dag *dag, Ref3 half) {
    return spatial_quat_exp(dag, half, dag_const(dag, 1));
}

static const double two_pi = 6.28318530717958647693;

// Of the logarithms of q, which are whole turns apart, the one next to what is expected.
static Ref3 log_near(Dag *dag, RefQuat q, Ref3 expected) {
    Ref3 log = spatial_quat_log(dag, q), axis = spatial_normalize(dag, log);
    Ref beyond = spatial_dot(dag, axis, spatial_sub(dag, log, expected));
    beyond = dag_op(dag, OP_DIV, beyond, dag_const(dag, two_pi), REF_NONE);
    Ref turns = dag_op(dag, OP_ROUND, beyond, REF_NONE, REF_NONE);
    Ref back = dag_op(dag, OP_MUL, turns, dag_const(dag, two_pi), REF_NONE);
    return spatial_sub(dag, log, spatial_scale(dag, axis, back));
}

static void fill_smooth(const Rotations *r, Segments *s, uint32_t span) {
    Dag *dag = r->table->dag;
    double third = keys_span(r->table->keys, span) / 3;
    Ref3 in = way(r, span, true, third), out = way(r, span + 1, false, third);
    RefQuat both =
        spatial_quat_mul(dag, spatial_quat_inverse(dag, r->keys[span]), r->keys[span + 1]);
    both = spatial_quat_mul(dag, spatial_quat_inverse(dag, whole(dag, in)), both);
    both = spatial_quat_mul(dag, both, spatial_quat_inverse(dag, whole(dag, out)));
    Ref3 expected = spatial_sub(dag, spatial_sub(dag, r->logs[span], in), out);
    s->in[span + 1] = in;
    s->out[span + 1] = out;
    s->turn[span + 1] = log_near(dag, both, expected);
    s->is_smooth[span + 1] = 1;
    s->has_smooth = true;
}

static void fill(const Rotations *r, Segments *s) {
    const Keys *keys = r->table->keys;
    uint32_t n = keys->n;
    Ref3 none = spatial_const(r->table->dag, 0, 0, 0);
    for (uint32_t i = 0; i <= n; i++) {
        bool moves = i > 0 && i < n && keys->modes[i - 1].curve != KEYS_STEP;
        s->from[i] = r->keys[i > 0 ? i - 1 : 0];
        s->turn[i] = moves ? r->logs[i - 1] : none;
        s->in[i] = s->out[i] = none;
    }
    if (keys->before == KEYS_END_LINEAR) {
        s->turn[0] = continued(r, false);
    }
    if (keys->after == KEYS_END_LINEAR) {
        s->turn[n] = continued(r, true);
    }
    for (uint32_t k = 0; k + 1 < n; k++) {
        if (keys->modes[k].curve == KEYS_SMOOTH) {
            fill_smooth(r, s, k);
        }
    }
}

// parts: the first scalar of each segment's value, which has n_parts of them.
static void pick(const KeysTable *table, const Ref *parts, uint32_t n_parts, Ref *out) {
    Ref *column = ARENA_ARRAY(table->scratch, table->n, Ref);
    for (uint32_t k = 0; k < n_parts; k++) {
        for (uint32_t i = 0; i < table->n; i++) {
            column[i] = parts[(size_t)i * n_parts + k];
        }
        out[k] = keys_pick(table, column);
    }
}

static RefQuat pick_turn(const KeysTable *table, const Ref3 *turns, Ref progress) {
    Ref3 half;
    pick(table, &turns[0].x, 3, &half.x);
    return spatial_quat_exp(table->dag, half, progress);
}

// `offset`: each repetition turns on by what leads from the first key to the last.
static RefQuat repeated(const Rotations *r, RefQuat q) {
    const KeysTable *table = r->table;
    Dag *dag = table->dag;
    if (table->turns == REF_NONE) {
        return q;
    }
    RefQuat back = spatial_quat_inverse(dag, r->keys[0]);
    RefQuat gain = spatial_quat_mul(dag, r->keys[table->keys->n - 1], back);
    gain = nearer(dag, spatial_quat_identity(dag), gain);
    RefQuat all = spatial_quat_exp(dag, spatial_quat_log(dag, gain), table->turns);
    return spatial_quat_mul(dag, all, q);
}

static Ref mul(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_MUL, a, b, REF_NONE);
}

static Ref sub(Dag *dag, Ref a, Ref b) {
    return dag_op(dag, OP_SUB, a, b, REF_NONE);
}

static RefQuat interpolate_smooth(const Rotations *r, const Segments *s, RefQuat from, Ref w) {
    const KeysTable *table = r->table;
    Dag *dag = table->dag;
    Ref t = table->s, one = dag_const(dag, 1), rest = sub(dag, one, t), square = mul(dag, t, t);
    Ref f1 = sub(dag, one, mul(dag, mul(dag, rest, rest), rest));
    Ref twice = mul(dag, dag_const(dag, 2), t);
    Ref f2 = mul(dag, square, sub(dag, dag_const(dag, 3), twice));
    f2 = dag_op(dag, OP_SELECT, keys_pick_number(table, s->is_smooth), f2, w);
    RefQuat q = spatial_quat_mul(dag, from, pick_turn(table, s->in, f1));
    q = spatial_quat_mul(dag, q, pick_turn(table, s->turn, f2));
    return spatial_quat_mul(dag, q, pick_turn(table, s->out, mul(dag, square, t)));
}

static RefQuat interpolate(const Rotations *r, Ref w) {
    const KeysTable *table = r->table;
    Segments s = {.from = ARENA_ARRAY(table->scratch, table->n, RefQuat),
                  .in = ARENA_ARRAY(table->scratch, table->n, Ref3),
                  .turn = ARENA_ARRAY(table->scratch, table->n, Ref3),
                  .out = ARENA_ARRAY(table->scratch, table->n, Ref3),
                  .is_smooth = ARENA_ARRAY(table->scratch, table->n, double)};
    fill(r, &s);
    RefQuat from;
    pick(table, &s.from[0].x, 4, &from.x);
    if (s.has_smooth) {
        return interpolate_smooth(r, &s, from, w);
    }
    return spatial_quat_mul(table->dag, from, pick_turn(table, s.turn, w));
}

static bool is_same(RefQuat a, RefQuat b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w;
}

RefQuat keys_rotation(Dag *dag, const Keys *keys, Ref clock, const RefQuat *values) {
    uint32_t n = keys->n;
    if (n == 1) {
        return values[0];
    }
    Arena scratch = {0};
    RefQuat *quats = ARENA_ARRAY(&scratch, n, RefQuat);
    Ref3 *logs = ARENA_ARRAY(&scratch, n, Ref3);
    quats[0] = values[0];
    for (uint32_t k = 0; k + 1 < n; k++) {
        quats[k + 1] = nearer(dag, quats[k], values[k + 1]);
        RefQuat turn = spatial_quat_mul(dag, spatial_quat_inverse(dag, quats[k]), quats[k + 1]);
        logs[k] = spatial_quat_log(dag, turn);
    }
    bool closes = is_same(quats[0], quats[n - 1]) ||
                  is_same(quats[0], spatial_quat_negate(dag, quats[n - 1]));
    KeysTable table = keys_table(dag, &scratch, keys, clock, closes);
    Rotations r = {&table, quats, logs};
    RefQuat q = repeated(&r, interpolate(&r, keys_progress(&table)));
    arena_free(&scratch);
    return q;
}
