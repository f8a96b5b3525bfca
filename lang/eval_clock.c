// SPDX-License-Identifier: Apache-2.0
// Clocks of instances. Within an instance IN_T is its own clock, and what is written there knows
// no other; what comes in from outside, and what goes out to the renderer, is put in terms of the
// film's clock, IN_FILM_T. Only what moves vertices stays as it is: instances share that.
#include "lang/object.h"

#include <string.h>

typedef struct {
    Eval *ev;
    Ref clock;
} Clock;

static Ref change(void *context, Ref ref) {
    const Clock *clock = context;
    return dag_substitute(clock->ev->dag, ref, IN_T, clock->clock);
}

static Value at_clock(Clock *clock, const Value *value);

static const List *list_at_clock(Clock *clock, const List *list) {
    Arena *arena = clock->ev->arena;
    List *copy = ARENA_NEW(arena, List);
    *copy = *list;
    Value *items = ARENA_ARRAY(arena, list->n, Value);
    for (uint32_t i = 0; i < list->n; i++) {
        items[i] = at_clock(clock, &list->items[i]);
    }
    copy->items = items;
    if (list->each) {
        Value *each = ARENA_NEW(arena, Value);
        *each = at_clock(clock, list->each);
        copy->each = each;
        copy->alive = change(clock, list->alive);
    }
    return copy;
}

static Value at_clock(Clock *clock, const Value *value) {
    Arena *arena = clock->ev->arena;
    Value changed = *value;
    if (!(value_inputs(clock->ev->dag, value) >> IN_T & 1)) {
        return changed;
    }
    if (value_is(value, VALUE_MATERIAL)) {
        changed.material = material_change(arena, value->material, change, clock);
    } else if (value_is(value, VALUE_LIST)) {
        changed.list = list_at_clock(clock, value->list);
    } else if (value_is_numeric(value)) {
        Ref refs[12];
        for (uint32_t i = 0; i < value->n; i++) {
            refs[i] = change(clock, value_refs(value)[i]);
        }
        changed = value_like(arena, value, refs);
        changed.dimension = value->dimension;
    }
    return changed;
}

static const Given *given_at_clock(Clock *clock, const Given *given) {
    if (!given || !(value_inputs(clock->ev->dag, &given->value) >> IN_T & 1)) {
        return given;
    }
    Given *changed = ARENA_NEW(clock->ev->arena, Given);
    *changed = *given;
    changed->value = at_clock(clock, &given->value);
    return changed;
}

// What t shows at the place, by the film's clock.
static Ref place_clock(Eval *ev, const Place *place) {
    return place->clock == REF_NONE ? dag_input(ev->dag, IN_FILM_T) : place->clock;
}

Place place_at_clock(Eval *ev, const Place *place) {
    Clock clock = {ev, place_clock(ev, place)};
    Place changed = *place;
    for (int k = 0; !place->is_identity && k < 12; k++) {
        changed.map.m[k / 4][k % 4] = change(&clock, place->map.m[k / 4][k % 4]);
    }
    if (place->clock != REF_NONE && !place->is_identity) {
        RefMap *inner = ARENA_NEW(ev->arena, RefMap);
        *inner = place->map;
        changed.inner = inner;
    }
    if (place->clock != REF_NONE && !place->outer_is_identity) {
        changed.map = place->is_identity
                          ? place->outer
                          : spatial_map_compose(ev->dag, &place->outer, &changed.map);
        changed.is_identity = false;
    }
    changed.visible = change(&clock, place->visible);
    changed.material = given_at_clock(&clock, place->material);
    for (int k = 0; k < RAY_KINDS; k++) {
        changed.seen[k] = given_at_clock(&clock, place->seen[k]);
    }
    return changed;
}

Object object_at_clock(Eval *ev, const Place *place, const Object *object) {
    Clock clock = {ev, place_clock(ev, place)};
    Object changed = *object;
    changed.given = ARENA_ARRAY(ev->arena, object->n_given, Given);
    for (uint32_t i = 0; i < object->n_given; i++) {
        changed.given[i] = *given_at_clock(&clock, &object->given[i]);
    }
    return changed;
}

// ---- Entering an instance

static const PropertyId clock_properties[] = {PROPERTY_INSTANCE_SPEED, PROPERTY_INSTANCE_OFFSET,
                                              PROPERTY_INSTANCE_CYCLE, PROPERTY_INSTANCE_CLOCK};

// A copy goes by the clock of its place; an instance has one clock, not two.
static bool check_clock(Eval *ev, const Object *copy, bool is_instance) {
    const Given *clock = object_given(copy, PROPERTY_INSTANCE_CLOCK);
    for (int k = 0; k < 4; k++) {
        const Given *given = object_given(copy, clock_properties[k]);
        if (given && !is_instance) {
            eval_error_at(ev, given->name,
                          arena_printf(ev->arena, "write instance %s { ... }", copy->name),
                          "a copy goes by the clock of its place: only an instance has '%s'",
                          property_infos[given->id].name);
            return false;
        }
        bool is_second = clock && given && (k == 0 || k == 1);
        if (is_second) {
            eval_error_at(ev, given->name, "clock = t is that of the place",
                          "an instance has '%s' or 'clock', not both",
                          property_infos[given->id].name);
            diag_note(ev->diag, clock->name, "'clock' is here");
            return false;
        }
    }
    return true;
}

static Ref given_scalar(Eval *ev, const Object *copy, PropertyId id, double otherwise) {
    const Given *given = object_given(copy, id);
    bool is_scalar = given && given->value.n == 1 && value_is_numeric(&given->value);
    return is_scalar ? given->value.ref[0] : dag_const(ev->dag, otherwise);
}

bool place_enter_instance(Eval *ev, Place *place, const Object *copy, bool is_instance) {
    if (!check_clock(ev, copy, is_instance)) {
        return false;
    }
    if (!is_instance) {
        return true;
    }
    Dag *dag = ev->dag;
    const Given *given = object_given(copy, PROPERTY_INSTANCE_CLOCK);
    Ref own = given ? given_scalar(ev, copy, PROPERTY_INSTANCE_CLOCK, 0)
                    : dag_op(dag, OP_ADD,
                             dag_op(dag, OP_MUL, given_scalar(ev, copy, PROPERTY_INSTANCE_SPEED, 1),
                                    dag_input(dag, IN_T), REF_NONE),
                             given_scalar(ev, copy, PROPERTY_INSTANCE_OFFSET, 0), REF_NONE);
    Clock outer = {ev, place_clock(ev, place)};
    Ref unwound = change(&outer, own), cycle = REF_NONE;
    own = unwound;
    if (object_given(copy, PROPERTY_INSTANCE_CYCLE)) {
        cycle = change(&outer, given_scalar(ev, copy, PROPERTY_INSTANCE_CYCLE, 1));
        own = dag_op(dag, OP_MOD, unwound, cycle, REF_NONE);
    }
    if (own == outer.clock && place->clock == REF_NONE) {
        return true; // as the film's
    }
    *place = place_at_clock(ev, place);
    for (uint32_t i = 0; i < copy->arguments->n; i++) {
        Binding *argument = &copy->arguments->bindings[i];
        if (argument->state != BINDING_DONE) {
            argument->value = at_clock(&outer, &argument->value);
        }
    }
    place->clock = own;
    place->unwound = unwound;
    place->cycle = cycle;
    place->inner = NULL;
    place->outer = place->map;
    place->outer_is_identity = place->is_identity;
    place->is_identity = true;
    return true;
}
