// SPDX-License-Identifier: Apache-2.0
// Materials as values of the language: expressions, of which lowering makes programs.
#ifndef LANG_MATERIAL_VALUE_H
#define LANG_MATERIAL_VALUE_H

#include "lang/dag.h"
#include "render/scene.h"

// What all materials have, before what is their own.
enum {
    MATERIAL_OPACITY,
    MATERIAL_BUMP,
    MATERIAL_NORMAL_X,
    MATERIAL_NORMAL_Y,
    MATERIAL_NORMAL_Z, // as pictures hold it, 0..1
    MATERIAL_OWN,
    MATERIAL_MAX_REFS = MATERIAL_OWN + 7,
    MATERIAL_MAX_PARTS = 64
};

typedef struct MaterialValue {
    MaterialKind kind;
    uint32_t n; // of refs
    // From MATERIAL_OWN on the outputs that render/scene.h names, none left out.
    Ref ref[MATERIAL_MAX_REFS];
    // Of a mix: what is mixed, and of how many materials that are no mixes it consists, at most
    // MATERIAL_MAX_PARTS; of others: 1.
    const struct MaterialValue *parts[2];
    uint32_t n_parts;
} MaterialValue;

// Which inputs the material and its parts read: bit i for Input i.
uint32_t material_inputs(const Dag *dag, const MaterialValue *material);

// The material with other expressions, made by `change` from each of its own and its parts'.
typedef Ref MaterialChange(void *context, Ref ref);
const MaterialValue *material_change(Arena *arena, const MaterialValue *material,
                                     MaterialChange *change, void *context);

#endif
