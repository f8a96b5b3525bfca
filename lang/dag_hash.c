// SPDX-License-Identifier: Apache-2.0
// What expressions compute, as a hash that does not depend on the rest of the graph.
#include "lang/dag_nodes.h"

static void add_table(const Dag *dag, uint32_t index, Hash128 *hash) {
    const ProgramTable *table = &dag->tables[index];
    const uint32_t about[2] = {table->n, table->live};
    hash_add(hash, about, sizeof about);
    if (table->values && !table->live) {
        hash_add(hash, table->values, table->n * sizeof *table->values);
    }
}

void dag_hash(const Dag *dag, const Ref *refs, uint32_t n, Hash128 *hash) {
    dag_walk(dag, refs, n, 0);
    DagWalk *w = dag->walk;
    for (uint32_t i = 0; i < w->n_order; i++) {
        const DagNode *node = &dag->nodes[w->order[i]];
        Ref operands[3];
        uint32_t n_operands = dag_node_operands(node, operands);
        uint32_t about[4] = {node->op, 0, 0, 0}; // operands by their place in the walk
        w->image[w->order[i]] = i;
        for (uint32_t k = 0; k < n_operands; k++) {
            about[k + 1] = w->image[operands[k]];
        }
        if (node->op == OP_CONST || node->op == OP_INPUT) {
            about[1] = node->a;
            about[2] = node->op == OP_CONST ? node->b : 0;
        }
        hash_add(hash, about, sizeof about);
        if (node->op == OP_SEARCH || node->op == OP_TABLE || node->op == OP_IMAGE) {
            add_table(dag, dag_node_table(node), hash);
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        hash_add(hash, &w->image[refs[i]], sizeof w->image[0]);
    }
}
