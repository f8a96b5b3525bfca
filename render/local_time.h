// SPDX-License-Identifier: Apache-2.0
// Time as instances have it: what their clocks show while a shutter is open.
#ifndef RENDER_LOCAL_TIME_H
#define RENDER_LOCAL_TIME_H

#include "render/scene.h"
#include "render/timeline.h"

// What the vertices of an instance have for t, at the film's seconds: the same without a clock.
double shape_seconds(const Shape *shape, const double *loops, double seconds);

// Seconds of that clock for each of the film's: by a central difference, and where the clock jumps
// within it by the side that does not.
double shape_rate(const Shape *shape, const double *loops, double seconds, double step);

// The cell and fraction of an instant given in seconds; far away, the last cell that there is.
Instant instant_of_seconds(double seconds, double fps);

// Called with intervals of a clock, in its seconds, lo <= hi.
typedef void LocalTake(void *context, double lo, double hi);

// What the clock of an instance shows over the part [lo, hi] of a cell of the film, as intervals
// that hold all of it; several where the clock jumps. A clock that runs straight is exact. Of one
// that bends, what it may do between probes is taken for twice what it is seen to do; its jumps are
// found to 2^-12 of the part.
void local_times(const Shape *shape, const double *loops, double fps, int64_t frame, double lo,
                 double hi, LocalTake *take, void *context);

#endif
