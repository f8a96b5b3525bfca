// SPDX-License-Identifier: Apache-2.0
// The graph of scalars: hash-consing, folding, simplification.
//
// What simplification may do: the result has the same bits as the operations written, except that
// the sign of a zero may change (x + 0 is x), and that a power with a small whole exponent is a
// product, always, so that folding and computing still agree.
#include "lang/dag.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "lang/dag_nodes.h"

enum { SLOTS_FIRST = 1024 };

static uint32_t mix(uint32_t h, uint32_t k) {
    h = (h ^ k) * 0x9e3779b1u;
    return h ^ h >> 15;
}

static uint32_t hash_node(const DagNode *n) {
    uint32_t h = mix(mix(mix(mix(n->op, n->a), n->b), n->c), 0x85ebca6bu);
    return h;
}

Dag *dag_new(Arena *arena) {
    Dag *dag = ARENA_NEW(arena, Dag);
    dag->arena = arena;
    dag->walk = ARENA_NEW(arena, DagWalk);
    dag->substitution = ARENA_NEW(arena, DagSubstitution);
    return dag;
}

uint32_t dag_n_nodes(const Dag *dag) {
    return (uint32_t)dag->n_nodes;
}

uint32_t dag_inputs(const Dag *dag, Ref ref) {
    return dag->nodes[ref].inputs;
}

bool dag_is_const(const Dag *dag, Ref ref, double *value) {
    const DagNode *n = &dag->nodes[ref];
    if (n->op != OP_CONST) {
        return false;
    }
    if (value) {
        *value = dag_node_value(n);
    }
    return true;
}

bool dag_is_finite(const Dag *dag, Ref ref) {
    return dag->nodes[ref].bound != BOUND_NONE;
}

static bool has_fact(const Dag *dag, Ref ref, uint8_t fact) {
    return (dag->nodes[ref].facts & fact) != 0;
}

// --- Hash-consing ---

static bool same_node(const DagNode *x, const DagNode *y) {
    return x->op == y->op && x->a == y->a && x->b == y->b && x->c == y->c;
}

static void grow_slots(Dag *dag) {
    size_t n = dag->n_slots ? dag->n_slots * 2 : SLOTS_FIRST;
    Ref *slots = ARENA_ARRAY(dag->arena, n, Ref);
    memset(slots, 0xff, n * sizeof *slots);
    for (Ref r = 0; r < dag->n_nodes; r++) {
        size_t i = hash_node(&dag->nodes[r]) & (n - 1);
        while (slots[i] != REF_NONE) {
            i = (i + 1) & (n - 1);
        }
        slots[i] = r;
    }
    dag->slots = slots;
    dag->n_slots = n;
}

static uint32_t inputs_of(const Dag *dag, const DagNode *n) {
    if (n->op == OP_INPUT) {
        return 1u << n->a;
    }
    Ref operands[3];
    uint32_t inputs = 0, arity = dag_node_operands(n, operands);
    for (uint32_t k = 0; k < arity; k++) {
        inputs |= dag->nodes[operands[k]].inputs;
    }
    return inputs;
}

static Ref intern(Dag *dag, Op op, Ref a, Ref b, Ref c) {
    if ((dag->n_nodes + 1) * 2 > dag->n_slots) {
        grow_slots(dag);
    }
    DagNode node = {.op = (uint8_t)op, .a = a, .b = b, .c = c};
    size_t i = hash_node(&node) & (dag->n_slots - 1);
    for (; dag->slots[i] != REF_NONE; i = (i + 1) & (dag->n_slots - 1)) {
        if (same_node(&dag->nodes[dag->slots[i]], &node)) {
            return dag->slots[i];
        }
    }
    node.inputs = inputs_of(dag, &node);
    node.facts = dag_node_facts(dag, &node);
    node.bound = dag_node_bound(dag, &node);
    dag->nodes =
        arena_grow(dag->arena, dag->nodes, dag->n_nodes, &dag->nodes_capacity, sizeof node);
    dag->nodes[dag->n_nodes] = node;
    dag->slots[i] = (Ref)dag->n_nodes;
    return (Ref)dag->n_nodes++;
}

