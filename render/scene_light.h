// SPDX-License-Identifier: Apache-2.0
// The lights of a scene (render/scene.h): plain structs of programs. They may read IN_T and
// IN_FILM_T.
#ifndef RENDER_SCENE_LIGHT_H
#define RENDER_SCENE_LIGHT_H

#include "render/program.h"
#include "render/sky_image.h"

typedef enum {
    LIGHT_SUN,  // out: direction towards it (any length), power (W/m2 facing it), r g b, angle
                // (radians across)
    LIGHT_LAMP, // out: from x y z, power (W, isotropic; intensity = power / 4 pi), r g b, radius
    LIGHT_SKY,  // out: r g b, power (radiance factor), by how much its image is turned around y
                // (radians); 4 outputs without an image
    LIGHT_SPOT, // out: as a lamp, then where it points x y z (any length), the whole angle of its
                // cone and the width of the edge within it (radians): power is the lamp's, the
                // cone only takes away
    LIGHT_AREA, // out: middle x y z, power (W, of all that shines, Lambertian), r g b, 1 if it
                // shines to both sides, half of its width x y z and of its height x y z: it faces
                // where width crossed with height points
} LightKind;

typedef struct {
    LightKind kind;
    const Program *program;
    const Program *visible; // 1 out; NULL: always
    SourceRef where;

    // Of skies, by which r g b are multiplied; NULL: there is none.
    const Program *gradient; // 3 out: r g b; reads IN_PX IN_PY IN_PZ besides, the unit direction
    const SkyImage *image;
} Light;

#endif
