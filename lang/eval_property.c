// SPDX-License-Identifier: Apache-2.0
// Properties and transforms: evaluated, checked against the schema, with hints.
#include "lang/object.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "lang/builtins.h"
#include "lang/eval_clip.h"

enum {
    MOTION_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 15u << IN_LOOP0,
    POINT_INPUTS = 1u << IN_U | 1u << IN_V | 7u << IN_PX | 7u << IN_NX,
    SHADING_INPUTS = MOTION_INPUTS | POINT_INPUTS | 7u << IN_WX | 7u << IN_WNX,
};

// Blocks of properties that are free again: objects within objects are few, one after another many.
typedef struct GivenBlock {
    struct GivenBlock *next;
    Given given[OBJECT_MAX_GIVEN];
} GivenBlock;

void object_begin(Eval *ev, Object *object) {
    GivenBlock *block = ev->free_given;
    if (block) {
        ev->free_given = block->next;
    } else {
        block = ARENA_NEW(ev->arena, GivenBlock);
    }
    object->given = block->given;
    object->n_given = 0;
}

void object_end(Eval *ev, Object *object) {
    GivenBlock *block = (GivenBlock *)((char *)object->given - offsetof(GivenBlock, given));
    block->next = ev->free_given;
    ev->free_given = block;
    object->given = NULL;
}

const Given *object_given(const Object *object, PropertyId id) {
    for (uint32_t i = 0; i < object->n_given; i++) {
        if (object->given[i].id == id) {
            return &object->given[i];
        }
    }
    return NULL;
}

// ---- Reports

// 1-24 is meant as 1..24, 24 as 1..24.
static const char *range_hint(Eval *ev, const Env *env, NodeId node, double x) {
    const Syntax *syntax = env->module->syntax;
    const Node *n = syntax_node(syntax, node);
    if (n->kind == NODE_BINARY && n->aux == OPERATOR_SUB &&
        syntax_node(syntax, n->a)->kind == NODE_NUMBER &&
        syntax_node(syntax, n->b)->kind == NODE_NUMBER) {
        return arena_printf(ev->arena, "write %.15g..%.15g",
                            syntax_number(syntax_node(syntax, n->a)),
                            syntax_number(syntax_node(syntax, n->b)));
    }
    return arena_printf(ev->arena, "write %.15g..%.15g", x > 1 ? 1 : x, x);
}

static bool wrong_type(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                       const Value *value) {
    double x;
    const char *hint = NULL;
    bool is_known = value_is(value, VALUE_NUMBER) && dag_is_const(ev->dag, value->ref[0], &x);
    if (info->type == PROPERTY_TYPE_ANGLE && is_known && !value->dimension) {
        hint = arena_printf(ev->arena, "write %.15gdeg", x);
    } else if ((info->type == PROPERTY_TYPE_VEC3 || info->type == PROPERTY_TYPE_COLOR) &&
               is_known) {
        hint = arena_printf(ev->arena, "write <%.15g, %.15g, %.15g>", x, x, x);
    } else if (info->type == PROPERTY_TYPE_VEC2 && is_known) {
        hint = arena_printf(ev->arena, "write <%.15g, %.15g>", x, x);
    } else if (info->type == PROPERTY_TYPE_RANGE && is_known) {
        hint = range_hint(ev, env, node, x);
    } else if (info->type == PROPERTY_TYPE_VEC2 || info->type == PROPERTY_TYPE_VEC3 ||
               info->type == PROPERTY_TYPE_COLOR) {
        hint = builtins_vector_hint(ev, value);
    } else if (info == &property_infos[PROPERTY_SHUTTER_LENGTH] && value_is(value, VALUE_ANGLE)) {
        hint = "write angle = ...";
    } else if (info == &property_infos[PROPERTY_SHUTTER_ANGLE] && value->dimension) {
        hint = "write length = ...";
    } else if (info->type == PROPERTY_TYPE_BOOL && value_is(value, VALUE_NUMBER)) {
        hint = "write true, false or a comparison: t > 1s";
    } else if (info->type == PROPERTY_TYPE_MATERIAL && value_is_vec3(value)) {
        hint = "write matte(...)";
    } else if (info->type == PROPERTY_TYPE_FUNCTION) {
        hint = arena_printf(ev->arena, "write fn %s(%s) = ...", info->name,
                            info->names[0] == 'u'   ? "u, v"
                            : info->names[0] == 'd' ? "dir, height"
                                                    : "p");
    }
    eval_error(ev, env, node, hint, "%s is %s, this is %s", info->name,
               schema_property_type_text(info), value_describe(ev->arena, value));
    return false;
}