Ref dag_const(Dag *dag, double value) {
    uint64_t bits = 0x7ff8000000000000u; // one NaN stands for all
    if (!isnan(value)) {
        memcpy(&bits, &value, sizeof bits);
    }
    return intern(dag, OP_CONST, (uint32_t)bits, (uint32_t)(bits >> 32), REF_NONE);
}

Ref dag_input(Dag *dag, Input input) {
    return intern(dag, OP_INPUT, (Ref)input, REF_NONE, REF_NONE);
}

// --- Tables ---

static uint32_t hash_values(const double *values, uint32_t n) {
    uint32_t h = n;
    for (uint32_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        h = mix(mix(h, (uint32_t)bits), (uint32_t)(bits >> 32));
    }
    return h;
}

static void grow_table_slots(Dag *dag) {
    size_t n = dag->n_table_slots ? dag->n_table_slots * 2 : 64;
    uint32_t *slots = ARENA_ARRAY(dag->arena, n, uint32_t);
    memset(slots, 0xff, n * sizeof *slots);
    for (uint32_t t = 0; t < dag->n_tables; t++) {
        if (dag->tables[t].is_lasting) {
            continue;
        }
        size_t i = hash_values(dag->tables[t].values, dag->tables[t].n) & (n - 1);
        while (slots[i] != REF_NONE) {
            i = (i + 1) & (n - 1);
        }
        slots[i] = t;
    }
    dag->table_slots = slots;
    dag->n_table_slots = n;
}

static uint32_t add_table(Dag *dag, ProgramTable table) {
    dag->tables = arena_grow(dag->arena, dag->tables, dag->n_tables, &dag->tables_capacity,
                             sizeof *dag->tables);
    dag->bounds = arena_grow(dag->arena, dag->bounds, dag->n_tables, &dag->bounds_capacity,
                             sizeof *dag->bounds);
    dag->bounds[dag->n_tables] = table.live || table.image ? BOUND_NONE : dag_table_bound(&table);
    dag->tables[dag->n_tables] = table;
    return (uint32_t)dag->n_tables++;
}

static uint32_t intern_table(Dag *dag, const double *values, uint32_t n) {
    if ((dag->n_tables + 1) * 2 > dag->n_table_slots) {
        grow_table_slots(dag);
    }
    size_t size = n * sizeof *values;
    size_t i = hash_values(values, n) & (dag->n_table_slots - 1);
    for (; dag->table_slots[i] != REF_NONE; i = (i + 1) & (dag->n_table_slots - 1)) {
        const ProgramTable *t = &dag->tables[dag->table_slots[i]];
        if (t->n == n && memcmp(t->values, values, size) == 0) {
            return dag->table_slots[i];
        }
    }
    double *copy = ARENA_ARRAY(dag->arena, n, double);
    memcpy(copy, values, size);
    dag->table_slots[i] = (uint32_t)dag->n_tables;
    return add_table(dag, (ProgramTable){copy, n, false, 0});
}

static uint32_t search(const double *values, uint32_t n, double x) {
    uint32_t lo = 0, hi = n; // values[lo] <= x < values[hi], as far as such exist
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (values[mid] <= x) {
            lo = mid;
        } else {
            hi = mid;
        }
    }
    return lo;
}

static bool all_equal(const double *values, uint32_t n) {
    for (uint32_t i = 1; i < n; i++) {
        if (memcmp(&values[i], &values[0], sizeof *values) != 0) {
            return false;
        }
    }
    return true;
}

// REF_NONE: it is not known.
static Ref fold_table(Dag *dag, Op op, Ref a, const double *values, uint32_t n) {
    double x;
    if (!dag_is_const(dag, a, &x)) {
        return REF_NONE;
    }
    if (op == OP_SEARCH) {
        return dag_const(dag, search(values, n, x));
    }
    return dag_const(dag, values[x >= n - 1 ? n - 1 : x >= 1 ? (uint32_t)x : 0]);
}

