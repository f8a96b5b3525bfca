// SPDX-License-Identifier: Apache-2.0
// The table of functions, and arguments checked against it.
#include "lang/builtins.h"

#include <stdlib.h>
#include <string.h>

const BuiltinInfo builtin_infos[BUILTIN_COUNT] = {
#define FUNCTION(id, name, params, result, run, op, help) {name, params, result, help},
#include "lang/builtins.def"
#undef FUNCTION
};

// PARAM(id, word in the table, as said in messages)
#define PARAM_TYPES(PARAM)                                                                         \
    PARAM(NUMBER, "number", "a number")                                                            \
    PARAM(ANGLE, "angle", "an angle")                                                              \
    PARAM(BOOL, "bool", "true or false")                                                           \
    PARAM(STRING, "string", "a string")                                                            \
    PARAM(COLOR, "color", "a color")                                                               \
    PARAM(VEC3, "vec3", "a vector of 3")                                                           \
    PARAM(VEC, "vec", "a vector")                                                                  \
    PARAM(ROTATION, "rotation", "a rotation")                                                      \
    PARAM(TRANSFORM, "transform", "a transform")                                                   \
    PARAM(MATERIAL, "material", "a material")                                                      \
    PARAM(CLIP, "clip", "a clip")                                                                  \
    PARAM(SCALAR, "scalar", "a number or an angle")                                                \
    PARAM(VALUE, "value", "a number, an angle or a vector")                                        \
    PARAM(ANY, "any", "a value")

typedef enum {
#define PARAM(id, word, text) PARAM_##id,
    PARAM_TYPES(PARAM)
#undef PARAM
        PARAM_TYPE_COUNT
} ParamType;

static const char *const param_words[PARAM_TYPE_COUNT] = {
#define PARAM(id, word, text) word,
    PARAM_TYPES(PARAM)
#undef PARAM
};

static const char *const param_texts[PARAM_TYPE_COUNT] = {
#define PARAM(id, word, text) text,
    PARAM_TYPES(PARAM)
#undef PARAM
};

typedef struct {
    Symbol name;
    ParamType type;
    bool is_variable; // takes one or more
    bool has_default;
    double value[3]; // the default; of vectors and colors three
} Param;

typedef struct {
    Param params[BUILTIN_MAX_PARAMS];
    uint32_t n, n_needed;
} Signature;

struct Builtins {
    Symbol names[BUILTIN_COUNT];
    Signature signatures[BUILTIN_COUNT];
    int16_t *by_symbol; // the builtin of a symbol, -1: none
    Symbol n_by_symbol;
};

// ---- The table, read once

// "0.5", "true", or "<0.5, 0.5, 1>"; a single number stands for three. Returns where it ends.
static const char *read_default(const char *text, double value[3]) {
    bool is_vector = *text == '<', is_word = *text >= 'a' && *text <= 'z';
    if (is_word) {
        value[0] = strncmp(text, "true", 4) == 0;
        return text + strcspn(text, ",");
    }
    char *end = (char *)text + is_vector;
    for (int k = 0; k < 3; k++) {
        if (k == 0 || is_vector) {
            value[k] = strtod(end + (k > 0 ? 2 : 0), &end);
        } else {
            value[k] = value[0];
        }
    }
    return end + is_vector;
}

// "size number = 0.5": one parameter, up to a comma.
static Param read_param(Symbols *symbols, const char **text) {
    Param param = {0};
    size_t n = strcspn(*text, " ");
    param.name = symbol_of(symbols, *text, n);
    *text += n + 1;
    n = strcspn(*text, " .,");
    while (strlen(param_words[param.type]) != n ||
           strncmp(*text, param_words[param.type], n) != 0) {
        param.type = (ParamType)(param.type + 1);
    }
    *text += n;
    if (strncmp(*text, "...", 3) == 0) {
        param.is_variable = true;
        *text += 3;
    } else if (strncmp(*text, " = ", 3) == 0) {
        param.has_default = true;
        *text = read_default(*text + 3, param.value);
    }
    *text += strncmp(*text, ", ", 2) == 0 ? 2 : 0;
    return param;
}