// The bounds of a component, known or at least sometimes.
static bool in_range(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info, double x) {
    bool is_positive = info->low == SCHEMA_POSITIVE;
    if (!isfinite(x)) {
        eval_error(ev, env, node, NULL, "%s is not a finite number", info->name);
        return false;
    }
    if (x >= info->low && x <= info->high) {
        return true;
    }
    bool is_angle = info->type == PROPERTY_TYPE_ANGLE;
    double factor = is_angle ? unit_infos[UNIT_DEG].factor : 1;
    const char *unit = is_angle ? "deg" : "", *bound;
    if (is_positive && x < info->low) {
        bound = "more than 0";
    } else if (x < info->low) {
        bound = arena_printf(ev->arena, "at least %.6g%s", info->low / factor, unit);
    } else {
        bool is_open = info->high == SCHEMA_UNDER_HALF_TURN;
        bound = arena_printf(ev->arena, "%s %.6g%s", is_open ? "less than" : "at most",
                             info->high / factor, unit);
    }
    eval_error(ev, env, node, NULL, "%s is %s, this is %.6g%s", info->name, bound, x / factor,
               unit);
    return false;
}

static bool check_scalars(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                          const Ref *refs, uint32_t n, uint32_t inputs) {
    for (uint32_t i = 0; i < n; i++) {
        double x;
        uint32_t read = dag_inputs(ev->dag, refs[i]);
        if (dag_is_const(ev->dag, refs[i], &x)) {
            if (!in_range(ev, env, node, info, x)) {
                return false;
            }
        } else if (info->when == SCHEMA_FIXED) {
            if (!eval_need(ev, env, node, refs[i], info->name, &x)) {
                return false;
            }
        } else if (read & ~inputs) {
            eval_error(ev, env, node, NULL, "%s can not depend on %s", info->name,
                       eval_input_name(read & ~inputs));
            return false;
        } else if (!eval_copies_within(ev, refs[i], info->low, info->high)) {
            return false;
        }
    }
    return true;
}

static bool check_dimension(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                            const Value *value) {
    if (!value->dimension || !info->dimension || value->dimension == info->dimension) {
        return true;
    }
    eval_error(ev, env, node, NULL, "%s is %s, this is %s", info->name,
               dimension_names[info->dimension], dimension_names[value->dimension]);
    return false;
}

// ---- One type after another

static bool check_vector(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                         Value *value) {
    uint32_t n = info->type == PROPERTY_TYPE_VEC2 ? 2 : 3;
    if ((!value_is(value, VALUE_VEC) && !value_is(value, VALUE_COLOR)) || value->n != n) {
        return wrong_type(ev, env, node, info, value);
    }
    value->type = info->type == PROPERTY_TYPE_COLOR ? VALUE_COLOR : VALUE_VEC;
    return check_dimension(ev, env, node, info, value) &&
           check_scalars(ev, env, node, info, value->ref, n, MOTION_INPUTS);
}

static bool check_count(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                        const Value *value) {
    double x = 0;
    if (!value_is(value, VALUE_NUMBER) || value->dimension) {
        return wrong_type(ev, env, node, info, value);
    }
    if (!eval_need(ev, env, node, value->ref[0], info->name, &x) ||
        !in_range(ev, env, node, info, x)) {
        return false;
    }
    if (x != floor(x)) {
        eval_error(ev, env, node, NULL, "%s is a whole number, this is %.15g", info->name, x);
        return false;
    }
    return true;
}

