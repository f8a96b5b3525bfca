// SPDX-License-Identifier: Apache-2.0
// glTF files made by the tests: a bar along x that two bones hold, a triangle on the second of
// them, and clips that move both; where its vertices are is known in closed form.
#ifndef TESTS_SKINNED_GLTF_H
#define TESTS_SKINNED_GLTF_H

#include <stddef.h>
#include <stdint.h>

enum { RINGS = 9, BAR_VERTICES = 4 * RINGS, SKINNED_VERTICES = BAR_VERTICES + 3 };

// What is wrong with a file.
typedef enum {
    SKINNED_SOUND,
    SKINNED_NAN_TIME,
    SKINNED_NAN_PLACE,
    SKINNED_HUGE_PLACE,
    SKINNED_BACKWARD,
    SKINNED_NO_ROTATION, // quaternions of zeros
    SKINNED_BAD_JOINT,   // weights of a bone that there is not
    SKINNED_BAD_WEIGHT,
    SKINNED_MORPH, // the clip moves a morph target
    SKINNED_KINDS
} SkinnedKind;

// The text of a file with the clips Bend (2.5 s), Wave (1.5 s) and Slide (1 s); to be freed.
char *skinned_gltf(SkinnedKind kind);

// Where a vertex is at a time of Bend or Wave; at rest.
void skinned_bend(uint32_t vertex, double seconds, double place[3]);
void skinned_wave(uint32_t vertex, double seconds, double place[3]);
void skinned_rest(uint32_t vertex, double place[3]);

#endif
