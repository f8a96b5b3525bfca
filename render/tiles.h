// SPDX-License-Identifier: Apache-2.0
// One frame's rays, shared out to threads in tiles.
#ifndef RENDER_TILES_H
#define RENDER_TILES_H

#include "render/path.h"
#include "render/progress.h"

enum { TILE_SIZE = 16 };

// Traces options->spp samples for every pixel of the frame (a number, 1 is the first) into the
// film, which is cleared before, unless paths begins with a later sample. Adds to stats and
// troubles, whose arrays have room for all of the scene's lights and materials. False:
// interrupted, and the film is not complete.
bool tiles_trace(const PathScene *paths, const World *world, const RenderOptions *options,
                 int64_t frame, Film *film, Progress *progress, RenderStats *stats,
                 PathTroubles *troubles);

#endif
