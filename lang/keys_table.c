// SPDX-License-Identifier: Apache-2.0
// The clock of a `keys` table, and choosing among its segments.
#include "lang/keys_table.h"

#include <math.h>

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static bool repeats(KeysEnd end) {
    return end == KEYS_END_LOOP || end == KEYS_END_PINGPONG || end == KEYS_END_OFFSET;
}

// --- The clock ---

typedef struct {
    Ref local, turns;
} Clock;

// Seconds since the first key are taken modulo the table's length, there and back modulo twice it.
static Clock repeated(Dag *dag, const Keys *keys, Ref clock, KeysEnd end) {
    double first = keys->times[0], length = keys->times[keys->n - 1] - first;
    Ref since = op2(dag, OP_SUB, clock, dag_const(dag, first));
    Clock c = {clock, dag_const(dag, 0)};
    if (!repeats(end)) {
        return c;
    }
    bool returns = end == KEYS_END_PINGPONG;
    Ref period = dag_const(dag, returns ? 2 * length : length);
    Ref phase = op2(dag, OP_MOD, since, period);
    if (end == KEYS_END_OFFSET) { // from the phase, so that both change at one instant
        Ref passed = op2(dag, OP_DIV, op2(dag, OP_SUB, since, phase), period);
        c.turns = op1(dag, OP_ROUND, passed);
    }
    phase = returns ? op2(dag, OP_MIN, phase, op2(dag, OP_SUB, period, phase)) : phase;
    c.local = op2(dag, OP_ADD, dag_const(dag, first), phase);
    return c;
}

// Between the first and the last key the clock is used as it is: adding and subtracting the first
// key's time would cost bits.
static Clock brought_in(Dag *dag, const Keys *keys, Ref clock) {
    Ref first = dag_const(dag, keys->times[0]), last = dag_const(dag, keys->times[keys->n - 1]);
    Clock before = repeated(dag, keys, clock, keys->before);
    Clock after = repeated(dag, keys, clock, keys->after);
    // Where the last key is passed but not jumped from, it is still inside.
    Op inside = keys->after == KEYS_END_PINGPONG ? OP_LE : OP_LT;
    Ref is_before = op2(dag, OP_LT, clock, first), is_inside = op2(dag, inside, clock, last);
    Ref zero = dag_const(dag, 0);
    Clock c;
    c.local = dag_op(dag, OP_SELECT, is_inside, clock, after.local);
    c.local = dag_op(dag, OP_SELECT, is_before, before.local, c.local);
    c.turns = dag_op(dag, OP_SELECT, is_inside, zero, after.turns);
    c.turns = dag_op(dag, OP_SELECT, is_before, before.turns, c.turns);
    return c;
}

// --- Segments ---

static void measure(const Keys *keys, double *from, double *starts, double *lengths) {
    uint32_t n = keys->n;
    from[0] = -INFINITY;
    starts[0] = keys->times[0];
    lengths[0] = keys->before == KEYS_END_LINEAR ? keys_end_span(keys, false) : INFINITY;
    for (uint32_t k = 0; k < n; k++) {
        from[k + 1] = starts[k + 1] = keys->times[k];
        bool moves = k + 1 < n && keys->modes[k].curve != KEYS_STEP;
        lengths[k + 1] = moves ? keys_span(keys, k) : INFINITY;
    }
    if (keys->after == KEYS_END_LINEAR) {
        lengths[n] = keys_end_span(keys, true);
    }
}

KeysTable keys_table(Dag *dag, Arena *scratch, const Keys *keys, Ref clock, bool is_same) {
    KeysTable table = {.dag = dag, .keys = keys, .scratch = scratch, .n = keys->n + 1};
    bool loops = keys->before == KEYS_END_LOOP || keys->after == KEYS_END_LOOP;
    bool offsets = keys->before == KEYS_END_OFFSET || keys->after == KEYS_END_OFFSET;
    table.is_closed = (loops && is_same) || offsets;
    Clock c = brought_in(dag, keys, clock);
    table.turns = offsets ? c.turns : REF_NONE;
    double *from = ARENA_ARRAY(scratch, table.n, double);
    double *starts = ARENA_ARRAY(scratch, table.n, double);
    double *lengths = ARENA_ARRAY(scratch, table.n, double);
    measure(keys, from, starts, lengths);
    table.index = dag_table_op(dag, OP_SEARCH, c.local, from, table.n);
    Ref since = op2(dag, OP_SUB, c.local, keys_pick_number(&table, starts));
    table.s = op2(dag, OP_DIV, since, keys_pick_number(&table, lengths));
    return table;
}

Ref keys_pick_number(const KeysTable *table, const double *numbers) {
    return dag_table_op(table->dag, OP_TABLE, table->index, numbers, table->n);
}

// A balanced tree of choices, for what is not constant.
static Ref choose(const KeysTable *table, const Ref *refs, uint32_t lo, uint32_t hi) {
    if (hi - lo == 1) {
        return refs[lo];
    }
    uint32_t middle = lo + (hi - lo) / 2;
    Ref is_low = op2(table->dag, OP_LT, table->index, dag_const(table->dag, middle));
    return dag_op(table->dag, OP_SELECT, is_low, choose(table, refs, lo, middle),
                  choose(table, refs, middle, hi));
}

Ref keys_pick(const KeysTable *table, const Ref *refs) {
    double *numbers = ARENA_ARRAY(table->scratch, table->n, double);
    for (uint32_t i = 0; i < table->n; i++) {
        if (!dag_is_const(table->dag, refs[i], &numbers[i])) {
            return choose(table, refs, 0, table->n);
        }
    }
    return keys_pick_number(table, numbers);
}

// --- Speeds at keys ---

static bool is_step(const Keys *keys, uint32_t span) {
    return keys->modes[span].curve == KEYS_STEP;
}

KeysNeighbours keys_neighbours(const KeysTable *table, uint32_t key, bool is_out) {
    const Keys *keys = table->keys;
    uint32_t last = keys->n - 1;
    bool has_before = key > 0 || table->is_closed, has_after = key < last || table->is_closed;
    KeysNeighbours r = {.before = key > 0 ? key - 1 : last - 1, .after = key < last ? key : 0};
    has_before = has_before && (!is_out || !is_step(keys, r.before));
    has_after = has_after && (is_out || !is_step(keys, r.after));
    double before = keys_span(keys, r.before), after = keys_span(keys, r.after);
    if (has_before && has_after) { // the slope of the parabola through three keys
        r.weight_before = after / (before + after);
        r.weight_after = before / (before + after);
    } else {
        r.weight_before = !has_after;
        r.weight_after = has_after;
    }
    return r;
}
