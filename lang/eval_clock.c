// SPDX-License-Identifier: Apache-2.0
// Clocks of instances. Within an instance IN_T is its own clock, and what is written there knows
// no other; what comes in from outside, and what goes out to the renderer, is put in terms of the
// film's clock, IN_FILM_T. Only what moves vertices stays as it is: instances share that.
#include "lang/eval_clip.h"

#include <string.h>

#include "lang/functions.h"

typedef struct {
    Eval *ev;
    Ref clock;
    const Clips *clips; // NULL: none
} Clock;

static Ref at(const Clock *clock, Ref ref, Ref when) {
    return dag_substitute(clock->ev->dag, ref, IN_T, when);
}

static bool is_blended(const Clock *clock, Ref ref) {
    return clock->clips && (dag_inputs(clock->ev->dag, ref) >> IN_T & 1);
}

// A number; where clips fade, on the line between its two values.
static Ref change(void *context, Ref ref) {
    const Clock *clock = context;
    Ref now = at(clock, ref, clock->clock);
    if (!is_blended(clock, ref)) {
        return now;
    }
    return functions_mix(clock->ev->dag, at(clock, ref, clock->clips->before), now,
                         clock->clips->weight);
}

// A truth value: the one that has the greater part.
static Ref change_truth(const Clock *clock, Ref ref) {
    Dag *dag = clock->ev->dag;
    Ref now = at(clock, ref, clock->clock);
    if (!is_blended(clock, ref)) {
        return now;
    }
    Ref is_before = dag_op(dag, OP_LT, clock->clips->weight, dag_const(dag, 0.5), REF_NONE);
    return dag_op(dag, OP_SELECT, is_before, at(clock, ref, clock->clips->before), now);
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
        copy->alive = change_truth(clock, list->alive);
    }
    return copy;
}

static Value numbers_at(const Clock *clock, const Value *value, Ref when) {
    Ref refs[12];
    for (uint32_t i = 0; i < value->n; i++) {
        refs[i] = at(clock, value_refs(value)[i], when);
    }
    Value changed = value_like(clock->ev->arena, value, refs);
    changed.dimension = value->dimension;
    return changed;
}

static RefQuat quat_of(const Value *value) {
    return (RefQuat){value->ref[0], value->ref[1], value->ref[2], value->ref[3]};
}

static Value blend_rotations(const Clock *clock, const Value *before, const Value *now) {
    RefQuat q = spatial_slerp(clock->ev->dag, quat_of(before), quat_of(now), clock->clips->weight);
    Value value = *now;
    memcpy(value.ref, (Ref[4]){q.x, q.y, q.z, q.w}, sizeof value.ref);
    return value;
}

static Ref3 mix3(const Clock *clock, Ref3 a, Ref3 b) {
    Dag *dag = clock->ev->dag;
    Ref w = clock->clips->weight;
    return ref3(functions_mix(dag, a.x, b.x, w), functions_mix(dag, a.y, b.y, w),
                functions_mix(dag, a.z, b.z, w));
}

// Turned the shorter way, moved and scaled along the line.
static Value blend_transforms(const Clock *clock, const Value *before, const Value *now) {
    Dag *dag = clock->ev->dag;
    RefParts a = spatial_map_split(dag, before->map), b = spatial_map_split(dag, now->map);
    RefParts parts = {mix3(clock, a.translation, b.translation),
                      spatial_slerp(dag, a.rotation, b.rotation, clock->clips->weight),
                      mix3(clock, a.scale, b.scale)};
    RefMap *map = ARENA_NEW(clock->ev->arena, RefMap);
    *map = spatial_map_join(dag, &parts);
    Value value = *now;
    value.map = map;
    return value;
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
    } else if (value_is(value, VALUE_BOOL)) {
        changed.ref[0] = change_truth(clock, value->ref[0]);
    } else if (value_is_numeric(value)) {
        Value now = numbers_at(clock, value, clock->clock);
        changed = now;
        if (clock->clips && value_is(value, VALUE_ROTATION)) {
            Value before = numbers_at(clock, value, clock->clips->before);
            changed = blend_rotations(clock, &before, &now);
        } else if (clock->clips && value_is(value, VALUE_TRANSFORM)) {
            Value before = numbers_at(clock, value, clock->clips->before);
            changed = blend_transforms(clock, &before, &now);
        } else if (clock->clips) {
            Ref refs[4];
            for (uint32_t i = 0; i < value->n; i++) {
                refs[i] = change(clock, value->ref[i]);
            }
            memcpy(changed.ref, refs, value->n * sizeof *refs);
        }
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
    Clock clock = {ev, place_clock(ev, place), place->clips};
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
    changed.visible = change_truth(&clock, place->visible);
    changed.material = given_at_clock(&clock, place->material);
    for (int k = 0; k < RAY_KINDS; k++) {
        changed.seen[k] = given_at_clock(&clock, place->seen[k]);
    }
    return changed;
}

Object object_at_clock(Eval *ev, const Place *place, const Object *object) {
    Clock clock = {ev, place_clock(ev, place), place->clips};
    Object changed = *object;
    changed.given = ARENA_ARRAY(ev->arena, object->n_given, Given);
    for (uint32_t i = 0; i < object->n_given; i++) {
        changed.given[i] = *given_at_clock(&clock, &object->given[i]);
    }
    return changed;
}

