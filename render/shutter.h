// SPDX-License-Identifier: Apache-2.0
// The shutter: which instants a pixel of a frame sees, and how much each of them counts.
//
// Samples of time are drawn in proportion to the curve, by the inverse of its integral, so all of
// them weigh the same. What moves is sampled at every instant that any pixel can see: the openings
// of all pixels together are one interval (shutter_seen).
#ifndef RENDER_SHUTTER_H
#define RENDER_SHUTTER_H

#include "render/scene.h"
#include "render/timeline.h"

// A density over the fraction 0..1 of the open interval, straight between points.
struct ShutterCurve {
    uint32_t n;        // >= 2
    const double *at;  // [n] ascending, 0 first, 1 last
    const double *w;   // [n] the density there, >= 0; its mean is 1
    const double *sum; // [n] its integral up to there: 0 first, 1 last
    double error;      // how far off the integral may be anywhere, as measured between the points
};

typedef enum {
    CURVE_FINE,
    CURVE_NOT_FINITE,
    CURVE_NEGATIVE,
    CURVE_ZERO,  // everywhere
    CURVE_ROUGH, // the error stays above SHUTTER_CURVE_ERROR
} CurveTrouble;

#define SHUTTER_CURVE_ERROR 1e-4
#define SHUTTER_MOST_DELAY  1e15 // frame periods

typedef struct {
    CurveTrouble trouble;
    double at, value; // where, and what was found there
} CurveReport;

// Of a program that reads IN_X: 0..1. It is evaluated at 1025 places and then halfway between them
// as long as it is not straight: a jump is found to 1e-9. NULL: see the report.
const ShutterCurve *shutter_curve_new(Arena *arena, const Program *program, CurveReport *report);

// The fraction of the open interval before which the part u of the light falls; u in [0, 1].
double shutter_fraction(const ShutterSettings *shutter, double u);

// How much later than at delay 0 a pixel's shutter opens, in frame periods.
double shutter_delay(const ShutterSettings *shutter, const FilmSettings *film, uint32_t x,
                     uint32_t y);

// Sets first_delay and last_delay, from every pixel. False: the delay of the pixel x, y is not
// finite, or more than SHUTTER_MOST_DELAY. Takes as long as running the program for each.
bool shutter_find_delays(ShutterSettings *shutter, const FilmSettings *film, uint32_t *x,
                         uint32_t *y);

static inline bool shutter_is_delayed(const ShutterSettings *shutter) {
    return shutter->first_delay != 0 || shutter->last_delay != 0;
}

// The instant at a fraction in [0, 1] of the open interval of frame number `frame` (1 is the
// first), for a pixel with this delay. Formed relative to the frame: a shutter of a microsecond a
// week into a film keeps all its instants apart.
static inline Instant shutter_instant(const ShutterSettings *shutter, int64_t frame, double delay,
                                      double fraction) {
    Instant at = instant_at(frame - 1, delay);
    return instant_at(at.frame, at.frac + (shutter->open + fraction * shutter->length));
}

// Everything that the pixels of a frame see: without a delay the open interval itself, else wider
// by what forming instants may round.
ShutterSpan shutter_seen(const ShutterSettings *shutter, int64_t frame);

static inline bool shutter_is_instant(const ShutterSettings *shutter) {
    return !(shutter->length > 0);
}

#endif
