// SPDX-License-Identifier: Apache-2.0
// Local time: running clocks, and bounds on what they show over a part of the film.
#include "render/local_time.h"

#include "render/mover.h"

enum {
    DEPTH = 12,
    PIECES = 256 // of one interval: what a clock that jumps more often shows is taken together
};

// Off the chord by so much of its length a clock still counts as bent, not as broken.
static const double STRAIGHT = 0.05;

double shape_seconds(const Shape *shape, const double *loops, double seconds) {
    if (!shape->clock) {
        return seconds;
    }
    double in[IN_COUNT], shown;
    shape_inputs(shape, loops, seconds, in);
    program_run1(shape->clock, in, &shown);
    return shown;
}

double shape_rate(const Shape *shape, const double *loops, double seconds, double step) {
    if (!shape->clock) {
        return 1;
    }
    double here = shape_seconds(shape, loops, seconds);
    double before = here - shape_seconds(shape, loops, seconds - step);
    double after = shape_seconds(shape, loops, seconds + step) - here;
    double larger = fmax(fabs(before), fabs(after)), smaller = fmin(fabs(before), fabs(after));
    if (larger > 2 * smaller + step) {
        return (fabs(before) < fabs(after) ? before : after) / step;
    }
    return (before + after) / (2 * step);
}

Instant instant_of_seconds(double seconds, double fps) {
    const double most = 0x1p60;
    double periods = fmin(fmax(seconds * fps, -most), most), whole = floor(periods);
    return (Instant){(int64_t)whole, periods - whole};
}

typedef struct {
    const Shape *shape;
    const double *loops;
    double fps;
    int64_t frame;
    LocalTake *take;
    void *context;
    uint32_t n_pieces;
} Walk;

static double shown_at(const Walk *w, double frac) {
    return shape_seconds(w->shape, w->loops, instant_seconds((Instant){w->frame, frac}, w->fps));
}

static void take_around(const Walk *w, double at, double by) {
    by = fabs(by);
    w->take(w->context, at - by, at + by);
}

// A piece too short to be cut any further: the clock jumps in it. On either side it may still run
// as far as it does in the piece's neighbour.
static void take_jump(const Walk *w, double lo, double hi, double a, double b) {
    double before = a - shown_at(w, lo - (hi - lo)), after = shown_at(w, hi + (hi - lo)) - b;
    double jump = fabs(b - a);
    if (isfinite(a)) {
        take_around(w, a, isfinite(before) ? fmin(fabs(before), jump) : 0);
    }
    if (isfinite(b)) {
        take_around(w, b, isfinite(after) ? fmin(fabs(after), jump) : 0);
    }
}

static void walk(Walk *w, double lo, double hi, double a, double b, int depth) {
    double mid = 0.5 * (lo + hi), m = shown_at(w, mid);
    double off = fabs(m - 0.5 * (a + b)), size = fmax(fabs(a), fabs(b));
    bool is_known = isfinite(off);
    if ((++w->n_pieces > PIECES && is_known) || off <= STRAIGHT * fabs(b - a) + 0x1p-50 * size) {
        w->take(w->context, fmin(fmin(a, b), m) - 2 * off, fmax(fmax(a, b), m) + 2 * off);
    } else if (depth == DEPTH || w->n_pieces > PIECES) {
        take_jump(w, lo, hi, a, b);
    } else {
        walk(w, lo, mid, a, m, depth + 1);
        walk(w, mid, hi, m, b, depth + 1);
    }
}

void local_times(const Shape *shape, const double *loops, double fps, int64_t frame, double lo,
                 double hi, LocalTake *take, void *context) {
    Walk w = {shape, loops, fps, frame, take, context, 0};
    double a = shown_at(&w, lo);
    if (hi > lo) {
        walk(&w, lo, hi, a, shown_at(&w, hi), 0);
    } else if (isfinite(a)) {
        take(context, a, a);
    }
}
