// SPDX-License-Identifier: Apache-2.0
// Expressions: names, literals, lists, ranges, members, conditions.
#include "lang/eval.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "lang/builtins.h"
#include "lang/eval_clip.h"
#include "lang/eval_keys.h"
#include "lang/eval_run.h"
#include "lang/eval_rate.h"
#include "lang/eval_sim.h"
#include "lang/lower.h"
#include "lang/watch.h"

enum { MAX_NAMES = 512 }; // looked through for a did-you-mean

// ---- Names

// NAME of an included file; NULL: none has it.
static const char *module_of(Eval *ev, const Env *env, Symbol name) {
    for (const Scope *scope = env->scope; scope; scope = scope->parent) {
        for (uint32_t i = 0; i < scope->n; i++) {
            const Binding *binding = &scope->bindings[i];
            if (binding->kind == BINDING_MODULE && scope_find_own(binding->members, name)) {
                return symbol_text(ev->symbols, binding->name);
            }
        }
    }
    return NULL;
}

static Value unknown_name(Eval *ev, const Env *env, NodeId node, Symbol symbol) {
    const char *name = symbol_text(ev->symbols, symbol), *module = module_of(ev, env, symbol);
    const char *names[MAX_NAMES];
    size_t n = scope_names(env->scope, ev->symbols, names, MAX_NAMES);
    n += builtins_names(names + n, MAX_NAMES - n);
    const char *foreign = schema_foreign_word(NULL, name), *near = diag_nearest(name, names, n);
    const char *hint = module    ? arena_printf(ev->arena, "write %s.%s", module, name)
                       : foreign ? foreign
                       : near    ? arena_printf(ev->arena, "did you mean '%s'?", near)
                                 : NULL;
    return eval_error(ev, env, node, hint, "nothing is called '%s' here", name);
}

static void mark_used(const Binding *binding) {
    if (binding->module && binding->node) {
        binding->module->flags[binding->node] |= MODULE_USED;
    }
}

static Value eval_let(Eval *ev, Binding *binding, Scope *at) {
    const Env inside = {binding->module, at};
    const Node *let = syntax_node(binding->module->syntax, binding->node);
    uint32_t index = (uint32_t)(binding - at->bindings);
    binding->state = BINDING_BUSY;
    diag_next_statement(ev->diag); // its mistakes are its own
    Value value = eval_expr(ev, &inside, let->b);
    diag_next_statement(ev->diag);
    // What is poison only because a loop must be unrolled is asked for again then.
    at->bindings[index].state =
        ev->unroll && value_is_poison(&value) ? BINDING_FRESH : BINDING_DONE;
    at->bindings[index].value = value;
    return value;
}

Value eval_binding(Eval *ev, Binding *binding, Scope *at, const Env *env, NodeId node) {
    mark_used(binding);
    const char *name = symbol_text(ev->symbols, binding->name);
    switch (binding->kind) {
    case BINDING_LET:
    case BINDING_PARAM:
        if (binding->state == BINDING_BUSY) {
            return eval_error(ev, env, node, NULL, "'%s' is defined by itself", name);
        }
        return binding->state == BINDING_DONE ? binding->value : eval_let(ev, binding, at);
    case BINDING_DEF:
        return eval_error(ev, env, node, arena_printf(ev->arena, "place it: %s { }", name),
                          "'%s' is a def, not a value", name);
    case BINDING_MODULE:
        return eval_error(ev, env, node, arena_printf(ev->arena, "write %s.NAME", name),
                          "'%s' is an included file, not a value", name);
    case BINDING_SIM:
        return eval_error(ev, env, node, arena_printf(ev->arena, "write %s.NAME", name),
                          "'%s' is a simulation, not a value", name);
    case BINDING_OF_COPIES:
        return eval_error(ev, env, node, "all copies have the same: write a number, or a let",
                          "a clip can not depend on '%s', a parameter of its def", name);
    default:
        return binding->value;
    }
}

static Value eval_name(Eval *ev, const Env *env, NodeId id, Symbol symbol) {
    Scope *at = NULL;
    Binding *binding = scope_find(env->scope, symbol, &at);
    if (binding) {
        return eval_binding(ev, binding, at, env, id);
    }
    int32_t builtin = builtins_find(ev->builtins, symbol);
    if (builtin < 0) {
        return unknown_name(ev, env, id, symbol);
    }
    Closure *closure = ARENA_NEW(ev->arena, Closure);
    *closure = (Closure){.builtin = builtin};
    return (Value){.type = VALUE_FUNCTION, .closure = closure};
}

