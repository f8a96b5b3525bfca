// SPDX-License-Identifier: Apache-2.0
// Values of the language. What is made of numbers holds graph nodes (lang/dag.h) in their place, so
// every value may be a motion.
#ifndef LANG_VALUE_H
#define LANG_VALUE_H

#include "lang/clip_value.h"
#include "lang/material_value.h"
#include "lang/spatial.h"
#include "lang/units.h"

// TYPE(id, name, with article)
#define VALUE_TYPES(TYPE)                                                                          \
    TYPE(POISON, "nothing", "nothing") /* an error was reported: stays silent */                   \
    TYPE(NUMBER, "number", "a number")                                                             \
    TYPE(ANGLE, "angle", "an angle")                                                               \
    TYPE(BOOL, "bool", "a bool")                                                                   \
    TYPE(VEC, "vec", "a vector")                                                                   \
    TYPE(COLOR, "color", "a color")                                                                \
    TYPE(ROTATION, "rotation", "a rotation")                                                       \
    TYPE(TRANSFORM, "transform", "a transform")                                                    \
    TYPE(STRING, "string", "a string")                                                             \
    TYPE(MATERIAL, "material", "a material")                                                       \
    TYPE(CLIP, "clip", "a clip")                                                                   \
    TYPE(LIST, "list", "a list")                                                                   \
    TYPE(FUNCTION, "function", "a function")                                                       \
    TYPE(RANGE, "range", "a range")

typedef enum {
#define TYPE(id, name, article) VALUE_##id,
    VALUE_TYPES(TYPE)
#undef TYPE
        VALUE_TYPE_COUNT
} ValueType;

typedef struct Value Value;
typedef struct Closure Closure; // lang/scope.h

typedef struct {
    uint32_t n, inputs; // inputs: that its items read
    const Value *items;
    // Of members of a simulation: the item IN_X, as an expression of it, and when it is there (a
    // truth value). NULL: the items have nothing in common.
    const Value *each;
    Ref alive;
    const Ref *length; // how many of its items are there, as loop variables say; NULL: all of them
} List;

typedef struct {
    Ref low, high, step; // REF_NONE: no step was written
    bool is_angle;
    uint8_t dimension;
} Range;

// Scalars are in SI units, angles in radians. A unit written on a number stays with it as a
// *dimension* while it is certain (sums, differences, signs), so that `radius = 5s` can be refused;
// products and functions forget it.
struct Value {
    uint8_t type; // ValueType
    uint8_t
        n; // scalars: 1, 2..4 for VEC, 3 COLOR, 4 ROTATION (x y z w), 12 TRANSFORM (rows); else 0
    uint8_t dimension;
    union {
        Ref ref[4];
        const RefMap *map; // TRANSFORM
        Symbol symbol;     // STRING: its text
        const MaterialValue *material;
        const ClipValue *clip;
        const List *list;
        const Closure *closure;
        const Range *range;
    };
};

extern const char *const value_type_names[VALUE_TYPE_COUNT]; // "number"

static inline Value value_poison(void) {
    return (Value){.type = VALUE_POISON};
}

static inline Value value_scalar(ValueType type, Ref ref) {
    return (Value){.type = (uint8_t)type, .n = 1, .ref = {ref}};
}

static inline bool value_is(const Value *value, ValueType type) {
    return value->type == type;
}

static inline bool value_is_poison(const Value *value) {
    return value->type == VALUE_POISON;
}

// Made of scalars: the values that motions are made of.
static inline bool value_is_numeric(const Value *value) {
    return value->type >= VALUE_NUMBER && value->type <= VALUE_TRANSFORM;
}

// A vector of 3 or a color: what directions, places and colors are given by.
static inline bool value_is_vec3(const Value *value) {
    return value->n == 3 && (value->type == VALUE_VEC || value->type == VALUE_COLOR);
}

// The scalars of a numeric value: value->n of them.
static inline const Ref *value_refs(const Value *value) {
    return value->type == VALUE_TRANSFORM ? &value->map->m[0][0] : value->ref;
}

static inline Ref3 value_ref3(const Value *value) {
    return (Ref3){value->ref[0], value->ref[1], value->ref[2]};
}

static inline RefQuat value_quat(const Value *value) {
    return (RefQuat){value->ref[0], value->ref[1], value->ref[2], value->ref[3]};
}

static inline Value value_from3(ValueType type, Ref3 v) {
    return (Value){.type = (uint8_t)type, .n = 3, .ref = {v.x, v.y, v.z}};
}

static inline Value value_from_quat(RefQuat q) {
    return (Value){.type = VALUE_ROTATION, .n = 4, .ref = {q.x, q.y, q.z, q.w}};
}

Value value_number(Dag *dag, double x);
Value value_vec(ValueType type, const Ref *refs, uint32_t n);
Value value_transform(Arena *arena, const RefMap *map); // copies
// A numeric value of like's type with other scalars (like->n of them, copied).
Value value_like(Arena *arena, const Value *like, const Ref *refs);

// Which inputs the value reads: bit i for Input i. Lists and materials: of all parts.
uint32_t value_inputs(const Dag *dag, const Value *value);

// The map of a transform or a rotation; false: the value is neither.
bool value_as_map(Dag *dag, const Value *value, RefMap *map);

// As said in messages: "a number", "a length", "a vector of 2", "an angle". Arena memory at most.
const char *value_describe(Arena *arena, const Value *value);

// As `print` and str() write it: constants as numbers (angles in degrees), motions by the name
// of their type. digits: significant ones, 0: as many as are needed.
const char *value_text(Arena *arena, const Dag *dag, const Symbols *symbols, const Value *value,
                       int digits);

// The type's name in `st4 eval`: "number", "vec3".
const char *value_type_name(Arena *arena, const Value *value);

#endif
