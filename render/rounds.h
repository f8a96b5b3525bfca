// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling of a frame, round by round: each brings the film to a higher level
// (render/adaptive.h), after each it is decided whether there is another one, and to which level.
//
// Whichever bound is reached first ends the frame: the noise, the samples, the time. The noise is
// looked at from the level on at which it is believed, and reached when it is so little even at
// most. What a round does depends on the film and the level alone, so the film and the level at
// work are all there is to keep for a checkpoint. Where there is no bound on time, levels depend on
// the film too, and the picture is the same bytes on any machine; where there is, the level at its
// end says how to make it again.
#ifndef RENDER_ROUNDS_H
#define RENDER_ROUNDS_H

#include "render/adaptive.h"
#include "render/render.h"
#include "render/tiles.h"

typedef struct {
    const RenderOptions *options; // is_adaptive
    Film *film;                   // with FILM_HALVES
    Level level;                  // at work; 0: not begun
    Level bound, believed;        // on the level; adaptive_believed
    double deadline;              // of clock_seconds; INFINITY: none
    AdaptiveNoise noise;          // once a round is done
    RenderStop stop;              // once there is no other round
    Allocation allocation;
    double began; // the round at work: of clock_seconds
    uint64_t n_before;
    double speed; // samples a second, of the last round
} Rounds;

// level: at which the film was left by an earlier run, 0: it is empty. deadline: of clock_seconds.
void rounds_begin(Rounds *rounds, const RenderOptions *options, Film *film, Level level,
                  double deadline);

// Gives what is to be traced next, within *pass; to be called again when all of it is. False: the
// frame is done. A frame has at least ADAPTIVE_LEAST samples in every pixel, however little time
// there is.
bool rounds_next(Rounds *rounds, TilePass *pass);

// Samples of all pixels that the frame will have in the end, as far as can be told by now.
uint64_t rounds_expect(const Rounds *rounds);

#endif