// ---- Literals

// 90deg is the double nearest to a quarter turn's quotient, not to 90 times a rounded degree.
static Ref in_unit(Dag *dag, Ref number, unsigned unit, double factor) {
    if (unit != UNIT_DEG) {
        return dag_op(dag, OP_MUL, number, dag_const(dag, factor), REF_NONE);
    }
    Ref half_turns = dag_op(dag, OP_DIV, number, dag_const(dag, 180), REF_NONE);
    return dag_op(dag, OP_MUL, half_turns, dag_const(dag, 3.141592653589793), REF_NONE);
}

static Value eval_number(Eval *ev, const Env *env, NodeId id, const Node *node) {
    const UnitInfo *unit = &unit_infos[node->aux];
    double factor = unit->factor;
    Ref varied = ev->runs ? eval_run_number(ev, env, id) : REF_NONE;
    if (node->aux == UNIT_FRAME) {
        if (!(ev->fps > 0)) {
            return eval_error(ev, env, id, "write a number, 24fps",
                              "the unit f is a frame's length, fps can not be given by it");
        }
        factor = 1 / ev->fps;
    }
    Ref number = varied != REF_NONE ? varied : dag_const(ev->dag, syntax_number(node));
    Value value = value_scalar(VALUE_NUMBER, in_unit(ev->dag, number, node->aux, factor));
    if (unit->dimension == DIMENSION_ANGLE || unit->dimension == DIMENSION_ANGULAR_RATE) {
        value.type = VALUE_ANGLE;
    }
    value.dimension = unit->dimension == DIMENSION_ANGLE ? DIMENSION_NONE : unit->dimension;
    return value;
}

static Value eval_vector(Eval *ev, const Env *env, NodeId id, const Node *node) {
    const Syntax *syntax = env->module->syntax;
    if (node->b < 2 || node->b > 4) {
        return eval_error(ev, env, id, NULL, "a vector has 2 to 4 components, this has %u",
                          node->b);
    }
    Ref refs[4];
    uint8_t dimension = DIMENSION_NONE;
    bool is_bad = false;
    for (uint32_t i = 0; i < node->b; i++) {
        NodeId element = syntax->extra[node->a + i];
        Value value = eval_expr(ev, env, element);
        if (value_is_poison(&value)) {
            is_bad = true;
        } else if (!value_is(&value, VALUE_NUMBER)) {
            eval_error(
                ev, env, element,
                value_is(&value, VALUE_ANGLE) ? "divide by 1deg or 1rad to make it a number" : NULL,
                "a vector is made of numbers, this is %s", value_describe(ev->arena, &value));
            is_bad = true;
        } else {
            refs[i] = value.ref[0];
            dimension = value.dimension ? value.dimension : dimension;
        }
    }
    if (is_bad) {
        return value_poison();
    }
    Value vector = value_vec(VALUE_VEC, refs, node->b);
    vector.dimension = dimension;
    return vector;
}

static Value make_list(Eval *ev, const Value *items, size_t n) {
    List *list = ARENA_NEW(ev->arena, List);
    *list = (List){.n = (uint32_t)n, .items = items};
    for (size_t i = 0; i < n; i++) {
        list->inputs |= value_inputs(ev->dag, &items[i]);
    }
    return (Value){.type = VALUE_LIST, .list = list};
}

static Value eval_list(Eval *ev, const Env *env, const Node *node) {
    const Syntax *syntax = env->module->syntax;
    Value *items = ARENA_ARRAY(ev->arena, node->b, Value);
    bool is_bad = false;
    for (uint32_t i = 0; i < node->b; i++) {
        items[i] = eval_expr(ev, env, syntax->extra[node->a + i]);
        is_bad = is_bad || value_is_poison(&items[i]);
    }
    return is_bad ? value_poison() : make_list(ev, items, node->b);
}

