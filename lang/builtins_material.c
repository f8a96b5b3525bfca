// SPDX-License-Identifier: Apache-2.0
// Materials: what functions that return them make of their arguments.
#include "lang/builtins.h"

#include <math.h>
#include <string.h>

// The parameters of each kind in the order in which lang/builtins.def has them.
enum { MAX_ARGUMENTS = 4 };

typedef struct {
    const char *name;
    double low, high;
} Bound;

static const Bound color = {"a color", 0, INFINITY}, edge = {"edge", 0, 1}, rough = {"rough", 0, 1},
                   ior = {"ior", 1, INFINITY}, power = {"power", 0, INFINITY},
                   depth = {"depth", 0, INFINITY}, weight = {"w", 0, 1},
                   opacity = {"opacity", 0, 1}, bump = {"bump", -INFINITY, INFINITY},
                   normal_map = {"normal_map", 0, 1};

// Parameters of all kinds, behind their own.
static const Bound *const common[] = {&opacity, &bump, &normal_map};
enum { N_COMMON = sizeof common / sizeof *common };

typedef struct {
    BuiltinId id;
    MaterialKind kind;
    uint32_t n;
    const Bound *bounds[MAX_ARGUMENTS];
} Kind;

static const Kind kinds[] = {
    {BUILTIN_MATTE, MATERIAL_MATTE, 1, {&color}},
    {BUILTIN_METAL, MATERIAL_METAL, 3, {&color, &rough, &edge}},
    {BUILTIN_GLOSS, MATERIAL_GLOSS, 3, {&color, &rough, &ior}},
    {BUILTIN_GLOW, MATERIAL_GLOW, 2, {&color, &power}},
    {BUILTIN_GLASS, MATERIAL_GLASS, 4, {&color, &ior, &rough, &depth}},
};

static const Kind *kind_of(BuiltinId id) {
    const Kind *kind = kinds;
    while (kind->id != id) {
        kind++;
    }
    return kind;
}

// False: reported, or asked for.
static bool is_within(const BuiltinCall *call, uint32_t arg, const Bound *bound) {
    Eval *ev = call->ev;
    const Value *value = &call->args[arg];
    for (uint32_t k = 0; k < value->n; k++) {
        double x;
        if (!dag_is_const(ev->dag, value->ref[k], &x)) {
            if (!eval_copies_within(ev, value->ref[k], bound->low, bound->high)) {
                return false;
            }
        } else if (!(x >= bound->low && x <= bound->high)) {
            bool is_below = !(x >= bound->low);
            eval_error(ev, call->env, call->nodes[arg] ? call->nodes[arg] : call->node, NULL,
                       "%s is at %s %g, this is %.6g", bound->name, is_below ? "least" : "most",
                       is_below ? bound->low : bound->high, x);
            return false;
        }
    }
    return true;
}

static MaterialValue *material_new(Eval *ev, MaterialKind kind) {
    static const double plain[MATERIAL_OWN] = {1, 0, 0.5, 0.5, 1};
    MaterialValue *material = ARENA_NEW(ev->arena, MaterialValue);
    *material = (MaterialValue){.kind = kind, .n = MATERIAL_OWN, .n_parts = 1};
    for (int i = 0; i < MATERIAL_OWN; i++) {
        material->ref[i] = dag_const(ev->dag, plain[i]);
    }
    return material;
}

Value builtins_material(const BuiltinCall *call) {
    const Kind *kind = kind_of(call->id);
    MaterialValue *material = material_new(call->ev, kind->kind);
    for (uint32_t i = 0; i < kind->n; i++) {
        if (!is_within(call, i, kind->bounds[i])) {
            return value_poison();
        }
        for (uint32_t k = 0; k < call->args[i].n; k++) {
            material->ref[material->n++] = call->args[i].ref[k];
        }
    }
    for (uint32_t i = 0, at = 0; i < N_COMMON; i++) {
        const Value *value = &call->args[kind->n + i];
        if (!is_within(call, kind->n + i, common[i])) {
            return value_poison();
        }
        for (uint32_t k = 0; k < value->n; k++) {
            material->ref[at++] = value->ref[k];
        }
    }
    return (Value){.type = VALUE_MATERIAL, .material = material};
}

Value builtins_mix_materials(const BuiltinCall *call) {
    const MaterialValue *a = call->args[0].material, *b = call->args[1].material;
    MaterialValue *material = material_new(call->ev, MATERIAL_MIX);
    if (!is_within(call, 2, &weight)) {
        return value_poison();
    }
    material->ref[material->n++] = call->args[2].ref[0];
    material->parts[0] = a;
    material->parts[1] = b;
    material->n_parts = a->n_parts + b->n_parts;
    if (material->n_parts > MATERIAL_MAX_PARTS) {
        return eval_error(call->ev, call->env, call->node, NULL,
                          "a mix is of at most %d materials, this is of %u", MATERIAL_MAX_PARTS,
                          material->n_parts);
    }
    return (Value){.type = VALUE_MATERIAL, .material = material};
}
