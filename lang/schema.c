// SPDX-License-Identifier: Apache-2.0
// The tables of lang/schema.def, and looking things up in them.
#include "lang/schema.h"

#include <math.h>
#include <string.h>

const PropertyInfo property_infos[PROPERTY_COUNT] = {
#define POSITIVE        SCHEMA_POSITIVE
#define UNDER_HALF_TURN SCHEMA_UNDER_HALF_TURN
#define NODE(...)
#define PROPERTY(node, id, name, type, dimension, when, default_text, low, high, status, names,    \
                 help)                                                                             \
    {name,                                                                                         \
     OBJECT_##node,                                                                                \
     PROPERTY_TYPE_##type,                                                                         \
     DIMENSION_##dimension,                                                                        \
     SCHEMA_##when,                                                                                \
     default_text,                                                                                 \
     low,                                                                                          \
     high,                                                                                         \
     SCHEMA_##status,                                                                              \
     names,                                                                                        \
     help},
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
};

// FIRST_NODE is the id of the node's first property: each FIRST takes a number from the count, and
// the line after it gives that number back.
enum {
#define NODE(id, ...)           FIRST_##id, BEFORE_##id = FIRST_##id - 1,
#define PROPERTY(node, id, ...) AT_##node##_##id,
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
    FIRST_END
};

const NodeInfo node_infos[OBJECT_KINDS] = {
#define NODE(id, name, class, variables, status, help)                                             \
    [OBJECT_##id] = {name, NODE_CLASS_##class, variables, SCHEMA_##status, help, FIRST_##id},
#define PROPERTY(...)
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
};

ObjectKind schema_node(const char *name) {
    for (int kind = 0; kind < OBJECT_KINDS; kind++) {
        if (node_infos[kind].class != NODE_CLASS_COMMON &&
            strcmp(node_infos[kind].name, name) == 0) {
            return (ObjectKind)kind;
        }
    }
    return OBJECT_KINDS;
}

const ObjectKind *schema_common(ObjectKind kind) {
    static const ObjectKind none[] = {OBJECT_KINDS};
    static const ObjectKind light[] = {OBJECT_ANY, OBJECT_KINDS};
    static const ObjectKind shape[] = {OBJECT_ANY, OBJECT_OBJECT, OBJECT_KINDS};
    static const ObjectKind group[] = {OBJECT_ANY, OBJECT_OBJECT, OBJECT_INHERITED, OBJECT_KINDS};
    static const ObjectKind instance[] = {OBJECT_INSTANCE, OBJECT_ANY, OBJECT_OBJECT,
                                          OBJECT_INHERITED, OBJECT_KINDS};
    if (kind == OBJECT_INSTANCE) {
        return instance;
    }
    switch (node_infos[kind].class) {
    case NODE_CLASS_LIGHT:
        return light;
    case NODE_CLASS_SHAPE:
        return shape;
    case NODE_CLASS_GROUP:
        return group;
    default:
        return none;
    }
}

static PropertyId own_property(ObjectKind kind, const char *name) {
    for (uint32_t id = node_infos[kind].first; id < schema_end(kind); id++) {
        if (strcmp(property_infos[id].name, name) == 0) {
            return (PropertyId)id;
        }
    }
    return PROPERTY_COUNT;
}

PropertyId schema_property(ObjectKind kind, const char *name) {
    PropertyId id = own_property(kind, name);
    for (const ObjectKind *k = schema_common(kind); id == PROPERTY_COUNT && *k != OBJECT_KINDS;
         k++) {
        id = own_property(*k, name);
    }
    return id;
}

static size_t own_names(ObjectKind kind, const char **names, size_t n, size_t max) {
    for (uint32_t id = node_infos[kind].first; id < schema_end(kind); id++, n++) {
        if (n < max) {
            names[n] = property_infos[id].name;
        }
    }
    return n;
}

size_t schema_property_names(ObjectKind kind, const char **names, size_t max) {
    size_t n = own_names(kind, names, 0, max);
    for (const ObjectKind *k = schema_common(kind); *k != OBJECT_KINDS; k++) {
        n = *k == kind ? n : own_names(*k, names, n, max);
    }
    return n;
}

size_t schema_node_names(const char **names, size_t max) {
    size_t n = 0;
    for (int kind = 0; kind < OBJECT_KINDS; kind++) {
        if (node_infos[kind].class != NODE_CLASS_COMMON) {
            if (n < max) {
                names[n] = node_infos[kind].name;
            }
            n++;
        }
    }
    return n;
}

const char *schema_foreign_word(const char *node, const char *name) {
    static const struct {
        const char *nodes, *word, *instead;
    } words[] = {
#define WORD(word, instead)           {NULL, word, instead},
#define WORD_IN(nodes, word, instead) {nodes, word, instead},
#include "lang/words.def"
#undef WORD
    };
    const char *anywhere = NULL;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp(words[i].word, name) != 0) {
            continue;
        }
        if (!words[i].nodes) {
            anywhere = words[i].instead;
        } else if (node && schema_has_word(words[i].nodes, node)) {
            return words[i].instead;
        }
    }
    return anywhere;
}

bool schema_has_word(const char *words, const char *word) {
    size_t n = strlen(word);
    for (const char *at = words; n && (at = strstr(at, word)); at += n) {
        if ((at == words || at[-1] == ' ') && (at[n] == '\0' || at[n] == ' ')) {
            return true;
        }
    }
    return false;
}

bool schema_takes_words(const PropertyInfo *property) {
    return property->type == PROPERTY_TYPE_WORD || property->type == PROPERTY_TYPE_WORD_OR_NUMBER ||
           property->type == PROPERTY_TYPE_WORD_OR_FUNCTION;
}

const char *schema_property_type_text(const PropertyInfo *property) {
    static const char *const texts[] = {
        [PROPERTY_TYPE_NUMBER] = "a number",
        [PROPERTY_TYPE_COUNT] = "a whole number",
        [PROPERTY_TYPE_ANGLE] = "an angle",
        [PROPERTY_TYPE_BOOL] = "true or false",
        [PROPERTY_TYPE_STRING] = "a string",
        [PROPERTY_TYPE_STRINGS] = "a string or a list of strings",
        [PROPERTY_TYPE_VEC2] = "a vector of 2",
        [PROPERTY_TYPE_VEC3] = "a vector of 3",
        [PROPERTY_TYPE_COLOR] = "a color",
        [PROPERTY_TYPE_RANGE] = "a range",
        [PROPERTY_TYPE_MATERIAL] = "a material",
        [PROPERTY_TYPE_FUNCTION] = "a function",
        [PROPERTY_TYPE_LIST] = "a list",
        [PROPERTY_TYPE_NUMBER_OR_LIST] = "a number or a list of numbers",
        [PROPERTY_TYPE_WORD] = "a word",
        [PROPERTY_TYPE_WORD_OR_NUMBER] = "a word or a number",
        [PROPERTY_TYPE_WORD_OR_FUNCTION] = "a word or a function",
        [PROPERTY_TYPE_TRANSFORM] = "a transform",
        [PROPERTY_TYPE_ANY] = "a value",
    };
    return property->type == PROPERTY_TYPE_NUMBER && property->dimension
               ? dimension_names[property->dimension]
               : texts[property->type];
}
