// SPDX-License-Identifier: Apache-2.0
// Pictures on surfaces: read tile by tile when first looked at, kept as a pyramid of ever smaller
// pictures, filtered over what falls into a pixel (OpenImageIO's texture system, in st4-image.so,
// loaded with the first texture).
//
// A picture fills the unit square of (u, v), v upwards, and repeats beyond. Its colors are linear
// light: what 8-bit files hold, and 16-bit ones that say so, comes off the sRGB curve before it is
// filtered, unless the picture is raw: numbers as they are, for heights, normals, roughness.
// Opacity is not multiplied into the colors.
#ifndef RENDER_TEXTURE_H
#define RENDER_TEXTURE_H

#include "accel/arena.h"
#include "render/program.h"

// The picture of a file, read once to see that it can be; the file stays in use until the program
// ends. NULL with one sentence in message[n], without the file's name.
const ProgramImage *texture_open(Arena *arena, const char *path, bool is_raw, char *message,
                                 size_t n);

// Bytes of tiles that all textures together keep in memory. Loads nothing: without textures it does
// nothing.
void texture_set_memory(size_t bytes);

#endif
