// SPDX-License-Identifier: Apache-2.0
// The functions of the language: looking them up, checking their arguments, running them.
#ifndef LANG_BUILTINS_H
#define LANG_BUILTINS_H

#include "lang/eval.h"

typedef enum {
#define FUNCTION(id, ...) BUILTIN_##id,
#include "lang/builtins.def"
#undef FUNCTION
    BUILTIN_COUNT
} BuiltinId;

typedef struct {
    const char *name, *params, *result, *help; // as in lang/builtins.def
} BuiltinInfo;
extern const BuiltinInfo builtin_infos[BUILTIN_COUNT];

enum { BUILTIN_MAX_PARAMS = 9 };

// An argument as written: its name (0: by place), where that stands, and its value.
typedef struct {
    Symbol name;
    uint32_t offset;
    NodeId node;
    Value value;
} BuiltinArgument;

typedef struct Builtins Builtins; // parameters, parsed; names, interned
const Builtins *builtins_new(Arena *arena, Symbols *symbols);

int32_t builtins_find(const Builtins *builtins, Symbol name); // -1: none
size_t builtins_names(const char **names, size_t max);        // all of them; as scope_names

// Reports a call of something that is neither a function of the script nor of the language.
Value builtins_unknown(Eval *ev, const Env *env, NodeId callee, Symbol name);

// No argument is poison. Reports and returns poison on a mistake.
Value builtins_call(Eval *ev, int32_t builtin, const BuiltinArgument *args, uint32_t n,
                    const Env *env, NodeId node);
Value builtins_apply(Eval *ev, int32_t builtin, const Value *values, uint32_t n, const Env *env,
                     NodeId node);

// ---- Between lang/builtins.c (arguments) and lang/builtins_run.c (what functions do)

typedef struct {
    Eval *ev;
    const Env *env;
    NodeId node;
    BuiltinId id;
    Op op;
    const Value *args;   // of fixed parameters: one each, in order; then the variable ones
    const NodeId *nodes; // where each was written; 0: a default
    uint32_t n;
} BuiltinCall;

typedef Value BuiltinRun(const BuiltinCall *call);

// lang/builtins_material.c
BuiltinRun builtins_material, builtins_mix_materials;

typedef struct {
    BuiltinRun *run; // NULL: not supported yet
    Op op;
} BuiltinAction;
extern const BuiltinAction builtin_actions[BUILTIN_COUNT];

// "write <1, 2, 3>" for a list that is meant as a vector; NULL: it is none.
const char *builtins_vector_hint(Eval *ev, const Value *value);

#endif
