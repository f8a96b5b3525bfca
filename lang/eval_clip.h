// SPDX-License-Identifier: Apache-2.0
// Clips: named spans of a def's time, and what an instance shows that plays them.
#ifndef LANG_EVAL_CLIP_H
#define LANG_EVAL_CLIP_H

#include "lang/object.h"

// ---- lang/eval_clip.c

// The clips of a def, by name: read, and mistakes reported, when the def is first used. at: the
// scope that has its binding.
const Scope *clips_of_def(Eval *ev, Scope *at, const Binding *def);
// Binds them in a scope, but for names that it has.
void clips_bind(Eval *ev, const Scope *clips, Scope *scope);

// NAME.CLIP or FILE.NAME.CLIP, where NAME is a def (NODE_MEMBER). False: it names no def.
bool clip_member(Eval *ev, const Env *env, NodeId node, Value *value);

// What play(...) gives: rest[5] are at, fade, speed, once and parts.
Value clip_play(Eval *ev, const ClipValue *clip, const Value *rest);

// A choice between clips, or between lists of clips, as long as each other or not. False: it
// must be known, or is between something else.
bool clip_choose(Eval *ev, Ref condition, const Value *a, const Value *b, Value *chosen);
bool clip_is_or_holds(const Value *value); // a clip, or a list of nothing but clips

// "it has walk and wave"
const char *clips_text(Eval *ev, const Scope *clips);

// ---- lang/eval_clip_play.c

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

// Sets the clock and the clips of the place of an instance; t: what its parent's clock shows.
// False: reported, or asked for.
bool place_play_clips(Eval *ev, Place *place, const Object *copy, const Given *given, Ref t);
// The same for an instance in a def that plays clips, whose clock goes by that def's time (IN_T).
void place_nest_clips(Eval *ev, Place *place, Ref clock);

#endif
