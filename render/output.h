// SPDX-License-Identifier: Apache-2.0
// The files of a run: that they can be written, and what their headers say.
#ifndef RENDER_OUTPUT_H
#define RENDER_OUTPUT_H

#include "render/film.h"
#include "render/render.h"

// Checks every path before the first ray. On failure: false, one error through the reporter.
bool output_check(const RenderOptions *options, const Reporter *reporter);

// Writes one frame's picture. Its header says how it was made; nothing in it depends on the time of
// day, the threads or the other frames. On failure as above.
bool output_write(const Scene *scene, const RenderOptions *options, const Film *film, int64_t frame,
                  const Reporter *reporter);

#endif
