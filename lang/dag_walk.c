// SPDX-License-Identifier: Apache-2.0
// Walks over the graph of scalars: visiting, substitution, compilation.
#include "lang/dag_nodes.h"

#include <string.h>

// Marks of the walk numbered e: e for a visited node, e - 1 for one whose operands are on the way.
enum { EPOCH_STEP = 2 };

static void prepare(const Dag *dag) {
    DagWalk *w = dag->walk;
    if (w->mark_capacity < dag->n_nodes) {
        // New marks are zero, and all walks before count as none.
        w->mark_capacity = dag->nodes_capacity;
        w->mark = ARENA_ARRAY(dag->arena, w->mark_capacity, uint32_t);
        w->image = ARENA_ARRAY(dag->arena, w->mark_capacity, Ref);
        w->epoch = 0;
    }
    if (w->epoch > UINT32_MAX - 2 * EPOCH_STEP) {
        memset(w->mark, 0, w->mark_capacity * sizeof *w->mark);
        w->epoch = 0;
    }
    w->epoch += EPOCH_STEP;
    w->n_order = 0;
}

static void push(const Dag *dag, size_t *n, Ref ref) {
    DagWalk *w = dag->walk;
    w->stack = arena_grow(dag->arena, w->stack, *n, &w->stack_capacity, sizeof *w->stack);
    w->stack[(*n)++] = ref;
}

static void emit(const Dag *dag, Ref ref) {
    DagWalk *w = dag->walk;
    w->order = arena_grow(dag->arena, w->order, w->n_order, &w->order_capacity, sizeof *w->order);
    w->order[w->n_order++] = ref;
}

void dag_walk(const Dag *dag, const Ref *roots, size_t n_roots, uint32_t mask) {
    prepare(dag);
    DagWalk *w = dag->walk;
    size_t n = 0;
    for (size_t i = n_roots; i-- > 0;) {
        if (!mask || dag->nodes[roots[i]].inputs & mask) {
            push(dag, &n, roots[i]);
        }
    }
    while (n > 0) {
        Ref ref = w->stack[n - 1];
        if (w->mark[ref] >= w->epoch - 1) { // a second time on top: its operands are done
            n--;
            if (w->mark[ref] != w->epoch) {
                w->mark[ref] = w->epoch;
                emit(dag, ref);
            }
            continue;
        }
        w->mark[ref] = w->epoch - 1;
        Ref operands[3];
        uint32_t arity = dag_node_operands(&dag->nodes[ref], operands);
        for (uint32_t k = arity; k-- > 0;) {
            Ref o = operands[k];
            if (w->mark[o] < w->epoch - 1 && (!mask || dag->nodes[o].inputs & mask)) {
                push(dag, &n, o);
            }
        }
    }
}

// ---- Substitution

static bool goes_on(const DagSubstitution *s, const Input *inputs, const Ref *with, uint32_t n) {
    return s->n == n && memcmp(s->inputs, inputs, n * sizeof *inputs) == 0 &&
           memcmp(s->with, with, n * sizeof *with) == 0;
}

static DagSubstitution *substitution(Dag *dag, const Input *inputs, const Ref *with, uint32_t n) {
    DagSubstitution *s = dag->substitution;
    if (s->capacity < dag->n_nodes) {
        const DagSubstitution old = *s;
        s->capacity = dag->nodes_capacity;
        s->mark = ARENA_ARRAY(dag->arena, s->capacity, uint32_t);
        s->image = ARENA_ARRAY(dag->arena, s->capacity, Ref);
        if (old.capacity > 0) {
            memcpy(s->mark, old.mark, old.capacity * sizeof *s->mark);
            memcpy(s->image, old.image, old.capacity * sizeof *s->image);
        }
    }
    if (!goes_on(s, inputs, with, n)) {
        s->n = n;
        memcpy(s->inputs, inputs, n * sizeof *inputs);
        memcpy(s->with, with, n * sizeof *with);
        if (++s->epoch == 0) {
            memset(s->mark, 0, s->capacity * sizeof *s->mark);
            s->epoch = 1;
        }
    }
    return s;
}

static Ref replacement(const DagSubstitution *s, const DagNode *input) {
    for (uint32_t k = 0; k < s->n; k++) {
        if (input->a == (Ref)s->inputs[k]) {
            return s->with[k];
        }
    }
    return REF_NONE;
}

