// SPDX-License-Identifier: Apache-2.0
// Prototypes: instances of a shape whose vertices read loop variables, but whose programs make the
// same of them, share one form.
#ifndef RENDER_PROTOTYPES_H
#define RENDER_PROTOTYPES_H

#include "render/scene.h"

typedef struct {
    uint32_t n;
    uint32_t *of;      // [n of which]: the prototype of each; NULL: there is one
    uint32_t *first;   // [n + 1]: where each one's begin in members
    uint32_t *members; // [n of which]: instances, ascending within a prototype
} Prototypes;

// Of the instances which[n], numbered as they come. Two are the same whose vertices are, to the
// bit, at any time; of other kinds than meshes each is its own.
Prototypes prototypes_of(Arena *arena, const Shape *shape, const uint32_t *which, uint32_t n);

// Those of a shape that are there at some instant, ascending; *n gets how many.
uint32_t *instances_seen(Arena *arena, const Shape *shape, uint32_t *n);

#endif
