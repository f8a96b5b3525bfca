// SPDX-License-Identifier: Apache-2.0
// Rates of change by differentiating graphs, and other times.
#include "lang/eval_rate.h"

#include <string.h>

#include "lang/builtins.h"
#include "lang/dag_nodes.h"
#include "lang/spatial.h"
#include "lang/watch.h"

// Step of the central differences where a motion is opaque: a compromise between what a double
// loses and how fast things move.
static const double difference_step = 1.0 / 65536;

// What is derived from a motion or moved in time is as large as it: each in turn of the one before
// would double without end, and nothing else is that large.
static void count_growth(Eval *ev, size_t n_before) {
    enum { LARGE = 1 << 16 };
    size_t growth = dag_n_nodes(ev->dag) - n_before;
    ev->steps += (growth > LARGE ? 128 : 8) * growth;
}

// Within the block of a simulation a state is only known at the instant at hand.
static bool is_state(Eval *ev, const Value *e) {
    bool is = false;
    if (ev->nears) {
        dag_walk(ev->dag, value_refs(e), e->n, 0);
        for (uint32_t i = 0; i < ev->dag->walk->n_order && !is; i++) {
            const DagNode *node = &ev->dag->nodes[ev->dag->walk->order[i]];
            is = node->op == OP_TABLE && ev->dag->tables[node->b].live;
        }
    }
    return is;
}

static Value refuse_state(Eval *ev, const Env *env, NodeId node, const char *hint) {
    return eval_error(ev, env, node, hint,
                      "within a simulation its states are known at one instant only");
}

// Its own clock and the film's, which runs as fast.
static void rates_of(Eval *ev, const Env *env, NodeId node, const Value *e, Ref *out) {
    bool is_opaque = false;
    for (uint32_t i = 0; i < e->n; i++) {
        Ref ref = value_refs(e)[i];
        Ref own = dag_diff(ev->dag, ref, IN_T, difference_step, &is_opaque);
        Ref film = dag_diff(ev->dag, ref, IN_FILM_T, difference_step, &is_opaque);
        out[i] = dag_op(ev->dag, OP_ADD, own, film, REF_NONE);
    }
    if (is_opaque) {
        diag_warn(ev->diag, WARN_ESTIMATED_RATE, syntax_span(env->module->syntax, node), NULL,
                  "noise and random numbers have no formula for their rate of change: it is "
                  "estimated over %.2g s",
                  2 * difference_step);
    }
}

// Of the unit quaternion w + v: twice the vector of q' q*, which is w v' - w' v + v x v'.
static Ref3 spin_of_rotation(Dag *dag, RefQuat q, const Ref rate[4]) {
    Ref3 v = ref3(q.x, q.y, q.z), dv = ref3(rate[0], rate[1], rate[2]);
    Ref3 along = spatial_sub(dag, spatial_scale(dag, dv, q.w), spatial_scale(dag, v, rate[3]));
    Ref3 half = spatial_add(dag, along, spatial_cross(dag, v, dv));
    return spatial_scale(dag, half, dag_const(dag, 2));
}

// Each axis c of a map that turns, and stretches its axes, has c x c'/c^2 = the spin less its part
// along c; all three together are twice the spin.
static Ref3 spin_of_map(Dag *dag, const RefMap *map, const Ref rate[12]) {
    Ref3 sum = spatial_const(dag, 0, 0, 0);
    for (int k = 0; k < 3; k++) {
        Ref3 axis = ref3(map->m[0][k], map->m[1][k], map->m[2][k]);
        Ref3 change = ref3(rate[k], rate[4 + k], rate[8 + k]);
        Ref part = dag_op(dag, OP_DIV, dag_const(dag, 0.5), spatial_dot(dag, axis, axis), REF_NONE);
        Ref3 own = spatial_scale(dag, spatial_cross(dag, axis, change), part);
        sum = spatial_add(dag, sum, own);
    }
    return sum;
}

static Value refuse_type(Eval *ev, const Env *env, NodeId node, BuiltinId id, const Value *e) {
    return eval_error(ev, env, node, NULL, "%s takes something made of numbers, this is %s",
                      builtin_infos[id].name, value_describe(ev->arena, e));
}

Value eval_rate(Eval *ev, const Env *env, NodeId node, const Value *e) {
    Ref rates[12];
    size_t n_before = dag_n_nodes(ev->dag);
    if (!value_is_numeric(e) || value_is(e, VALUE_BOOL)) {
        return refuse_type(ev, env, node, BUILTIN_D, e);
    }
    if (is_state(ev, e)) {
        return refuse_state(ev, env, node, "the rate of x is what stands behind x' =");
    }
    rates_of(ev, env, node, e, rates);
    Value rate = value_is(e, VALUE_ROTATION)
                     ? value_from3(VALUE_VEC, spin_of_rotation(ev->dag, value_quat(e), rates))
                     : value_like(ev->arena, e, rates);
    count_growth(ev, n_before);
    return rate;
}

Value eval_at(Eval *ev, const Env *env, NodeId node, const Value *e, Ref when) {
    static const Input clocks[2] = {IN_T, IN_FILM_T};
    const Ref whens[2] = {when, when};
    Ref refs[12];
    size_t n_before = dag_n_nodes(ev->dag);
    watch_other_times(ev);
    if (!value_is_numeric(e)) {
        return refuse_type(ev, env, node, BUILTIN_AT, e);
    }
    if (is_state(ev, e)) {
        return refuse_state(ev, env, node, "what is to be remembered is a state of its own");
    }
    for (uint32_t i = 0; i < e->n; i++) {
        refs[i] = dag_substitute_all(ev->dag, value_refs(e)[i], clocks, whens, 2);
    }
    count_growth(ev, n_before);
    return value_like(ev->arena, e, refs);
}

bool eval_motion_member(Eval *ev, const Env *env, NodeId node, const Value *e, const char *member,
                        Value *value) {
    const bool is_rotation = value_is(e, VALUE_ROTATION);
    if (is_rotation && strcmp(member, "spin") == 0) {
        *value = eval_rate(ev, env, node, e);
        return true;
    }
    if (is_rotation || !value_is(e, VALUE_TRANSFORM)) {
        return false;
    }
    const RefMap map = *e->map;
    const Value pos = value_from3(VALUE_VEC, ref3(map.m[0][3], map.m[1][3], map.m[2][3]));
    if (strcmp(member, "pos") == 0) {
        *value = pos;
    } else if (strcmp(member, "vel") == 0) {
        *value = eval_rate(ev, env, node, &pos);
    } else if (strcmp(member, "turn") == 0) {
        *value = value_from_quat(spatial_map_split(ev->dag, &map).rotation);
    } else if (strcmp(member, "spin") == 0 && is_state(ev, e)) {
        *value = refuse_state(ev, env, node, NULL);
    } else if (strcmp(member, "spin") == 0) {
        Ref rates[12];
        size_t n_before = dag_n_nodes(ev->dag);
        rates_of(ev, env, node, e, rates);
        *value = value_from3(VALUE_VEC, spin_of_map(ev->dag, &map, rates));
        count_growth(ev, n_before);
    } else {
        return false;
    }
    return true;
}
