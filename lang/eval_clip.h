// SPDX-License-Identifier: Apache-2.0
// Clips: named spans of a def's time, and what an instance shows that plays them.
#ifndef LANG_EVAL_CLIP_H
#define LANG_EVAL_CLIP_H

#include "lang/object.h"

// One clip fading into the next: vertices that move are then of a form of its own.
typedef struct {
    Ref clock;    // seconds since the fade began, from 0 to its length
    Ref is_on;    // a truth value
    Ref times[3]; // by that clock as IN_T: `before`, `now` and `weight` of Clips
} ClipFade;

// What an instance that plays clips shows of its def: the moment `before` where the weight is 0,
// what Place.clock shows where it is 1, what lies between them else. By the film's clock.
typedef struct Clips {
    Ref before, weight, is_fading;
    uint32_t n;
    ClipFade *fades;
} Clips;

// Where the clips of a copy's def have names.
Env clip_names(Eval *ev, const Env *env, const Object *copy);
// What play(...) gives: rest[5] are at, fade, speed, once and parts.
Value clip_play(Eval *ev, const Value *clip, const Value *rest);
// Sets the clock and the clips of the place of an instance; t: what its parent's clock shows.
// False: reported, or asked for.
bool place_play_clips(Eval *ev, Place *place, const Given *given, Ref t);

#endif
