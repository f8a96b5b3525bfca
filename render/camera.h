// SPDX-License-Identifier: Apache-2.0
// Cameras: from a point of the picture and of the lens to a ray, at one instant.
#ifndef RENDER_CAMERA_H
#define RENDER_CAMERA_H

#include "accel/vec.h"
#include "render/scene.h"

// A camera at one instant, ready for rays. Picture points are in pixels: x right, y down, (0, 0)
// the corner of the first pixel.
typedef struct {
    CameraKind kind;
    Vec3 from;
    Vec3 right, down, forward; // orthonormal
    double pixel; // perspective: size of a pixel at distance 1; orthographic: in metres
    double center_x, center_y; // the picture point straight ahead
    bool is_valid;             // false: a program gave something not finite, or from == to
} Camera;

// scene->camera with `automatic` already resolved (see camera_automatic). seconds: the film's
// clock. Where `up` lies along the line of sight an axis takes its place.
Camera camera_at(const Scene *scene, double seconds);

// A program (10 constants, as CameraSettings has them) for a camera of 40 degrees that sees the
// whole box lo..hi with a margin, from a little above and to the side.
const Program *camera_automatic(Arena *arena, const Scene *scene, Vec3 lo, Vec3 hi);

// The ray through picture point (x, y); dir has unit length.
void camera_ray(const Camera *camera, double x, double y, Vec3 *origin, Vec3 *dir);

// Picture point of a world point; false where it is behind the camera. scale gets pixels per metre
// across the line of sight at that point.
bool camera_project(const Camera *camera, Vec3 point, double *x, double *y, double *scale);

#endif
