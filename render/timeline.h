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

// Part of a cell in which a shutter is open: [lo, hi] in frame periods, 0 <= lo <= hi <= 1; equal
// only where the shutter is open for an instant.
typedef struct {
    int64_t frame;
    double lo, hi;
} Opening;

// A shutter of any length; its openings, one in each cell that it reaches, are worked out on
// demand.
typedef struct {
    Instant start;
    double length;    // frame periods
    uint64_t n_cells; // >= 1
} ShutterSpan;

// The shutter of film frame `number`, by its settings (render/scene.h) in frame periods.
static inline ShutterSpan shutter_span(int64_t number, double open, double length) {
    Instant start = instant_at(number - 1, open);
    double end = start.frac + length, whole = ceil(end);
    return (ShutterSpan){start, length, whole > 1 ? (uint64_t)whole : 1};
}

static inline Opening shutter_opening(const ShutterSpan *span, uint64_t i) {
    double end = span->start.frac + span->length - (double)i;
    return (Opening){span->start.frame + (int64_t)i, i == 0 ? span->start.frac : 0,
                     end < 1 ? end : 1};
}

#endif
