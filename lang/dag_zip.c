// SPDX-License-Identifier: Apache-2.0
// Many alike expressions as one of an index: anti-unification, with tables where they differ.
#include <string.h>

#include "lang/dag_nodes.h"

enum { MAX_DEPTH = 64, MAX_VISITS = 4096 };

typedef struct {
    Dag *dag;
    Ref index;
    uint32_t n, visits;
    Arena scratch;
} Zip;

static bool is_const(const Zip *zip, Ref ref, double *value) {
    return ref != REF_NONE && dag_is_const(zip->dag, ref, value);
}

// The operands that make an expression look like the model, where folding has changed it: x is
// x + 0, x * 1 and the like, 0 is 0 times anything.
static bool adapt(Zip *zip, const DagNode *model, Ref ref, Ref operands[3]) {
    Dag *dag = zip->dag;
    bool is_left = is_const(zip, model->a, NULL), is_right = is_const(zip, model->b, NULL);
    double x;
    Ref neutral = dag_const(dag, model->op == OP_ADD || model->op == OP_SUB ? 0 : 1);
    if (model->op == OP_MUL && (is_left || is_right) && is_const(zip, ref, &x) && x == 0) {
        operands[0] = is_left ? ref : model->a;
        operands[1] = is_left ? model->b : ref;
        return true;
    }
    bool is_either = model->op == OP_ADD || model->op == OP_MUL;
    bool is_second = model->op == OP_SUB || model->op == OP_DIV || model->op == OP_POW;
    if (is_either && is_left) {
        operands[0] = neutral;
        operands[1] = ref;
        return true;
    }
    operands[0] = ref;
    operands[1] = neutral;
    return (is_either || is_second) && is_right;
}

// Sums and products keep their operands in the order in which these were made: a constant goes
// where the model has its own.
static void turn_round(const Zip *zip, const DagNode *model, Ref operands[3]) {
    bool is_free = model->op == OP_ADD || model->op == OP_MUL;
    bool is_left = is_const(zip, model->a, NULL), is_right = is_const(zip, model->b, NULL);
    if (is_free && is_left != is_right && is_const(zip, operands[0], NULL) == is_right &&
        is_const(zip, operands[1], NULL) == is_left) {
        Ref first = operands[0];
        operands[0] = operands[1];
        operands[1] = first;
    }
}

static Ref zip_refs(Zip *zip, const Ref *refs, uint32_t depth);

static Ref zip_operands(Zip *zip, const Ref *refs, uint32_t depth) {
    const DagNode model = zip->dag->nodes[refs[zip->n - 1]]; // the last: the first are often folded
    uint32_t n_operands = op_operands[model.op];
    bool has_table = dag_node_has_table(&model);
    Ref *columns[3], made[3] = {model.a, model.b, model.c};
    for (uint32_t k = 0; k < 3; k++) {
        columns[k] = ARENA_ARRAY(&zip->scratch, zip->n, Ref);
    }
    for (uint32_t i = 0; i < zip->n; i++) {
        const DagNode node = zip->dag->nodes[refs[i]];
        Ref operands[3] = {node.a, node.b, node.c};
        bool is_alike = node.op == model.op &&
                        (!has_table || (dag_node_table(&node) == dag_node_table(&model) &&
                                        (model.op == OP_IMAGE || node.c == model.c)));
        if (n_operands == 0 || (!is_alike && !adapt(zip, &model, refs[i], operands))) {
            return REF_NONE;
        }
        if (is_alike) {
            turn_round(zip, &model, operands);
        }
        for (uint32_t k = 0; k < n_operands; k++) {
            columns[k][i] = operands[k];
        }
    }
    for (uint32_t k = 0; k < n_operands; k++) {
        made[k] = zip_refs(zip, columns[k], depth + 1);
        if (made[k] == REF_NONE) {
            return REF_NONE;
        }
    }
    return dag_rebuild(zip->dag, &model, made);
}

static Ref zip_refs(Zip *zip, const Ref *refs, uint32_t depth) {
    bool is_same = true, is_known = true;
    if (depth > MAX_DEPTH || ++zip->visits > MAX_VISITS) {
        return REF_NONE;
    }
    double *values = ARENA_ARRAY(&zip->scratch, zip->n, double);
    for (uint32_t i = 0; i < zip->n; i++) {
        is_same = is_same && refs[i] == refs[0];
        is_known = is_known && is_const(zip, refs[i], &values[i]);
    }
    return is_same    ? refs[0]
           : is_known ? dag_table_op(zip->dag, OP_TABLE, zip->index, values, zip->n)
                      : zip_operands(zip, refs, depth);
}

Ref dag_zip(Dag *dag, const Ref *refs, uint32_t n, Ref index) {
    Zip zip = {.dag = dag, .index = index, .n = n};
    Ref ref = zip_refs(&zip, refs, 0);
    arena_free(&zip.scratch);
    return ref;
}
