// SPDX-License-Identifier: Apache-2.0
// Simulations in scripts: their blocks, and their members as motions.
//
// The block is evaluated when a member is first asked for, or where it stands; it is run when a
// member is read. Its states are tables that the simulation writes (dag_live), read at the member
// `id`; what comes of it are tables of polynomials, read at the member and the time, which make
// graphs like all others: a member may be asked for by a batched loop's variable.
#ifndef LANG_EVAL_SIM_H
#define LANG_EVAL_SIM_H

#include "lang/eval.h"
#include "lang/simulator.h"

typedef struct Sim Sim;
struct Given; // lang/object.h
struct Object;
struct Place;

// Binds the name of a NODE_SIM.
void eval_sim_declare(Eval *ev, const Env *env, NodeId statement);

// Where it stands: its mistakes are reported.
void eval_sim_emit(Eval *ev, const Env *env, NodeId statement);

// Sim.member: a list where the sim has a count, else a value. Poison: reported, or asked for.
Value eval_sim_member(Eval *ev, const Env *env, NodeId node, Sim *sim, const char *member);

// The item of a list that has `each`, at an index that is not constant.
Value eval_sim_at(Eval *ev, const List *list, Ref index);

// A node that stands in the block of a rigid body (ev->body): a shape becomes its own.
void eval_body_take(Eval *ev, const struct Object *object, const struct Place *place);

// ---- Between the files lang/eval_sim*.c

// What tells live tables apart: states count from 0, sums of near() from SIM_LIVE_SUMS.
enum { SIM_LIVE_SUMS = 1 << 24, SIM_LIVE_THERE = SIM_LIVE_SUMS - 1 };

typedef struct {
    Symbol name;
    Value start;      // its type and width
    uint32_t first;   // of its scalars among all of them
    NodeId statement; // of the start value
    NodeId rate;      // 0: none was written
    bool is_assigned; // by an event
    Ref own[4];       // within the block: its scalars, of the member id
    Value value;      // likewise, as it is read
    Value each;       // within the block: of the member IN_X
    const List *within,
        *outside; // the members, read in the block and elsewhere; made when asked for
} SimVariable;

// Bodies of one label: one, or those of indices 0, 1, 2...
typedef struct {
    Symbol name;
    bool is_list;
    uint32_t n;
    uint32_t *members;  // [n] by index, of the tracks
    Value *places;      // [n] of fixed bodies, transforms; NULL: the tracks tell
    const List *values; // made when asked for
    size_t capacity;
} SimGroup;

struct Sim {
    Symbol name;
    const Module *module;
    Scope *scope;  // where it stands
    Scope *within; // of its block, once that is evaluated
    NodeId statement, block;
    BindingState state; // of its block
    bool is_bad, has_run;
    bool has_count;
    uint32_t n_variables;
    SimVariable *variables;
    SimState spec;  // of a sim state
    SimRigid rigid; // of a sim rigid
    bool is_rigid;
    uint32_t n_groups;
    SimGroup *groups;
    Hash128 key;
    SimTracks tracks;
    Ref alive;                // of the member IN_X at t
    const List *alive_within; // likewise within the block, at the instant; made when asked for
    Ref *columns;             // [n_states] likewise; REF_NONE: not made yet
};

// lang/eval_sim_near.c: near(places, radius, f) within the block of a sim state; args: its three.
Value eval_sim_near(Eval *ev, const Env *env, NodeId node, const Value *args);

// A state of these scalars; what stands for a rotation becomes one.
Value sim_state_value(Eval *ev, const SimVariable *variable, const Ref *scalars);

// The number of a member by an index: between two it is the one before, beyond the ends the last.
Ref sim_index(Dag *dag, Ref index, uint32_t n);

// SIM_READS_ bits of what is computed within the block, of so many members.
uint8_t sim_reads(Dag *dag, const Ref *refs, uint32_t n, uint32_t n_members);

// What near() of a block came to.
typedef struct SimNears SimNears;
SimNears *sim_nears_new(Eval *ev, Sim *sim);
// As the simulation wants them, and added to its key.
void sim_nears_finish(Eval *ev, SimNears *nears);

// lang/eval_sim_state.c: evaluates the block. False: reported, or asked for.
bool eval_sim_state(Eval *ev, Sim *sim);
// lang/eval_sim_rigid.c: likewise.
bool eval_sim_rigid(Eval *ev, Sim *sim);

// The span of a simulation, low to high, from its property (NULL: not given) or the film. False:
// reported.
bool eval_sim_span(Eval *ev, const struct Given *given, double *low, double *high);

#endif
