// SPDX-License-Identifier: Apache-2.0
// What moves: sets of points, each a rest position or the result of a program, at any instant.
//
// One interface for the vertices of a mesh in its own space, for those of many meshes in the world
// (baked), and for centres and radii of spheres.
#ifndef RENDER_MOVER_H
#define RENDER_MOVER_H

#include "accel/vec.h"
#include "render/scene.h"

typedef struct {
    size_t n;
    const double *rest;       // [n][width]: the values where points and track are NULL
    const VertexTrack *track; // the positions that points reads, or goes without
    const uint32_t *which;    // [n]: the vertices of the track; NULL: n from `first` on
    size_t first;
    const Program *points;    // 3 outputs, for spheres 4
    const Program *fade;      // as Shape.fade; NULL: none
    const Program *transform; // 12 outputs, applied to the points; NULL: none
    ProgramInputs in;         // everything but the time
} MoverPart;

typedef struct {
    MoverPart *parts;
    uint32_t n_parts;
    uint32_t width; // 3: positions; 4: centre and radius
    size_t n;       // of all parts
} Mover;

bool program_reads_loops(const Program *program);

// False: no program of it reads the time.
bool mover_moves(const Mover *mover);

// The loop variables of an instance; NULL: none.
static inline const double *shape_loops(const Shape *shape, uint32_t instance) {
    return shape->n_loops ? shape->loops + (size_t)instance * shape->n_loops : NULL;
}

// Points the inputs of a part at the loop variables of an instance.
void mover_set_loops(ProgramInputs *in, const Shape *shape, uint32_t instance);

// The element of in[] that programs of one element (program_run1) take, for an instance at a time.
void shape_inputs(const Shape *shape, const double *loops, double seconds, double in[IN_COUNT]);

// Whether an instance is there, at the film's seconds.
bool shape_is_visible(const Shape *shape, const double *loops, double seconds);

// The 12 outputs of a program as a map. False: it is not finite.
bool affine_from_rows(const double rows[12], Affine *out);
// A program of 12 outputs as a map; NULL: the identity. False where it is not finite.
bool affine_run(const Program *transform, const double in[IN_COUNT], Affine *out);
// The same of one that reads IN_T alone.
bool affine_run_at(const Program *transform, double t, Affine *out);

// The vertices of a mesh under shape->vertex, in the shape's own space, for one instance.
MoverPart mover_mesh(Arena *arena, const Shape *shape, uint32_t instance);

// Everything at one instant: out[c][0..n) gets component c. Allocates from scratch.
void mover_run(const Mover *mover, double seconds, Arena *scratch, double *const out[4]);

// The same for the elements [first, first + n) alone.
void mover_run_some(const Mover *mover, size_t first, size_t n, double seconds, Arena *scratch,
                    double *const out[4]);

// A smaller one over the elements which[n], ascending.
Mover mover_subset(Arena *arena, const Mover *mover, const uint32_t *which, size_t n);

#endif
