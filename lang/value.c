// SPDX-License-Identifier: Apache-2.0
// Values: construction, description, text.
#include "lang/value.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *const value_type_names[VALUE_TYPE_COUNT] = {
#define TYPE(id, name, article) name,
    VALUE_TYPES(TYPE)
#undef TYPE
};

static const char *const type_articles[VALUE_TYPE_COUNT] = {
#define TYPE(id, name, article) article,
    VALUE_TYPES(TYPE)
#undef TYPE
};

Value value_number(Dag *dag, double x) {
    return value_scalar(VALUE_NUMBER, dag_const(dag, x));
}

Value value_vec(ValueType type, const Ref *refs, uint32_t n) {
    Value value = {.type = (uint8_t)type, .n = (uint8_t)n};
    memcpy(value.ref, refs, n * sizeof *refs);
    return value;
}

Value value_transform(Arena *arena, const RefMap *map) {
    RefMap *copy = ARENA_NEW(arena, RefMap);
    *copy = *map;
    return (Value){.type = VALUE_TRANSFORM, .n = 12, .map = copy};
}

Value value_like(Arena *arena, const Value *like, const Ref *refs) {
    if (like->type != VALUE_TRANSFORM) {
        return value_vec((ValueType)like->type, refs, like->n);
    }
    RefMap map;
    memcpy(map.m, refs, sizeof map.m);
    return value_transform(arena, &map);
}

bool value_as_map(Dag *dag, const Value *value, RefMap *map) {
    if (value->type == VALUE_ROTATION) {
        *map = spatial_map_quat(dag, value_quat(value));
        return true;
    }
    if (value->type == VALUE_TRANSFORM) {
        *map = *value->map;
        return true;
    }
    return false;
}

static uint32_t refs_inputs(const Dag *dag, const Ref *refs, uint32_t n) {
    uint32_t inputs = 0;
    for (uint32_t i = 0; i < n; i++) {
        inputs |= dag_inputs(dag, refs[i]);
    }
    return inputs;
}

uint32_t value_inputs(const Dag *dag, const Value *value) {
    if (value_is_numeric(value)) {
        return refs_inputs(dag, value_refs(value), value->n);
    }
    uint32_t inputs = 0;
    switch (value->type) {
    case VALUE_MATERIAL:
        return material_inputs(dag, value->material);
    case VALUE_CLIP:
        return refs_inputs(dag, value->clip->ref, CLIP_REFS);
    case VALUE_LIST:
        return value->list->inputs;
    case VALUE_RANGE:
        inputs = dag_inputs(dag, value->range->low) | dag_inputs(dag, value->range->high);
        return value->range->step == REF_NONE ? inputs
                                              : inputs | dag_inputs(dag, value->range->step);
    default:
        return 0;
    }
}

const char *value_describe(Arena *arena, const Value *value) {
    if (value->dimension) {
        return dimension_names[value->dimension];
    }
    if (value->type == VALUE_VEC) {
        return arena_printf(arena, "a vector of %u", value->n);
    }
    return type_articles[value->type];
}

const char *value_type_name(Arena *arena, const Value *value) {
    return value->type == VALUE_VEC ? arena_printf(arena, "vec%u", value->n)
                                    : value_type_names[value->type];
}

// Text grows at the end of a buffer of fixed size; what does not fit ends in "...".
typedef struct {
    const Dag *dag;
    const Symbols *symbols;
    int digits;
    size_t n;
    char text[4096];
} Writer;

static void put(Writer *w, const char *s) {
    size_t n = strlen(s), room = sizeof w->text - 4 - w->n;
    if (w->n > sizeof w->text - 4) {
        return;
    }
    if (n > room) {
        memcpy(w->text + w->n, s, room);
        memcpy(w->text + sizeof w->text - 4, "...", 4);
        w->n = sizeof w->text;
        return;
    }
    memcpy(w->text + w->n, s, n + 1);
    w->n += n;
}

