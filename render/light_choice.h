// SPDX-License-Identifier: Apache-2.0
// Which lights a point of a surface asks while a frame is traced.
//
// Up to LIGHT_CHOICE_FEW lamps, spots and areas are asked one by one, and so are as many emitters:
// what is near is found without noise. More of either kind go into one light tree, from which
// LIGHT_CHOICE_DRAWN are drawn, so that ten thousand cost little more than ten. Suns are asked one
// by one, skies by rays.
//
// The tree bounds its lights over the time for which the frame's shutter is open; where they are
// and what they emit is evaluated at the ray's own time, of those that are drawn.
#ifndef RENDER_LIGHT_CHOICE_H
#define RENDER_LIGHT_CHOICE_H

#include "render/emitter.h"
#include "render/light.h"
#include "render/material.h"

enum { LIGHT_CHOICE_FEW = 8, LIGHT_CHOICE_DRAWN = 2 };

typedef struct {
    EmitterSet emitters;
    const LightTree *tree; // NULL: all are asked one by one
    bool draws_lights;     // lamps, spots and areas are in the tree, and in no LightSet
    bool draws_emitters;
    const uint32_t *lights; // [n_lights]: the scene's lights that are the tree's first
    uint32_t n_lights;
    bool has_area, is_near; // one of these has, or is: as in LightSet
} LightChoice;

typedef struct {
    const Scene *scene;
    const World *world;
    const Materials *materials;
    int64_t frame; // number
    bool moves;    // something does while the shutter is open
} LightChoiceInput;

// Before the frame's first ray; costs nothing where there are few lights and nothing glows.
LightChoice light_choice_new(Arena *arena, const LightChoiceInput *input);

// How many samples of an emitter a point takes on the mean: 1 where they are asked one by one.
double light_choice_emitter(const LightChoice *choice, Vec3 from, Vec3 normal, uint32_t emitter);
// Of a light that draws_lights: by its index in `lights`.
double light_choice_light(const LightChoice *choice, Vec3 from, Vec3 normal, uint32_t light);

#endif
