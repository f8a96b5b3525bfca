// SPDX-License-Identifier: Apache-2.0
// From linear light to bytes for the eye: exposure, a tone curve, the transfer curve.
//
// srgb: the sRGB curve alone (IEC 61966-2-1); what is above 1 is cut.
// neutral: the Khronos PBR Neutral tone mapper (Khronos Group, "Khronos PBR Neutral Tone Mapper",
//   2024), then the sRGB curve. Below 0.8 colors lose at most 0.04 and nothing else, the reflection
//   of a coat under an even light; above, highlights are compressed towards 1 and towards white.
//   It is chosen among the published curves because what is matte keeps the color that the scene
//   says, hue included, and because it is short; filmic curves darken and shift everything.
// raw: no curve, a byte is 255 times the value.
#ifndef RENDER_DISPLAY_H
#define RENDER_DISPLAY_H

#include <stdint.h>

#include "render/film_settings.h"

typedef struct {
    ViewKind view;
    double gain;
    double step[256]; // [i]: the value from which on the byte is i rather than i - 1
} Display;

// exposure: in stops.
void display_init(Display *display, ViewKind view, double exposure);

// color: linear, of any size; what is below 0 or no number counts as 0.
void display_color(const Display *display, const double color[3], uint8_t bytes[3]);

// The tone curve of `neutral` alone; may be in place.
void display_neutral(const double color[3], double out[3]);

double display_linear_from_srgb(double v);

#endif