// [for x in xs if condition: e]
static Value eval_comprehension(Eval *ev, const Env *env, const Node *node) {
    const uint32_t *extra = env->module->syntax->extra + node->a;
    Sequence sequence;
    Value iterated = eval_expr(ev, env, extra[2]);
    if (!eval_sequence(ev, env, extra[2], &iterated, &sequence)) {
        return value_poison();
    }
    Value *items = NULL;
    size_t n = 0, capacity = 0;
    // One scope for all items: nothing within an expression outlives it.
    const Env inside = {env->module, scope_new(ev->arena, env->scope)};
    Binding *variable = scope_bind(ev->arena, inside.scope, extra[0], BINDING_LOOP);
    for (uint32_t i = 0; i < sequence.n; i++) {
        if (!eval_step(ev, env, extra[4])) {
            return value_poison();
        }
        variable->value = sequence_item(ev, &sequence, i);
        bool is_in = true;
        if (extra[3]) {
            Value condition = eval_expr(ev, &inside, extra[3]);
            if (!eval_need_bool(ev, &inside, extra[3], &condition, "what a list keeps", NULL,
                                &is_in)) {
                return value_poison();
            }
        }
        if (is_in) {
            Value item = eval_expr(ev, &inside, extra[4]);
            if (value_is_poison(&item)) {
                return item;
            }
            items = arena_grow(ev->arena, items, n, &capacity, sizeof *items);
            items[n++] = item;
        }
    }
    return make_list(ev, items, n);
}

static Value eval_range(Eval *ev, const Env *env, const Node *node) {
    const uint32_t *extra = env->module->syntax->extra + node->b;
    NodeId parts[3] = {node->a, extra[0], extra[1]};
    Range *range = ARENA_NEW(ev->arena, Range);
    Ref *refs[3] = {&range->low, &range->high, &range->step};
    uint8_t type = VALUE_POISON;
    for (int i = 0; i < 3; i++) {
        *refs[i] = REF_NONE;
        if (!parts[i]) {
            continue;
        }
        Value value = eval_expr(ev, env, parts[i]);
        if (value_is_poison(&value)) {
            return value;
        }
        if (value.type != VALUE_NUMBER && value.type != VALUE_ANGLE) {
            return eval_error(ev, env, parts[i], NULL,
                              "a range goes over numbers or angles, this is %s",
                              value_describe(ev->arena, &value));
        }
        if (i > 0 && value.type != type) {
            double x;
            bool is_known = type == VALUE_ANGLE && dag_is_const(ev->dag, value.ref[0], &x);
            return eval_error(
                ev, env, parts[i], is_known ? arena_printf(ev->arena, "write %.15gdeg", x) : NULL,
                "the range begins with %s, this is %s",
                type == VALUE_ANGLE ? "an angle" : "a number", value_describe(ev->arena, &value));
        }
        if (value.dimension && range->dimension && value.dimension != range->dimension) {
            return eval_error(ev, env, parts[i], NULL, "the range begins with %s, this is %s",
                              dimension_names[range->dimension], value_describe(ev->arena, &value));
        }
        type = value.type;
        range->dimension = value.dimension ? value.dimension : range->dimension;
        *refs[i] = value.ref[0];
    }
    range->is_angle = type == VALUE_ANGLE;
    return (Value){.type = VALUE_RANGE, .range = range};
}

// ---- Members and indices

static int component_index(const Value *value, const char *member) {
    static const char *const letters[] = {"xyzw", "rgb", "uv"};
    if (member[1] || !value_is_numeric(value) || value->type == VALUE_TRANSFORM || value->n < 2) {
        return -1;
    }
    for (size_t i = 0; i < sizeof letters / sizeof letters[0]; i++) {
        const char *at = strchr(letters[i], member[0]);
        if (at && at - letters[i] < value->n) {
            return (int)(at - letters[i]);
        }
    }
    return -1;
}

static Value unknown_member(Eval *ev, const Env *env, NodeId id, const Scope *members,
                            Symbol module, const char *member) {
    const char *names[MAX_NAMES];
    size_t n = 0;
    for (uint32_t i = 0; i < members->n && n < MAX_NAMES; i++) {
        names[n++] = symbol_text(ev->symbols, members->bindings[i].name);
    }
    const char *near = diag_nearest(member, names, n);
    Span where = syntax_span(env->module->syntax, id);
    where.lo = where.hi - (uint32_t)strlen(member); // a member ends with its name
    return eval_error_at(
        ev, where, near ? arena_printf(ev->arena, "did you mean '%s'?", near) : NULL,
        "the file included as '%s' has no '%s'", symbol_text(ev->symbols, module), member);
}

