// SPDX-License-Identifier: Apache-2.0
// Calls: arguments to parameters by place and by name, functions of the script and of the language.
#include "lang/eval.h"

#include "lang/builtins.h"

// An argument list in extra: n, then (name or 0, offset, value) each.
typedef struct {
    const uint32_t *words;
    uint32_t n;
} Args;

static Args args_of(const Env *env, ExtraId args) {
    const uint32_t *extra = env->module->syntax->extra + args;
    return args ? (Args){extra + 1, extra[0]} : (Args){NULL, 0};
}

typedef struct {
    const uint32_t *words; // (name, offset, default or 0)...
    uint32_t n;
} Params;

static Params params_of(const Module *module, NodeId params) {
    if (!params) {
        return (Params){NULL, 0};
    }
    const Node *node = syntax_node(module->syntax, params);
    return (Params){module->syntax->extra + node->a, node->b};
}

// A fn or a def, as said in reports.
static const char *callee_text(Eval *ev, const Module *module, NodeId callee) {
    const Node *node = syntax_node(module->syntax, callee);
    return arena_printf(ev->arena, "%s %s", node->kind == NODE_DEF ? "def" : "fn",
                        symbol_text(ev->symbols, node->a));
}

// ---- Binding

// What arguments are bound to.
typedef struct {
    const Module *module;
    NodeId node; // NODE_FN or NODE_DEF
    Params params;
} Callee;

static Callee callee_of(const Module *module, NodeId node) {
    const Syntax *syntax = module->syntax;
    return (Callee){module, node, params_of(module, syntax->extra[syntax_node(syntax, node)->b])};
}

static uint32_t param_index(const Params *params, Symbol name) {
    uint32_t i = 0;
    while (i < params->n && params->words[3 * i] != name) {
        i++;
    }
    return i;
}

static void unknown_argument(Eval *ev, const Env *env, uint32_t offset, const Callee *callee,
                             Symbol name) {
    const Params *params = &callee->params;
    const char **names = ARENA_ARRAY(ev->arena, params->n, const char *), *all = "";
    for (uint32_t i = 0; i < params->n; i++) {
        names[i] = symbol_text(ev->symbols, params->words[3 * i]);
        all = i < 8 ? arena_printf(ev->arena, "%s%s%.40s", all, i ? ", " : "", names[i]) : all;
    }
    const char *near = diag_nearest(symbol_text(ev->symbols, name), names, params->n);
    eval_error_at(ev, syntax_word_span(env->module->syntax, offset),
                  near        ? arena_printf(ev->arena, "did you mean '%s'?", near)
                  : params->n ? arena_printf(ev->arena, "it takes: %s", all)
                              : "it takes nothing",
                  "%s has no parameter '%s'", callee_text(ev, callee->module, callee->node),
                  symbol_text(ev->symbols, name));
}

// Puts each argument's node in the place of its parameter.
static bool place_args(Eval *ev, const Env *env, NodeId node, Args args, const Callee *callee,
                       NodeId *placed) {
    const Params *params = &callee->params;
    uint32_t n_positional = 0;
    for (uint32_t i = 0; i < args.n; i++) {
        Symbol name = args.words[3 * i];
        uint32_t index = name ? param_index(params, name) : n_positional++;
        if (name && index == params->n) {
            unknown_argument(ev, env, args.words[3 * i + 1], callee, name);
            return false;
        }
        if (index >= params->n) {
            eval_error(ev, env, node, NULL, "%s takes %u argument%s, these are more",
                       callee_text(ev, callee->module, callee->node), params->n,
                       params->n == 1 ? "" : "s");
            return false;
        }
        if (placed[index]) {
            eval_error(ev, env, args.words[3 * i + 2], NULL, "%s: '%s' is given twice",
                       callee_text(ev, callee->module, callee->node),
                       symbol_text(ev->symbols, params->words[3 * index]));
            return false;
        }
        placed[index] = args.words[3 * i + 2];
    }
    return true;
}

