// SPDX-License-Identifier: Apache-2.0
// An object's frame: what takes the doubles of the scene to the floats of the kernels.
//
// local = (object - center) * scale, with scale a power of two, so that the rest pose has its
// largest extent in [0.5, 1). The frame comes from the rest pose alone: it is the same whichever
// part of the film is in memory.
#ifndef ACCEL_FRAME_H
#define ACCEL_FRAME_H

#include "accel/accel.h"
#include "accel/vec.h"

typedef struct {
    double center[3];
    double scale;
} Frame;

// From a box in object space; lo > hi or an extent of 0 gives scale 1.
Frame frame_from_box(Vec3 lo, Vec3 hi);

// What undoes it: distances along the object-space ray are base + t * unit.
typedef struct {
    double base, unit;
} FrameDistance;

// Turns a ray of object space (double; dir of any length but 0) into one for the kernels, tmin and
// tmax included; key and f are left alone. An origin far from the object is moved along the ray to
// the point nearest to the frame's centre, in double and a second and third time for what the first
// left over, so that the float origin is as exact as the doubles were; tmin and tmax move with it.
// False: the ray is not finite or its direction is 0 (a miss).
bool frame_ray(const Frame *frame, Vec3 origin, Vec3 dir, double tmin, double tmax, AccelRay *ray,
               FrameDistance *distance);

#endif
