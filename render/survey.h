// SPDX-License-Identifier: Apache-2.0
// A survey of the frames asked for: what gives no light, what gives too much and what is not there
// whenever a shutter is open. The same for any blocks that they are rendered in.
#ifndef RENDER_SURVEY_H
#define RENDER_SURVEY_H

#include "render/render.h"

// Warns of lights that come and go but are off all the time ("light-never-visible"), of colors over
// time that are above 1 ("albedo-above-one") and of scenes whose shapes are all invisible all the
// time ("empty"). What is dark, bright or invisible by a constant is the loader's to say.
void survey_scene(const Scene *scene, const RenderOptions *options, const Reporter *reporter);

#endif
