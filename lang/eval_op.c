// SPDX-License-Identifier: Apache-2.0
// Operators: which types go together, what comes of them, and hints where they do not.
#include "lang/eval_clip.h"

static const char *const signs[OPERATOR_COUNT] = {"-", "not", "+", "-",  "*",  "/",  "%",   "^",
                                                  "<", "<=",  ">", ">=", "==", "!=", "and", "or"};

static Ref op2(Eval *ev, Op op, Ref a, Ref b) {
    return dag_op(ev->dag, op, a, b, REF_NONE);
}

static bool is_scalar(const Value *value) {
    return value->type == VALUE_NUMBER || value->type == VALUE_ANGLE;
}

static bool is_vector(const Value *value) {
    return value->type == VALUE_VEC || value->type == VALUE_COLOR;
}

// ---- Reports

static bool is_order(Operator op) {
    return op == OPERATOR_LT || op == OPERATOR_LE || op == OPERATOR_GT || op == OPERATOR_GE;
}

// A plain number beside a value that is none: what to write in its place, where that is accepted.
static const char *hint_instead(Eval *ev, Operator op, const Value *number, const Value *other) {
    double x;
    bool is_known = dag_is_const(ev->dag, number->ref[0], &x);
    if (number->dimension || op == OPERATOR_POW || op == OPERATOR_AND || op == OPERATOR_OR) {
        return NULL;
    }
    if (other->type == VALUE_ANGLE) {
        return is_known ? arena_printf(ev->arena, "write %.15gdeg", x)
                        : "multiply the number by 1deg";
    }
    if (!is_vector(other) || is_order(op)) {
        return NULL;
    }
    const char *part = is_known ? arena_printf(ev->arena, "%.15g", x) : "s";
    uint32_t n = other->n;
    return arena_printf(ev->arena, "write <%s, %s%s%s%s%s>", part, part, n > 2 ? ", " : "",
                        n > 2 ? part : "", n > 3 ? ", " : "", n > 3 ? part : "");
}

static const char *hint_for(Operator op, const Value *a, const Value *b) {
    bool is_power = op == OPERATOR_POW || op == OPERATOR_MUL;
    if (is_power && (a->type == VALUE_ANGLE || b->type == VALUE_ANGLE)) {
        return a->type == b->type && op == OPERATOR_MUL
                   ? "divide one of them by 1turn, 1rad or 1deg to make it a number"
                   : "divide by 1turn, 1rad or 1deg to make it a number";
    }
    if (is_order(op) && (is_vector(a) || is_vector(b))) {
        return "vectors have no order: compare their length(v), or components such as v.x";
    }
    if ((op == OPERATOR_ADD || op == OPERATOR_SUB) && is_vector(a) && b->type == VALUE_ANGLE) {
        return "an axis and its angle are two values: write x, 90deg";
    }
    if (a->type == VALUE_CLIP || b->type == VALUE_CLIP) {
        return "a clip is no number: play(walk, at = 3s, speed = 2) says how it plays";
    }
    if ((a->type == VALUE_STRING) != (b->type == VALUE_STRING) && op == OPERATOR_ADD) {
        return "write str(...)";
    }
    return NULL;
}

// Marks the operand that is to be replaced, if there is one.
static Value mismatch(Eval *ev, const Env *env, NodeId node, Operator op, const Value *a,
                      const Value *b) {
    const Node *n = syntax_node(env->module->syntax, node);
    const char *hint = NULL;
    if (n->kind == NODE_BINARY && (a->type == VALUE_NUMBER) != (b->type == VALUE_NUMBER)) {
        bool is_left = a->type == VALUE_NUMBER;
        hint = hint_instead(ev, op, is_left ? a : b, is_left ? b : a);
        bool marks_left = hint ? is_left : a->type == VALUE_ANGLE;
        if (hint || (op == OPERATOR_POW && (a->type == VALUE_ANGLE || b->type == VALUE_ANGLE))) {
            node = marks_left ? n->a : n->b;
        }
    }
    return eval_error(ev, env, node, hint ? hint : hint_for(op, a, b),
                      "%s %s %s: these do not go together", value_describe(ev->arena, a), signs[op],
                      value_describe(ev->arena, b));
}