Ref dag_substitute_all(Dag *dag, Ref ref, const Input *inputs, const Ref *with, uint32_t n) {
    uint32_t mask = 0;
    for (uint32_t k = 0; k < n; k++) {
        mask |= 1u << inputs[k];
    }
    if (!(dag_inputs(dag, ref) & mask)) {
        return ref;
    }
    DagSubstitution *s = substitution(dag, inputs, with, n);
    size_t depth = 0;
    push(dag, &depth, ref);
    while (depth > 0) {
        const Ref top = dag->walk->stack[depth - 1];
        const size_t before = depth;
        const DagNode node = dag->nodes[top]; // a copy: building moves the nodes
        Ref operands[3];
        uint32_t arity = s->mark[top] == s->epoch ? 0 : dag_node_operands(&node, operands);
        for (uint32_t k = arity; k-- > 0;) {
            Ref o = operands[k];
            if (!(dag->nodes[o].inputs & mask)) {
                continue;
            }
            if (s->mark[o] != s->epoch) {
                push(dag, &depth, o);
            }
            operands[k] = s->image[o];
        }
        if (depth > before) { // the operands first
            continue;
        }
        depth--;
        if (s->mark[top] != s->epoch) {
            s->image[top] =
                node.op == OP_INPUT ? replacement(s, &node) : dag_rebuild(dag, &node, operands);
            s->mark[top] = s->epoch;
        }
    }
    return s->image[ref];
}

Ref dag_substitute(Dag *dag, Ref ref, Input input, Ref with) {
    return dag_substitute_all(dag, ref, &input, &with, 1);
}

static double const_value(const Dag *dag, Ref ref) {
    double value = 0;
    dag_is_const(dag, ref, &value);
    return value;
}

// Gives the tables that the walk met numbers of their own. Returns how many there are.
static uint32_t number_tables(const Dag *dag, uint32_t *number, ProgramTable *tables) {
    const DagWalk *w = dag->walk;
    uint32_t n = 0;
    memset(number, 0xff, dag->n_tables * sizeof *number);
    for (uint32_t i = 0; i < w->n_order; i++) {
        const DagNode *node = &dag->nodes[w->order[i]];
        if (dag_node_has_table(node) && number[dag_node_table(node)] == REF_NONE) {
            number[dag_node_table(node)] = n;
            tables[n++] = dag->tables[dag_node_table(node)];
        }
    }
    return n;
}

static Instr instr_of(const Dag *dag, Ref ref, const uint32_t *number) {
    const DagNode *node = &dag->nodes[ref];
    Instr instr = {.op = node->op};
    Ref operands[3];
    uint32_t arity = dag_node_operands(node, operands);
    uint32_t *fields[3] = {&instr.a, &instr.b, &instr.c};
    for (uint32_t k = 0; k < arity; k++) {
        *fields[k] = dag->walk->image[operands[k]];
    }
    if (node->op == OP_CONST) {
        instr.value = const_value(dag, ref);
    } else if (node->op == OP_INPUT) {
        instr.table = node->a;
    } else if (dag_node_has_table(node)) {
        instr.table = number[dag_node_table(node)];
    }
    return instr;
}

Program *dag_compile(const Dag *dag, Arena *arena, const Ref *roots, uint32_t n_roots) {
    dag_walk(dag, roots, n_roots, 0);
    DagWalk *w = dag->walk;
    Arena scratch = {0};
    uint32_t *number = ARENA_ARRAY(&scratch, dag->n_tables, uint32_t);
    ProgramTable *tables = ARENA_ARRAY(&scratch, dag->n_tables, ProgramTable);
    uint32_t n_tables = number_tables(dag, number, tables);
    Instr *code = ARENA_ARRAY(&scratch, w->n_order, Instr);
    uint32_t *out = ARENA_ARRAY(&scratch, n_roots, uint32_t);
    for (uint32_t i = 0; i < w->n_order; i++) {
        w->image[w->order[i]] = i; // here a node becomes its place in the code
        code[i] = instr_of(dag, w->order[i], number);
    }
    for (uint32_t i = 0; i < n_roots; i++) {
        out[i] = w->image[roots[i]];
    }
    Program *program = program_new(arena, code, w->n_order, out, n_roots, tables, n_tables);
    arena_free(&scratch);
    return program;
}
