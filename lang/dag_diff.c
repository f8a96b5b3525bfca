// SPDX-License-Identifier: Apache-2.0
// Rates of change: forward differentiation over the graph.
//
// NOISE and HASH are opaque: along the direction in which their operands move, a central
// difference is built, (f(a + h a', ...) - f(a - h a', ...)) / 2h, whose error is of second order
// in h like that of (f(t + h) - f(t - h)) / 2h, at the cost of two evaluations and no copy of what
// lies below.
#include "lang/dag_nodes.h"

// One node being differentiated: its operands a, b, c and their rates da, db, dc.
typedef struct {
    Dag *dag;
    Ref self, a, b, c, da, db, dc;
    double step;
} Rate;

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref add(Dag *dag, Ref a, Ref b) {
    return op2(dag, OP_ADD, a, b);
}

static Ref sub(Dag *dag, Ref a, Ref b) {
    return op2(dag, OP_SUB, a, b);
}

static Ref divide(Dag *dag, Ref a, Ref b) {
    return op2(dag, OP_DIV, a, b);
}

static bool is_zero(const Dag *dag, Ref ref) {
    double x;
    return dag_is_const(dag, ref, &x) && x == 0;
}

// A product with a rate that is 0 for sure is 0, even where the other factor is infinite: what
// does not change contributes nothing.
static Ref times_rate(Dag *dag, Ref factor, Ref rate) {
    return is_zero(dag, rate) ? rate : op2(dag, OP_MUL, factor, rate);
}

static Ref divide_rate(Dag *dag, Ref rate, Ref by) {
    return is_zero(dag, rate) ? rate : divide(dag, rate, by);
}

static Ref select3(Dag *dag, Ref condition, Ref then, Ref otherwise) {
    return dag_op(dag, OP_SELECT, condition, then, otherwise);
}

// rate / by, where `by` may be 0 at the end of a function's domain: what rests there, a clamped
// argument say, has rate 0 and not 0/0.
static Ref divide_rate_or_rest(Dag *dag, Ref rate, Ref by) {
    Ref zero = dag_const(dag, 0);
    return select3(dag, op2(dag, OP_EQ, rate, zero), zero, divide_rate(dag, rate, by));
}

// (a' - q b') / b, where q = a/b is the node itself.
static Ref rate_div(const Rate *r) {
    Ref numerator = sub(r->dag, r->da, times_rate(r->dag, r->self, r->db));
    return divide_rate(r->dag, numerator, r->b);
}

// a' - b' floor(a/b)
static Ref rate_mod(const Rate *r) {
    Ref turns = op1(r->dag, OP_FLOOR, divide(r->dag, r->a, r->b));
    return sub(r->dag, r->da, times_rate(r->dag, turns, r->db));
}

// b a^(b-1) a' + a^b ln(a) b'; the second term is 0 where a is 0.
static Ref rate_pow(const Rate *r) {
    Dag *dag = r->dag;
    Ref less = op2(dag, OP_POW, r->a, sub(dag, r->b, dag_const(dag, 1)));
    Ref base = times_rate(dag, op2(dag, OP_MUL, r->b, less), r->da);
    if (is_zero(dag, r->db)) {
        return base;
    }
    Ref zero = dag_const(dag, 0);
    Ref grown = op2(dag, OP_MUL, r->self, op1(dag, OP_LOG, r->a));
    Ref factor = select3(dag, op2(dag, OP_EQ, r->a, zero), zero, grown);
    return add(dag, base, times_rate(dag, factor, r->db));
}

// From the right: at 0 the rate of |a| is |a'|.
static Ref rate_abs(const Rate *r) {
    Dag *dag = r->dag;
    Ref zero = dag_const(dag, 0);
    Ref kink = select3(dag, op2(dag, OP_EQ, r->a, zero), op1(dag, OP_ABS, r->da), r->da);
    return select3(dag, op2(dag, OP_LT, r->a, zero), op1(dag, OP_NEG, r->da), kink);
}

// From the right: where a and b meet, the one that will be the smaller (the larger) is followed.
static Ref rate_min_max(const Rate *r, Op op) {
    Dag *dag = r->dag;
    if (r->da == r->db) {
        return r->da;
    }
    Ref first = op == OP_MIN ? op2(dag, OP_LT, r->a, r->b) : op2(dag, OP_LT, r->b, r->a);
    Ref meet = op2(dag, op, r->da, r->db);
    return select3(dag, op2(dag, OP_EQ, r->a, r->b), meet, select3(dag, first, r->da, r->db));
}

// (a a' + b b') / h, as products of numbers up to 1; from the right where both are 0.
static Ref rate_hypot(const Rate *r) {
    Dag *dag = r->dag;
    Ref along_a = times_rate(dag, divide(dag, r->a, r->self), r->da);
    Ref along_b = times_rate(dag, divide(dag, r->b, r->self), r->db);
    Ref away = op2(dag, OP_HYPOT, r->da, r->db);
    Ref at_zero = op2(dag, OP_EQ, r->self, dag_const(dag, 0));
    return select3(dag, at_zero, away, add(dag, along_a, along_b));
}

