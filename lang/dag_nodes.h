// SPDX-License-Identifier: Apache-2.0
// Inside of a Dag, shared by the files that build it (lang/dag.c) and walk it (lang/dag_*.c).
//
// Operands always precede the node that uses them, so the graph has no cycles. Graphs may be a
// million nodes deep: every walk keeps its own stack.
#ifndef LANG_DAG_NODES_H
#define LANG_DAG_NODES_H

#include "lang/dag.h"

enum {
    FACT_TRUTH = 1,    // 0 or 1
    FACT_INTEGER = 2,  // a whole number, infinite or NaN
    FACT_POSITIVE = 4, // not below 0 (but perhaps NaN)
    BOUND_NONE = INT16_MAX,
    MARK_UNSEEN = 0, // c of a SEARCH whose steps are no breaks
};

// CONST: a and b are the low and high half of the double's bits. INPUT: a is the Input. SEARCH and
// TABLE: b is the index of the table; c of SEARCH: MARK_UNSEEN, else REF_NONE. IMAGE: c is the
// index of the table.
typedef struct {
    uint8_t op;
    uint8_t facts;   // FACT_ bits
    int16_t bound;   // |value| <= 2^bound and never NaN; BOUND_NONE: nothing is known
    uint32_t inputs; // bit i: Input i is read, here or below
    Ref a, b, c;
} DagNode;

// Scratch of the walks. Nodes are marked with a number that changes with each walk, so that a walk
// costs what it visits and not what the graph holds.
typedef struct {
    uint32_t *mark;
    Ref *image; // what a visited node became
    Ref *order; // the visited nodes, operands first
    Ref *stack;
    size_t mark_capacity, order_capacity, stack_capacity;
    uint32_t n_order, epoch;
} DagWalk;

// The last substitution, which the next goes on with where it is of the same inputs: the parts of a
// map share nearly all of their nodes, and so do the places of a scene.
enum { DAG_SUBSTITUTED_MOST = 6 };
typedef struct {
    Input inputs[DAG_SUBSTITUTED_MOST];
    Ref with[DAG_SUBSTITUTED_MOST];
    uint32_t n, epoch;
    uint32_t *mark; // epoch: image is what the node became
    Ref *image;
    size_t capacity;
} DagSubstitution;

struct Dag {
    Arena *arena;
    DagNode *nodes;
    size_t n_nodes, nodes_capacity;
    Ref *slots; // open addressing, a power of two; REF_NONE: empty
    size_t n_slots;
    ProgramTable *tables;
    int16_t *bounds; // [n_tables] of their values, as of nodes
    size_t n_tables, tables_capacity, bounds_capacity;
    uint32_t *table_slots;
    size_t n_table_slots;
    DagWalk *walk;
    DagSubstitution *substitution;
};

static inline bool dag_node_has_table(const DagNode *node) {
    return node->op == OP_SEARCH || node->op == OP_TABLE || node->op == OP_IMAGE;
}

static inline uint32_t dag_node_table(const DagNode *node) {
    return node->op == OP_IMAGE ? node->c : node->b;
}

static inline uint32_t dag_node_operands(const DagNode *node, Ref operands[3]) {
    operands[0] = node->a;
    operands[1] = node->b;
    operands[2] = node->c;
    return op_operands[node->op];
}

double dag_node_value(const DagNode *node); // of a CONST
// What follows for a new node from its operands (lang/dag_facts.c).
int16_t dag_node_bound(const Dag *dag, const DagNode *node);
int16_t dag_table_bound(const ProgramTable *table);
uint8_t dag_node_facts(const Dag *dag, const DagNode *node);

// Visits what the roots reach and that reads any input of the mask (mask 0: everything), operands
// first; leaves walk->order and walk->n_order. The next walk ends this one's results.
void dag_walk(const Dag *dag, const Ref *roots, size_t n_roots, uint32_t mask);

static inline bool dag_walk_visited(const Dag *dag, Ref ref) {
    return dag->walk->mark[ref] == dag->walk->epoch;
}

// The same node with other operands, built anew.
Ref dag_rebuild(Dag *dag, const DagNode *node, const Ref operands[3]);

#endif
