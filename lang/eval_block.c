// SPDX-License-Identifier: Apache-2.0
// Blocks: names, then properties and transforms, then what stands in them. Loops and choices.
#include "lang/object.h"

#include <stdio.h>
#include <string.h>

#include "lang/builtins.h"
#include "lang/eval_run.h"
#include "lang/eval_sim.h"
#include "lang/loader.h"
#include "lang/lower.h"

// ---- Names

// t and its like mean the same everywhere.
static bool is_reserved(Eval *ev, Symbol name) {
    static const char *const words[] = {"true", "false", "pi", "x", "y", "z", "t", "T"};
    const char *text = symbol_text(ev->symbols, name);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp(text, words[i]) == 0) {
            return true;
        }
    }
    return false;
}

Binding *eval_bind_name(Eval *ev, const Env *env, NodeId statement, Symbol name, BindingKind kind) {
    const char *text = symbol_text(ev->symbols, name);
    Span where = syntax_name_span(env->module->syntax, statement);
    if (is_reserved(ev, name)) {
        eval_error_at(ev, where, "another name is needed", "'%s' is predefined", text);
        return NULL;
    }
    if (kind == BINDING_DEF && schema_node(text) != OBJECT_KINDS) {
        eval_error_at(ev, where, "another name is needed", "'%s' is a node of the language", text);
        return NULL;
    }
    const Binding *old = scope_find_own(env->scope, name);
    if (old) {
        eval_error_at(ev, where, NULL, "'%s' is defined twice", text);
        diag_note(ev->diag, old->where, "first defined here");
        return NULL;
    }
    Binding *binding = scope_bind(ev->arena, env->scope, name, kind);
    binding->module = env->module;
    binding->node = statement;
    binding->where = where;
    if (kind == BINDING_FN) {
        Closure *closure = ARENA_NEW(ev->arena, Closure);
        *closure = (Closure){env->module, env->scope, statement, -1};
        binding->value = (Value){.type = VALUE_FUNCTION, .closure = closure};
    }
    return binding;
}

static void declare(Eval *ev, const Env *env, NodeId statement, BindingKind kind) {
    eval_bind_name(ev, env, statement, syntax_node(env->module->syntax, statement)->a, kind);
}

void eval_declare(Eval *ev, const Env *env, NodeId block) {
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, block);
    for (uint32_t i = 0; i < node->b; i++) {
        NodeId statement = syntax->extra[node->a + i];
        switch (syntax_node(syntax, statement)->kind) {
        case NODE_LET:
            declare(ev, env, statement, BINDING_LET);
            break;
        case NODE_PARAM:
            loader_declare_param(ev, env, statement);
            break;
        case NODE_FN:
            declare(ev, env, statement, BINDING_FN);
            break;
        case NODE_DEF:
            declare(ev, env, statement, BINDING_DEF);
            break;
        case NODE_INCLUDE:
            loader_include(ev, env, statement);
            break;
        case NODE_SIM:
            eval_sim_declare(ev, env, statement);
            break;
        default:
            continue;
        }
        diag_next_statement(ev->diag);
    }
}

// ---- Choices and loops

static const char decided_once[] =
    "what exists is decided once: write visible = ... in the objects";

// The block that an `if` chooses, 0: none, or its condition is not known (reported, or asked for).
NodeId eval_chosen_block(Eval *ev, const Env *env, NodeId statement, const char *hint) {
    const Node *node = syntax_node(env->module->syntax, statement);
    const uint32_t *extra = env->module->syntax->extra + node->b;
    Value condition = eval_expr(ev, env, node->a);
    bool is_true = false;
    if (!eval_need_bool(ev, env, node->a, &condition, "the condition of 'if'", hint, &is_true)) {
        return 0;
    }
    if (is_true) {
        return extra[0];
    }
    if (extra[1] && syntax_node(env->module->syntax, extra[1])->kind == NODE_IF) {
        return eval_chosen_block(ev, env, extra[1], hint);
    }
    return extra[1];
}

static Env inner(Eval *ev, const Env *env) {
    return (Env){env->module, scope_new(ev->arena, env->scope)};
}

