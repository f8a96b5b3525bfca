// SPDX-License-Identifier: Apache-2.0
// The scalars of time at whose steps a motion may jump or bend.
#include "lang/dag_nodes.h"

#include <stdlib.h>

enum { CLOCKS = 1u << IN_T | 1u << IN_FILM_T };
enum { LOOPS = 1u << IN_LOOP0 | 1u << IN_LOOP1 | 1u << IN_LOOP2 | 1u << IN_LOOP3 };

typedef struct {
    Ref *refs;
    size_t n, capacity;
} RefList;

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static bool has_fact(const Dag *dag, Ref ref, uint8_t fact) {
    return (dag->nodes[ref].facts & fact) != 0;
}

static bool is_motion_of_time(const Dag *dag, Ref ref) {
    uint32_t inputs = dag_inputs(dag, ref);
    return (inputs & CLOCKS) && !(inputs & ~(uint32_t)(CLOCKS | LOOPS));
}

static void add_break(Dag *dag, Arena *arena, RefList *list, Ref ref) {
    if (is_motion_of_time(dag, ref)) {
        list->refs = arena_grow(arena, list->refs, list->n, &list->capacity, sizeof *list->refs);
        list->refs[list->n++] = ref;
    }
}

static Ref is_below_zero(Dag *dag, Ref a) {
    return op2(dag, OP_LT, a, dag_const(dag, 0));
}

// A condition that is no truth value changes where its number passes 0. Whole numbers, and truth is
// one, change only where something below them does.
static void add_condition(Dag *dag, Arena *arena, RefList *list, Ref a) {
    if (!has_fact(dag, a, FACT_INTEGER)) {
        add_break(dag, arena, list, is_below_zero(dag, a));
    }
}

static void add_comparison(Dag *dag, Arena *arena, RefList *list, Ref a, Ref b, Op op) {
    if (!has_fact(dag, a, FACT_INTEGER) || !has_fact(dag, b, FACT_INTEGER)) {
        add_break(dag, arena, list, op2(dag, op, a, b));
    }
}

// Where the divisor passes 0 the quotient jumps from one infinity to the other.
static void add_pole(Dag *dag, Arena *arena, RefList *list, Ref divisor) {
    if (!has_fact(dag, divisor, FACT_POSITIVE)) {
        add_break(dag, arena, list, is_below_zero(dag, divisor));
    }
}

static const double inverse_pi = 0.318309886183790671538;

static void add_breaks_of(Dag *dag, Arena *arena, RefList *list, Ref self) {
    DagNode node = dag->nodes[self];
    Ref a = node.a, b = node.b;
    switch ((Op)node.op) {
    case OP_FLOOR:
        add_break(dag, arena, list, a);
        break;
    case OP_CEIL:
        add_break(dag, arena, list, op1(dag, OP_NEG, a));
        break;
    case OP_ROUND:
        add_break(dag, arena, list, op2(dag, OP_ADD, a, dag_const(dag, 0.5)));
        break;
    case OP_MOD:
        add_break(dag, arena, list, op2(dag, OP_DIV, a, b));
        break;
    case OP_SEARCH:
        if (node.c != MARK_UNSEEN) {
            add_break(dag, arena, list, self);
        }
        break;
    case OP_TABLE: // a is rounded down
        if (!has_fact(dag, a, FACT_INTEGER)) {
            add_break(dag, arena, list, a);
        }
        break;
    case OP_SIGN:
        add_break(dag, arena, list, self);
        break;
    case OP_ABS:
        add_condition(dag, arena, list, a);
        break;
    case OP_LT:
    case OP_LE:
        add_comparison(dag, arena, list, a, b, (Op)node.op);
        break;
    case OP_EQ:
    case OP_MIN:
    case OP_MAX:
        add_comparison(dag, arena, list, a, b, OP_LT);
        break;
    case OP_NOT:
    case OP_SELECT:
        add_condition(dag, arena, list, a);
        break;
    case OP_AND:
    case OP_OR:
        add_condition(dag, arena, list, a);
        add_condition(dag, arena, list, b);
        break;
    case OP_DIV:
        add_pole(dag, arena, list, b);
        break;
    case OP_TAN: // poles at odd quarter turns
        add_break(
            dag, arena, list,
            op2(dag, OP_ADD, op2(dag, OP_MUL, a, dag_const(dag, inverse_pi)), dag_const(dag, 0.5)));
        break;
    case OP_ATAN2: // the cut: y changes its sign where x is negative
        add_break(dag, arena, list, op2(dag, OP_AND, is_below_zero(dag, a), is_below_zero(dag, b)));
        break;
    default:
        break;
    }
}

static int compare_refs(const void *x, const void *y) {
    Ref a = *(const Ref *)x, b = *(const Ref *)y;
    return (a > b) - (a < b);
}

uint32_t dag_breaks(Dag *dag, const Ref *roots, uint32_t n_roots, Ref *out, uint32_t max) {
    dag_walk(dag, roots, n_roots, CLOCKS);
    Arena scratch = {0};
    RefList list = {0};
    for (uint32_t i = 0; i < dag->walk->n_order; i++) {
        add_breaks_of(dag, &scratch, &list, dag->walk->order[i]);
    }
    if (list.n) {
        qsort(list.refs, list.n, sizeof *list.refs, compare_refs);
    }
    uint32_t n = 0;
    for (size_t i = 0; i < list.n; i++) {
        if (i > 0 && list.refs[i] == list.refs[i - 1]) {
            continue;
        }
        if (n < max) {
            out[n] = list.refs[i];
        }
        n++;
    }
    arena_free(&scratch);
    return n;
}
