// SPDX-License-Identifier: Apache-2.0
// Colours as graphs: linear-light RGB with the primaries of Rec. 709.
#ifndef LANG_COLOR_H
#define LANG_COLOR_H

#include "lang/spatial.h"

// "#c83", "#cc8833" (the # may be missing) as encoded values in 0..1. False: something else.
bool color_parse(const char *text, double rgb[3]);

// One channel from sRGB's encoding to linear light (IEC 61966-2-1); odd, so that values below 0
// stay what they are, and defined above 1.
Ref color_linear(Dag *dag, Ref encoded);
Ref3 color_srgb(Dag *dag, Ref3 encoded);

// hue in turns (any number), saturation and value: of the sRGB-encoded colour, as colour pickers
// show it; the result is linear.
Ref3 color_hsv(Dag *dag, Ref hue, Ref saturation, Ref value);

// The light of a black body, its largest channel 1, none below 0. Chromaticity by the cubic
// splines of Kim et al., "Design of Advanced Color Temperature Control System for HDTV
// Applications", J. Korean Phys. Soc. 41 (2002): within 0.001 in x and y of the Planckian locus
// from 1667 K to 25000 K; temperatures outside are taken as the nearest of these.
Ref3 color_kelvin(Dag *dag, Ref kelvin);

#endif