void eval_bind_loop(Eval *ev, const Env *env, NodeId statement, Value value) {
    const Node *node = syntax_node(env->module->syntax, statement);
    Binding *binding = scope_bind(ev->arena, env->scope, node->a, BINDING_LOOP);
    binding->module = env->module;
    binding->where = (Span){node->lo, node->lo + 3};
    binding->value = value;
}

NodeId eval_loop_block(const Env *env, NodeId statement) {
    return env->module->syntax->extra[syntax_node(env->module->syntax, statement)->b + 1];
}

bool eval_loop_sequence(Eval *ev, const Env *env, NodeId statement, Sequence *sequence) {
    const Node *node = syntax_node(env->module->syntax, statement);
    NodeId iterated = env->module->syntax->extra[node->b];
    if (is_reserved(ev, node->a)) {
        eval_error_at(ev, syntax_name_span(env->module->syntax, statement),
                      "another name is needed", "'%s' is predefined",
                      symbol_text(ev->symbols, node->a));
        return false;
    }
    Value value = eval_expr(ev, env, iterated);
    return eval_sequence(ev, env, iterated, &value, sequence);
}

// After a statement: the next one's mistakes are its own. Where calls went too deep, all that made
// them is given up, or a def that places itself twice would be tried 2^256 times.
void eval_statement_ends(Eval *ev) {
    diag_next_statement(ev->diag);
    if (ev->calls == 0 && ev->steps <= ev->max_steps) {
        ev->stopped = false;
    }
}

// ---- Properties and transforms

// Whether a block has properties or transforms that join what stands around it.
static bool joins(const Syntax *syntax, NodeId block) {
    const Node *node = syntax_node(syntax, block);
    for (uint32_t i = 0; i < node->b; i++) {
        const Node *s = syntax_node(syntax, syntax->extra[node->a + i]);
        switch (s->kind) {
        case NODE_PROPERTY:
        case NODE_TRANSFORM:
            return true;
        case NODE_FOR:
            if (joins(syntax, syntax->extra[s->b + 1])) {
                return true;
            }
            break;
        case NODE_IF:
            for (const Node *choice = s; choice;) {
                NodeId other = syntax->extra[choice->b + 1];
                if (joins(syntax, syntax->extra[choice->b])) {
                    return true;
                }
                choice = other ? syntax_node(syntax, other) : NULL;
                if (choice && choice->kind != NODE_IF) {
                    if (joins(syntax, other)) {
                        return true;
                    }
                    choice = NULL;
                }
            }
            break;
        default:
            break;
        }
    }
    return false;
}

static void gather_loop(Eval *ev, const Env *env, Object *object, NodeId statement) {
    Sequence sequence;
    NodeId block = eval_loop_block(env, statement);
    if (!joins(env->module->syntax, block) || !eval_loop_sequence(ev, env, statement, &sequence)) {
        return;
    }
    for (uint32_t i = 0; i < sequence.n && eval_step(ev, env, statement); i++) {
        Env inside = inner(ev, env);
        eval_bind_loop(ev, &inside, statement, sequence_item(ev, &sequence, i));
        eval_declare(ev, &inside, block);
        eval_gather(ev, &inside, object, block);
    }
}

void eval_gather(Eval *ev, const Env *env, Object *object, NodeId block) {
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, block);
    for (uint32_t i = 0; i < node->b; i++) {
        NodeId statement = syntax->extra[node->a + i];
        const Node *s = syntax_node(syntax, statement);
        switch (s->kind) {
        case NODE_PROPERTY:
            eval_property(ev, env, object, statement);
            break;
        case NODE_FN:
            if (property_is_function(object, symbol_text(ev->symbols, s->a))) {
                eval_property(ev, env, object, statement);
            }
            break;
        case NODE_TRANSFORM:
            eval_transform(ev, env, object, statement);
            break;
        case NODE_FOR:
            gather_loop(ev, env, object, statement);
            break;
        case NODE_INCLUDE:
            loader_gather(ev, env, object, statement);
            break;
        case NODE_IF: {
            NodeId chosen = eval_chosen_block(ev, env, statement, decided_once);
            if (chosen) {
                Env inside = inner(ev, env);
                eval_declare(ev, &inside, chosen);
                eval_gather(ev, &inside, object, chosen);
            }
            break;
        }
        default:
            continue;
        }
        eval_statement_ends(ev);
    }
}

