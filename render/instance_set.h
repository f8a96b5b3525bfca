// SPDX-License-Identifier: Apache-2.0
// Sets of instances: many places of one form that stand still in the world, each with a clock that
// runs along a line. An instance is a record of 80 bytes; what they have in common, how it moves in
// its own time and the boxes of that motion, is there once.
//
// Outer maps are kept with their 3x3 part in float: an instance is turned and sized to 6e-8 of what
// the scene says, everywhere by the same amount, and stands where the scene says in double.
#ifndef RENDER_INSTANCE_SET_H
#define RENDER_INSTANCE_SET_H

#include "render/body.h"
#include "render/scene.h"
#include "render/timeline.h"

typedef struct {
    double at[3];
    float linear[3][3];
    uint32_t instance; // of the shape
    double speed, offset;
} InstanceRecord;

// Boxes of what is common over equal parts of [lo, hi] of its own time, and of all powers of two of
// them from each on: any interval's box is the union of two.
typedef struct {
    double lo, hi;
    uint32_t n, n_levels; // n 0: there is one box, at all times
    Bounds *boxes;        // [n_levels][n]
} PhaseBoxes;

struct InstanceSet {
    const Shape *shape;
    Form *form;
    InstanceRecord *records; // [n]
    const double *cycles;    // [n]; NULL: all have `cycle`
    double cycle;            // seconds; 0: none
    uint32_t n, base;        // base: the object that the shape's first instance is
    uint32_t first;          // among all bodies, the first member
    uint32_t first_group;    // among all things of the upper level
    bool moves;              // by clocks: otherwise records have none
    PhaseBoxes phases;
    float (*boxes)[6]; // [n], lo and hi in the world while any shutter of the block is open
};

enum {
    SET_LEAST = 64, // fewer instances are bodies of their own
    SET_GROUP = 16  // neighbours that the upper level knows as one thing
};

static inline uint32_t set_n_groups(const InstanceSet *set) {
    return (set->n + SET_GROUP - 1) / SET_GROUP;
}

bool instance_set_suits(const Scene *scene, const Shape *shape);

// All instances that are there, neighbours in space beside each other; n 0: none is.
InstanceSet instance_set_new(Arena *arena, const Shape *shape, Form *form, uint32_t base,
                             uint32_t n_threads);

// What the clock of member k shows.
double instance_seconds(const InstanceSet *set, uint32_t k, double seconds);

// Member k as a body.
Body instance_body(const InstanceSet *set, uint32_t k);
Placement instance_place(const InstanceSet *set, uint32_t k, double seconds);
Affine instance_outer(const InstanceSet *set, uint32_t k);

// Once the form's keys are stored: over what all clocks show between two instants of the film.
void instance_phases(Arena *arena, InstanceSet *set, double fps, double first, double last);

// Then: set->boxes over all openings.
void instance_boxes(Arena *arena, InstanceSet *set, double fps, const Opening *openings, size_t n,
                    uint32_t n_threads);

// Bounds in the world over part of a cell of the film.
Bounds instance_bounds(const InstanceSet *set, uint32_t k, double fps, int64_t frame, double lo,
                       double hi);

// As local_times (render/local_time.h), for member k.
void instance_times(const InstanceSet *set, uint32_t k, double first, double last,
                    void take(void *context, double lo, double hi), void *context);

#endif
