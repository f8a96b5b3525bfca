// SPDX-License-Identifier: Apache-2.0
// Programs remembered by the loop variables that they read.
#include "render/memo.h"

#include <string.h>

enum { LOOPS = IN_COUNT - IN_LOOP0 };

typedef struct {
    const Program *program; // NULL: the slot is free
    double loops[LOOPS];    // 0 where it reads none
    double seconds[2];      // t and T of the outputs
    double *registers;      // then the outputs
    uint32_t capacity;
} Slot;

struct ProgramMemo {
    Arena *arena;
    uint32_t mask;
    Slot *slots; // NULL: nothing was run yet, and in many scenes nothing ever is
};

ProgramMemo *memo_new(Arena *arena, uint32_t n_slots) {
    ProgramMemo *memo = ARENA_NEW(arena, ProgramMemo);
    *memo = (ProgramMemo){arena, n_slots - 1, NULL};
    return memo;
}

static Slot *slot_of(ProgramMemo *memo, const Program *program, const double loops[LOOPS]) {
    uint64_t hash = (uintptr_t)program >> 4;
    for (int k = 0; k < LOOPS; k++) {
        uint64_t bits;
        memcpy(&bits, &loops[k], sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return &memo->slots[hash & memo->mask];
}

static void take_slot(ProgramMemo *memo, Slot *slot, const Program *program,
                      const double loops[LOOPS]) {
    uint32_t n = program_n_instr(program) + program_n_out(program);
    if (n > slot->capacity) {
        slot->capacity = 2 * n;
        slot->registers = ARENA_ARRAY(memo->arena, slot->capacity, double);
    }
    slot->program = program;
    memcpy(slot->loops, loops, sizeof slot->loops);
}

void memo_run(ProgramMemo *memo, const Program *program, const double in[IN_COUNT], double *out) {
    double loops[LOOPS] = {0};
    uint32_t inputs = program_inputs(program), n_out = program_n_out(program);
    for (int k = 0; k < LOOPS; k++) {
        loops[k] = inputs >> (IN_LOOP0 + k) & 1 ? in[IN_LOOP0 + k] : 0;
    }
    memo->slots = memo->slots ? memo->slots : ARENA_ARRAY(memo->arena, memo->mask + 1, Slot);
    Slot *slot = slot_of(memo, program, loops);
    const double seconds[2] = {in[IN_T], in[IN_FILM_T]};
    bool is_known = slot->program == program && memcmp(slot->loops, loops, sizeof loops) == 0;
    if (!is_known) {
        take_slot(memo, slot, program, loops);
        program_keep(program, in, slot->registers);
    }
    double *kept = slot->registers + program_n_instr(program);
    if (!is_known || memcmp(slot->seconds, seconds, sizeof seconds) != 0) {
        program_run_kept(program, in, slot->registers, kept);
        memcpy(slot->seconds, seconds, sizeof seconds);
    }
    memcpy(out, kept, n_out * sizeof *out);
}