// ---- What stands in a block

static void emit_values(Eval *ev, const Env *env, const Place *place, NodeId statement,
                        const Sequence *sequence, bool has_objects, const char *name) {
    NodeId block = eval_loop_block(env, statement);
    unsigned n_errors = diag_n_errors(ev->diag); // the first value with a mistake is enough
    for (uint32_t i = 0;
         i < sequence->n && diag_n_errors(ev->diag) == n_errors && eval_step(ev, env, statement);
         i++) {
        Env inside = inner(ev, env);
        Place here = *place;
        here.suffix = arena_printf(ev->arena, "%s[%u]", place->suffix, i);
        eval_bind_loop(ev, &inside, statement, sequence_item(ev, sequence, i));
        eval_declare(ev, &inside, block);
        eval_emit(ev, &inside, &here, block, has_objects, name);
    }
}

static bool counts(const Sequence *sequence) {
    for (uint32_t i = 0; i < sequence->n; i++) {
        if (sequence->numbers[i] != i) {
            return false;
        }
    }
    return true;
}

// The body once, its variable an input. False: that did not do.
static bool emit_batch(Eval *ev, const Env *env, const Place *place, NodeId statement,
                       const Sequence *sequence, bool has_objects, const char *name) {
    Loops *outer = ev->loops;
    Loops *loops = ARENA_NEW(ev->arena, Loops);
    *loops = (Loops){outer,
                     sequence->numbers,
                     sequence->n,
                     outer ? outer->depth + 1 : 0,
                     sequence->n * (outer ? outer->n_instances : 1),
                     counts(sequence),
                     NULL};
    LoweringMark mark = lowering_mark(ev->lowering);
    Env inside = inner(ev, env);
    NodeId block = eval_loop_block(env, statement);
    eval_bind_loop(
        ev, &inside, statement,
        value_scalar(sequence->type, dag_input(ev->dag, (Input)(IN_LOOP0 + loops->depth))));
    ev->loops = loops;
    eval_declare(ev, &inside, block);
    eval_emit(ev, &inside, place, block, has_objects, name);
    ev->loops = outer;
    if (!ev->unroll) {
        return true;
    }
    lowering_rewind(ev->lowering, mark);
    if (ev->unroll >> loops->depth & 1) {
        env->module->flags[statement] |= MODULE_UNROLL;
        ev->unroll &= ~(1u << loops->depth);
    }
    return false;
}

static void emit_loop(Eval *ev, const Env *env, const Place *place, NodeId statement,
                      bool has_objects, const char *name) {
    Sequence sequence;
    if (!eval_loop_sequence(ev, env, statement, &sequence) || sequence.n == 0) {
        return;
    }
    uint32_t depth = ev->loops ? ev->loops->depth + 1 : 0;
    uint64_t n = (uint64_t)sequence.n * (ev->loops ? ev->loops->n_instances : 1);
    if (n > EVAL_MAX_ITEMS) {
        eval_error(ev, env, statement, "make fewer, or a mesh",
                   "these loops make %llu copies, at most %d are allowed", (unsigned long long)n,
                   EVAL_MAX_ITEMS);
        return;
    }
    bool is_batch = !ev->body && sequence.numbers && sequence.n > 1 && depth < EVAL_MAX_LOOPS &&
                    !(env->module->flags[statement] & MODULE_UNROLL);
    if (is_batch && emit_batch(ev, env, place, statement, &sequence, has_objects, name)) {
        return;
    }
    if (!ev->unroll) { // else a loop further out goes first
        emit_values(ev, env, place, statement, &sequence, has_objects, name);
    }
}

// What the script prints is seen by a person: value by value, and only once.
static bool wants_values(Eval *ev) {
    if (ev->loops) {
        ev->unroll |= (2u << ev->loops->depth) - 1;
    }
    return ev->unroll != 0;
}

static void emit_print(Eval *ev, const Env *env, NodeId statement) {
    const Node *node = &env->module->syntax->nodes[statement];
    if (wants_values(ev)) {
        return;
    }
    const char *line = "";
    for (uint32_t i = 0; i < node->b; i++) {
        Value value = eval_expr(ev, env, env->module->syntax->extra[node->a + i]);
        if (value_is_poison(&value)) {
            return;
        }
        line = arena_printf(ev->arena, "%s%s%s", line, i ? " " : "",
                            value_text(ev->arena, ev->dag, ev->symbols, &value, 0));
    }
    diag_print(ev->diag, syntax_span(env->module->syntax, statement), line);
}

