// SPDX-License-Identifier: Apache-2.0
// Scopes: what names mean. A chain from the innermost block outwards; names are bound when their
// block is entered, values are found when a name is first used, so what nobody uses costs nothing
// and a `let` may be used above its line.
#ifndef LANG_SCOPE_H
#define LANG_SCOPE_H

#include "lang/value.h"

typedef struct Scope Scope;

// A file, parsed.
typedef struct {
    Syntax *syntax;
    Scope *scope;   // of its outermost block
    uint8_t *flags; // per node: what is found out about it while evaluating
    size_t n_flags; // >= syntax->n_nodes
} Module;

enum {
    MODULE_USED = 1,   // let, fn, def: somebody used it
    MODULE_UNROLL = 2, // for: its body needs a number where its variable stands
};

typedef enum {
    BINDING_LET,
    BINDING_PARAM,
    BINDING_FN,
    BINDING_DEF,
    BINDING_ARGUMENT,  // of a function or a def
    BINDING_OF_COPIES, // a def's parameter where no copy gives it a value
    BINDING_LOOP,      // variable of a for or a comprehension
    BINDING_VARIABLE,  // of a node: u, v, p, n, i
    BINDING_MODULE,    // include ... as NAME
    BINDING_SIM,
} BindingKind;

typedef enum { BINDING_FRESH, BINDING_BUSY, BINDING_DONE } BindingState;

typedef struct {
    Symbol name;
    uint8_t kind;  // BindingKind
    uint8_t state; // of LET and PARAM: whether value is there; of ARGUMENT: DONE where nobody gave
                   // it, so that it was made within what is called
    const Module *module;
    NodeId node;     // the statement; 0: none
    Span where;      // of the name
    Value value;     // LET, PARAM: once DONE; ARGUMENT, LOOP, VARIABLE; FN: the closure
    Scope *members;  // MODULE; DEF: its clips, NULL: not read yet (lang/eval_clip.h)
    struct Sim *sim; // SIM: what it is and came to (lang/eval_sim.h)
} Binding;

struct Scope {
    Scope *parent;
    Binding *bindings; // in order of binding
    uint32_t *slots;   // hash table of indices + 1, once there are many; NULL before
    uint32_t n, n_slots;
    size_t capacity;
};

Scope *scope_new(Arena *arena, Scope *parent);

// Adds a binding, whatever is there; it stays where it is only until the next one is added.
Binding *scope_bind(Arena *arena, Scope *scope, Symbol name, BindingKind kind);

// In this scope alone; NULL: not there.
Binding *scope_find_own(const Scope *scope, Symbol name);

// From this scope outwards; *at gets the scope. A node's variable yields to a loop's of the same
// name further out: `for i in 0..3 { mesh { translate <i, 0, 0> } }` means the loop's.
Binding *scope_find(Scope *scope, Symbol name, Scope **at);

// Names in reach, the innermost first, for did-you-mean: at most max, their number is returned.
size_t scope_names(const Scope *scope, const Symbols *symbols, const char **names, size_t max);

// A function: the user's, with the scope that it was written in, one of lang/builtins.def, or one
// of a number that such a one has made, as a graph.
struct Closure {
    const Module *module;
    Scope *scope;
    NodeId node;     // NODE_FN
    int32_t builtin; // index of the table, -1: the user's, or a graph
    bool is_graph;
    Ref graph; // in which IN_X is the argument
};

#endif
