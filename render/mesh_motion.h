// SPDX-License-Identifier: Apache-2.0
// A clip of a scene of Assimp: the pose of its nodes at each time. Part of st4-assimp.so.
//
// Each node that has a channel moves by it: its place and scale go straight from key to key, its
// rotation the shorter way at a steady pace (slerp: K. Shoemake, "Animating rotation with
// quaternion curves", SIGGRAPH 1985); before the first and after the last key they stay. Of keys at
// one time the last counts from then on. Times are in the clip's own ticks, from its 0 to its
// duration.
#ifndef RENDER_MESH_MOTION_H
#define RENDER_MESH_MOTION_H

#include "render/mesh_skin.h"

typedef struct {
    const Skin *skin;
    const struct aiAnimation *animation;
    const struct aiNodeAnim **channel; // [skin->n_nodes]; NULL: the node has none
    Affine *local;                     // [skin->n_nodes]
    double duration, rate;             // ticks; ticks per second
} Motion;

// Without any look at the channels.
double motion_seconds(const struct aiAnimation *animation);

// False: it is damaged, or of a kind that is not read; message[n] gets a sentence.
bool motion_new(Arena *arena, const Skin *skin, const struct aiAnimation *animation, Motion *motion,
                char *message, size_t n);

void motion_pose(const Motion *motion, double ticks, SkinPose *pose);

// The ticks at which the pose may bend, and, where it jumps, the last ones before, ascending, from
// 0 to the duration.
double *motion_bends(Arena *arena, const Motion *motion, size_t *n);

// How far any node turns between two instants with no bend between them, at most: radians.
double motion_turn(const Motion *motion, double lo, double hi);

#endif