static Value eval_member(Eval *ev, const Env *env, NodeId id, const Node *node) {
    const Node *object = syntax_node(env->module->syntax, node->a);
    const char *member = symbol_text(ev->symbols, node->b);
    if (object->kind == NODE_NAME) {
        Scope *at = NULL;
        Binding *binding = scope_find(env->scope, object->a, &at);
        if (binding && binding->kind == BINDING_MODULE) {
            Binding *inner = scope_find_own(binding->members, node->b);
            mark_used(binding);
            return inner ? eval_binding(ev, inner, binding->members, env, id)
                         : unknown_member(ev, env, id, binding->members, object->a, member);
        }
        if (binding && binding->kind == BINDING_SIM) {
            return eval_sim_member(ev, env, id, binding->sim, member);
        }
        if (!binding && object->a == ev->kind_names[OBJECT_FILM]) {
            return lower_film_member(ev, env, id, member);
        }
    }
    Value value;
    if (clip_member(ev, env, id, &value)) {
        return value;
    }
    value = eval_expr(ev, env, node->a);
    if (value_is_poison(&value)) {
        return value;
    }
    if (eval_motion_member(ev, env, node->a, &value, member, &value)) {
        return value;
    }
    int i = component_index(&value, member);
    if (i < 0) {
        return eval_error(ev, env, id,
                          value_is(&value, VALUE_ROTATION)
                              ? "a rotation has .spin, and the components .x .y .z .w"
                          : value.n >= 2 && value.n <= 4 ? "components are .x .y .z .w, or .r .g .b"
                          : value_is(&value, VALUE_TRANSFORM)
                              ? "a transform has .pos, .vel, .turn and .spin"
                              : NULL,
                          "%s has no member '%s'", value_describe(ev->arena, &value), member);
    }
    Value component = value_scalar(VALUE_NUMBER, value.ref[i]);
    component.dimension = value.dimension;
    return component;
}

// A list of numeric values of one type, read at an index that moves: tables where all is known,
// else a chain of choices. The index holds at the ends.
static Value index_motion(Eval *ev, const Env *env, NodeId id, const List *list, Ref index) {
    const Value *first = &list->items[0];
    ev->steps += list->n / 8; // looking at an item is less work than a step
    watch_read(ev, syntax_span(env->module->syntax, id), "the list", index, 0,
               nextafter(list->n, 0));
    for (uint32_t i = 0; i < list->n; i++) {
        const Value *item = &list->items[i];
        if (!value_is_numeric(item) || item->type != first->type || item->n != first->n) {
            return eval_error(
                ev, env, id, NULL,
                "a list that is read at a moving index holds values of one numeric type");
        }
    }
    Ref refs[12];
    double *table = ARENA_ARRAY(ev->arena, list->n, double);
    for (uint32_t k = 0; k < first->n; k++) {
        bool is_known = true;
        for (uint32_t i = 0; i < list->n; i++) {
            is_known = is_known && dag_is_const(ev->dag, value_refs(&list->items[i])[k], &table[i]);
        }
        if (is_known) {
            refs[k] = dag_table_op(ev->dag, OP_TABLE, index, table, list->n);
            continue;
        }
        refs[k] = value_refs(&list->items[list->n - 1])[k];
        for (uint32_t i = list->n - 1; i-- > 0;) {
            Ref is_before = dag_op(ev->dag, OP_LT, index, dag_const(ev->dag, i + 1.0), REF_NONE);
            refs[k] =
                dag_op(ev->dag, OP_SELECT, is_before, value_refs(&list->items[i])[k], refs[k]);
        }
    }
    return value_like(ev->arena, first, refs);
}

static Value eval_index(Eval *ev, const Env *env, NodeId id, const Node *node) {
    Value list = eval_expr(ev, env, node->a), index = eval_expr(ev, env, node->b);
    if (value_is_poison(&list) || value_is_poison(&index)) {
        return value_poison();
    }
    bool is_vector = value_is(&list, VALUE_VEC) || value_is(&list, VALUE_COLOR);
    if (!value_is(&list, VALUE_LIST) && !is_vector) {
        return eval_error(ev, env, node->a, NULL,
                          "only lists and vectors have an index, this is %s",
                          value_describe(ev->arena, &list));
    }
    if (!value_is(&index, VALUE_NUMBER)) {
        return eval_error(ev, env, node->b, NULL, "an index is a number, this is %s",
                          value_describe(ev->arena, &index));
    }
    if (is_vector) {
        Value *items = ARENA_ARRAY(ev->arena, list.n, Value);
        for (uint32_t i = 0; i < list.n; i++) {
            items[i] = value_scalar(VALUE_NUMBER, list.ref[i]);
        }
        list = make_list(ev, items, list.n);
    }
    double at = 0;
    if (!eval_list_is_known(ev, list.list)) {
        return value_poison();
    }
    if (list.list->each && !dag_is_const(ev->dag, index.ref[0], NULL)) {
        return eval_sim_at(ev, list.list, index.ref[0]);
    }
    Known known = eval_known(ev, index.ref[0], &at);
    if (known == KNOWN_LATER) {
        return value_poison();
    }
    if (list.list->n == 0) {
        return eval_error(ev, env, id, NULL, "the list is empty");
    }
    if (known == KNOWN_NEVER) {
        return index_motion(ev, env, id, list.list, index.ref[0]);
    }
    if (!(at >= 0 && at < list.list->n) || at != floor(at)) {
        return eval_error(ev, env, node->b, NULL,
                          "index %.15g: a whole number from 0 to %u is expected", at,
                          list.list->n - 1);
    }
    return list.list->items[(uint32_t)at];
}

