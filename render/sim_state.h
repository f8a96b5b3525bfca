// SPDX-License-Identifier: Apache-2.0
// Simulations by equations: members with a few scalars each, the rates at which these change, and
// events that set them anew.
//
// Members that read no other are integrated each by itself, on all threads, by SUNDIALS CVODE
// (Hindmarsh et al., "SUNDIALS: Suite of nonlinear and differential/algebraic equation solvers",
// ACM TOMS 31(3), 2005): Adams-Moulton with a fixed point iteration, or BDF with Newton and GMRES
// where is_stiff; no matrix is ever made. Members that read each other are one system: with BDF, if
// is_stiff, else by Runge-Kutta, which an event does not throw back (render/sim_crowd.h). The
// result does not depend on the number of threads.
//
// A member that is not there keeps its scalars: those of its start before it is born, its last ones
// afterwards. Nothing happens to it, and it is near to none.
//
// A member to which more than SIM_STATE_EVENTS events happen within a ten-thousandth of the span
// (at most a millisecond) rests from then on: its scalars keep their values.
#ifndef RENDER_SIM_STATE_H
#define RENDER_SIM_STATE_H

#include "render/program.h"
#include "render/sim.h"
#include "render/sim_near.h"

enum { SIM_STATE_EVENTS = 8, SIM_STATE_STEPS = 4000000 }; // steps: of each system, at most

// What a program reads besides the member's own states: others' states or presence, sums.
enum { SIM_READS_OTHERS = 1, SIM_READS_SUMS = 2 };
typedef enum { SIM_RATES, SIM_CONDITIONS, SIM_ASSIGNED, SIM_READERS } SimReader;

typedef struct {
    uint32_t n_members, n_states; // scalars of a member
    double low, high;             // seconds, low < high
    double tolerance;             // > 0: of each step and of the stored course, times max(1, |x|)
    bool is_coupled;              // members read each other
    bool is_stiff;
    // [n_states][n_members]: what the programs read as tables; written while running.
    double *live;
    double *there;        // [n_members]: likewise, 1 for those that are there, else 0
    const SimNear *nears; // sums that the programs read as tables too; filled in before they run
    uint32_t n_nears;
    // They read IN_I, the member, and all but start and life the live tables and IN_T, which is
    // IN_FILM_T too.
    const Program *start;       // n_states out
    const Program *life;        // 2 out: born, dies; NULL: it is always there
    const Program *rates;       // n_states out
    const Program *conditions;  // n_whens out, below 0 where true; NULL: there are none
    const Program *assigned;    // n_assigned out
    uint8_t reads[SIM_READERS]; // SIM_READS_ bits
    uint32_t n_whens, n_assigned;
    const uint32_t *assigned_when, *assigned_state; // [n_assigned] of which event, to which state
} SimState;

// Everything in *tracks is of the arena. False: *failure says why.
bool sim_state_run(Arena *arena, const SimState *sim, SimProgress *progress, void *context,
                   SimTracks *tracks, SimFailure *failure);

// Name and version of what computes: results may differ between versions.
const char *sim_state_library(void);

#endif