static Ref table_op(Dag *dag, Op op, Ref a, const double *values, uint32_t n, Ref mark) {
    if (op == OP_TABLE && all_equal(values, n)) {
        return dag_const(dag, values[0]);
    }
    if (op == OP_SEARCH && n == 1) {
        return dag_const(dag, 0);
    }
    Ref known = fold_table(dag, op, a, values, n);
    return known != REF_NONE ? known : intern(dag, op, a, intern_table(dag, values, n), mark);
}

Ref dag_column(Dag *dag, Ref a, const double *values, uint32_t n) {
    if (all_equal(values, n)) {
        return dag_const(dag, values[0]);
    }
    Ref known = fold_table(dag, OP_TABLE, a, values, n);
    return known != REF_NONE
               ? known
               : intern(dag, OP_TABLE, a, add_table(dag, (ProgramTable){values, n, true, 0, NULL}),
                        REF_NONE);
}

Ref dag_live(Dag *dag, Ref a, const double *values, uint32_t n, uint32_t which) {
    ProgramTable table = {values, n, true, which + 1, NULL};
    return intern(dag, OP_TABLE, a, add_table(dag, table), REF_NONE);
}

Ref dag_image(Dag *dag, Ref s, Ref t, const ProgramImage *image, uint32_t channel) {
    uint32_t table = 0;
    while (table < dag->n_tables &&
           (dag->tables[table].image != image || dag->tables[table].n != channel)) {
        table++;
    }
    if (table == dag->n_tables) {
        table = add_table(dag, (ProgramTable){NULL, channel, true, 0, image});
    }
    return intern(dag, OP_IMAGE, s, t, table);
}

Ref dag_table_op(Dag *dag, Op op, Ref a, const double *values, uint32_t n) {
    return table_op(dag, op, a, values, n, REF_NONE);
}

Ref dag_search_unseen(Dag *dag, Ref a, const double *values, uint32_t n) {
    return table_op(dag, OP_SEARCH, a, values, n, MARK_UNSEEN);
}

// --- Simplification: each returns REF_NONE where it has nothing to say ---

static bool is_value(const Dag *dag, Ref ref, double value) {
    double x;
    return dag_is_const(dag, ref, &x) && x == value;
}

static bool is_op(const Dag *dag, Ref ref, Op op) {
    return dag->nodes[ref].op == op;
}

static Ref negate(Dag *dag, Ref a) {
    return dag_op(dag, OP_NEG, a, REF_NONE, REF_NONE);
}

static Ref simplify_add(Dag *dag, Ref a, Ref b) {
    if (is_value(dag, a, 0)) {
        return b;
    }
    if (is_value(dag, b, 0)) {
        return a;
    }
    if (is_op(dag, b, OP_NEG)) {
        return dag_op(dag, OP_SUB, a, dag->nodes[b].a, REF_NONE);
    }
    if (is_op(dag, a, OP_NEG)) {
        return dag_op(dag, OP_SUB, b, dag->nodes[a].a, REF_NONE);
    }
    return REF_NONE;
}

static Ref simplify_sub(Dag *dag, Ref a, Ref b) {
    if (is_value(dag, b, 0)) {
        return a;
    }
    if (is_value(dag, a, 0)) {
        return negate(dag, b);
    }
    if (a == b && dag_is_finite(dag, a)) {
        return dag_const(dag, 0);
    }
    if (is_op(dag, b, OP_NEG)) {
        return dag_op(dag, OP_ADD, a, dag->nodes[b].a, REF_NONE);
    }
    return REF_NONE;
}

