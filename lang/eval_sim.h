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

// Binds the name of a NODE_SIM.
void eval_sim_declare(Eval *ev, const Env *env, NodeId statement);

// Where it stands: its mistakes are reported.
void eval_sim_emit(Eval *ev, const Env *env, NodeId statement);

// Sim.member: a list where the sim has a count, else a value. Poison: reported, or asked for.
Value eval_sim_member(Eval *ev, const Env *env, NodeId node, Sim *sim, const char *member);

// The item of a list that has `each`, at an index that is not constant.
Value eval_sim_at(Eval *ev, const List *list, Ref index);

// ---- Between the files lang/eval_sim*.c

typedef struct {
    Symbol name;
    Value start;      // its type and width
    uint32_t first;   // of its scalars among all of them
    NodeId statement; // of the start value
    NodeId rate;      // 0: none was written
    bool is_assigned; // by an event
    Value value;      // within the block: of the member id
    Value each;       // within the block: of the member IN_X
    const List *within,
        *outside; // the members, read in the block and elsewhere; made when asked for
} SimVariable;

struct Sim {
    Symbol name;
    const Module *module;
    Scope *scope; // where it stands
    NodeId statement, block;
    BindingState state; // of its block
    bool is_bad, has_run;
    bool has_count;
    uint32_t n_variables;
    SimVariable *variables;
    SimState spec;
    Hash128 key;
    SimTracks tracks;
    Ref alive;    // of the member IN_X at t
    Ref *columns; // [n_states] likewise; REF_NONE: not made yet
};

// lang/eval_sim_state.c: evaluates the block. False: reported, or asked for.
bool eval_sim_state(Eval *ev, Sim *sim);

#endif
