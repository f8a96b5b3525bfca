// SPDX-License-Identifier: Apache-2.0
// Accumulated motion blur: a frame as the mean of sharp pictures (Paul Haeberli and Kurt Akeley,
// The Accumulation Buffer, 1990; the thesis, section 7), the way of before there were trees over
// space and time, kept to be measured against.
//
// The shutter's interval is cut into n equal parts; in the middle of each the scene is sampled, a
// static three-dimensional structure is built over it, and a share of every pixel's samples is
// traced through that. Each part counts the same. What moves is seen n times in place of blurred:
// an error that more samples do not remove, only more subframes.
//
// Subframe i of n has the samples i spp/n to (i + 1) spp/n - 1, which are spread over the pixel by
// themselves where spp/n is a power of two.
#ifndef RENDER_ACCUMULATE_H
#define RENDER_ACCUMULATE_H

#include "render/tiles.h"

// Whether a frame of this scene is more than one instant: else subframes would all be the same, and
// rendering goes the usual way.
bool accumulate_applies(const Scene *scene, const RenderOptions *options);

// Traces all subframes of a frame into the film, which is empty. The camera must not be
// automatic any more. Adds to stats, sampling, building and tracing included, and to troubles. An
// exit status of render_frames.
int accumulate_trace(const Scene *scene, const RenderOptions *options, int64_t frame,
                     const Reporter *reporter, Film *film, Progress *progress, RenderStats *stats,
                     PathTroubles *troubles);

#endif