const Builtins *builtins_new(Arena *arena, Symbols *symbols) {
    Builtins *builtins = ARENA_NEW(arena, Builtins);
    for (int id = 0; id < BUILTIN_COUNT; id++) {
        Signature *signature = &builtins->signatures[id];
        builtins->names[id] =
            symbol_of(symbols, builtin_infos[id].name, strlen(builtin_infos[id].name));
        for (const char *text = builtin_infos[id].params; *text;) {
            Param param = read_param(symbols, &text);
            signature->params[signature->n++] = param;
            signature->n_needed += !param.has_default;
        }
    }
    for (int id = 0; id < BUILTIN_COUNT; id++) {
        Symbol end = builtins->names[id] + 1;
        builtins->n_by_symbol = end > builtins->n_by_symbol ? end : builtins->n_by_symbol;
    }
    builtins->by_symbol = ARENA_ARRAY(arena, builtins->n_by_symbol, int16_t);
    memset(builtins->by_symbol, -1, builtins->n_by_symbol * sizeof *builtins->by_symbol);
    for (int id = 0; id < BUILTIN_COUNT; id++) {
        builtins->by_symbol[builtins->names[id]] = (int16_t)id;
    }
    return builtins;
}

int32_t builtins_find(const Builtins *builtins, Symbol name) {
    return name < builtins->n_by_symbol ? builtins->by_symbol[name] : -1;
}

size_t builtins_names(const char **names, size_t max) {
    size_t n = 0;
    for (int id = 0; id < BUILTIN_COUNT && n < max; id++) {
        names[n++] = builtin_infos[id].name;
    }
    return n;
}

// ---- Reports

Value builtins_unknown(Eval *ev, const Env *env, NodeId callee, Symbol name) {
    enum { MAX_NAMES = 512 };
    const char *names[MAX_NAMES], *text = symbol_text(ev->symbols, name);
    const char *foreign = schema_foreign_word(NULL, text), *near = NULL;
    size_t n = 0;
    if (syntax_node(env->module->syntax, callee) == ev->material_callee) {
        for (int id = 0; id < BUILTIN_COUNT; id++) {
            if (strcmp(builtin_infos[id].result, "material") == 0) {
                names[n++] = builtin_infos[id].name;
            }
        }
        near = diag_nearest(text, names, n);
    }
    n = builtins_names(names, MAX_NAMES);
    n += scope_names(env->scope, ev->symbols, names + n, MAX_NAMES - n);
    near = near ? near : diag_nearest(text, names, n);
    return eval_error(ev, env, callee,
                      foreign ? foreign
                      : near  ? arena_printf(ev->arena, "did you mean '%s'?", near)
                              : NULL,
                      "there is no function '%s'", text);
}

static const char *usage(Eval *ev, int32_t id) {
    return arena_printf(ev->arena, "%s(%s)", builtin_infos[id].name, builtin_infos[id].params);
}

const char *builtins_vector_hint(Eval *ev, const Value *value) {
    double x[4];
    if (!value_is(value, VALUE_LIST) || value->list->n < 2 || value->list->n > 4) {
        return NULL;
    }
    const char *text = "write <";
    for (uint32_t i = 0; i < value->list->n; i++) {
        const Value *item = &value->list->items[i];
        if (!value_is(item, VALUE_NUMBER)) {
            return NULL;
        }
        text = dag_is_const(ev->dag, item->ref[0], &x[i])
                   ? arena_printf(ev->arena, "%s%s%.15g", text, i ? ", " : "", x[i])
                   : arena_printf(ev->arena, "%s%s%c", text, i ? ", " : "", "xyzw"[i]);
    }
    return arena_printf(ev->arena, "%s>", text);
}