Value value_at_clips(Eval *ev, const Place *place, const Value *value) {
    Clock clock = {ev, place->clock, place->clips};
    return at_clock(&clock, value);
}

// ---- Entering an instance

static const PropertyId clock_properties[] = {PROPERTY_INSTANCE_SPEED, PROPERTY_INSTANCE_OFFSET,
                                              PROPERTY_INSTANCE_CYCLE, PROPERTY_INSTANCE_CLOCK,
                                              PROPERTY_INSTANCE_CLIPS};
enum { N_CLOCKS = sizeof clock_properties / sizeof clock_properties[0] };

static bool refuse_both(Eval *ev, const Given *one, const Given *other, const char *hint) {
    eval_error_at(ev, other->name, hint, "an instance has '%s' or '%s', not both",
                  property_infos[other->id].name, property_infos[one->id].name);
    diag_note(ev->diag, one->name, "'%s' is here", property_infos[one->id].name);
    return false;
}

// A copy goes by the clock of its place; an instance has one clock, not two.
static bool check_clock(Eval *ev, const Object *copy, bool is_instance) {
    const Given *clock = object_given(copy, PROPERTY_INSTANCE_CLOCK);
    const Given *clips = object_given(copy, PROPERTY_INSTANCE_CLIPS);
    for (int k = 0; k < N_CLOCKS; k++) {
        const Given *given = object_given(copy, clock_properties[k]);
        if (given && !is_instance) {
            eval_error_at(ev, given->name,
                          arena_printf(ev->arena, "write instance %s { ... }", copy->name),
                          "a copy goes by the clock of its place: only an instance has '%s'",
                          property_infos[given->id].name);
            return false;
        }
        if (given && clips && given != clips) {
            return refuse_both(ev, clips, given,
                               "when and how fast they play: play(walk, at = 1s, speed = 2)");
        }
        if (given && clock && (k == 0 || k == 1)) {
            return refuse_both(ev, clock, given, "clock = t is that of the place");
        }
    }
    return true;
}

static Ref given_scalar(Eval *ev, const Object *copy, PropertyId id, double otherwise) {
    const Given *given = object_given(copy, id);
    bool is_scalar = given && given->value.n == 1 && value_is_numeric(&given->value);
    return is_scalar ? given->value.ref[0] : dag_const(ev->dag, otherwise);
}

// What its clock shows before it starts again, by that of its place as IN_T.
static Ref unwound_of(Eval *ev, const Object *copy) {
    Dag *dag = ev->dag;
    if (object_given(copy, PROPERTY_INSTANCE_CLOCK)) {
        return given_scalar(ev, copy, PROPERTY_INSTANCE_CLOCK, 0);
    }
    Ref speed = given_scalar(ev, copy, PROPERTY_INSTANCE_SPEED, 1);
    Ref run = dag_op(dag, OP_MUL, speed, dag_input(dag, IN_T), REF_NONE);
    return dag_op(dag, OP_ADD, run, given_scalar(ev, copy, PROPERTY_INSTANCE_OFFSET, 0), REF_NONE);
}

static bool goes_as_its_place(Eval *ev, const Object *copy) {
    return !object_given(copy, PROPERTY_INSTANCE_CLIPS) &&
           !object_given(copy, PROPERTY_INSTANCE_CYCLE) &&
           unwound_of(ev, copy) == dag_input(ev->dag, IN_T);
}

// Sets what its clock shows by the film's. False: reported, or asked for.
static bool set_clock(Clock *outer, Place *place, const Object *copy) {
    Eval *ev = outer->ev;
    Dag *dag = ev->dag;
    const Given *clips = object_given(copy, PROPERTY_INSTANCE_CLIPS);
    if (clips && outer->clips) {
        eval_error_at(ev, clips->name, "let its clock go by theirs: clock = 2*t",
                      "not supported yet: an instance that plays clips, in a def that plays clips");
        return false;
    }
    if (clips) {
        return place_play_clips(ev, place, copy, clips, outer->clock);
    }
    Ref unwound = unwound_of(ev, copy), cycle = REF_NONE, clock = unwound;
    if (object_given(copy, PROPERTY_INSTANCE_CYCLE)) {
        cycle = given_scalar(ev, copy, PROPERTY_INSTANCE_CYCLE, 1);
        clock = dag_op(dag, OP_MOD, unwound, cycle, REF_NONE);
    }
    if (outer->clips) {
        place_nest_clips(ev, place, clock);
        return true;
    }
    place->unwound = change(outer, unwound);
    place->cycle = cycle == REF_NONE ? REF_NONE : change(outer, cycle);
    place->clock = change(outer, clock);
    return true;
}

bool place_enter_instance(Eval *ev, Place *place, const Object *copy, bool is_instance) {
    if (!check_clock(ev, copy, is_instance)) {
        return false;
    }
    if (!is_instance || goes_as_its_place(ev, copy)) {
        return true;
    }
    Clock outer = {ev, place_clock(ev, place), place->clips};
    Place within = place_at_clock(ev, place);
    if (!set_clock(&outer, &within, copy)) {
        return false;
    }
    for (uint32_t i = 0; i < copy->arguments->n; i++) {
        Binding *argument = &copy->arguments->bindings[i];
        if (argument->state != BINDING_DONE) {
            argument->value = at_clock(&outer, &argument->value);
        }
    }
    within.inner = NULL;
    within.outer = within.map;
    within.outer_is_identity = within.is_identity;
    within.is_identity = true;
    *place = within;
    return true;
}
