// SPDX-License-Identifier: Apache-2.0
// near(places, radius, f) in a `sim state`: the sum of f over the members around each one.
//
// f is evaluated once, for a member IN_I and another one SIM_NEAR_OTHER; what it comes to becomes
// outputs of a program of the neighborhood, and their sums tables that the simulation fills in.
#include <math.h>

#include "lang/dag_nodes.h"
#include "lang/eval_sim.h"

enum {
    MAX_NEIGHBORHOODS = 16,
    MAX_TERMS = 64, // of a neighborhood
    PAIR_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 1u << IN_I | 1u << SIM_NEAR_OTHER
};

// Calls with the same places and radius share one.
typedef struct {
    const SimVariable *places;
    double radius;
    uint32_t n;
    Ref terms[MAX_TERMS], sums[MAX_TERMS]; // sums: of this member
    double *rows[MAX_TERMS];
} Neighborhood;

struct SimNears {
    Sim *sim;
    uint32_t n, n_sums;
    Neighborhood all[MAX_NEIGHBORHOODS];
};

SimNears *sim_nears_new(Eval *ev, Sim *sim) {
    SimNears *nears = ARENA_NEW(ev->arena, SimNears);
    nears->sim = sim;
    return nears;
}

// ---- Arguments

static const SimVariable *places_of(const Sim *sim, const Value *list) {
    for (uint32_t i = 0; i < sim->n_variables; i++) {
        const SimVariable *variable = &sim->variables[i];
        if (value_is(list, VALUE_LIST) && variable->within && variable->within == list->list &&
            variable->start.n <= 3) {
            return variable;
        }
    }
    return NULL;
}

// pair: f(j) of near(), which may read the other member too.
static uint8_t reads_of(Dag *dag, const Ref *refs, uint32_t n, uint32_t n_members, bool is_pair) {
    const Ref own = dag_input(dag, IN_I);
    const Ref other = is_pair ? dag_input(dag, SIM_NEAR_OTHER) : own;
    const Ref known[] = {own, other, sim_index(dag, own, n_members),
                         sim_index(dag, other, n_members)};
    uint8_t reads = 0;
    dag_walk(dag, refs, n, 0);
    for (uint32_t i = 0; i < dag->walk->n_order; i++) {
        const DagNode *node = &dag->nodes[dag->walk->order[i]];
        uint32_t live = node->op == OP_TABLE ? dag->tables[node->b].live : 0;
        bool is_known = false;
        for (int k = 0; k < 4; k++) {
            is_known = is_known || node->a == known[k];
        }
        if (live > SIM_LIVE_SUMS) {
            reads |= SIM_READS_SUMS;
        } else if (live && !is_known) {
            reads |= SIM_READS_OTHERS;
        }
    }
    return reads;
}

uint8_t sim_reads(Dag *dag, const Ref *refs, uint32_t n, uint32_t n_members) {
    return reads_of(dag, refs, n, n_members, false);
}

// What f comes to for a pair; poison: reported, or asked for.
static Value pair_value(Eval *ev, const Env *env, NodeId node, const Value *f) {
    Value other = value_scalar(VALUE_NUMBER, dag_input(ev->dag, SIM_NEAR_OTHER));
    Value value = eval_apply(ev, f->closure, NULL, &other, 1, env, node);
    if (value_is_poison(&value)) {
        return value;
    }
    bool is_plain = value.type == VALUE_NUMBER || value.type == VALUE_ANGLE ||
                    value.type == VALUE_VEC || value.type == VALUE_COLOR;
    if (!is_plain) {
        return eval_error(ev, env, node, NULL,
                          "near adds up numbers, angles, vectors or colors, this is %s",
                          value_describe(ev->arena, &value));
    }
    uint32_t read = value_inputs(ev->dag, &value);
    if (read & LOOP_INPUTS) {
        ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        return value_poison();
    }
    if (read & ~(uint32_t)PAIR_INPUTS) {
        return eval_error(ev, env, node, NULL, "what near adds up can not depend on %s",
                          eval_input_name(read & ~(uint32_t)PAIR_INPUTS));
    }
    if (sim_reads(ev->dag, value.ref, value.n, 1) & SIM_READS_SUMS) {
        return eval_error(ev, env, node, "keep it as a state",
                          "what near adds up can not depend on another near");
    }
    return value;
}

// ---- Neighborhoods

