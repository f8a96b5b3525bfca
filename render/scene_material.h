// SPDX-License-Identifier: Apache-2.0
// The materials of a scene (render/scene.h).
#ifndef RENDER_SCENE_MATERIAL_H
#define RENDER_SCENE_MATERIAL_H

#include "render/program.h"

typedef enum {
    MATERIAL_MATTE, // out: r g b (albedo)
    MATERIAL_METAL, // out: r g b (reflectance at normal incidence), rough in 0..1, and, if it is
                    // not white, r g b of the edge (render/fresnel.h)
    MATERIAL_GLOSS, // out: r g b (albedo under the coat), rough, ior
    MATERIAL_GLOW,  // out: r g b, power (radiance = rgb * power)
    MATERIAL_GLASS, // out: r g b, ior (>= 1), rough, depth: what is left of white light on its way
                    // through two surfaces if depth is 0, else within after so many metres
    MATERIAL_MIX,   // out: share of the second part, in 0..1
} MaterialKind;

// Its first three outputs say how much of the light that falls on it comes back.
static inline bool material_reflects(MaterialKind kind) {
    return kind != MATERIAL_GLOW && kind != MATERIAL_MIX;
}

// May read u v p n P N besides.
typedef struct {
    MaterialKind kind;
    const Program *program;
    SourceRef where;
    const char *label; // "red" where a name was written, else "matte@12"
    uint32_t parts[2]; // of a mix: materials before this one
    // 1 out: share of the light that meets a surface there, in 0..1; NULL: all. A mix has its
    // parts' own.
    const Program *opacity;
    const Program *height; // 1 out: by so many metres of the world the surface only seems raised
    // 3 out: the normal as pictures hold it, (x + 1) / 2 along the growing u, v and outwards; NULL:
    // the surface's own
    const Program *normal;
} Material;

#endif
