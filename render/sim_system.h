// SPDX-License-Identifier: Apache-2.0
// Equations of one member, or of all, as SUNDIALS CVODE integrates them.
#ifndef RENDER_SIM_SYSTEM_H
#define RENDER_SIM_SYSTEM_H

#include "render/sim_state.h"

typedef enum { SIM_STEP_ON, SIM_STEP_EVENT, SIM_STEP_FAILED } SimStep;

// Members first .. first + n - 1.
typedef struct SimSystem {
    const SimState *sim;
    uint32_t first, n;
    double *y;           // [n_states][n] at the system's time
    int *roots;          // [n_whens][n] after SIM_STEP_EVENT: not 0 for what happened
    const char *message; // after a failure
    uint32_t bad_member; // whose it was, from first on
    struct SimSolver *solver;
} SimSystem;

// NULL: no memory.
SimSystem *sim_system_new(const SimState *sim, uint32_t n);
void sim_system_free(SimSystem *system); // NULL: nothing

// Sets y to the members' start values; all are there. False: they are not finite.
bool sim_system_start(SimSystem *system);

// From y at t, which may have jumped, towards the time `end`, the first step at most so long;
// INFINITY: as it comes.
void sim_system_restart(SimSystem *system, double t, double end, double first_step);

// One step, to an event at most; *t becomes the time reached (on failure: where it stopped).
SimStep sim_system_step(SimSystem *system, double *t);

// Quintics between two times of the last step; false: they do not lie in it.
bool sim_system_interpolate(SimSystem *system, double from, double to);
// The coefficients of scalar i of y.
const double *sim_system_fit(const SimSystem *system, uint32_t i);
// The largest difference between them and the solution, each by max(1, |x|), at three points.
double sim_system_miss(SimSystem *system);

// The rates of y at t, out[n_states][n].
void sim_system_rates(SimSystem *system, double t, double *out);

// ---- Events

// out[n_whens][n]: below 0 where true.
void sim_system_conditions(SimSystem *system, double t, double *out);
// Carries out the assignments of all events marked in fires[n_whens][n], of all members at once,
// from the values before. False: some are not finite, of system->bad_member first.
bool sim_system_assign(SimSystem *system, double t, const uint8_t *fires);
// The scalars of member first + j keep their values from now on.
void sim_system_rest(SimSystem *system, uint32_t j);
// Whether it is there; at the start all are.
void sim_system_be_there(SimSystem *system, uint32_t j, bool is);

#endif
