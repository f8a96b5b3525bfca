// SPDX-License-Identifier: Apache-2.0
// The evaluator: partial evaluation of scripts into graphs (lang/dag.h) and objects.
//
// One walk over the syntax tree. Values are made of graph nodes, so what depends on t stays an
// expression and everything else is a number at once; functions vanish by being applied. A failed
// evaluation yields a poison value that stays silent, after one report.
//
// Loops. The body of a `for` is evaluated once, its variable an input of the graph (IN_LOOP0...):
// a thousand copies cost one. Where the body cannot do without a number (an `if`, a list, a label,
// a light), it asks for it by eval_known(): the walk is then repeated for each value.
#ifndef LANG_EVAL_H
#define LANG_EVAL_H

#include "lang/schema.h"
#include "lang/scope.h"

enum {
    EVAL_MAX_CALLS = 256,      // nested calls of functions and defs
    EVAL_DEEP = 8,             // that many of them within each other are recursion
    EVAL_MAX_DEPTH = 3000,     // nested expressions and blocks: the C stack's bound
    EVAL_MAX_LOOPS = 4,        // batched loops around a shape
    EVAL_MAX_ITEMS = 1 << 24,  // of a list or of all batched loops around a shape
    EVAL_MAX_NODES = 1 << 25,  // of the graph
    EVAL_MAX_STRING = 1 << 20, // bytes
};

// The batched loops around a place, inner to outer.
typedef struct Loops {
    struct Loops *parent;
    const double *values;
    uint32_t n_values;
    uint32_t depth;       // IN_LOOP0 + depth is its variable
    uint32_t n_instances; // of this and all outer loops
    bool counts;          // the values are 0, 1, 2...
    double *table;        // [n_instances][depth + 1], made by the lowering when first needed
} Loops;

typedef struct Lowering Lowering; // lang/lower.h
typedef struct {
    Arena *arena; // of the syntax trees and the graph
    Dag *dag;
    Diag *diag;
    Sources *sources;
    Symbols *symbols;
    const struct Builtins *builtins;
    Lowering *lowering;
    Symbol *kind_names; // symbols of the nodes' names, by ObjectKind
    double fps;         // > 0 once the film is known; the unit f needs it
    uint64_t steps, max_steps;
    uint32_t calls, depth, n_deep; // n_deep: copies of defs, deep within others
    unsigned n_noted;              // errors before the last one whose call was shown
    uint32_t unroll;               // bit k: the batched loop k must be walked value by value
    bool stopped;         // steps or calls ran out: everything is poison until the next statement
    bool reads_film;      // the film is evaluated before everything else: now
    bool has_bad_file;    // an included file could not be parsed
    bool has_failed_file; // a file was missing or damaged
    struct GivenBlock *free_given;     // lang/eval_property.c
    const struct Place *playing;       // of the instance around that plays clips; NULL: none
    Loops *loops;                      // batched, around the place where the walk is
    const struct RunLoop *runs;        // those of them that are runs
    struct Loader *loader;             // lang/loader.h
    struct Watches *watches;           // lang/watch.h
    struct SimNears *nears;            // of the sim state under evaluation; NULL: none is
    struct BodyShapes *body;           // of a rigid body: shapes become its; NULL: the scene's
    const struct Simulator *simulator; // lang/simulator.h; NULL: nothing is simulated
    Scope *predefined;
    const Node *material_callee; // the function of the call that a material is expected of, or NULL
} Eval;

// Where an expression stands.
typedef struct {
    const Module *module;
    Scope *scope;
} Env;

// ---- lang/eval_known.c

// Reports and returns poison. hint may be NULL.
Value eval_error(Eval *ev, const Env *env, NodeId node, const char *hint, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
Value eval_error_at(Eval *ev, Span where, const char *hint, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Counts a step of work; false: they ran out (reported), be silent.
bool eval_step(Eval *ev, const Env *env, NodeId node);

// KNOWN: *x has it. LATER: depends on batched loops alone, asked for, be silent. NEVER: on t.
typedef enum { KNOWN, KNOWN_LATER, KNOWN_NEVER } Known;
Known eval_known(Eval *ev, Ref ref, double *x);

// A number that must be known; false: reported, or asked for. what: "the end of a range".
bool eval_need(Eval *ev, const Env *env, NodeId node, Ref ref, const char *what, double *x);
bool eval_need_bool(Eval *ev, const Env *env, NodeId node, const Value *value, const char *what,
                    const char *hint, bool *x);

// What depends on batched loops alone: is it in [low, high] for all copies? If not, asks for them.
bool eval_copies_within(Eval *ev, Ref ref, double low, double high);

const char *eval_input_name(uint32_t inputs); // of the first of a set: "t", "p", "i"

// Values of a list or range that must be known now. False: reported, or asked for.
// n_values and either items (list) or numbers (range, NULL for lists).
typedef struct {
    uint32_t n;
    const double *numbers;
    const Value *items;
    ValueType type; // of numbers: NUMBER or ANGLE
} Sequence;
bool eval_sequence(Eval *ev, const Env *env, NodeId node, const Value *value, Sequence *sequence);
bool eval_list_is_known(Eval *ev, const List *list); // its length is; false: asked for
Value sequence_item(Eval *ev, const Sequence *sequence, uint32_t i);

// ---- lang/eval_expr.c

Value eval_expr(Eval *ev, const Env *env, NodeId node);

// The value of a binding that was found in scope `at`; evaluates lets at first use.
Value eval_binding(Eval *ev, Binding *binding, Scope *at, const Env *env, NodeId node);

// ---- lang/eval_op.c

Value eval_unary(Eval *ev, const Env *env, NodeId node, Operator op, Value a);
Value eval_binary(Eval *ev, const Env *env, NodeId node, Operator op, Value a, Value b);
Value eval_select(Eval *ev, const Env *env, NodeId node, Ref condition, Value a, Value b);
Ref eval_equal(Eval *ev, const Value *a, const Value *b); // REF_NONE: not comparable

// ---- lang/eval_call.c

Value eval_call(Eval *ev, const Env *env, NodeId node);

// Applies a function to values, by name: what its parameters do not name is left out. NULL names:
// positional.
Value eval_apply(Eval *ev, const Closure *closure, const Symbol *names, const Value *values,
                 uint32_t n, const Env *env, NodeId node);

// Binds the parameters of a fn or a def in `scope` to the arguments of `args` (index of extra, 0:
// none), evaluated in env. False: reported.
bool eval_bind(Eval *ev, const Env *env, NodeId node, ExtraId args, const Module *module,
               NodeId callee, Scope *scope);

// A note after mistakes in what was called, with the innermost call. n_errors: before it.
void eval_note_call(Eval *ev, unsigned n_errors, Span where, const Module *module, NodeId callee);

// lang/loader.c: a property's default, from the schema; poison: it has none.
Value eval_default(Eval *ev, PropertyId id);

#endif
