// SPDX-License-Identifier: Apache-2.0
// From a scene's shapes to the bodies of a world and the forms that they share, not sampled yet.
#ifndef RENDER_ASSEMBLE_H
#define RENDER_ASSEMBLE_H

#include "render/body.h"

typedef struct {
    Form **forms;
    Body *bodies; // with a form
    Body *planes;
    uint32_t n_forms, n_bodies, n_planes, n_objects;
    size_t forms_capacity, planes_capacity;
} Assembly;

// Everything is allocated from the arena but what forms allocate themselves. Warnings about rest
// poses are given here. options->tolerance and ->bake are read.
Assembly assemble(Arena *arena, const Scene *scene, const RenderOptions *options,
                  const Reporter *reporter);
void assembly_destroy(Assembly *assembly);

// The instant that stands for the whole film: its first.
double film_first_seconds(const Scene *scene);

#endif
