// SPDX-License-Identifier: Apache-2.0
// The film's time: frames and fractions, shutters, cells.
//
// An instant is (frame, frac): `frame` whole frame periods after the start of frame 1, plus
// frac * period, frac in [0, 1). Seconds are formed only to evaluate expressions, so that a shutter
// of a microsecond at a million seconds keeps its resolution.
//
// A *cell* is one frame period [frame, frame + 1). Instants at which vertices are sampled are cuts
// of a cell: at its breaks first, then by halving. Which cuts a cell gets depends on the cell
// alone, never on the frames rendered with it.
#ifndef RENDER_TIMELINE_H
#define RENDER_TIMELINE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int64_t frame; // 0 is the period that begins with frame number 1
    double frac;   // [0, 1)
} Instant;

// frame + offset, offset in frame periods, of any size and sign.
static inline Instant instant_at(int64_t frame, double offset) {
    double whole = floor(offset);
    double frac = offset - whole;
    if (frac >= 1) { // a tiny negative offset
        whole += 1;
        frac = 0;
    }
    return (Instant){frame + (int64_t)whole, frac};
}

static inline double instant_seconds(Instant at, double fps) {
    return ((double)at.frame + at.frac) / fps;
}

#endif