// Sums and comparisons need the same unit, if both sides have one.
static bool units_agree(const Value *a, const Value *b) {
    return !a->dimension || !b->dimension || a->dimension == b->dimension;
}

// ---- Arithmetic

static Value componentwise(Eval *ev, Op op, const Value *a, const Value *b) {
    Ref refs[4];
    uint32_t n = a->n > b->n ? a->n : b->n;
    for (uint32_t i = 0; i < n; i++) {
        refs[i] = op2(ev, op, a->ref[a->n == 1 ? 0 : i], b->ref[b->n == 1 ? 0 : i]);
    }
    bool is_color = a->type == VALUE_COLOR || b->type == VALUE_COLOR;
    return value_vec(is_color ? VALUE_COLOR : VALUE_VEC, refs, n);
}

static Value eval_sum(Eval *ev, const Env *env, NodeId node, Operator op, const Value *a,
                      const Value *b) {
    Op graph_op = op == OPERATOR_ADD ? OP_ADD : OP_SUB;
    if (op == OPERATOR_ADD && a->type == VALUE_STRING && b->type == VALUE_STRING) {
        size_t n = symbol_size(ev->symbols, a->symbol), m = symbol_size(ev->symbols, b->symbol);
        if (n + m > EVAL_MAX_STRING) {
            return eval_error(ev, env, node, NULL, "this string is longer than %d bytes",
                              EVAL_MAX_STRING);
        }
        const char *text = arena_printf(ev->arena, "%s%s", symbol_text(ev->symbols, a->symbol),
                                        symbol_text(ev->symbols, b->symbol));
        return (Value){.type = VALUE_STRING, .symbol = symbol_of(ev->symbols, text, n + m)};
    }
    bool is_ok =
        (is_scalar(a) && a->type == b->type) || (is_vector(a) && is_vector(b) && a->n == b->n);
    if (!is_ok || !units_agree(a, b)) {
        return mismatch(ev, env, node, op, a, b);
    }
    Value sum = is_scalar(a)
                    ? value_scalar((ValueType)a->type, op2(ev, graph_op, a->ref[0], b->ref[0]))
                    : componentwise(ev, graph_op, a, b);
    sum.dimension = a->dimension == b->dimension ? a->dimension : DIMENSION_NONE;
    return sum;
}

// A place, or another map, mapped by a rotation or a transform: b first, then a.
static Value eval_map(Eval *ev, const Env *env, NodeId node, const Value *a, const Value *b) {
    RefMap outer, inner;
    if (a->type == VALUE_ROTATION && b->type == VALUE_ROTATION) {
        return value_from_quat(spatial_quat_mul(ev->dag, value_quat(a), value_quat(b)));
    }
    if (a->type == VALUE_ROTATION && b->type == VALUE_VEC && b->n == 3) {
        return value_from3(VALUE_VEC, spatial_quat_rotate(ev->dag, value_quat(a), value_ref3(b)));
    }
    value_as_map(ev->dag, a, &outer);
    if (b->type == VALUE_VEC && b->n == 3) {
        return value_from3(VALUE_VEC, spatial_map_point(ev->dag, &outer, value_ref3(b)));
    }
    if (!value_as_map(ev->dag, b, &inner)) {
        return mismatch(ev, env, node, OPERATOR_MUL, a, b);
    }
    outer = spatial_map_compose(ev->dag, &outer, &inner);
    return value_transform(ev->arena, &outer);
}