static const char *argument_hint(Eval *ev, ParamType type, const Value *value) {
    double x;
    bool is_known = value->type == VALUE_NUMBER && dag_is_const(ev->dag, value->ref[0], &x);
    if (type == PARAM_CLIP) {
        return "it is named in a def: clip walk = 0s..1s";
    }
    if (type == PARAM_ANGLE && is_known) {
        return arena_printf(ev->arena, "write %.15gdeg", x);
    }
    if (type == PARAM_ANGLE && value->type == VALUE_NUMBER) {
        return "multiply by 1deg, 1rad or 1turn to make it an angle";
    }
    if ((type == PARAM_COLOR || type == PARAM_VEC3) && is_known) {
        return arena_printf(ev->arena, "write <%.15g, %.15g, %.15g>", x, x, x);
    }
    if (type == PARAM_COLOR || type == PARAM_VEC3 || type == PARAM_VEC) {
        return builtins_vector_hint(ev, value);
    }
    if (type == PARAM_NUMBER && value->type == VALUE_ANGLE) {
        return "divide by 1deg, 1rad or 1turn to make it a number";
    }
    return NULL;
}

// ---- Checks

static bool fits(ParamType type, Value *value) {
    switch (type) {
    case PARAM_NUMBER:
        return value->type == VALUE_NUMBER;
    case PARAM_ANGLE:
        return value->type == VALUE_ANGLE;
    case PARAM_BOOL:
        return value->type == VALUE_BOOL;
    case PARAM_STRING:
        return value->type == VALUE_STRING;
    case PARAM_COLOR:
        if (value_is_vec3(value)) {
            value->type = VALUE_COLOR;
            return true;
        }
        return false;
    case PARAM_VEC3:
        return value_is_vec3(value);
    case PARAM_VEC:
        return value->type == VALUE_VEC || value->type == VALUE_COLOR;
    case PARAM_ROTATION:
        return value->type == VALUE_ROTATION;
    case PARAM_TRANSFORM:
        return value->type == VALUE_TRANSFORM || value->type == VALUE_ROTATION;
    case PARAM_MATERIAL:
        return value->type == VALUE_MATERIAL;
    case PARAM_CLIP:
        return value->type == VALUE_CLIP;
    case PARAM_SCALAR:
        return value->type == VALUE_NUMBER || value->type == VALUE_ANGLE;
    case PARAM_VALUE:
        return value->type == VALUE_NUMBER || value->type == VALUE_ANGLE ||
               value->type == VALUE_VEC || value->type == VALUE_COLOR;
    default:
        return true;
    }
}

static bool check_argument(Eval *ev, const Env *env, NodeId node, int32_t id, const Param *param,
                           Value *value) {
    if (fits(param->type, value)) {
        return true;
    }
    eval_error(ev, env, node, argument_hint(ev, param->type, value), "%s: '%s' is %s, this is %s",
               builtin_infos[id].name, symbol_text(ev->symbols, param->name),
               param_texts[param->type], value_describe(ev->arena, value));
    return false;
}

// Scalars and values of one call are of one type: min(1, 2deg) is a mistake. A number may stand
// beside vectors where the function works by component.
static bool check_alike(Eval *ev, const BuiltinCall *call, const Signature *signature) {
    const Value *first = NULL;
    for (uint32_t i = 0; i < call->n; i++) {
        ParamType type = signature->params[i < signature->n ? i : signature->n - 1].type;
        if (type != PARAM_SCALAR && type != PARAM_VALUE && type != PARAM_VEC) {
            continue;
        }
        const Value *value = &call->args[i];
        bool is_alike = !first || (value->n == first->n &&
                                   (value->type == VALUE_ANGLE) == (first->type == VALUE_ANGLE));
        if (!is_alike) {
            eval_error(
                ev, call->env, call->nodes[i] ? call->nodes[i] : call->node,
                argument_hint(ev, first->type == VALUE_ANGLE ? PARAM_ANGLE : PARAM_ANY, value),
                "%s: %s and %s do not go together", builtin_infos[call->id].name,
                value_describe(ev->arena, first), value_describe(ev->arena, value));
            return false;
        }
        first = first ? first : value;
    }
    return true;
}