static bool check_scalar(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                         ValueType type, const Value *value) {
    // An angle per second is an angle where its unit is forgotten; here it stands as written.
    if (!value_is(value, type)) {
        return wrong_type(ev, env, node, info, value);
    }
    if (value->dimension == DIMENSION_ANGULAR_RATE) {
        eval_error(ev, env, node, "multiply by a time, such as t", "%s is %s, this is %s",
                   info->name, schema_property_type_text(info), dimension_names[value->dimension]);
        return false;
    }
    return check_dimension(ev, env, node, info, value) &&
           check_scalars(ev, env, node, info, value->ref, 1, MOTION_INPUTS);
}

// One, or a list of them.
static bool check_numbers(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                          const Value *value) {
    if (!value_is(value, VALUE_LIST)) {
        return check_scalar(ev, env, node, info, VALUE_NUMBER, value);
    }
    for (uint32_t i = 0; i < value->list->n; i++) {
        const Value *item = &value->list->items[i];
        if (!value_is(item, VALUE_NUMBER)) {
            eval_error(ev, env, node, NULL, "%s is %s, item %u is %s", info->name,
                       schema_property_type_text(info), i, value_describe(ev->arena, item));
            return false;
        }
        if (!check_scalar(ev, env, node, info, VALUE_NUMBER, item)) {
            return false;
        }
    }
    return true;
}

static bool check_range(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                        const Value *value) {
    if (!value_is(value, VALUE_RANGE)) {
        return wrong_type(ev, env, node, info, value);
    }
    Ref ends[2] = {value->range->low, value->range->high};
    double low = 0, high = 0;
    if (!check_scalars(ev, env, node, info, ends, 2, 0)) {
        return false;
    }
    dag_is_const(ev->dag, ends[0], &low);
    dag_is_const(ev->dag, ends[1], &high);
    if (high < low) {
        eval_error(ev, env, node, NULL, "%s ends before it begins", info->name);
        return false;
    }
    return true;
}

static bool check_parts(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                        const MaterialValue *material) {
    return check_scalars(ev, env, node, info, material->ref, material->n, SHADING_INPUTS) &&
           (material->kind != MATERIAL_MIX ||
            (check_parts(ev, env, node, info, material->parts[0]) &&
             check_parts(ev, env, node, info, material->parts[1])));
}

static bool check_material(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                           const Value *value) {
    if (!value_is(value, VALUE_MATERIAL)) {
        return wrong_type(ev, env, node, info, value);
    }
    return check_parts(ev, env, node, info, value->material);
}

// Every parameter without a default must be one that the property's function is given.
static bool check_function(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                           const Value *value) {
    if (!value_is(value, VALUE_FUNCTION)) {
        return wrong_type(ev, env, node, info, value);
    }
    const Closure *closure = value->closure;
    const char *given = info->type == PROPERTY_TYPE_FUNCTION ? info->names : "x";
    if (closure->builtin >= 0 || closure->is_graph) {
        return true;
    }
    const Syntax *syntax = closure->module->syntax;
    NodeId params = syntax->extra[syntax_node(syntax, closure->node)->b];
    const Node *list = params ? syntax_node(syntax, params) : NULL;
    for (uint32_t i = 0; list && i < list->b; i++) {
        const uint32_t *words = syntax->extra + list->a + 3 * i;
        const char *name = symbol_text(ev->symbols, words[0]);
        if (!words[2] && !schema_has_word(given, name)) {
            eval_error_at(ev, syntax_word_span(syntax, words[1]),
                          arena_printf(ev->arena, "it may take: %s", given),
                          "%s is not given a '%s'", info->name, name);
            return false;
        }
    }
    return true;
}

