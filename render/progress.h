// SPDX-License-Identifier: Apache-2.0
// How far a run is, on standard error: a line that redraws itself for people, a line of JSON now
// and then for programs.
#ifndef RENDER_PROGRESS_H
#define RENDER_PROGRESS_H

#include "render/render.h"

typedef struct {
    ProgressKind kind;
    uint64_t total;           // samples, of all frames
    uint64_t traced, skipped; // of them: by this run, and what it need not trace
    int64_t frame;
    double start;   // of clock_seconds: the run
    double since;   // of clock_seconds: the last progress_frame; INFINITY: nothing is traced now
    double seconds; // traced before that
    double next;    // of clock_seconds: the next line
    double noise;   // estimated, of the frame at work; 0: not known
} Progress;

void progress_begin(Progress *progress, ProgressKind kind, uint32_t n_frames, uint64_t total);
// From here to progress_pause samples are traced; speed is that of these times alone.
void progress_frame(Progress *progress, int64_t frame);
void progress_pause(Progress *progress);
void progress_written(Progress *progress, int64_t frame); // its picture is there
void progress_add(Progress *progress, uint64_t samples);  // from any thread
// Samples that need not be traced; they count as done, not as fast.
void progress_skip(Progress *progress, uint64_t samples);
// The same by what is left of the total besides what was traced.
void progress_left(Progress *progress, uint64_t samples);
// Between two rounds of a frame: how many samples are left as far as can be told, and how large
// its noise is, relative; 0: not known yet.
void progress_judge(Progress *progress, uint64_t left, double noise);
void progress_end(Progress *progress); // clears the line

#endif
