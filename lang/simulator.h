// SPDX-License-Identifier: Apache-2.0
// Who runs simulations for the evaluator, and keeps what they came to.
#ifndef LANG_SIMULATOR_H
#define LANG_SIMULATOR_H

#include "lang/hash.h"
#include "render/sim_rigid.h"
#include "render/sim_state.h"

typedef struct {
    const char *name;      // as the script has it
    const SimState *state; // one of both
    const SimRigid *rigid;
    Hash128 key; // of all that the result depends on, but for libraries
} SimJob;

typedef struct Simulator {
    // Everything in *tracks is of the arena. False: *failure says why.
    bool (*run)(void *context, Arena *arena, const SimJob *job, SimTracks *tracks,
                SimFailure *failure);
    void *context;
    bool runs_all; // also what nothing reads
} Simulator;

#endif