static bool check_transform(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                            Value *value) {
    if (!value_is(value, VALUE_TRANSFORM) && !value_is(value, VALUE_ROTATION)) {
        return wrong_type(ev, env, node, info, value);
    }
    uint32_t read = value_inputs(ev->dag, value) & ~(uint32_t)MOTION_INPUTS;
    if (read) {
        eval_error(ev, env, node, NULL, "%s can not depend on %s", info->name,
                   eval_input_name(read));
        return false;
    }
    return true;
}

static bool check_strings(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                          Value *value) {
    if (!value_is(value, VALUE_LIST)) {
        return value_is(value, VALUE_STRING) || wrong_type(ev, env, node, info, value);
    }
    if (value->list->n == 0) {
        eval_error(ev, env, node, NULL, "%s is an empty list", info->name);
        return false;
    }
    for (uint32_t i = 0; i < value->list->n; i++) {
        const Value *item = &value->list->items[i];
        if (!value_is(item, VALUE_STRING)) {
            eval_error(ev, env, node, NULL, "%s is a list of strings, item %u is %s", info->name, i,
                       value_describe(ev->arena, item));
            return false;
        }
    }
    return true;
}

static bool check_value(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                        Value *value) {
    switch (info->type) {
    case PROPERTY_TYPE_NUMBER:
        return check_scalar(ev, env, node, info, VALUE_NUMBER, value);
    case PROPERTY_TYPE_ANGLE:
        return check_scalar(ev, env, node, info, VALUE_ANGLE, value);
    case PROPERTY_TYPE_BOOL:
        return check_scalar(ev, env, node, info, VALUE_BOOL, value);
    case PROPERTY_TYPE_COUNT:
        return check_count(ev, env, node, info, value);
    case PROPERTY_TYPE_STRING:
        return value_is(value, VALUE_STRING) || wrong_type(ev, env, node, info, value);
    case PROPERTY_TYPE_STRINGS:
        return check_strings(ev, env, node, info, value);
    case PROPERTY_TYPE_VEC2:
    case PROPERTY_TYPE_VEC3:
    case PROPERTY_TYPE_COLOR:
        return check_vector(ev, env, node, info, value);
    case PROPERTY_TYPE_RANGE:
        return check_range(ev, env, node, info, value);
    case PROPERTY_TYPE_MATERIAL:
        return check_material(ev, env, node, info, value);
    case PROPERTY_TYPE_FUNCTION:
        return check_function(ev, env, node, info, value);
    case PROPERTY_TYPE_WORD_OR_FUNCTION:
        return value_is(value, VALUE_STRING) || check_function(ev, env, node, info, value);
    case PROPERTY_TYPE_TRANSFORM:
        return check_transform(ev, env, node, info, value);
    case PROPERTY_TYPE_NUMBER_OR_LIST:
        return check_numbers(ev, env, node, info, value);
    case PROPERTY_TYPE_LIST:
        return value_is(value, VALUE_LIST) || wrong_type(ev, env, node, info, value);
    default:
        return true;
    }
}

// ---- Words

static const char *choices(Eval *ev, const PropertyInfo *info) {
    bool has_functions = info->type == PROPERTY_TYPE_WORD_OR_FUNCTION;
    return arena_printf(ev->arena, "it is one of: %s%s", info->names,
                        has_functions ? " trapezoid(a, b), or a function of x" : "");
}

static const char *word_near(Eval *ev, const PropertyInfo *info, const char *text) {
    const char *names[32], *words = info->names;
    size_t n = 0;
    for (const char *at = words; *at && n < 32; at += *at == ' ') {
        size_t size = strcspn(at, " ");
        names[n++] = arena_string(ev->arena, at, size);
        at += size;
    }
    const char *near = diag_nearest(text, names, n);
    return near ? arena_printf(ev->arena, "did you mean %s?", near) : choices(ev, info);
}

