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
#include "render/shot.h"

typedef struct {
    uint32_t bounces; // 0: direct light only
    uint32_t spp;     // 0: not said
    uint64_t seed;
    bool freeze;  // the noise is the same in every frame
    double clamp; // radiance that one surface adds to a path after its first bounce; 0: any
} RenderSettings;

typedef enum {
    MATERIAL_MATTE, // out: r g b (albedo)
    MATERIAL_METAL, // out: r g b (reflectance at normal incidence), rough in 0..1
    MATERIAL_GLOSS, // out: r g b (albedo under the coat), rough, ior
    MATERIAL_GLOW,  // out: r g b, power (radiance = rgb * power)
} MaterialKind;

// May read u v p n P N besides.
typedef struct {
    MaterialKind kind;
    const Program *program;
    SourceRef where;
    const char *label; // "red" where a name was written, else "matte@12"
} Material;

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
    const Program *geometry;  // spheres and planes
    const Program *transform; // 12 out, rows of the map to the world; NULL: identity
    const Program *visible;   // 1 out, != 0: there at that instant; NULL: always

    // Scalars of t whose floor jumps, or whose sign changes from < 0 to >= 0, just where vertex,
    // geometry or transform may jump or have a kink: sampling cuts there. 1 program, any number of
    // outputs; NULL: no breaks known.
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
} Shape;

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