// y = a, x = b: (x y' - y x') / h^2, without overflow.
static Ref rate_atan2(const Rate *r) {
    Dag *dag = r->dag;
    Ref h = op2(dag, OP_HYPOT, r->a, r->b);
    Ref up = times_rate(dag, divide(dag, r->b, h), r->da);
    Ref across = times_rate(dag, divide(dag, r->a, h), r->db);
    return divide_rate(dag, sub(dag, up, across), h);
}

// a' / sqrt((1 - a)(1 + a)), which keeps its digits near the ends.
static Ref rate_asin(const Rate *r) {
    Dag *dag = r->dag;
    Ref one = dag_const(dag, 1);
    Ref square = op2(dag, OP_MUL, sub(dag, one, r->a), add(dag, one, r->a));
    return divide_rate_or_rest(dag, r->da, op1(dag, OP_SQRT, square));
}

static Ref one_plus_square(Dag *dag, Ref x) {
    return add(dag, dag_const(dag, 1), op2(dag, OP_MUL, x, x));
}

static Ref moved(const Rate *r, double step, Op op) {
    Dag *dag = r->dag;
    Ref h = dag_const(dag, step);
    Ref a = add(dag, r->a, times_rate(dag, h, r->da));
    Ref b = add(dag, r->b, times_rate(dag, h, r->db));
    Ref c = op_operands[op] > 2 ? add(dag, r->c, times_rate(dag, h, r->dc)) : REF_NONE;
    const DagNode self = dag->nodes[r->self];
    return dag_rebuild(dag, &self, (Ref[3]){a, b, c});
}

static Ref rate_opaque(const Rate *r, Op op) {
    Ref rise = sub(r->dag, moved(r, r->step, op), moved(r, -r->step, op));
    return divide(r->dag, rise, dag_const(r->dag, 2 * r->step));
}

static Ref rate_of(const Rate *r, Op op) {
    Dag *dag = r->dag;
    Ref a = r->a, b = r->b, da = r->da, db = r->db;
    switch (op) {
    case OP_ADD:
        return add(dag, da, db);
    case OP_SUB:
        return sub(dag, da, db);
    case OP_MUL:
        return add(dag, times_rate(dag, b, da), times_rate(dag, a, db));
    case OP_DIV:
        return rate_div(r);
    case OP_MOD:
        return rate_mod(r);
    case OP_POW:
        return rate_pow(r);
    case OP_NEG:
        return op1(dag, OP_NEG, da);
    case OP_ABS:
        return rate_abs(r);
    case OP_SQRT:
        return divide_rate_or_rest(dag, da, op2(dag, OP_MUL, dag_const(dag, 2), r->self));
    case OP_EXP:
        return times_rate(dag, r->self, da);
    case OP_LOG:
        return divide_rate(dag, da, a);
    case OP_SIN:
        return times_rate(dag, op1(dag, OP_COS, a), da);
    case OP_COS:
        return op1(dag, OP_NEG, times_rate(dag, op1(dag, OP_SIN, a), da));
    case OP_TAN:
        return times_rate(dag, one_plus_square(dag, r->self), da);
    case OP_ASIN:
        return rate_asin(r);
    case OP_ACOS:
        return op1(dag, OP_NEG, rate_asin(r));
    case OP_ATAN:
        return divide_rate(dag, da, one_plus_square(dag, a));
    case OP_ATAN2:
        return rate_atan2(r);
    case OP_HYPOT:
        return rate_hypot(r);
    case OP_MIN:
    case OP_MAX:
        return rate_min_max(r, op);
    case OP_SELECT:
        return select3(dag, a, db, r->dc);
    case OP_HASH:
    case OP_NOISE:
    case OP_IMAGE:
        return rate_opaque(r, op);
    default: // steps: constant wherever they have a rate
        return dag_const(dag, 0);
    }
}

static bool is_opaque(Op op) {
    return op == OP_HASH || op == OP_NOISE || op == OP_IMAGE;
}

Ref dag_diff(Dag *dag, Ref ref, Input input, double step, bool *opaque) {
    uint32_t mask = 1u << input;
    Ref zero = dag_const(dag, 0), one = dag_const(dag, 1);
    if (!(dag_inputs(dag, ref) & mask)) {
        return zero;
    }
    dag_walk(dag, &ref, 1, mask);
    DagWalk *w = dag->walk;
    for (uint32_t i = 0; i < w->n_order; i++) {
        Ref self = w->order[i];
        DagNode node = dag->nodes[self]; // a copy: building moves the nodes
        Op op = (Op)node.op;
        Ref operands[3], rate[3] = {zero, zero, zero};
        uint32_t arity = dag_node_operands(&node, operands);
        bool changes = false;
        for (uint32_t k = 0; k < arity; k++) {
            if (dag_walk_visited(dag, operands[k])) {
                rate[k] = w->image[operands[k]];
            }
            changes = changes || rate[k] != zero;
        }
        Rate r = {dag,     self,    operands[0], operands[1], operands[2],
                  rate[0], rate[1], rate[2],     step};
        if (op == OP_INPUT) {
            w->image[self] = one;
        } else if (!changes) {
            w->image[self] = zero;
        } else {
            w->image[self] = rate_of(&r, op);
            if (is_opaque(op) && opaque) {
                *opaque = true;
            }
        }
    }
    return w->image[ref];
}
