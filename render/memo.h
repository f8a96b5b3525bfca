// SPDX-License-Identifier: Apache-2.0
// What programs of shapes came to, kept: bodies of one group share transforms, and rays of one
// instant ask for the same ones again and again.
#ifndef RENDER_MEMO_H
#define RENDER_MEMO_H

#include "render/program.h"

// One thread's.
typedef struct ProgramMemo ProgramMemo;

// n_slots: a power of two; programs that fall into one slot drive each other out.
ProgramMemo *memo_new(Arena *arena, uint32_t n_slots);

// As program_run1 for a program that reads times and loop variables alone; the same bits. What
// loop variables decide is worked out once while it stays in its slot, the rest once an instant.
void memo_run(ProgramMemo *memo, const Program *program, const double in[IN_COUNT], double *out);

#endif