static bool bind_value(Eval *ev, Scope *scope, Symbol name, Value value) {
    if (value_is_poison(&value)) {
        return false;
    }
    scope_bind(ev->arena, scope, name, BINDING_ARGUMENT)->value = value;
    return true;
}

bool eval_bind(Eval *ev, const Env *env, NodeId node, ExtraId args, const Module *module,
               NodeId callee_node, Scope *scope) {
    Callee callee = callee_of(module, callee_node);
    const Params *params = &callee.params;
    NodeId *placed = ARENA_ARRAY(ev->arena, params->n, NodeId);
    if (!place_args(ev, env, node, args_of(env, args), &callee, placed)) {
        return false;
    }
    const Env inside = {module, scope};
    bool is_ok = true;
    for (uint32_t i = 0; i < params->n; i++) {
        Symbol name = params->words[3 * i];
        NodeId by_default = params->words[3 * i + 2];
        if (scope_find_own(scope, name)) {
            continue; // set by the block of a copy
        }
        if (!placed[i] && !by_default) {
            eval_error(ev, env, node, NULL, "%s needs '%s'", callee_text(ev, module, callee_node),
                       symbol_text(ev->symbols, name));
            return false;
        }
        Value value =
            placed[i] ? eval_expr(ev, env, placed[i]) : eval_expr(ev, &inside, by_default);
        if (!bind_value(ev, scope, name, value)) {
            is_ok = false;
        } else if (!placed[i]) {
            scope_find_own(scope, name)->state = BINDING_DONE;
        }
    }
    return is_ok;
}

void eval_note_call(Eval *ev, unsigned n_errors, Span where, const Module *module, NodeId callee) {
    unsigned n = diag_n_errors(ev->diag);
    if (n > n_errors && n > ev->n_noted) {
        diag_note(ev->diag, where, "in this use of %s", callee_text(ev, module, callee));
        ev->n_noted = n;
    }
}

// ---- Applying

static bool enter(Eval *ev, const Env *env, NodeId node) {
    if (ev->calls < EVAL_MAX_CALLS) {
        ev->calls++;
        return true;
    }
    if (ev->loops) { // with a number in place of the variable it may end
        ev->unroll |= (1u << (ev->loops->depth + 1)) - 1;
        return false;
    }
    eval_error(ev, env, node, "recursion must end while the scene is loaded",
               "calls are nested more than %d deep", EVAL_MAX_CALLS);
    ev->stopped = true;
    return false;
}

static Value call_closure(Eval *ev, const Env *env, NodeId node, const Closure *closure,
                          ExtraId args) {
    const Syntax *syntax = closure->module->syntax;
    const uint32_t *extra = syntax->extra + syntax_node(syntax, closure->node)->b;
    const Env inside = {closure->module, scope_new(ev->arena, closure->scope)};
    if (!eval_bind(ev, env, node, args, closure->module, closure->node, inside.scope) ||
        !enter(ev, env, node)) {
        return value_poison();
    }
    unsigned n_errors = diag_n_errors(ev->diag);
    Value value = eval_expr(ev, &inside, extra[1]);
    ev->calls--;
    if (value_is_poison(&value) && diag_n_errors(ev->diag) > n_errors) {
        eval_note_call(ev, n_errors, syntax_span(env->module->syntax, node), closure->module,
                       closure->node);
    }
    return value;
}

static Value apply_graph(Eval *ev, const Closure *closure, const Value *x, const Env *env,
                         NodeId node) {
    if (!value_is(x, VALUE_NUMBER)) {
        return eval_error(ev, env, node, NULL, "this function takes a number, this is %s",
                          value_describe(ev->arena, x));
    }
    return value_scalar(VALUE_NUMBER, dag_substitute(ev->dag, closure->graph, IN_X, x->ref[0]));
}

