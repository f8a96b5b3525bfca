// SPDX-License-Identifier: Apache-2.0
// What the equations of a simulation come to at an instant, for some of its members.
//
// The states are read from the simulation's live tables, which the caller fills in first: those of
// the members asked for and of those among whom they are, to whom they may be near, and whom they
// read otherwise. Results are columns of the members asked for: out[k * n + i] is output k of the
// i-th of them.
#ifndef RENDER_SIM_EQUATIONS_H
#define RENDER_SIM_EQUATIONS_H

#include "render/sim_state.h"

typedef struct SimEquations SimEquations;

// For one thread at a time. NULL: no memory.
SimEquations *sim_equations_new(const SimState *sim);
void sim_equations_free(SimEquations *equations); // NULL: nothing

void sim_equations_start(SimEquations *equations, SimMembers members, double *out);
void sim_equations_rates(SimEquations *equations, double t, SimMembers members, SimMembers among,
                         double *out);
// Below 0 where true; what is not a number does not hold.
void sim_equations_conditions(SimEquations *equations, double t, SimMembers members,
                              SimMembers among, double *out);

// Carries out, in y[n_states][n] at t, the assignments of all events marked in fires[n_whens][n],
// of all members at once, from the values before, which are live.
void sim_equations_assign(SimEquations *equations, double t, SimMembers members, SimMembers among,
                          const uint8_t *fires, double *y);

// The first of the values that is not a finite number; n: all are.
size_t sim_first_infinite(const double *values, size_t n);

#endif
