// SPDX-License-Identifier: Apache-2.0
// One frame's rays, shared out to threads in tiles.
//
// A pass brings pixels to as many samples as it asks for; what a pixel has already, by the film's
// counts, is not done again. So a pass can be left between any two samples, for a checkpoint or for
// good, and gone on with in this run or in another: the film is all the state there is. A pass
// after which others follow, with numbers decided from the film alone, is as deterministic as one.
#ifndef RENDER_TILES_H
#define RENDER_TILES_H

#include "render/adaptive.h"
#include "render/path.h"
#include "render/progress.h"

enum { TILE_SIZE = 16 };

typedef struct {
    int64_t frame;                // a number, 1 is the first
    uint32_t first;               // index of the first sample of each pixel
    uint32_t n;                   // samples that each pixel is to have
    const Allocation *allocation; // NULL, or how many each is to have, of a film in two halves
    double due; // of clock_seconds: when to come back for a checkpoint; INFINITY: never
} TilePass;

typedef enum { TILES_DONE, TILES_DUE, TILES_INTERRUPTED } TilesOutcome;

// Traces what the film lacks. Adds to stats and troubles, whose arrays have room for all of the
// scene's lights and materials.
TilesOutcome tiles_trace(const PathScene *paths, const World *world, const RenderOptions *options,
                         const TilePass *pass, Film *film, Progress *progress, RenderStats *stats,
                         PathTroubles *troubles);

#endif