Value eval_apply(Eval *ev, const Closure *closure, const Symbol *names, const Value *values,
                 uint32_t n, const Env *env, NodeId node) {
    if (closure->builtin >= 0) {
        return builtins_apply(ev, closure->builtin, values, n, env, node);
    }
    if (closure->is_graph) {
        return apply_graph(ev, closure, &values[0], env, node);
    }
    const Syntax *syntax = closure->module->syntax;
    const uint32_t *extra = syntax->extra + syntax_node(syntax, closure->node)->b;
    const Env inside = {closure->module, scope_new(ev->arena, closure->scope)};
    Params params = params_of(closure->module, extra[0]);
    for (uint32_t i = 0; i < params.n; i++) {
        Symbol name = params.words[3 * i];
        uint32_t k = 0;
        while (names && k < n && names[k] != name) {
            k++;
        }
        k = names ? k : i;
        if (k < n) {
            bind_value(ev, inside.scope, name, values[k]);
        } else if (params.words[3 * i + 2]) {
            bind_value(ev, inside.scope, name, eval_expr(ev, &inside, params.words[3 * i + 2]));
        } else {
            const char *text = names && n ? symbol_text(ev->symbols, names[0]) : "none";
            for (uint32_t j = 1; names && j < n; j++) {
                text = arena_printf(ev->arena, "%s %s", text, symbol_text(ev->symbols, names[j]));
            }
            return eval_error_at(ev, syntax_word_span(syntax, params.words[3 * i + 1]), NULL,
                                 "%s is not given a '%s' here; what it may take: %s",
                                 callee_text(ev, closure->module, closure->node),
                                 symbol_text(ev->symbols, name), text);
        }
    }
    if (!enter(ev, env, node)) {
        return value_poison();
    }
    Value value = eval_expr(ev, &inside, extra[1]);
    ev->calls--;
    return value;
}

// ---- Calls

static Value call_builtin(Eval *ev, const Env *env, NodeId node, int32_t builtin, ExtraId args_id) {
    Args args = args_of(env, args_id);
    BuiltinArgument *given = ARENA_ARRAY(ev->arena, args.n, BuiltinArgument);
    bool is_bad = false;
    for (uint32_t i = 0; i < args.n; i++) {
        given[i] = (BuiltinArgument){.name = args.words[3 * i],
                                     .offset = args.words[3 * i + 1],
                                     .node = args.words[3 * i + 2]};
        given[i].value = eval_expr(ev, env, given[i].node);
        is_bad = is_bad || value_is_poison(&given[i].value);
    }
    return is_bad ? value_poison() : builtins_call(ev, builtin, given, args.n, env, node);
}

static Value call_graph(Eval *ev, const Env *env, NodeId node, const Closure *closure,
                        ExtraId args_id) {
    Args args = args_of(env, args_id);
    if (args.n != 1 || args.words[0]) {
        return eval_error(ev, env, node, NULL, "this function takes 1 argument without a name");
    }
    Value x = eval_expr(ev, env, args.words[2]);
    return value_is_poison(&x) ? x : apply_graph(ev, closure, &x, env, args.words[2]);
}

Value eval_call(Eval *ev, const Env *env, NodeId id) {
    const Node *call = syntax_node(env->module->syntax, id);
    const Node *callee = syntax_node(env->module->syntax, call->a);
    if (callee->kind == NODE_NAME) {
        Scope *at = NULL;
        Binding *binding = scope_find(env->scope, callee->a, &at);
        int32_t builtin = binding ? -1 : builtins_find(ev->builtins, callee->a);
        if (builtin >= 0) {
            return call_builtin(ev, env, id, builtin, call->b);
        }
        if (!binding) {
            return builtins_unknown(ev, env, call->a, callee->a);
        }
    }
    Value function = eval_expr(ev, env, call->a);
    if (value_is_poison(&function)) {
        return function;
    }
    if (!value_is(&function, VALUE_FUNCTION)) {
        return eval_error(ev, env, call->a, NULL, "a function is expected before '(', this is %s",
                          value_describe(ev->arena, &function));
    }
    if (function.closure->is_graph) {
        return call_graph(ev, env, id, function.closure, call->b);
    }
    return function.closure->builtin >= 0
               ? call_builtin(ev, env, id, function.closure->builtin, call->b)
               : call_closure(ev, env, id, function.closure, call->b);
}
