// SPDX-License-Identifier: Apache-2.0
// What is seen in each pixel, and how much of it, as Cryptomatte (Friedman and Jones, "Fully
// automatic ID mattes with support for motion blur and transparency", SIGGRAPH 2015 posters; Psyop,
// "Cryptomatte specification", version 1.2): channels that compositors make mattes from.
//
// A thing is known by its name's hash, written as the bits of a float. Each pixel has pairs of such
// an id and its coverage, the largest first, two in the four channels of a rank: CryptoObject00.R
// .G .B .A holds the first id, its coverage, the second, its coverage; 01 and 02 follow. Coverages
// are shares of the pixel's samples: where no more than CRYPTOMATTE_IDS things are seen they sum to
// the share that met a surface. The header's manifest names what the picture shows.
#ifndef RENDER_CRYPTOMATTE_H
#define RENDER_CRYPTOMATTE_H

#include "render/film_names.h"

enum { CRYPTOMATTE_IDS = 6 };

// MurmurHash3_x86_32 of the name's bytes with seed 0 (Austin Appleby, public domain).
uint32_t cryptomatte_hash(const char *name);

// The bits of the float that stands for the name: its hash, with the lowest bit of the exponent
// flipped where it would be zero, denormal, infinite or no number.
uint32_t cryptomatte_id(const char *name);

// What attributes of a header are called that cryptomatte_add adds begins so.
#define CRYPTOMATTE_PREFIX "cryptomatte/"

// Adds the channels and attributes of LAYER_OBJECT and LAYER_MATERIAL where the film has them. The
// image's arrays are replaced by longer ones, from the arena. names: of all that is in the film.
void cryptomatte_add(const FilmNames names[N_FILM_IDS], const Film *film, Arena *arena,
                     Image *image);

#endif