static Value eval_product(Eval *ev, const Env *env, NodeId node, const Value *a, const Value *b) {
    if (a->type == VALUE_ROTATION || a->type == VALUE_TRANSFORM) {
        return eval_map(ev, env, node, a, b);
    }
    if (is_scalar(a) && is_scalar(b)) {
        if (a->type == VALUE_ANGLE && b->type == VALUE_ANGLE) {
            return mismatch(ev, env, node, OPERATOR_MUL, a, b);
        }
        ValueType type =
            a->type == VALUE_ANGLE || b->type == VALUE_ANGLE ? VALUE_ANGLE : VALUE_NUMBER;
        return value_scalar(type, op2(ev, OP_MUL, a->ref[0], b->ref[0]));
    }
    bool is_ok = (is_vector(a) && is_vector(b) && a->n == b->n) ||
                 (is_vector(a) && b->type == VALUE_NUMBER) ||
                 (a->type == VALUE_NUMBER && is_vector(b));
    return is_ok ? componentwise(ev, OP_MUL, a, b) : mismatch(ev, env, node, OPERATOR_MUL, a, b);
}

static Value eval_quotient(Eval *ev, const Env *env, NodeId node, const Value *a, const Value *b) {
    if (is_scalar(a) && is_scalar(b)) {
        if (a->type == VALUE_NUMBER && b->type == VALUE_ANGLE) {
            return mismatch(ev, env, node, OPERATOR_DIV, a, b);
        }
        return value_scalar(a->type == b->type ? VALUE_NUMBER : VALUE_ANGLE,
                            op2(ev, OP_DIV, a->ref[0], b->ref[0]));
    }
    bool is_ok = is_vector(a) && (b->type == VALUE_NUMBER || (is_vector(b) && a->n == b->n));
    return is_ok ? componentwise(ev, OP_DIV, a, b) : mismatch(ev, env, node, OPERATOR_DIV, a, b);
}

static Value eval_modulo(Eval *ev, const Env *env, NodeId node, const Value *a, const Value *b) {
    if (is_scalar(a) && a->type == b->type && units_agree(a, b)) {
        Value rest = value_scalar((ValueType)a->type, op2(ev, OP_MOD, a->ref[0], b->ref[0]));
        rest.dimension = a->dimension == b->dimension ? a->dimension : DIMENSION_NONE;
        return rest;
    }
    bool is_ok = is_vector(a) && (b->type == VALUE_NUMBER || (is_vector(b) && a->n == b->n));
    return is_ok ? componentwise(ev, OP_MOD, a, b) : mismatch(ev, env, node, OPERATOR_MOD, a, b);
}

// ---- Comparison

static Ref equal_materials(Eval *ev, const MaterialValue *a, const MaterialValue *b) {
    Ref truth = dag_const(ev->dag, a->kind == b->kind);
    for (uint32_t i = 0; i < a->n && a->kind == b->kind; i++) {
        truth = op2(ev, OP_AND, truth, op2(ev, OP_EQ, a->ref[i], b->ref[i]));
    }
    for (int k = 0; k < 2 && a->kind == MATERIAL_MIX && b->kind == MATERIAL_MIX; k++) {
        truth = op2(ev, OP_AND, truth, equal_materials(ev, a->parts[k], b->parts[k]));
    }
    return truth;
}

