// SPDX-License-Identifier: Apache-2.0
// Walks over materials and their parts.
#include "lang/material_value.h"

uint32_t material_inputs(const Dag *dag, const MaterialValue *material) {
    uint32_t inputs = 0;
    for (uint32_t i = 0; i < material->n; i++) {
        inputs |= dag_inputs(dag, material->ref[i]);
    }
    for (int k = 0; k < 2 && material->kind == MATERIAL_MIX; k++) {
        inputs |= material_inputs(dag, material->parts[k]);
    }
    return inputs;
}

const MaterialValue *material_change(Arena *arena, const MaterialValue *material,
                                     MaterialChange *change, void *context) {
    MaterialValue *changed = ARENA_NEW(arena, MaterialValue);
    *changed = *material;
    for (uint32_t i = 0; i < changed->n; i++) {
        changed->ref[i] = change(context, changed->ref[i]);
    }
    for (int k = 0; k < 2 && material->kind == MATERIAL_MIX; k++) {
        changed->parts[k] = material_change(arena, material->parts[k], change, context);
    }
    return changed;
}
