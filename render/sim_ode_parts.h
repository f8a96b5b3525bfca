// SPDX-License-Identifier: Apache-2.0
// Inside of the driver of ODE, shared by the files render/sim_ode*.c: the only ones that know ODE.
#ifndef RENDER_SIM_ODE_PARTS_H
#define RENDER_SIM_ODE_PARTS_H

#include <ode/ode.h>
#include <stdio.h>

#include "render/sim_ode.h"

// What goes on in an island of bodies, the stronger the later.
typedef enum { ODE_AT_REST, ODE_HIT, ODE_PUSHED } OdeDrive;

typedef struct {
    const RigidBody *about;
    dBodyID id;                // NULL: it is fixed and does not move
    double center[3];          // of mass, in the body's block
    double last[3];            // velocity of its origin a step earlier, where a force reads it
    dMatrix3 inertia, inverse; // about the centre of mass
    bool is_round;             // the inertia is the same about all axes
    bool touches, is_jointed;
    uint32_t member;
    uint32_t island; // the number of another body in it, or its own
    OdeDrive drive;  // of the body that stands for its island
} OdeBody;

// Two geoms that touch.
typedef struct {
    OdeBody *a, *b;
    uint32_t first, n; // of the contacts
} OdeTouch;

typedef struct {
    const SimRigid *sim;
    RigidEvaluate *evaluate;
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
    OdeBody *bodies;
    dJointID *joints; // [n_joints]
    FILE *out;
    OdeTouch *touches; // of this step
    dContact *points;
    size_t n_touches, n_points, touches_capacity, points_capacity;
    bool has_no_memory;
} OdeRun;

void sim_ode_quaternion(const double turn[4], dQuaternion q);

// render/sim_ode_shape.c. NULL: no memory.
dGeomID sim_ode_geom(dSpaceID space, const RigidShape *shape);
void sim_ode_add_mass(dMass *total, const RigidShape *shape, double density);

// render/sim_ode_spin.c, of a body that is not fixed: once it has its mass; its spin at the
// beginning; how it turns by itself in the step to come.
void sim_ode_keep_inertia(OdeBody *body);
void sim_ode_start_spin(OdeBody *body, double h, const double now[3]);
void sim_ode_spin(OdeBody *body, double h);

// render/sim_ode_touch.c: what touches, as joints for the step to come. False: no memory.
bool sim_ode_touch(OdeRun *run);

#endif
