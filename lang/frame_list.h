// SPDX-License-Identifier: Apache-2.0
// Lists of frames as people write them: 1-48,60,72x2.
//
//   list = part { "," part } .
//   part = N | N "-" [ N ] [ "x" STEP ] | N "x" STEP .
//
// A part without its last frame runs to the film's last; "xS" takes every S-th frame. Frame numbers
// may be negative.
#ifndef LANG_FRAME_LIST_H
#define LANG_FRAME_LIST_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/arena.h"

enum { FRAME_LIST_MAX = 10000000, FRAME_MAX = 1000000000 };

typedef struct {
    int64_t first, last, step; // step >= 1
    bool is_open;              // last is the film's
} FrameSpan;

typedef struct {
    const FrameSpan *spans;
    uint32_t n_spans;
} FrameList;

// False with a sentence in message[n]. The spans live in the arena.
bool frame_list_parse(Arena *arena, const char *text, FrameList *list, char *message, size_t n);

// The frames in ascending order, each once, in the arena; *n_frames gets how many (0: every part
// begins after film_last, or there are more than FRAME_LIST_MAX).
const int64_t *frame_list_frames(Arena *arena, const FrameList *list, int64_t film_last,
                                 uint32_t *n_frames);

#endif
