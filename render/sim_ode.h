// SPDX-License-Identifier: Apache-2.0
// What the child process that runs ODE sends through its pipe: for each step a RigidStep, and where
// that is fine a RigidState for each member. Both ends are the same program on the same machine.
#ifndef RENDER_SIM_ODE_H
#define RENDER_SIM_ODE_H

#include "render/sim_rigid.h"

enum { RIGID_STREAM_MAGIC = 0x52347374 };

typedef struct {
    uint32_t magic;
    uint32_t is_bad; // the simulation ends here: member says whose fault it is
    uint32_t member;
    double time; // seconds: when that was
    char message[100];
} RigidStep;

typedef struct {
    double at[3], turn[4];       // after the step; x y z w
    double velocity[3], spin[3]; // during the step
    uint32_t touches, sleeps;
} RigidState;

typedef void RigidEvaluate(const Program *program, const double in[IN_COUNT], double *out);

// What st4-ode.so exports. The first RigidStep is of the beginning. Only to be called in a child
// process. n_steps: sim_rigid_steps. evaluate: program_run1, which the plugin cannot see.
int sim_ode_send(const SimRigid *sim, uint64_t n_steps, RigidEvaluate *evaluate, int fd);

#endif
