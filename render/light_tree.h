// SPDX-License-Identifier: Apache-2.0
// A tree over many lights, from which one is drawn with a probability near its share of the light
// at a point, in logarithmic time.
//
// A. Conty Estevez, C. Kulla, "Importance sampling of many lights with adaptive tree splitting",
// HPG 2018, without the splitting: every node bounds where its lights are, where they face and how
// much they emit; a walk from the root picks a child by its importance for the point. Built by
// their surface area orientation heuristic.
//
// Bounds must hold for all instants at which the tree is asked, but only for little noise: no light
// with power has a probability of 0 anywhere, so what is estimated is right whatever they are.
#ifndef RENDER_LIGHT_TREE_H
#define RENDER_LIGHT_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/arena.h"
#include "accel/vec.h"

// One light. It emits to where is within acos(cos_e) of one of its normals, which are within
// acos(cos_o) of the axis (unit; any where cos_o is -1).
typedef struct {
    Vec3 lo, hi;
    Vec3 axis;
    double cos_o, cos_e;
    bool two_sided; // as much along -axis
    double power;   // of any unit; 0 or not finite: never drawn
} LightBounds;

typedef struct LightTree LightTree;

// NULL: no light has any power. Everything is allocated from the arena. O(n log n).
LightTree *light_tree_build(Arena *arena, const LightBounds *lights, uint32_t n);

// Draws a light for a surface at `from` that sees what is on the normal's side (0: on any);
// u in [0, 1) is used up. Its probability is > 0, and that of light_tree_probability.
uint32_t light_tree_sample(const LightTree *tree, Vec3 from, Vec3 normal, double u,
                           double *probability);
double light_tree_probability(const LightTree *tree, Vec3 from, Vec3 normal, uint32_t light);

// Calls visit for each light whose box a ray meets before tmax; dir is unit.
typedef void LightVisitor(void *context, uint32_t light);
void light_tree_visit(const LightTree *tree, Vec3 origin, Vec3 dir, double tmax,
                      LightVisitor *visit, void *context);

#endif