// One order of the operands; the other is tried by the caller.
static Ref simplify_scale(Dag *dag, Ref a, Ref b) {
    double k;
    if (!dag_is_const(dag, b, &k)) {
        return REF_NONE;
    }
    if (k == 0 && dag_is_finite(dag, a)) {
        return dag_const(dag, 0);
    }
    if (k == 1) {
        return a;
    }
    if (k == -1) {
        return negate(dag, a);
    }
    if (is_op(dag, a, OP_NEG)) {
        return dag_op(dag, OP_MUL, dag->nodes[a].a, dag_const(dag, -k), REF_NONE);
    }
    return REF_NONE;
}

static Ref simplify_mul(Dag *dag, Ref a, Ref b) {
    Ref r = simplify_scale(dag, a, b);
    r = r != REF_NONE ? r : simplify_scale(dag, b, a);
    if (r == REF_NONE && is_op(dag, a, OP_NEG) && is_op(dag, b, OP_NEG)) {
        r = dag_op(dag, OP_MUL, dag->nodes[a].a, dag->nodes[b].a, REF_NONE);
    }
    return r;
}

static Ref simplify_div(Dag *dag, Ref a, Ref b) {
    double k;
    int exponent;
    if (!dag_is_const(dag, b, &k) || !isfinite(k)) {
        return REF_NONE;
    }
    // Division by a power of two is a product, exactly.
    if (fabs(frexp(k, &exponent)) == 0.5 && exponent > -1000 && exponent < 1000) {
        return dag_op(dag, OP_MUL, a, dag_const(dag, 1 / k), REF_NONE);
    }
    return REF_NONE;
}

// Small whole powers are products: faster, and exact for squares.
static Ref simplify_pow(Dag *dag, Ref a, Ref b) {
    double k;
    if (!dag_is_const(dag, b, &k)) {
        return REF_NONE;
    }
    if (k == 0) {
        return dag_const(dag, 1);
    }
    if (k == 1) {
        return a;
    }
    if (k == 2) {
        return dag_op(dag, OP_MUL, a, a, REF_NONE);
    }
    if (k == 3) {
        return dag_op(dag, OP_MUL, dag_op(dag, OP_MUL, a, a, REF_NONE), a, REF_NONE);
    }
    if (k == -1) {
        return dag_op(dag, OP_DIV, dag_const(dag, 1), a, REF_NONE);
    }
    return REF_NONE;
}

static Ref truth_of(Dag *dag, Ref a) {
    if (has_fact(dag, a, FACT_TRUTH)) {
        return a;
    }
    Ref not = dag_op(dag, OP_NOT, a, REF_NONE, REF_NONE);
    return dag_op(dag, OP_NOT, not, REF_NONE, REF_NONE);
}

static Ref simplify_logic(Dag *dag, Op op, Ref a, Ref b) {
    double k;
    if (dag_is_const(dag, a, &k) || dag_is_const(dag, b, &k)) {
        Ref other = dag_is_const(dag, a, NULL) ? b : a;
        bool decides = (op == OP_AND) == (k == 0);
        return decides ? dag_const(dag, op == OP_OR) : truth_of(dag, other);
    }
    return a == b ? truth_of(dag, a) : REF_NONE;
}

static Ref simplify_unary(Dag *dag, Op op, Ref a) {
    switch (op) {
    case OP_NEG:
        if (is_op(dag, a, OP_NEG)) {
            return dag->nodes[a].a;
        }
        if (is_op(dag, a, OP_SUB)) {
            return dag_op(dag, OP_SUB, dag->nodes[a].b, dag->nodes[a].a, REF_NONE);
        }
        return REF_NONE;
    case OP_ABS:
        if (is_op(dag, a, OP_NEG)) {
            return dag_op(dag, OP_ABS, dag->nodes[a].a, REF_NONE, REF_NONE);
        }
        return has_fact(dag, a, FACT_POSITIVE) ? a : REF_NONE;
    case OP_FLOOR:
    case OP_CEIL:
        return has_fact(dag, a, FACT_INTEGER) ? a : REF_NONE;
    case OP_NOT:
        if (is_op(dag, a, OP_NOT) && has_fact(dag, dag->nodes[a].a, FACT_TRUTH)) {
            return dag->nodes[a].a;
        }
        return REF_NONE;
    default:
        return REF_NONE;
    }
}