static void emit_assert(Eval *ev, const Env *env, const Node *node) {
    Value condition = eval_expr(ev, env, node->a);
    bool is_true = true;
    if (!eval_need_bool(ev, env, node->a, &condition, "what is asserted", NULL, &is_true) ||
        is_true) {
        return;
    }
    const char *message = NULL;
    if (node->b) {
        Value value = eval_expr(ev, env, node->b);
        message =
            value_is_poison(&value) ? NULL : value_text(ev->arena, ev->dag, ev->symbols, &value, 0);
    }
    eval_error(ev, env, node->a, NULL, "assertion failed%s%s", message ? ": " : "",
               message ? message : "");
}

static void emit_misplaced(Eval *ev, const Env *env, NodeId statement) {
    const Node *node = syntax_node(env->module->syntax, statement);
    Span where = {node->lo, node->lo + 1};
    switch (node->kind) {
    case NODE_CLIP:
        if (!(env->module->flags[statement] & MODULE_USED)) { // else it is one of a def's own
            eval_error_at(
                ev, syntax_word_span(env->module->syntax, node->lo), NULL,
                "a clip is a span of a def's time: it stands in a def, in no other block");
        }
        break;
    case NODE_RATE:
        eval_error_at(ev, syntax_name_span(env->module->syntax, statement), NULL,
                      "rates of change (x' = ...) belong in 'sim state'");
        break;
    default:
        where = syntax_word_span(env->module->syntax, node->lo);
        eval_error_at(ev, where, NULL, "'%s' belongs in a sim",
                      node->kind == NODE_WHEN ? "when" : "joint");
    }
}

void eval_emit_statement(Eval *ev, const Env *env, const Place *place, NodeId statement,
                         bool has_objects, const char *name) {
    const Node *node = syntax_node(env->module->syntax, statement);
    switch ((NodeKind)node->kind) {
    case NODE_OBJECT:
        if (has_objects) {
            eval_object(ev, env, place, statement);
        } else {
            eval_error_at(ev, syntax_name_span(env->module->syntax, statement),
                          "write group { } around both", "%s holds no other objects", name);
        }
        break;
    case NODE_FOR:
        emit_loop(ev, env, place, statement, has_objects, name);
        break;
    case NODE_RUN:
        eval_emit_run(ev, env, place, statement, has_objects, name);
        break;
    case NODE_IF: {
        NodeId chosen = eval_chosen_block(ev, env, statement, decided_once);
        if (chosen) {
            Env inside = inner(ev, env);
            eval_declare(ev, &inside, chosen);
            eval_emit(ev, &inside, place, chosen, has_objects, name);
        }
        break;
    }
    case NODE_INCLUDE:
        loader_place(ev, env, place, statement);
        break;
    case NODE_PRINT:
        emit_print(ev, env, statement);
        break;
    case NODE_ASSERT:
        emit_assert(ev, env, node);
        break;
    case NODE_SIM:
        eval_sim_emit(ev, env, statement);
        break;
    case NODE_JOINT:
    case NODE_WHEN:
    case NODE_CLIP:
    case NODE_RATE:
        emit_misplaced(ev, env, statement);
        break;
    default:
        break;
    }
}

void eval_emit(Eval *ev, const Env *env, const Place *place, NodeId block, bool has_objects,
               const char *name) {
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, block);
    if (ev->depth >= EVAL_MAX_DEPTH) {
        ev->stopped = true;
        eval_error(ev, env, block, NULL, "blocks are nested too deeply");
        return;
    }
    ev->depth += 4; // a block's walk takes more of the stack than an expression's
    for (uint32_t i = 0; i < node->b && !ev->unroll; i++) {
        NodeId statement = syntax->extra[node->a + i];
        if (eval_step(ev, env, statement)) {
            eval_emit_statement(ev, env, place, statement, has_objects, name);
        }
        eval_statement_ends(ev);
    }
    ev->depth -= 4;
}
