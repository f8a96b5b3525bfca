// SPDX-License-Identifier: Apache-2.0
// Simulations of rigid bodies by ODE (Smith, "Open Dynamics Engine", version 0.16), in a child
// process that streams its steps: ODE aborts where bodies run away.
//
// Steps are of one length, on one thread, with the order of constraints drawn from the seed. ODE
// moves a body by its velocity after each step's forces; taken as the velocity in the middle of the
// step, and started half a step early, that is of second order, and exact in free fall. So is the
// turning of what is free (render/sim_ode_spin.c).
//
// What hardly moves for half a second sleeps: render/sim_ode_touch.c says until when.
//
// Columns of the tracks: place x y z, unit quaternion x y z w, to be normalised. Between steps:
// Hermite's cubic with velocities from the neighbouring middles; straight within a step in which
// the body touches something, so that no curve overshoots into what it hits. An arc ends where the
// velocity jumps by more than RIGID_JUMP. Pieces are then joined as far as tolerance allows.
#ifndef RENDER_SIM_RIGID_H
#define RENDER_SIM_RIGID_H

#include "render/program.h"
#include "render/sim.h"
#include "render/sim_solid.h"

enum { RIGID_COLUMNS = 7, RIGID_MOST_STEPS = 10000000 };

#define RIGID_JUMP 0.05 // metres a second

typedef enum {
    RIGID_BOX,
    RIGID_SPHERE,
    RIGID_CYLINDER,
    RIGID_CAPSULE,
    RIGID_PLANE,
    RIGID_CONVEX, // a hull
    RIGID_MESH    // closed, but of a fixed body
} RigidShapeKind;

typedef struct {
    RigidShapeKind kind;
    // BOX: its extent; SPHERE: radius; CYLINDER, CAPSULE: radius, length (along z; of a capsule
    // between the centres of its ends)
    double size[3];
    double at[3];          // of its origin in the body's block, metres; not of PLANE
    double turn[4];        // unit quaternion x y z w, likewise
    double plane[4];       // PLANE: unit normal, and its distance from the origin, in the world
    const SimSolid *solid; // CONVEX, MESH: around `at`; else NULL
    SimSolidMass own;      // of solid, where it is closed
} RigidShape;

typedef struct {
    const char *name; // its label, for messages
    bool is_fixed;
    const Program *motion; // of a fixed one that moves: 7 out, as the columns; reads IN_T. NULL
    const Program *force;  // newtons: 3 out; reads IN_T, IN_PX.. (place), IN_WX.. (velocity). NULL
    uint32_t first_shape, n_shapes;
    double at[3], turn[4]; // at the beginning
    double density, mass;  // kg/m3; kg, 0: from the density
    double friction, bounce;
    double velocity[3], spin[3]; // m/s, rad/s
} RigidBody;

// HINGE and SLIDER have stops, strength and speed.
typedef enum { RIGID_HINGE, RIGID_BALL, RIGID_SLIDER, RIGID_FIXED } RigidJointKind;

typedef struct {
    RigidJointKind kind;
    int32_t a, b;          // indices of bodies, another each, one not fixed; -1: the world
    double at[3], axis[3]; // in the world; not 0
    double low, high;      // radians or metres from the start; infinite: no stops
    double strength;       // newton metres or newtons, at most, towards the speed; 0: none
    const Program *speed;  // 1 out, of a against b, by the second; reads IN_T. NULL: 0
} RigidJoint;

typedef struct {
    uint32_t n_bodies, n_members, n_shapes, n_joints;
    const RigidBody *bodies;
    const uint32_t *members; // [n_members] of the tracks: indices of bodies that are not fixed
    const RigidShape *shapes;
    const RigidJoint *joints;
    double gravity[3], low, high, step, tolerance;
    uint32_t seed, iterations;
    unsigned limit; // seconds of processor time for the child; 0: none
} SimRigid;

// How many steps it takes: no less than two, as it is their neighbours that tell how they bend.
uint64_t sim_rigid_steps(const SimRigid *sim);

// As sim_state_run; failure->member is an index of members, or UINT32_MAX: nobody's.
bool sim_rigid_run(Arena *arena, const SimRigid *sim, SimProgress *progress, void *context,
                   SimTracks *tracks, SimFailure *failure);

// What results depend on besides *sim.
const char *sim_rigid_library(void);

#endif