static Ref simplify_same(Dag *dag, Op op, Ref a) {
    switch (op) {
    case OP_MIN:
    case OP_MAX:
        return a;
    case OP_LT:
        return dag_const(dag, 0);
    case OP_LE:
    case OP_EQ:
        return dag_is_finite(dag, a) ? dag_const(dag, 1) : REF_NONE;
    default:
        return REF_NONE;
    }
}

static Ref simplify_select(Dag *dag, Ref a, Ref b, Ref c) {
    double k;
    if (dag_is_const(dag, a, &k)) {
        return k != 0 ? b : c;
    }
    if (b == c) {
        return b;
    }
    if (is_op(dag, a, OP_NOT)) {
        return dag_op(dag, OP_SELECT, dag->nodes[a].a, c, b);
    }
    return REF_NONE;
}

static Ref simplify(Dag *dag, Op op, Ref a, Ref b, Ref c) {
    switch (op) {
    case OP_ADD:
        return simplify_add(dag, a, b);
    case OP_SUB:
        return simplify_sub(dag, a, b);
    case OP_MUL:
        return simplify_mul(dag, a, b);
    case OP_DIV:
        return simplify_div(dag, a, b);
    case OP_AND:
    case OP_OR:
        return simplify_logic(dag, op, a, b);
    case OP_SELECT:
        return simplify_select(dag, a, b, c);
    default:
        if (op_operands[op] == 1) {
            return simplify_unary(dag, op, a);
        }
        return a == b ? simplify_same(dag, op, a) : REF_NONE;
    }
}

static bool is_commutative(Op op) {
    return op == OP_ADD || op == OP_MUL || op == OP_EQ || op == OP_AND || op == OP_OR;
}

static bool all_const(const Dag *dag, const Ref *operands, uint32_t n, double value[3]) {
    for (uint32_t k = 0; k < n; k++) {
        if (!dag_is_const(dag, operands[k], &value[k])) {
            return false;
        }
    }
    return true;
}

Ref dag_op(Dag *dag, Op op, Ref a, Ref b, Ref c) {
    assert(op_operands[op] > 0 && op != OP_SEARCH && op != OP_TABLE && op != OP_IMAGE);
    b = op_operands[op] > 1 ? b : REF_NONE;
    c = op_operands[op] > 2 ? c : REF_NONE;
    Ref operands[3] = {a, b, c};
    double value[3] = {0};
    if (op == OP_POW) {
        Ref r = simplify_pow(dag, a, b);
        if (r != REF_NONE) {
            return r;
        }
    }
    if (all_const(dag, operands, op_operands[op], value)) {
        return dag_const(dag, program_fold(op, value[0], value[1], value[2]));
    }
    Ref r = simplify(dag, op, a, b, c);
    if (r != REF_NONE) {
        return r;
    }
    if (is_commutative(op) && b < a) {
        return intern(dag, op, b, a, c);
    }
    return intern(dag, op, a, b, c);
}

Ref dag_rebuild(Dag *dag, const DagNode *node, const Ref operands[3]) {
    if (node->op == OP_IMAGE) {
        return intern(dag, OP_IMAGE, operands[0], operands[1], node->c);
    }
    if (node->op == OP_SEARCH || node->op == OP_TABLE) {
        ProgramTable table = dag->tables[node->b];
        Ref known = table.live ? REF_NONE
                               : fold_table(dag, (Op)node->op, operands[0], table.values, table.n);
        // What follows from its values alone was found when the table was first used.
        return known != REF_NONE ? known : intern(dag, (Op)node->op, operands[0], node->b, node->c);
    }
    return dag_op(dag, (Op)node->op, operands[0], operands[1], operands[2]);
}
