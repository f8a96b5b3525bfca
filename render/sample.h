// SPDX-License-Identifier: Apache-2.0
// At which instants motion is sampled, so that moving straight between them is right within a
// tolerance in pixels.
//
// A cell of time (a frame period) is cut at its breaks, and each piece halved until the error of
// linear motion is small enough, seen from the camera of that time. The error is measured on a
// fixed subset of the points at the middle and at seeded irregular times, so that no period of the
// motion hides from it: whatever turns twice per frame is not taken for still. Whether a piece is
// halved depends on the piece alone; what no shutter sees is not looked at.
#ifndef RENDER_SAMPLE_H
#define RENDER_SAMPLE_H

#include "accel/frame.h"
#include "render/camera.h"
#include "render/mover.h"
#include "render/timeline.h"

enum {
    SAMPLE_DEPTH = 10,                   // at most 1024 spans per frame
    SAMPLE_MAX_CUTS = 1 << SAMPLE_DEPTH, // breaks in one cell
};

// One span of linear motion within a cell. The far end's points are taken at hi_at: hi itself, or,
// before a jump, the last instant below it.
typedef struct {
    int64_t frame;
    double lo, hi, hi_at; // frame periods, 0 <= lo < hi <= 1
} Span;

// True where b begins with the very points that a ended with.
static inline bool span_continues(const Span *a, const Span *b) {
    bool is_next = a->frame == b->frame ? a->hi == b->lo
                                        : a->frame + 1 == b->frame && a->hi == 1 && b->lo == 0;
    return is_next && a->hi_at == a->hi;
}

// One place where the points stand in the world.
typedef struct {
    const Shape *shape;
    const Program *transform; // NULL: the points are in the world already
    const double *loops;
} SampleView;

// Breaks of one shape, for one instance.
typedef struct {
    const Shape *shape;
    const double *loops;
} SampleBreaks;

typedef struct {
    const Scene *scene;
    Mover all;   // n points
    Mover probe; // the subset on which errors are measured
    Frame frame; // in which they will be stored
    const SampleBreaks *breaks;
    const SampleView *views;    // of many, those that look largest in the cell's middle count
    uint32_t n_breaks, n_views; // n_views >= 1
    double pixels;              // > 0: per unit of the points' space, instead of views
    double tolerance;           // pixels
    uint32_t samples;           // spans per frame; 0: by the tolerance
} Sampler;

typedef struct {
    double error;   // pixels, the largest measured on what was kept
    bool is_missed; // the tolerance was, at SAMPLE_DEPTH
    bool has_too_many_breaks;
    bool is_fast_rotation; // more than a quarter turn within a span that the user asked for
    bool is_not_finite;
    double not_finite_at; // seconds, the first
    uint64_t evaluations; // points times instants
} SampleReport;

// A sampler's subset: all of a few points, else extremes and a seeded choice. Evaluates every point
// at `seconds` once.
Mover sample_choose(Arena *arena, const Mover *all, double seconds);

// The spans that a shutter with this opening sees, ascending; appends to *spans (n, capacity).
void sample_cell(const Sampler *sampler, Opening open, Arena *arena, Span **spans, size_t *n,
                 size_t *capacity, SampleReport *report);

// Pixels per metre at a world point, for a point anywhere: within the picture as the camera sees
// it, elsewhere by the distance alone (it may be seen in a mirror).
double sample_pixels(const Camera *camera, Vec3 point);

// The instants within a cell, ascending, where a break's floor changes: below is the last fraction
// with the old value, at the first one with the new.
typedef struct {
    double below, at;
} Cut;

// Returns how many, at most SAMPLE_MAX_CUTS; *has_more where there are more of them.
size_t breaks_find(const SampleBreaks *breaks, uint32_t n_breaks, double fps, int64_t frame,
                   Arena *scratch, Cut *cuts, bool *has_more);

#endif
