// SPDX-License-Identifier: Apache-2.0
// Clips, one after another, as few places of all points, between which straight lines are right.
// Part of st4-assimp.so.
//
// Right means within KEYS_BOUND of the diagonal of the box of the mesh as it rests. An eighth of
// that goes to instants from which no more is lost than by halving the spans between the clips'
// own keys until nothing at their middles and quarters is off (rotations under a quarter turn hide
// nothing there); the rest to leaving out those of them that straight lines come near to.
#ifndef RENDER_MESH_KEYS_H
#define RENDER_MESH_KEYS_H

#include "render/mesh_motion.h"

#define KEYS_BOUND 1e-4

typedef struct {
    double *seconds; // [n] ascending; the first clip begins at 0, each where the one before ended
    float **xyz;     // [n][skin->n_points][3]
    size_t n;        // >= 1
} Keys;

// A jump, as from one clip to the next, takes the shortest time that there is. False: message[n]
// gets a sentence.
bool keys_find(Arena *arena, const Skin *skin, const Motion *motions, uint32_t n_motions,
               Keys *keys, char *message, size_t n);

#endif
