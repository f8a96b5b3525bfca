// SPDX-License-Identifier: Apache-2.0
// Checkpoints: the sums of the frame at work, kept in a file beside its picture, so that whatever
// ends the run costs at most what was traced since the last of them.
#ifndef RENDER_CHECKPOINT_H
#define RENDER_CHECKPOINT_H

#include "render/film_file.h"
#include "render/render.h"

// When the next one is due. Writing takes at most a fiftieth of the time: where a disk is slow,
// checkpoints are further apart than asked for.
typedef struct {
    double seconds;      // between two; 0: none
    double due;          // of clock_seconds; INFINITY: never
    uint64_t n_replaced; // samples in one that was there before and is not gone on from: it is not
                         // replaced by one of fewer
    bool has_failed;
} Checkpoint;

// The film, which has the size of the origin, is cleared, or filled from the picture's checkpoint
// where options->resume is set and there is one; the origin then gets its level and milliseconds.
// False: there is one that cannot be gone on with; one error through the reporter says why.
bool checkpoint_begin(Checkpoint *checkpoint, const RenderOptions *options, const char *picture,
                      Film *film, FilmOrigin *origin, const Reporter *reporter);

// Writes the film beside the picture, and says when the next one is due. What cannot be written is
// a warning, once: the run is worth going on with. False: there is none from this moment.
bool checkpoint_save(Checkpoint *checkpoint, const char *picture, const Film *film,
                     const FilmOrigin *origin, const Reporter *reporter);

// For when the picture is there.
void checkpoint_remove(const char *picture);

#endif