// A bare word, or the same in quotes. A name that is none of the words may still be a value.
static bool read_word(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info,
                      Value *value) {
    const Node *n = syntax_node(env->module->syntax, node);
    if (n->kind != NODE_NAME && n->kind != NODE_STRING) {
        return false;
    }
    const char *text = symbol_text(ev->symbols, n->a);
    if (schema_has_word(info->names, text)) {
        *value = (Value){.type = VALUE_STRING, .symbol = n->a};
        return true;
    }
    Scope *at = NULL;
    if (n->kind == NODE_STRING || !scope_find(env->scope, n->a, &at)) {
        eval_error(ev, env, node, word_near(ev, info, text), "%s can not be '%s'", info->name,
                   text);
        *value = value_poison();
        return true;
    }
    return false;
}

static Value read_value(Eval *ev, const Env *env, NodeId node, const PropertyInfo *info) {
    Value value;
    bool is_word = schema_takes_words(info);
    if (is_word && read_word(ev, env, node, info, &value)) {
        return value;
    }
    const Syntax *syntax = env->module->syntax;
    bool is_material = info->type == PROPERTY_TYPE_MATERIAL;
    ev->material_callee = is_material && syntax_node(syntax, node)->kind == NODE_CALL
                              ? syntax_node(syntax, syntax_node(syntax, node)->a)
                              : NULL;
    value = eval_expr(ev, env, node);
    if (value_is_poison(&value) || !is_word) {
        return value;
    }
    if (value_is(&value, VALUE_STRING) &&
        schema_has_word(info->names, symbol_text(ev->symbols, value.symbol))) {
        return value;
    }
    if (info->type == PROPERTY_TYPE_WORD_OR_FUNCTION && value_is(&value, VALUE_FUNCTION)) {
        return value;
    }
    bool is_number = info->type == PROPERTY_TYPE_WORD_OR_NUMBER && value_is(&value, VALUE_NUMBER);
    if (!is_number || !check_scalars(ev, env, node, info, value.ref, 1, 0)) {
        return is_number ? value_poison()
                         : eval_error(ev, env, node, choices(ev, info), "%s is %s, this is %s",
                                      info->name, schema_property_type_text(info),
                                      value_describe(ev->arena, &value));
    }
    return value;
}

// ---- The doors

static void unknown_property(Eval *ev, const Env *env, const Object *object, NodeId statement,
                             const char *name) {
    enum { MAX_NAMES = 64 };
    Span where = syntax_name_span(env->module->syntax, statement);
    const char *names[MAX_NAMES];
    const char *foreign = schema_foreign_word(node_infos[object->kind].name, name);
    if (!object->name) {
        eval_error_at(ev, where, arena_printf(ev->arena, "write let %s = ...", name),
                      "'%s' is a property of nothing here", name);
        return;
    }
    size_t n = schema_property_names(object->kind, names, MAX_NAMES);
    const char *near = diag_nearest(name, names, n < MAX_NAMES ? n : MAX_NAMES);
    eval_error_at(ev, where,
                  foreign ? foreign
                  : near  ? arena_printf(ev->arena, "did you mean '%s'?", near)
                          : NULL,
                  "%s has no property '%s'", object->name, name);
}

bool property_is_function(const Object *object, const char *name) {
    PropertyId id = schema_property(object->kind, name);
    PropertyType type = id == PROPERTY_COUNT ? PROPERTY_TYPE_ANY : property_infos[id].type;
    return type == PROPERTY_TYPE_FUNCTION || type == PROPERTY_TYPE_WORD_OR_FUNCTION;
}

// A parameter of a def, set in the block of its copy.
static bool is_argument(Eval *ev, const Env *env, Object *object, NodeId statement) {
    const Node *s = syntax_node(env->module->syntax, statement);
    if (!object->def_params || s->kind != NODE_PROPERTY) {
        return false;
    }
    const Syntax *syntax = object->def_env->module->syntax;
    const Node *list = syntax_node(syntax, object->def_params);
    for (uint32_t i = 0; i < list->b; i++) {
        if (syntax->extra[list->a + 3 * i] != s->a) {
            continue;
        }
        Binding *old = scope_find_own(object->arguments, s->a);
        if (old) {
            eval_error_at(ev, syntax_name_span(env->module->syntax, statement), NULL,
                          "'%s' is given twice", symbol_text(ev->symbols, s->a));
            diag_note(ev->diag, old->where, "first given here");
            return true;
        }
        Value value = eval_expr(ev, env, s->b);
        Binding *binding = scope_bind(ev->arena, object->arguments, s->a, BINDING_ARGUMENT);
        binding->value = value;
        binding->where = syntax_name_span(env->module->syntax, statement);
        return true;
    }
    return false;
}

