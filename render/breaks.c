// SPDX-License-Identifier: Apache-2.0
// Breaks: where in a cell a scalar of time passes an integer.
//
// The scalars are probed on a fixed grid of instants per cell; where the floor differs between two
// of them the change is bisected to neighbouring doubles. A scalar that crosses and comes back
// between two instants of the grid stays unseen.
#include "render/sample.h"

#include <stdlib.h>

enum { GRID = 64 };

// Below this (frame periods) bisection stops: it matters only at the very start of a cell.
static const double FINEST = 0x1p-60;
// Cuts nearer than this are one.
static const double SAME = 0x1p-40;

typedef struct {
    const Program *program;
    double in[IN_COUNT];
    double *out;
    uint32_t output;
    int64_t frame;
    double fps;
} Scalar;

static double floor_at(Scalar *s, double frac) {
    s->in[IN_T] = s->in[IN_FILM_T] = instant_seconds((Instant){s->frame, frac}, s->fps);
    program_run1(s->program, s->in, s->out);
    return floor(s->out[s->output]);
}

// A value that is not finite is not a break: nothing can be said of its sides.
static bool differ(double a, double b) {
    return isfinite(a) && isfinite(b) && a != b;
}

// The first change after lo, whose floor is `old`, before or at hi.
static Cut bisect(Scalar *s, double lo, double hi, double old) {
    for (;;) {
        double mid = lo + (hi - lo) / 2;
        if (mid <= lo || mid >= hi || hi - lo <= FINEST) {
            return (Cut){lo, hi};
        }
        if (differ(floor_at(s, mid), old)) {
            hi = mid;
        } else {
            lo = mid;
        }
    }
}

static bool find_between(Scalar *s, double lo, double hi, double old, double new, Cut *cuts,
                         size_t *n) {
    while (differ(old, new)) {
        if (*n == SAMPLE_MAX_CUTS) {
            return false;
        }
        Cut cut = bisect(s, lo, hi, old);
        cuts[(*n)++] = cut;
        old = floor_at(s, cut.at);
        lo = cut.at;
    }
    return true;
}

static int cut_compare(const void *a, const void *b) {
    double x = ((const Cut *)a)->at, y = ((const Cut *)b)->at;
    return (x > y) - (x < y);
}

static size_t merge(Cut *cuts, size_t n) {
    size_t kept = 0;
    qsort(cuts, n, sizeof *cuts, cut_compare);
    for (size_t i = 0; i < n; i++) {
        if (kept > 0 && cuts[i].at - cuts[kept - 1].at < SAME) {
            cuts[kept - 1].at = cuts[i].at;
        } else {
            cuts[kept++] = cuts[i];
        }
    }
    return kept;
}

static bool find_in(const SampleBreaks *breaks, double fps, int64_t frame, Arena *scratch,
                    Cut *cuts, size_t *n) {
    const Program *program = breaks->shape->breaks;
    uint32_t n_out = program_n_out(program);
    Scalar s = {program, {0}, ARENA_ARRAY(scratch, n_out, double), 0, frame, fps};
    shape_inputs(breaks->shape, breaks->loops, 0, s.in);
    double *floors = ARENA_ARRAY(scratch, (size_t)(GRID + 1) * n_out, double);
    for (int i = 0; i <= GRID; i++) {
        floor_at(&s, (double)i / GRID);
        for (uint32_t k = 0; k < n_out; k++) {
            floors[i * n_out + k] = floor(s.out[k]);
        }
    }
    for (s.output = 0; s.output < n_out; s.output++) {
        for (int i = 0; i < GRID; i++) {
            if (!find_between(&s, (double)i / GRID, (double)(i + 1) / GRID,
                              floors[i * n_out + s.output], floors[(i + 1) * n_out + s.output],
                              cuts, n)) {
                return false;
            }
        }
    }
    return true;
}

size_t breaks_find(const SampleBreaks *breaks, uint32_t n_breaks, double fps, int64_t frame,
                   Arena *scratch, Cut *cuts, bool *has_more) {
    size_t n = 0;
    *has_more = false;
    for (uint32_t i = 0; i < n_breaks && !*has_more; i++) {
        *has_more = !find_in(&breaks[i], fps, frame, scratch, cuts, &n);
    }
    return merge(cuts, n);
}
