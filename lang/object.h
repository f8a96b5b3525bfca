// SPDX-License-Identifier: Apache-2.0
// Objects: nodes of a script with their blocks evaluated, and the place where they stand. Made by
// the evaluator (lang/eval_block.c, lang/eval_object.c), turned into render/scene.h by lowering.
#ifndef LANG_OBJECT_H
#define LANG_OBJECT_H

#include "lang/eval.h"

// A property as given by the script.
typedef struct Given {
    PropertyId id;
    Value value;
    Span name, where; // of the name, of the value
    Env env;
    NodeId node; // the value's, for reports; NODE_FN for functions
} Given;

// Where things are put: what the blocks around them say. The innermost block that gives a property
// wins; transforms are joined.
typedef struct Place {
    bool is_identity;                                            // map is not set
    RefMap map;                                                  // to the world
    Ref visible;                                                 // of all blocks together
    const Given *material, *bake, *smooth, *tolerance, *samples; // NULL: nobody says
    const Given *seen[RAY_KINDS], *catcher;
    const char *path;   // of the labels around: "", "Car/"
    const char *suffix; // "[2]" within loops that are walked value by value, else ""
    // What is added to the label of each copy of a shape, where that is not the copy's index: as
    // Ball[12], or joined as Ball12.
    bool has_number, is_joined;
    Ref number;
    uint32_t steps;    // around circles; 0: as many as the picture wants
    bool is_outermost; // no node's block is around: film and its like stand here
    // Within an instance, what its own clock (IN_T) shows, by the film's (IN_FILM_T); REF_NONE: the
    // film's itself. What stands above is by IN_T where it was written within the instance, by
    // IN_FILM_T where outside. The map is that within; `outer` leads from the instance to the
    // world.
    Ref clock;
    const struct Clips *clips; // lang/eval_clip.h; NULL: none; else the map has no IN_T in it
    Ref unwound, cycle; // the clock before it starts again, and after how long; REF_NONE: never
    bool outer_is_identity;
    RefMap outer;
    const RefMap *inner; // by the film's clock (place_at_clock): the map within as it was, by IN_T
} Place;

enum { OBJECT_MAX_GIVEN = 40 };

// A block's own statements, evaluated.
typedef struct Object {
    ObjectKind kind;  // whose properties it takes; OBJECT_INSTANCE for the copy of a def
    const char *name; // "sphere", "Blade"
    Span where;       // of the path
    Env env;
    Scope *arguments;   // of a copy: where its def's parameters go; else NULL
    const Env *def_env; // of a copy: the def's place and parameters
    NodeId def_params, def_block;
    const Scope *clips; // of a copy: those of its def
    bool is_identity;
    RefMap map; // all transforms of the block, the first written acts first
    uint32_t n_given;
    Given *given; // OBJECT_MAX_GIVEN
} Object;

// Its properties live until object_end.
void object_begin(Eval *ev, Object *object);
void object_end(Eval *ev, Object *object);

const Given *object_given(const Object *object, PropertyId id); // NULL: not given

// A node's own value of a property, else its default; poison only where the default is "".
Value object_value(Eval *ev, const Object *object, PropertyId id);

// ---- lang/eval_property.c

// Evaluates `name = value` (NODE_PROPERTY) or a `fn` that is a property (NODE_FN) for the object.
void eval_property(Eval *ev, const Env *env, Object *object, NodeId statement);

// Whether a `fn` of this name in the object's block is one of its properties.
bool property_is_function(const Object *object, const char *name);

// Joins a transform statement.
void eval_transform(Eval *ev, const Env *env, Object *object, NodeId statement);

// Checks what came of a property's function (components, what they read). what: "at". inputs: bits
// that it may read. False: reported.
bool eval_check_vec3(Eval *ev, Span where, const char *what, const Value *value, uint32_t inputs);

// ---- lang/eval_object.c

// Evaluates the properties and transforms of a node whose kind and env, a scope of its own, are
// set; object_end ends it.
void eval_node_begin(Eval *ev, Object *object, NodeId block);

// What a path means, NAME or FILE.NAME; NULL: nothing. *at: the scope that has it.
Binding *object_find(const Env *env, NodeId path, Scope **at);

// A node, a copy or an instance: NODE_OBJECT.
void eval_object(Eval *ev, const Env *env, const Place *place, NodeId statement);

// ---- lang/eval_clock.c

// The place by the film's clock (its map is then that to the world), and the properties of an
// object there, but for its functions.
Place place_at_clock(Eval *ev, const Place *place);
Object object_at_clock(Eval *ev, const Place *place, const Object *object);
// From the block of a copy, whose place this is, into its def. False: reported.
bool place_enter_instance(Eval *ev, Place *place, const Object *copy, bool is_instance);

// A value as it is by the film's clock where clips play.
Value value_at_clips(Eval *ev, const Place *place, const Value *value);

// ---- lang/eval_block.c

// Binds a name for a statement; NULL: it is taken or reserved (reported).
Binding *eval_bind_name(Eval *ev, const Env *env, NodeId statement, Symbol name, BindingKind kind);
// Binds the names that a block defines.
void eval_declare(Eval *ev, const Env *env, NodeId block);
// Properties and transforms of a block, those in its `for`s and `if`s included.
void eval_gather(Eval *ev, const Env *env, Object *object, NodeId block);
// Everything else: objects, prints, asserts. has_objects: whether the block may hold any; if not,
// `name` is the node's, for the report.
void eval_emit(Eval *ev, const Env *env, const Place *place, NodeId block, bool has_objects,
               const char *name);

void eval_emit_statement(Eval *ev, const Env *env, const Place *place, NodeId statement,
                         bool has_objects, const char *name);
// The block that an `if` chooses, 0: none, or its condition is not known (reported, with
// the hint, or asked for).
NodeId eval_chosen_block(Eval *ev, const Env *env, NodeId statement, const char *hint);
// What a `for` goes over (false: reported, or asked for); its body; its variable.
bool eval_loop_sequence(Eval *ev, const Env *env, NodeId statement, Sequence *sequence);
NodeId eval_loop_block(const Env *env, NodeId statement);
void eval_bind_loop(Eval *ev, const Env *env, NodeId statement, Value value);
// After a statement: the next one's mistakes are its own.
void eval_statement_ends(Eval *ev);

// Where nothing is around: in no block, by the film's clock.
Place place_outermost(Eval *ev);

// The place within an object's block.
Place place_within(Eval *ev, const Place *place, const Object *object);

#endif
