// SPDX-License-Identifier: Apache-2.0
// The inside of a world, for the files that build it and trace in it.
#ifndef RENDER_WORLD_PARTS_H
#define RENDER_WORLD_PARTS_H

#include "accel/boxtree.h"
#include "render/assemble.h"
#include "render/builds.h"
#include "render/world.h"

// The time axis of the upper tree: every cell that a shutter of the block reaches, cut into equal
// ticks.
typedef struct {
    int64_t *cells; // ascending
    uint32_t n_cells, per_cell;
} TickAxis;

struct World {
    Arena arena;
    const Scene *scene;
    double fps;
    Assembly parts;
    Opening *openings; // all that shutters see, ascending; far from each other within a cell
    size_t n_openings; // >= 1
    TickAxis ticks;
    Builds *builds; // over parts.forms
    BoxTree *top;   // over bodies and groups; NULL: all of the few bodies are asked
    AccelStats top_stats;
};

// The tick of an instant; of one outside of all cells, the nearest.
uint32_t tick_of(const TickAxis *axis, Instant at);

// Everything but the structures. NULL after an error was reported.
World *world_sample(const Scene *scene, const RenderOptions *options, const int64_t *frames,
                    uint32_t n_frames, const Reporter *reporter, uint32_t *n_taken);
// Assembled only.
World *world_new(const Scene *scene, const RenderOptions *options, const Reporter *reporter);
size_t world_memory(const RenderOptions *options);

// Builds world->top.
void top_build(World *world, const RenderOptions *options, AccelStats *stats);

// What a view knows of a body at its instant.
typedef struct {
    uint64_t stamp; // of the instant for which this was worked out; 0: never
    uint32_t id;
    const Body *body; // the world's, or `made`
    Body made;
    const Placement *place; // own, or the body's
    Placement own;
    uint32_t key;
    float f;
    uint8_t unseen; // bit k: not met by rays of RayKind k
    // Of a plane, in its own space; a normal of length 0 where there is none.
    Vec3 normal;
    double offset;
} BodyView;

struct WorldView {
    const World *world;
    Instant at;
    double seconds;
    uint32_t tick;
    uint64_t stamp;
    BodyView *slots;
    uint32_t mask; // slots - 1
    AccelCounters count;
    ProgramMemo *memo;
    Arena arena;
};

// id: as WorldHit.body.
const BodyView *view_body(WorldView *view, uint32_t id);

// The corners of a triangle, in the world, and a sphere's center and radius before the transform,
// as rays meet them at the view's instant.
void surface_corners(const Body *body, const BodyView *at, uint32_t prim, Vec3 corner[3]);
Vec3 surface_center(const Body *body, const BodyView *at, uint32_t prim, double *radius);

// A plane's unit normal and offset, in its own space.
bool plane_at(const Body *body, double seconds, Vec3 *normal, double *offset);

#endif
