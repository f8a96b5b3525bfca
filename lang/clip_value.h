// SPDX-License-Identifier: Apache-2.0
// Clips as values of the language: a span of a def's time, and how it is played.
#ifndef LANG_CLIP_VALUE_H
#define LANG_CLIP_VALUE_H

#include "lang/dag.h"
#include "lang/syntax.h"

// Scalars of a clip, by loop variables alone; times are in seconds.
typedef enum {
    CLIP_BEGIN, // of the def's time
    CLIP_END,
    CLIP_AT, // from here on play()'s parameters behind its first, in their order
    CLIP_FADE,
    CLIP_SPEED,
    CLIP_ONCE, // a truth value
    CLIP_PARTS,
    CLIP_REFS
} ClipRef;

typedef struct {
    Symbol name; // 0: which of several it is, loop variables say
    Symbol def;  // whose time it is of
    const Syntax *syntax;
    NodeId def_block; // of syntax: tells the def from others of its name
    bool is_played;   // by play(); else what stands from CLIP_AT on are its defaults
    Ref ref[CLIP_REFS];
} ClipValue;

static inline bool clip_is_of_one_def(const ClipValue *a, const ClipValue *b) {
    return a->syntax == b->syntax && a->def_block == b->def_block;
}

#endif