Ref eval_equal(Eval *ev, const Value *a, const Value *b) {
    Ref truth = dag_const(ev->dag, 1);
    if (value_is_numeric(a) && value_is_numeric(b)) {
        if (a->n != b->n || (a->type != b->type && !(is_vector(a) && is_vector(b)))) {
            return REF_NONE;
        }
        for (uint32_t i = 0; i < a->n; i++) {
            truth = op2(ev, OP_AND, truth, op2(ev, OP_EQ, value_refs(a)[i], value_refs(b)[i]));
        }
        return truth;
    }
    if (a->type != b->type) {
        return REF_NONE;
    }
    switch (a->type) {
    case VALUE_STRING:
        return dag_const(ev->dag, a->symbol == b->symbol);
    case VALUE_CLIP:
        truth = dag_const(ev->dag, clip_is_of_one_def(a->clip, b->clip));
        for (int k = 0; k < CLIP_REFS; k++) {
            truth = op2(ev, OP_AND, truth, op2(ev, OP_EQ, a->clip->ref[k], b->clip->ref[k]));
        }
        return truth;
    case VALUE_LIST:
        if (!eval_list_is_known(ev, a->list) || !eval_list_is_known(ev, b->list)) {
            return truth; // all is asked again
        }
        if (a->list->n != b->list->n) {
            return dag_const(ev->dag, 0);
        }
        // Lists may share their items, so that a few lines make more of them than can be compared.
        for (uint32_t i = 0; i < a->list->n && truth != REF_NONE && ev->steps < ev->max_steps;
             i++) {
            ev->steps += 4;
            Ref is_same = eval_equal(ev, &a->list->items[i], &b->list->items[i]);
            truth = is_same == REF_NONE ? REF_NONE : op2(ev, OP_AND, truth, is_same);
        }
        return truth;
    case VALUE_RANGE:
        truth = op2(ev, OP_AND, op2(ev, OP_EQ, a->range->low, b->range->low),
                    op2(ev, OP_EQ, a->range->high, b->range->high));
        if (a->range->step == REF_NONE || b->range->step == REF_NONE) {
            return a->range->step == b->range->step ? truth : dag_const(ev->dag, 0);
        }
        return op2(ev, OP_AND, truth, op2(ev, OP_EQ, a->range->step, b->range->step));
    case VALUE_MATERIAL:
        return equal_materials(ev, a->material, b->material);
    case VALUE_FUNCTION:
        return dag_const(ev->dag, a->closure->node == b->closure->node &&
                                      a->closure->scope == b->closure->scope &&
                                      a->closure->builtin == b->closure->builtin &&
                                      a->closure->is_graph == b->closure->is_graph &&
                                      a->closure->graph == b->closure->graph);
    default:
        return REF_NONE;
    }
}

static Value eval_comparison(Eval *ev, const Env *env, NodeId node, Operator op, const Value *a,
                             const Value *b) {
    if (op == OPERATOR_EQ || op == OPERATOR_NE) {
        Ref truth = units_agree(a, b) ? eval_equal(ev, a, b) : REF_NONE;
        if (ev->steps >= ev->max_steps && !eval_step(ev, env, node)) {
            return value_poison();
        }
        if (truth == REF_NONE) {
            return mismatch(ev, env, node, op, a, b);
        }
        return value_scalar(VALUE_BOOL,
                            op == OPERATOR_EQ ? truth : op2(ev, OP_NOT, truth, REF_NONE));
    }
    if (!is_scalar(a) || a->type != b->type || !units_agree(a, b)) {
        return mismatch(ev, env, node, op, a, b);
    }
    bool is_swapped = op == OPERATOR_GT || op == OPERATOR_GE;
    Op graph_op = op == OPERATOR_LT || op == OPERATOR_GT ? OP_LT : OP_LE;
    return value_scalar(VALUE_BOOL, is_swapped ? op2(ev, graph_op, b->ref[0], a->ref[0])
                                               : op2(ev, graph_op, a->ref[0], b->ref[0]));
}

// ---- The doors

Value eval_unary(Eval *ev, const Env *env, NodeId node, Operator op, Value a) {
    if (value_is_poison(&a)) {
        return a;
    }
    if (op == OPERATOR_NOT) {
        return value_is(&a, VALUE_BOOL)
                   ? value_scalar(VALUE_BOOL, op2(ev, OP_NOT, a.ref[0], REF_NONE))
                   : eval_error(ev, env, node, NULL, "'not' takes true or false, this is %s",
                                value_describe(ev->arena, &a));
    }
    if (!is_scalar(&a) && !is_vector(&a)) {
        return eval_error(ev, env, node, NULL, "%s has no opposite", value_describe(ev->arena, &a));
    }
    Value negated = a;
    for (uint32_t i = 0; i < a.n; i++) {
        negated.ref[i] = op2(ev, OP_NEG, a.ref[i], REF_NONE);
    }
    return negated;
}

