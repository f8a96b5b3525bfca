// SPDX-License-Identifier: Apache-2.0
// A scene over time, as the language hands it to the renderer: plain structs of programs. Nothing
// here knows syntax, nothing here is sampled yet. Frozen before the first ray; const from then on.
//
// World: right-handed, y up, metres, seconds, radians, linear-light RGB (Rec. 709 primaries).
// Every program may read IN_T, IN_FILM_T and the loop variables of its place; what else it may read
// is said beside it. A NULL program stands for the default named there.
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "render/film_settings.h"
#include "render/mesh.h"
#include "render/program.h"
#include "render/scene_light.h"
#include "render/scene_material.h"
#include "render/shot.h"

typedef struct {
    uint32_t bounces; // 0: direct light only
    uint32_t spp;     // 0: not said
    uint64_t seed;
    bool freeze;    // the noise is the same in every frame
    bool has_noise; // samples are to go on until the noise is that:
    double noise;   // relative RMSE of the picture
    double seconds; // to spend on a frame; 0: as many as it takes
    double clamp;   // radiance that one surface adds to a path after its first bounce; 0: any
} RenderSettings;

// Who asks whether a ray meets a shape.
typedef enum {
    RAY_CAMERA, // the camera, through holes too
    RAY_SHADOW, // a surface, whether it sees a light
    RAY_BOUNCE, // a surface, what is there: mirrors, glass, light from surface to surface
    RAY_KINDS,
    RAY_ANY = RAY_KINDS // everything that there is
} RayKind;

typedef enum {
    SHAPE_MESH,
    SHAPE_SPHERE, // geometry out: centre x y z, radius
    SHAPE_PLANE,  // geometry out: normal x y z (any length), offset: points with p.n/|n| = offset
} ShapeKind;

// A shape that stands n_instances times, once for each set of values of the loops around it.
typedef struct {
    ShapeKind kind;
    SourceRef where;
    const char *label;     // "Car/Wheel" or "sphere@12"; instances add [i], or what number gives
    const Program *number; // 1 out, added to the label as [12]; NULL: the instance, where many are
    bool is_joined;        // as 12
    uint32_t material;     // index into materials

    const Mesh *mesh;         // SHAPE_MESH: the rest pose
    const VertexTrack *track; // SHAPE_MESH: where the vertices are at t; NULL: in the rest pose
    const Program *vertex;    // SHAPE_MESH: 3 out, a vertex in the shape's own block; reads u v p n
                              // i besides, p from the track. NULL: the vertices stay at p
    const Program *clock;     // 1 out, seconds: what vertex and track have for t; NULL: IN_T itself
    const Program *fade;      // 3 out, by what the clock shows and loops: the vertices are those at
                              // the first of two times of theirs, on the way to those at the
                              // second as far as the third says, 0 to 1; NULL: they are at t
    const Program *geometry;  // spheres and planes
    const Program *transform; // 12 out, rows of the map to the world; NULL: identity
    // Where the transform is outer times inner, and all clocks of the instances run along lines:
    const Program *pace;  // 3 out, by loops alone: speed, offset, cycle (0: none) of the clock, t =
                          // speed * T + offset, from 0 again at the cycle; NULL: it is not parted
    const Program *outer; // 12 out, by loops alone; NULL: identity
    const Program *inner; // 12 out, by IN_T alone; NULL: identity
    const Program *visible;         // 1 out, != 0: there at that instant; NULL: always
    const Program *seen[RAY_KINDS]; // 1 out each, != 0: met by such rays; NULL: always
    bool is_catcher;                // not there but for the shadows on it; throws none

    // Scalars of t whose floor jumps, or whose sign changes from < 0 to >= 0, just where vertex,
    // geometry or transform may jump or have a kink: sampling cuts there. 1 program, any number of
    // outputs; NULL: no breaks known. With a clock: of vertex alone, by its own t.
    const Program *breaks;

    double tolerance; // pixels, > 0: bound on the error of sampled motion
    double smooth;    // radians: edges sharper than this stay sharp; < 0: faceted
    uint32_t samples; // spans per frame, given by the user; 0: chosen by the tolerance
    bool bake;        // into the common tree, in world space

    uint32_t n_instances; // 1 without loops
    uint32_t n_loops;     // 0..4
    const double *loops;  // [n_instances][n_loops]: IN_LOOP0...

    // [n_instances]: which objects of the scene the instances are, counted as they were written;
    // NULL: those behind the ones of the shape before.
    const uint32_t *objects;
    bool is_other_form; // it is the same objects as the shape before, which are there in turn
} Shape;

// How many objects it is besides those of the shapes before.
static inline uint32_t shape_n_objects(const Shape *shape) {
    return shape->is_other_form ? 0 : shape->n_instances;
}

// Whether some rays pass through it that others meet.
static inline bool shape_is_selective(const Shape *shape) {
    return shape->seen[RAY_CAMERA] || shape->seen[RAY_SHADOW] || shape->seen[RAY_BOUNCE] ||
           shape->is_catcher;
}

typedef struct {
    FilmSettings film;
    ShutterSettings shutter;
    CameraSettings camera;
    RenderSettings render;
    const Light *lights;
    const Material *materials;
    const Shape *shapes;
    uint32_t n_lights, n_materials, n_shapes;
    char hash[33]; // hexadecimal, of everything that the scene was made from
} Scene;

#endif
