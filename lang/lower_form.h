// SPDX-License-Identifier: Apache-2.0
// Forms: what each kind of shape is before its place and its looks are added.
#ifndef LANG_LOWER_FORM_H
#define LANG_LOWER_FORM_H

#include "lang/lower_parts.h"
#include "render/mesh_clips.h"

typedef struct {
    ShapeKind kind;
    const Mesh *mesh;
    const VertexTrack *track; // NULL: the mesh rests
    Ref track_key;            // of a track: the number of its key at t
    Ref vertex[3];            // REF_NONE: no program moves the vertices
    Ref geometry[4];
    uint32_t n_geometry;
    // A mesh that shapes of many sizes share: `own` maps `rest` (of p; REF_NONE: p itself) to the
    // shape's own block, where its material sees it as at t = 0.
    bool is_mapped;
    RefMap own;
    Ref rest[3];
    bool is_solid; // its sharp edges are known, whatever `smooth` says
    bool faceted;
    Ref color[3]; // instead of the material's; REF_NONE: that
} Form;

// lang/lower_shape.c: of any shape but points. False: reported, or there is nothing to see.
bool lower_form(Eval *ev, const Object *object, const Place *place, Form *form);

// lang/lower_mesh.c: the mesh of a `mesh`, with what moves it. False: reported.
bool lower_mesh_form(Eval *ev, const Object *object, const Place *place, Form *form);

// lang/lower_clip.c: the places of the vertices in the clips that are given. False: reported.
bool lower_clip_read(Eval *ev, const Given *file, const Given *clip, Arena *scratch,
                     PointCache *places);
// The same for the same names in the same order.
Symbol lower_clip_symbol(Eval *ev, const Given *clip);

// lang/lower_solid.c: cylinder, cone, torus, disc. False: reported, or there is nothing to see.
bool lower_solid_form(Eval *ev, const Object *object, const Place *place, Form *form);

// lang/lower_points.c: emits one shape or, where the points have nothing in common, several; the
// shape itself is made by `emit`.
typedef void LowerEmit(Eval *ev, const Object *object, const Place *place, const char *label,
                       const Form *form);
void lower_points(Eval *ev, const Object *object, const Place *place, const char *label,
                  LowerEmit *emit);

// A mesh with room for so many; nothing is in it yet. For lower_mesh_vertex, lower_mesh_triangle.
Mesh *lower_mesh_new(Eval *ev, uint32_t n_vertices, uint32_t n_triangles, bool has_normals);
// The index of the new vertex. normal: NULL where the mesh has none.
uint32_t lower_mesh_vertex(Mesh *mesh, const double p[3], const double normal[3], double u,
                           double v);
void lower_mesh_triangle(Mesh *mesh, uint32_t a, uint32_t b, uint32_t c);

// Warns of an object without a surface; false.
bool lower_nothing_seen(Eval *ev, const Object *object);

#endif