Value eval_binary(Eval *ev, const Env *env, NodeId node, Operator op, Value a, Value b) {
    if (value_is_poison(&a) || value_is_poison(&b)) {
        return value_poison();
    }
    switch (op) {
    case OPERATOR_ADD:
    case OPERATOR_SUB:
        return eval_sum(ev, env, node, op, &a, &b);
    case OPERATOR_MUL:
        return eval_product(ev, env, node, &a, &b);
    case OPERATOR_DIV:
        return eval_quotient(ev, env, node, &a, &b);
    case OPERATOR_MOD:
        return eval_modulo(ev, env, node, &a, &b);
    case OPERATOR_POW:
        return value_is(&a, VALUE_NUMBER) && value_is(&b, VALUE_NUMBER)
                   ? value_scalar(VALUE_NUMBER, op2(ev, OP_POW, a.ref[0], b.ref[0]))
                   : mismatch(ev, env, node, op, &a, &b);
    case OPERATOR_AND:
    case OPERATOR_OR:
        return value_is(&a, VALUE_BOOL) && value_is(&b, VALUE_BOOL)
                   ? value_scalar(VALUE_BOOL,
                                  op2(ev, op == OPERATOR_AND ? OP_AND : OP_OR, a.ref[0], b.ref[0]))
                   : mismatch(ev, env, node, op, &a, &b);
    default:
        return eval_comparison(ev, env, node, op, &a, &b);
    }
}

static bool is_alike(const MaterialValue *a, const MaterialValue *b) {
    return a->kind == b->kind && (a->kind != MATERIAL_MIX || (is_alike(a->parts[0], b->parts[0]) &&
                                                              is_alike(a->parts[1], b->parts[1])));
}

static const MaterialValue *select_material(Eval *ev, Ref condition, const MaterialValue *a,
                                            const MaterialValue *b) {
    MaterialValue *material = ARENA_NEW(ev->arena, MaterialValue);
    *material = *a;
    for (uint32_t i = 0; i < material->n; i++) {
        material->ref[i] = dag_op(ev->dag, OP_SELECT, condition, a->ref[i], b->ref[i]);
    }
    for (int k = 0; k < 2 && a->kind == MATERIAL_MIX; k++) {
        material->parts[k] = select_material(ev, condition, a->parts[k], b->parts[k]);
    }
    return material;
}

Value eval_select(Eval *ev, const Env *env, NodeId node, Ref condition, Value a, Value b) {
    if (value_is_poison(&a) || value_is_poison(&b)) {
        return value_poison();
    }
    if (value_is(&a, VALUE_MATERIAL) && value_is(&b, VALUE_MATERIAL) &&
        is_alike(a.material, b.material)) {
        return (Value){.type = VALUE_MATERIAL,
                       .material = select_material(ev, condition, a.material, b.material)};
    }
    Value clips;
    if (clip_choose(ev, condition, &a, &b, &clips)) {
        return clips;
    }
    bool is_one_type = a.type == b.type || (is_vector(&a) && is_vector(&b));
    if (!value_is_numeric(&a) || !is_one_type || a.n != b.n) {
        double truth; // a choice between things: it must be known
        if (eval_known(ev, condition, &truth) == KNOWN_LATER) {
            return value_poison();
        }
        if (clip_is_or_holds(&a) && clip_is_or_holds(&b)) {
            return eval_error(ev, env, node, "say when a clip begins by at: play(wave, at = 3s)",
                              "which clips an instance plays can not depend on %s",
                              eval_input_name(dag_inputs(ev->dag, condition) & ~LOOP_INPUTS));
        }
        return eval_error(ev, env, node,
                          is_one_type ? NULL : "both sides of ':' must be of one type",
                          "%s : %s: a choice that is made while time passes is between numbers, "
                          "vectors, transforms, or materials of one kind",
                          value_describe(ev->arena, &a), value_describe(ev->arena, &b));
    }
    Ref refs[12];
    for (uint32_t i = 0; i < a.n; i++) {
        refs[i] = dag_op(ev->dag, OP_SELECT, condition, value_refs(&a)[i], value_refs(&b)[i]);
    }
    Value chosen = value_like(ev->arena, &a, refs);
    chosen.dimension = a.dimension == b.dimension ? a.dimension : DIMENSION_NONE;
    return chosen;
}