// The shortest decimal that reads back as the same double.
static void put_number(Writer *w, double x) {
    char s[40];
    if (w->digits > 0) {
        snprintf(s, sizeof s, "%.*g", w->digits, x);
    } else {
        for (int digits = 15; digits <= 17; digits++) {
            snprintf(s, sizeof s, "%.*g", digits, x);
            double back = 0;
            if (sscanf(s, "%lf", &back) == 1 && back == x) {
                break;
            }
        }
    }
    put(w, s);
}

static void put_scalar(Writer *w, const Value *value, Ref ref) {
    double x;
    if (!dag_is_const(w->dag, ref, &x)) {
        put(w, "(moves)");
    } else if (value->type == VALUE_BOOL) {
        put(w, x != 0 ? "true" : "false");
    } else if (value->type == VALUE_ANGLE) {
        // 30deg is not a multiple of the double nearest to pi / 180: 15 digits hide that.
        double degrees = x / unit_infos[UNIT_DEG].factor, nearest = 0;
        char s[40];
        snprintf(s, sizeof s, "%.15g", degrees);
        sscanf(s, "%lf", &nearest);
        put_number(w, nearest);
        put(w, "deg");
    } else {
        put_number(w, x);
    }
}

// "walk (0s..1s)", or "play(walk (0s..1s), at = 3s, ...)".
static void put_clip(Writer *w, const ClipValue *clip) {
    static const struct {
        const char *before, *behind;
        ValueType type;
    } parts[CLIP_REFS] = {[CLIP_BEGIN] = {" (", "s", VALUE_NUMBER},
                          [CLIP_END] = {"..", "s)", VALUE_NUMBER},
                          [CLIP_AT] = {", at = ", "s", VALUE_NUMBER},
                          [CLIP_FADE] = {", fade = ", "s", VALUE_NUMBER},
                          [CLIP_SPEED] = {", speed = ", "", VALUE_NUMBER},
                          [CLIP_ONCE] = {", once = ", "", VALUE_BOOL},
                          [CLIP_PARTS] = {", parts = ", ")", VALUE_NUMBER}};
    put(w, clip->is_played ? "play(" : "");
    put(w, clip->name ? symbol_text(w->symbols, clip->name) : "clip");
    for (int k = 0; k < (clip->is_played ? CLIP_REFS : CLIP_AT); k++) {
        const Value part = value_scalar(parts[k].type, clip->ref[k]);
        put(w, parts[k].before);
        put_scalar(w, &part, part.ref[0]);
        put(w, parts[k].behind);
    }
}

static void put_value(Writer *w, const Value *value) {
    if (value_is_numeric(value)) {
        const Ref *refs = value_refs(value);
        put(w, value->n > 1 ? "<" : "");
        for (uint32_t i = 0; i < value->n; i++) {
            put(w, i ? ", " : "");
            put_scalar(w, value, refs[i]);
        }
        put(w, value->n > 1 ? ">" : "");
        return;
    }
    switch (value->type) {
    case VALUE_STRING:
        put(w, symbol_text(w->symbols, value->symbol));
        break;
    case VALUE_CLIP:
        put_clip(w, value->clip);
        break;
    case VALUE_LIST:
        put(w, "[");
        for (uint32_t i = 0; i < value->list->n && w->n < sizeof w->text; i++) {
            put(w, i ? ", " : "");
            put_value(w, &value->list->items[i]);
        }
        put(w, "]");
        break;
    case VALUE_RANGE: {
        Value like = {.type = value->range->is_angle ? VALUE_ANGLE : VALUE_NUMBER, .n = 1};
        put_scalar(w, &like, value->range->low);
        put(w, "..");
        put_scalar(w, &like, value->range->high);
        if (value->range->step != REF_NONE) {
            put(w, " by ");
            put_scalar(w, &like, value->range->step);
        }
        break;
    }
    default:
        put(w, type_articles[value->type]);
    }
}

const char *value_text(Arena *arena, const Dag *dag, const Symbols *symbols, const Value *value,
                       int digits) {
    Writer w = {.dag = dag, .symbols = symbols, .digits = digits};
    put_value(&w, value);
    return arena_string(arena, w.text, strlen(w.text));
}
