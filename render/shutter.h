// SPDX-License-Identifier: Apache-2.0
// The shutter: which instants a frame sees. A box: every instant of the interval counts the same.
#ifndef RENDER_SHUTTER_H
#define RENDER_SHUTTER_H

#include "render/scene.h"
#include "render/timeline.h"

// u in [0, 1] over the open interval of frame number `frame` (1 is the first). Formed relative to
// the frame: a shutter of a microsecond a week into a film keeps all its instants apart.
static inline Instant shutter_instant(const ShutterSettings *shutter, int64_t frame, double u) {
    return instant_at(frame - 1, shutter->open + u * shutter->length);
}

static inline bool shutter_is_instant(const ShutterSettings *shutter) {
    return !(shutter->length > 0);
}

#endif