static Value default_value(Eval *ev, const Param *param) {
    Ref refs[3];
    for (int k = 0; k < 3; k++) {
        refs[k] = dag_const(ev->dag, param->value[k]);
    }
    switch (param->type) {
    case PARAM_VEC3:
        return value_vec(VALUE_VEC, refs, 3);
    case PARAM_COLOR:
        return value_vec(VALUE_COLOR, refs, 3);
    case PARAM_ANGLE:
        return value_scalar(VALUE_ANGLE, refs[0]);
    case PARAM_BOOL:
        return value_scalar(VALUE_BOOL, refs[0]);
    default:
        return value_scalar(VALUE_NUMBER, refs[0]);
    }
}

// Arguments in the order of the parameters; variable ones behind. false: reported.
static bool place(Eval *ev, const Env *env, NodeId node, int32_t id, const Signature *signature,
                  const BuiltinArgument *args, uint32_t n, Value *values, NodeId *nodes) {
    uint32_t n_positional = 0;
    bool is_variable = signature->n && signature->params[signature->n - 1].is_variable;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t index = n_positional;
        if (args[i].name) {
            index = 0;
            while (index < signature->n && signature->params[index].name != args[i].name) {
                index++;
            }
            if (index == signature->n) {
                eval_error_at(ev, syntax_word_span(env->module->syntax, args[i].offset),
                              usage(ev, id), "%s has no parameter '%s'", builtin_infos[id].name,
                              symbol_text(ev->symbols, args[i].name));
                return false;
            }
        } else {
            n_positional++;
        }
        if (index >= signature->n && !is_variable) {
            eval_error(ev, env, args[i].node, usage(ev, id),
                       "%s takes %s%u argument%s, these are %u", builtin_infos[id].name,
                       signature->n_needed < signature->n ? "at most " : "", signature->n,
                       signature->n == 1 ? "" : "s", n);
            return false;
        }
        if (values[index].type != VALUE_POISON) {
            eval_error(ev, env, args[i].node, NULL, "%s: '%s' is given twice",
                       builtin_infos[id].name,
                       symbol_text(ev->symbols, signature->params[index].name));
            return false;
        }
        values[index] = args[i].value;
        nodes[index] = args[i].node;
    }
    for (uint32_t i = 0; i < signature->n; i++) {
        if (values[i].type == VALUE_POISON) {
            if (!signature->params[i].has_default) {
                eval_error(ev, env, node, usage(ev, id), "%s needs '%s'", builtin_infos[id].name,
                           symbol_text(ev->symbols, signature->params[i].name));
                return false;
            }
            values[i] = default_value(ev, &signature->params[i]);
        }
    }
    return true;
}

Value builtins_call(Eval *ev, int32_t id, const BuiltinArgument *args, uint32_t n, const Env *env,
                    NodeId node) {
    const Signature *signature = &ev->builtins->signatures[id];
    const BuiltinAction *action = &builtin_actions[id];
    uint32_t room = n > signature->n ? n : signature->n;
    if (!action->run) {
        return eval_error(ev, env, node, NULL, "not supported yet: %s(...)",
                          builtin_infos[id].name);
    }
    Value *values = ARENA_ARRAY(ev->arena, room, Value);
    NodeId *nodes = ARENA_ARRAY(ev->arena, room, NodeId);
    if (!place(ev, env, node, id, signature, args, n, values, nodes)) {
        return value_poison();
    }
    for (uint32_t i = 0; i < room; i++) {
        const Param *param = &signature->params[i < signature->n ? i : signature->n - 1];
        if (!check_argument(ev, env, nodes[i] ? nodes[i] : node, id, param, &values[i])) {
            return value_poison();
        }
    }
    BuiltinCall call = {ev, env, node, (BuiltinId)id, action->op, values, nodes, room};
    return check_alike(ev, &call, signature) ? action->run(&call) : value_poison();
}

Value builtins_apply(Eval *ev, int32_t id, const Value *values, uint32_t n, const Env *env,
                     NodeId node) {
    BuiltinArgument *args = ARENA_ARRAY(ev->arena, n, BuiltinArgument);
    for (uint32_t i = 0; i < n; i++) {
        args[i] = (BuiltinArgument){.node = node, .value = values[i]};
    }
    return builtins_call(ev, id, args, n, env, node);
}
