// SPDX-License-Identifier: Apache-2.0
// Inside of the evaluation of a `sim rigid`, shared by its files (lang/eval_sim_rigid.c,
// lang/eval_sim_body.c).
#ifndef LANG_EVAL_SIM_PARTS_H
#define LANG_EVAL_SIM_PARTS_H

#include "lang/eval_sim.h"
#include "lang/object.h"

// A body by its label.
typedef struct {
    Symbol name;
    bool has_index;
    double index;
    NodeId statement;
    Value place; // of a fixed body: a transform
} RigidLabel;

typedef struct {
    Eval *ev;
    Sim *sim;
    Object object; // its settings
    RigidBody *bodies;
    RigidLabel *labels; // [n_bodies]
    RigidShape *shapes;
    RigidJoint *joints;
    size_t n_bodies, n_shapes, n_joints;
    size_t bodies_capacity, labels_capacity, shapes_capacity, joints_capacity;
    bool is_bad;
} RigidBlock;

// What was wrong is reported, or asked for. Returns false.
bool sim_rigid_fail(RigidBlock *b);

// Adds to the key of the simulation.
void sim_rigid_hash(RigidBlock *b, const double *numbers, size_t n);

// The components of a property, which must be known. False: they are not (reported, or asked for).
bool sim_rigid_numbers(RigidBlock *b, const Object *object, PropertyId id, double *out);

// The index of a label, which must be known. False: it is not.
bool sim_rigid_index(RigidBlock *b, const Env *env, NodeId node, double *index);

typedef struct {
    double at[3], turn[4];
} RigidPose;

// The pose that an object's transforms come to. moving: it may depend on time, and these 7 get it;
// *moves: whether it does. NULL: it may not. False: reported, or asked for.
bool sim_rigid_pose(RigidBlock *b, const Object *object, RigidPose *pose, Ref *moving, bool *moves);

// lang/eval_sim_shape.c: the shapes in the block of a body, which is called so in reports, those in
// copies of defs and in groups too.
typedef struct {
    const char *name;
    const RigidPose *pose;
    bool is_fixed, moves;
    bool is_convex; // its meshes are hulls
} RigidOwner;
void sim_rigid_shapes(RigidBlock *b, const Env *env, NodeId block, const RigidOwner *owner);

// A `body` or `fixed` with its shapes.
void sim_rigid_body(RigidBlock *b, const Env *env, NodeId statement, bool is_fixed);

#endif
