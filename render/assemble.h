// SPDX-License-Identifier: Apache-2.0
// From a scene's shapes to the bodies of a world and the forms that they share, not sampled yet.
#ifndef RENDER_ASSEMBLE_H
#define RENDER_ASSEMBLE_H

#include "render/instance_set.h"

// Bodies are counted through: those with a record of their own, the members of the sets one after
// the other, the planes.
typedef struct {
    Form **forms;
    Body *bodies; // with a form
    InstanceSet *sets;
    Body *planes;
    uint32_t n_forms, n_bodies, n_sets, n_members, n_groups, n_planes, n_objects;
    size_t forms_capacity, sets_capacity, planes_capacity;
} Assembly;

// Bodies that are no planes.
static inline uint32_t assembly_n_solid(const Assembly *parts) {
    return parts->n_bodies + parts->n_members;
}

// The set that a body is a member of; NULL: it is none. *member gets which.
const InstanceSet *assembly_set(const Assembly *parts, uint32_t body, uint32_t *member);

// What the upper level sorts: bodies with a record of their own, then the groups of the sets.
static inline uint32_t assembly_n_things(const Assembly *parts) {
    return parts->n_bodies + parts->n_groups;
}

// The set of a thing that is a group, and its members [*first, *last); NULL: it is a body.
const InstanceSet *assembly_group(const Assembly *parts, uint32_t thing, uint32_t *first,
                                  uint32_t *last);

// Everything is allocated from the arena but what forms allocate themselves. Warnings about rest
// poses are given here. options->tolerance and ->bake are read.
Assembly assemble(Arena *arena, const Scene *scene, const RenderOptions *options,
                  const Reporter *reporter);
void assembly_destroy(Assembly *assembly);

// The instant that stands for the whole film: its first.
double film_first_seconds(const Scene *scene);

#endif