static Neighborhood *neighborhood(SimNears *nears, const SimVariable *places, double radius) {
    for (uint32_t i = 0; i < nears->n; i++) {
        if (nears->all[i].places == places && nears->all[i].radius == radius) {
            return &nears->all[i];
        }
    }
    if (nears->n == MAX_NEIGHBORHOODS) {
        return NULL;
    }
    nears->all[nears->n] = (Neighborhood){.places = places, .radius = radius};
    return &nears->all[nears->n++];
}

// The sum of a term, the same for the same one.
static Ref sum_of(Eval *ev, SimNears *nears, Neighborhood *around, Ref term) {
    uint32_t n_members = nears->sim->spec.n_members;
    for (uint32_t k = 0; k < around->n; k++) {
        if (around->terms[k] == term) {
            return around->sums[k];
        }
    }
    if (around->n == MAX_TERMS) {
        return REF_NONE;
    }
    uint32_t k = around->n++;
    around->terms[k] = term;
    around->rows[k] = ARENA_ARRAY(ev->arena, n_members, double);
    around->sums[k] = dag_live(ev->dag, dag_input(ev->dag, IN_I), around->rows[k], n_members,
                               SIM_LIVE_SUMS + nears->n_sums++);
    return around->sums[k];
}

Value eval_sim_near(Eval *ev, const Env *env, NodeId node, const Value *args) {
    double radius;
    if (!ev->nears) {
        return eval_error(ev, env, node, NULL,
                          "near stands in the rates and events of a sim state");
    }
    const char *name = symbol_text(ev->symbols, ev->nears->sim->name);
    const SimVariable *places = places_of(ev->nears->sim, &args[0]);
    if (!places) {
        return eval_error(ev, env, node, arena_printf(ev->arena, "write near(%s.pos, 1, f)", name),
                          "near wants a place of all members of %s: a state of up to 3 numbers",
                          name);
    }
    if (value_inputs(ev->dag, &args[1]) & ~LOOP_INPUTS) {
        return eval_error(ev, env, node, "leave out who is too far in f",
                          "the radius of near must be known when the scene is loaded: it is one "
                          "for all members at all times");
    }
    if (!eval_need(ev, env, node, args[1].ref[0], "the radius of near", &radius)) {
        return value_poison();
    }
    if (!(radius > 0 && radius < INFINITY)) {
        return eval_error(ev, env, node, NULL, "the radius of near is more than 0, this is %.9g",
                          radius);
    }
    if (!value_is(&args[2], VALUE_FUNCTION)) {
        return eval_error(ev, env, node, "write fn f(j) = ...  and near(..., f)",
                          "near wants a function of another member's number, this is %s",
                          value_describe(ev->arena, &args[2]));
    }
    Value value = pair_value(ev, env, node, &args[2]);
    if (value_is_poison(&value)) {
        return value;
    }
    Neighborhood *around = neighborhood(ev->nears, places, radius);
    for (uint32_t k = 0; around && k < value.n; k++) {
        value.ref[k] = sum_of(ev, ev->nears, around, value.ref[k]);
        around = value.ref[k] == REF_NONE ? NULL : around;
    }
    return around
               ? value
               : eval_error(ev, env, node, NULL, "more than %d neighborhoods, or %d sums over one",
                            MAX_NEIGHBORHOODS, MAX_TERMS);
}

// ---- For the simulation

void sim_nears_finish(Eval *ev, SimNears *nears) {
    SimState *spec = &nears->sim->spec;
    SimNear *all = ARENA_ARRAY(ev->arena, nears->n, SimNear);
    for (uint32_t i = 0; i < nears->n; i++) {
        Neighborhood *around = &nears->all[i];
        const double about[] = {around->places->first, around->radius, around->n};
        SimNear near = {.n_members = spec->n_members,
                        .n_axes = around->places->start.n,
                        .there = spec->there,
                        .radius = around->radius,
                        .n_terms = around->n,
                        .sum = around->rows};
        for (uint32_t k = 0; k < near.n_axes; k++) {
            near.axis[k] = spec->live + (size_t)(around->places->first + k) * spec->n_members;
        }
        uint8_t reads = reads_of(ev->dag, around->terms, around->n, spec->n_members, true);
        for (int k = 0; k < SIM_READERS; k++) {
            spec->reads[k] |= spec->reads[k] & SIM_READS_SUMS ? reads : 0;
        }
        near.terms = dag_compile(ev->dag, ev->arena, around->terms, around->n);
        hash_add(&nears->sim->key, about, sizeof about);
        dag_hash(ev->dag, around->terms, around->n, &nears->sim->key);
        all[i] = near;
    }
    spec->nears = all;
    spec->n_nears = nears->n;
}