// ---- The switch

static Value eval_cond(Eval *ev, const Env *env, NodeId id, const Node *node) {
    const uint32_t *extra = env->module->syntax->extra + node->b;
    Value condition = eval_expr(ev, env, node->a);
    if (value_is_poison(&condition)) {
        return condition;
    }
    if (!value_is(&condition, VALUE_BOOL)) {
        return eval_error(ev, env, node->a,
                          value_is(&condition, VALUE_NUMBER) ? "write a comparison" : NULL,
                          "what stands before '?' is true or false, this is %s",
                          value_describe(ev->arena, &condition));
    }
    double truth;
    if (dag_is_const(ev->dag, condition.ref[0], &truth)) {
        return eval_expr(ev, env, extra[truth != 0 ? 0 : 1]);
    }
    Value a = eval_expr(ev, env, extra[0]), b = eval_expr(ev, env, extra[1]);
    return eval_select(ev, env, id, condition.ref[0], a, b);
}

// `and` and `or` do not look at their right side where the left one decides.
static Value eval_logic(Eval *ev, const Env *env, NodeId id, const Node *node) {
    Value a = eval_expr(ev, env, node->a);
    double truth;
    if (value_is(&a, VALUE_BOOL) && dag_is_const(ev->dag, a.ref[0], &truth) &&
        (truth != 0) == (node->aux == OPERATOR_OR)) {
        return a;
    }
    Value b = eval_expr(ev, env, node->b);
    return eval_binary(ev, env, id, (Operator)node->aux, a, b);
}

static Value eval_node(Eval *ev, const Env *env, NodeId id) {
    const Node *node = syntax_node(env->module->syntax, id);
    switch ((NodeKind)node->kind) {
    case NODE_NUMBER:
        return eval_number(ev, env, id, node);
    case NODE_STRING:
        return (Value){.type = VALUE_STRING, .symbol = node->a};
    case NODE_NAME:
        return eval_name(ev, env, id, node->a);
    case NODE_VECTOR:
        return eval_vector(ev, env, id, node);
    case NODE_LIST:
        return eval_list(ev, env, node);
    case NODE_COMPREHENSION:
        return eval_comprehension(ev, env, node);
    case NODE_KEYS:
        return eval_keys(ev, env, id);
    case NODE_CALL:
        return eval_call(ev, env, id);
    case NODE_MEMBER:
        return eval_member(ev, env, id, node);
    case NODE_INDEX:
        return eval_index(ev, env, id, node);
    case NODE_UNARY:
        return eval_unary(ev, env, id, (Operator)node->aux, eval_expr(ev, env, node->a));
    case NODE_BINARY:
        if (node->aux == OPERATOR_AND || node->aux == OPERATOR_OR) {
            return eval_logic(ev, env, id, node);
        }
        Value a = eval_expr(ev, env, node->a), b = eval_expr(ev, env, node->b);
        return eval_binary(ev, env, id, (Operator)node->aux, a, b);
    case NODE_COND:
        return eval_cond(ev, env, id, node);
    case NODE_RANGE:
        return eval_range(ev, env, node);
    default: // the parser reported what it could not read
        return value_poison();
    }
}

Value eval_expr(Eval *ev, const Env *env, NodeId id) {
    if (!eval_step(ev, env, id)) {
        return value_poison();
    }
    if (ev->depth >= EVAL_MAX_DEPTH) {
        ev->stopped = true;
        return eval_error(ev, env, id, NULL, "expressions are nested too deeply");
    }
    ev->depth++;
    Value value = eval_node(ev, env, id);
    ev->depth--;
    return value;
}
