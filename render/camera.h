// SPDX-License-Identifier: Apache-2.0
// Cameras: from a point of the picture and of the lens to a ray, at one instant.
//
// The lens is thin: all rays through one point of the picture meet where the pinhole's ray is at
// the distance `focus`, so that a point at the distance z spreads over A |z - focus| / z there, A
// being the aperture's diameter (Potmesil and Chakravarty, "A lens and aperture camera model for
// synthetic image generation", 1981). Distances are along the line of sight; those of the spherical
// camera are from its middle, and its lens faces each direction in turn. The orthographic camera is
// telecentric: its rays spread by A |z - focus| / focus.
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
    double pixel; // size of a pixel at distance 1, spherical: at the horizon; orthographic: in
                  // metres at any distance
    double width, height;      // of the picture, in pixels
    double center_x, center_y; // the picture point straight ahead
    double radius;             // of the lens, in metres; 0: a pinhole
    double focus;              // metres
    uint32_t blades;
    bool is_valid; // false: a program gave something not finite or out of range, or from == to
} Camera;

// scene->camera with `automatic` already resolved (see camera_automatic). seconds: the film's
// clock. Where `up` lies along the line of sight an axis takes its place.
Camera camera_at(const Scene *scene, double seconds);

// A program (10 constants, as CameraSettings has them) for a camera of 40 degrees that sees the
// whole box lo..hi with a margin, from a little above and to the side.
const Program *camera_automatic(Arena *arena, const Scene *scene, Vec3 lo, Vec3 hi);

// The ray through picture point (x, y) and the middle of the lens; dir has unit length. Spherical:
// x goes around from behind over the left, y from the zenith down; beyond the picture's edges it
// goes on around.
void camera_ray(const Camera *camera, double x, double y, Vec3 *origin, Vec3 *dir);

// Through a point of the lens: (u, v) in [0, 1] are uniform over its disc or polygon, which has a
// corner at the top.
void camera_lens_ray(const Camera *camera, double x, double y, double u, double v, Vec3 *origin,
                     Vec3 *dir);

// Picture point of a world point, through the middle of the lens; false where it is behind the
// camera. scale gets pixels per metre across the line of sight at that point; spherical: as many as
// at the horizon.
bool camera_project(const Camera *camera, Vec3 point, double *x, double *y, double *scale);

// How far away a world point is, in metres along the line of sight; spherical: from the middle.
double camera_depth(const Camera *camera, Vec3 point);

#endif
