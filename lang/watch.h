// SPDX-License-Identifier: Apache-2.0
// Watches: what can only be judged once the film is known. Noted while evaluating, reported after
// a scene without errors.
#ifndef LANG_WATCH_H
#define LANG_WATCH_H

#include "lang/eval.h"

typedef struct Watches Watches;
Watches *watches_new(Arena *arena);

// A `keys` table that holds its ends: whether the film meets any of the keys.
void watch_keys(Eval *ev, Span where, double first, double last);

// A motion is evaluated at other times than its own: where its keys lie says nothing any more.
void watch_other_times(Eval *ev);

// Sampled data of the span [low, high] is read at `at`; outside of it the ends are held. Looked at
// where `at` depends on time alone. what: "the list", as reports begin.
void watch_read(Eval *ev, Span where, const char *what, Ref at, double low, double high);

// What is known until the second `high` alone is read at the time of the place.
void watch_end(Eval *ev, Span where, const char *what, double high);

// Warns of everything that was noted.
void watches_report(Eval *ev, const Scene *scene);

#endif