static Value function_value(Eval *ev, const Env *env, NodeId statement) {
    Closure *closure = ARENA_NEW(ev->arena, Closure);
    *closure = (Closure){env->module, env->scope, statement, -1};
    env->module->flags[statement] |= MODULE_USED;
    return (Value){.type = VALUE_FUNCTION, .closure = closure};
}

void eval_property(Eval *ev, const Env *env, Object *object, NodeId statement) {
    const Syntax *syntax = env->module->syntax;
    const Node *s = syntax_node(syntax, statement);
    if (is_argument(ev, env, object, statement)) {
        return;
    }
    const char *name = symbol_text(ev->symbols, s->a);
    PropertyId id = schema_property(object->kind, name);
    if (id == PROPERTY_COUNT) {
        unknown_property(ev, env, object, statement, name);
        return;
    }
    const PropertyInfo *info = &property_infos[id];
    const Given *old = object_given(object, id);
    Given given = {.id = id, .env = *env, .name = {s->lo, s->lo + (uint32_t)strlen(name)}};
    if (old && old->env.module == env->module && old->name.lo == s->lo) {
        return; // it was needed before the others
    }
    if (old) {
        eval_error_at(ev, syntax_name_span(syntax, statement), NULL, "%s is given twice", name);
        diag_note(ev->diag, old->name, "first given here");
        return;
    }
    if (info->status == SCHEMA_LATER) {
        eval_error_at(ev, syntax_name_span(syntax, statement), NULL,
                      "not supported yet: '%s' of %s", name,
                      object->name ? object->name : "a file");
        return;
    }
    bool is_fn = s->kind == NODE_FN;
    if (id == PROPERTY_INSTANCE_CLIPS) {
        given.env.scope = scope_new(ev->arena, env->scope);
        clips_bind(ev, object->clips, given.env.scope);
    }
    given.node = is_fn ? statement : s->b;
    given.value =
        is_fn ? function_value(ev, env, statement) : read_value(ev, &given.env, s->b, info);
    if (!value_is_poison(&given.value) && !check_value(ev, env, given.node, info, &given.value)) {
        given.value = value_poison();
    }
    given.where =
        (Span){syntax_node(syntax, given.node)->lo, syntax_node(syntax, given.node)->lo + 1};
    if (object->n_given < OBJECT_MAX_GIVEN) {
        object->given[object->n_given++] = given;
    }
}

Value object_value(Eval *ev, const Object *object, PropertyId id) {
    const Given *given = object_given(object, id);
    return given ? given->value : eval_default(ev, id);
}

bool eval_check_vec3(Eval *ev, Span where, const char *what, const Value *value, uint32_t inputs) {
    if (value_is_poison(value)) {
        return false;
    }
    if (!value_is_vec3(value)) {
        eval_error_at(ev, where, NULL, "%s gives a vector of 3, this is %s", what,
                      value_describe(ev->arena, value));
        return false;
    }
    uint32_t read = value_inputs(ev->dag, value) & ~inputs;
    if (read) {
        eval_error_at(ev, where, NULL, "%s can not depend on %s", what, eval_input_name(read));
        return false;
    }
    for (uint32_t i = 0; i < 3; i++) {
        double x;
        if (dag_is_const(ev->dag, value->ref[i], &x) && !isfinite(x)) {
            eval_error_at(ev, where, NULL, "%s is not a finite number", what);
            return false;
        }
    }
    return true;
}
