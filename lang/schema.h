// SPDX-License-Identifier: Apache-2.0
// The schema: which nodes there are and which properties each of them takes (lang/schema.def).
#ifndef LANG_SCHEMA_H
#define LANG_SCHEMA_H

#include "lang/value.h"

typedef enum {
    NODE_CLASS_SETTING,
    NODE_CLASS_CAMERA,
    NODE_CLASS_LIGHT,
    NODE_CLASS_SHAPE,
    NODE_CLASS_GROUP,
    NODE_CLASS_COMMON
} NodeClass;

typedef enum {
#define NODE(id, ...) OBJECT_##id,
#define PROPERTY(...)
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
    OBJECT_KINDS
} ObjectKind;

typedef enum {
#define NODE(...)
#define PROPERTY(node, id, ...) PROPERTY_##node##_##id,
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
    PROPERTY_COUNT
} PropertyId;

typedef enum {
    PROPERTY_TYPE_NUMBER,
    PROPERTY_TYPE_COUNT, // a whole number
    PROPERTY_TYPE_ANGLE,
    PROPERTY_TYPE_BOOL,
    PROPERTY_TYPE_STRING,
    PROPERTY_TYPE_STRINGS, // or one alone
    PROPERTY_TYPE_VEC2,
    PROPERTY_TYPE_VEC3,
    PROPERTY_TYPE_COLOR, // a color or a vector of 3
    PROPERTY_TYPE_RANGE,
    PROPERTY_TYPE_MATERIAL,
    PROPERTY_TYPE_FUNCTION,
    PROPERTY_TYPE_LIST,
    PROPERTY_TYPE_NUMBER_OR_LIST, // of numbers
    PROPERTY_TYPE_WORD,           // one of a few bare words; its value is a string
    PROPERTY_TYPE_WORD_OR_NUMBER,
    PROPERTY_TYPE_WORD_OR_FUNCTION, // the function is one of x
    PROPERTY_TYPE_TRANSFORM,        // or a rotation
    PROPERTY_TYPE_ANY
} PropertyType;

typedef enum { SCHEMA_READY, SCHEMA_LATER } SchemaStatus;
typedef enum { SCHEMA_FIXED, SCHEMA_MOVES } SchemaWhen;

typedef struct {
    const char *name;
    NodeClass class;
    const char *variables; // separated by spaces
    SchemaStatus status;
    const char *help;
    uint16_t first; // its own properties: PropertyIds from here to schema_end
} NodeInfo;

typedef struct {
    const char *name;
    ObjectKind node;
    PropertyType type;
    Dimension dimension;
    SchemaWhen when;
    const char *default_text; // an expression; "": none
    double low, high;         // both allowed; low == SCHEMA_POSITIVE: more than 0
    SchemaStatus status;
    const char *names; // words, or variables of a function, separated by spaces
    const char *help;
} PropertyInfo;

#define SCHEMA_POSITIVE 4.9406564584124654e-324
// The highest of angles that must be less than half a turn.
#define SCHEMA_UNDER_HALF_TURN 3.1415926

extern const NodeInfo node_infos[OBJECT_KINDS];
extern const PropertyInfo property_infos[PROPERTY_COUNT];

// The node kind of a name; OBJECT_KINDS: there is none.
ObjectKind schema_node(const char *name);

static inline uint32_t schema_end(ObjectKind kind) {
    return kind + 1 < OBJECT_KINDS ? node_infos[kind + 1].first : PROPERTY_COUNT;
}

// The kinds whose properties a node of this kind takes besides its own, ends with OBJECT_KINDS.
const ObjectKind *schema_common(ObjectKind kind);

// PROPERTY_COUNT: the node has no such property.
PropertyId schema_property(ObjectKind kind, const char *name);

// All property names that a node takes; at most max are written, the number there are is returned.
size_t schema_property_names(ObjectKind kind, const char **names, size_t max);
// The names of all nodes, likewise.
size_t schema_node_names(const char **names, size_t max);

// What to write instead of a word of POV-Ray, in the block of a node (NULL: anywhere), or where a
// "statement" begins; NULL: it is none.
const char *schema_foreign_word(const char *node, const char *name);

// Whether `word` is among the words of a list separated by spaces.
bool schema_has_word(const char *words, const char *word);

// Whether its value may be one of `names` as a bare word.
bool schema_takes_words(const PropertyInfo *property);

const char *schema_property_type_text(const PropertyInfo *property); // "an angle", "a length"

#endif
