// SPDX-License-Identifier: Apache-2.0
// Points: many spheres as one shape, whose instances are told apart by a loop variable of its own.
//
// What differs from point to point is looked up by that variable. Points that move each in a way of
// its own become a shape each.
#include "lang/lower_form.h"

#include <math.h>
#include <string.h>

enum { MOTION_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 15u << IN_LOOP0 };

typedef struct {
    const Value *at, *color;                        // [n]; color: NULL, or n of them
    const List *at_list, *color_list, *radius_list; // radius_list: NULL, or of n of them
    uint32_t n;
    Ref radius; // where there is no list
} Points;

// Each a vector of 3 that may depend on t; false: reported.
static bool check_items(Eval *ev, const Given *given, const char *what) {
    const List *list = given->value.list;
    for (uint32_t i = 0; i < list->n; i++) {
        const Value *item = &list->items[i];
        if (!value_is_vec3(item)) {
            eval_error(ev, &given->env, given->node, NULL, "%s is a list of %s, item %u is %s",
                       what, given->id == PROPERTY_POINTS_AT ? "vectors of 3" : "colors", i,
                       value_describe(ev->arena, item));
            return false;
        }
        uint32_t read = value_inputs(ev->dag, item) & ~(uint32_t)MOTION_INPUTS;
        if (read) {
            eval_error(ev, &given->env, given->node, NULL, "%s can not depend on %s", what,
                       eval_input_name(read));
            return false;
        }
        for (int k = 0; k < 3; k++) {
            double x = 0;
            if (dag_is_const(ev->dag, item->ref[k], &x) && !isfinite(x)) {
                eval_error(ev, &given->env, given->node, NULL,
                           "item %u of %s is not a finite number", i, what);
                return false;
            }
        }
    }
    return true;
}

// False: reported.
static bool read_radius(Eval *ev, const Object *object, Points *points) {
    const Given *given = object_given(object, PROPERTY_POINTS_RADIUS);
    points->radius_list = NULL;
    if (!given || !value_is(&given->value, VALUE_LIST)) {
        return lower_scalar(ev, object, PROPERTY_POINTS_RADIUS, &points->radius);
    }
    points->radius = REF_NONE;
    points->radius_list = given->value.list;
    if (points->radius_list->n == points->n) {
        return true;
    }
    eval_error(ev, &given->env, given->node, NULL, "there are %u points and %u radii", points->n,
               points->radius_list->n);
    return false;
}

static bool read_points(Eval *ev, const Object *object, Points *points) {
    const Given *at = object_given(object, PROPERTY_POINTS_AT),
                *color = object_given(object, PROPERTY_POINTS_COLOR);
    if (!at) {
        eval_error_at(ev, object->where, "write at = [<0, 0, 0>, <1, 0, 0>]", "points needs 'at'");
        return false;
    }
    if (!value_is(&at->value, VALUE_LIST) || !check_items(ev, at, "at")) {
        return false;
    }
    points->at = at->value.list->items;
    points->at_list = at->value.list;
    points->n = at->value.list->n;
    if (!read_radius(ev, object, points)) {
        return false;
    }
    double radius;
    if (!points->radius_list && dag_is_const(ev->dag, points->radius, &radius) && radius == 0) {
        return lower_nothing_seen(ev, object);
    }
    points->color = NULL;
    if (color) {
        if (!value_is(&color->value, VALUE_LIST) || !check_items(ev, color, "color")) {
            return false;
        }
        if (color->value.list->n != points->n) {
            eval_error(ev, &color->env, color->node, NULL, "there are %u points and %u colors",
                       points->n, color->value.list->n);
            return false;
        }
        points->color = color->value.list->items;
        points->color_list = color->value.list;
    }
    return true;
}

// One expression for component k of all items; false: they are not alike.
static bool zip_component(Eval *ev, const List *list, uint32_t n, int k, Ref index, Ref *out) {
    const Value *items = list->items;
    if (list->each) {
        *out = dag_substitute(ev->dag, list->each->ref[k], IN_X, index);
        return true;
    }
    Ref *refs = ARENA_ARRAY(ev->arena, n, Ref);
    for (uint32_t i = 0; i < n; i++) {
        refs[i] = items[i].ref[k];
    }
    *out = dag_zip(ev->dag, refs, n, index);
    return *out != REF_NONE;
}

// A point of a simulation that is not there has no radius.
static Ref radius_of(Eval *ev, const Points *points, Ref index, Ref radius) {
    if (!points->at_list->each) {
        return radius;
    }
    Ref alive = dag_substitute(ev->dag, points->at_list->alive, IN_X, index);
    return dag_op(ev->dag, OP_SELECT, alive, radius, dag_const(ev->dag, 0));
}

static bool zip_form(Eval *ev, const Points *points, Ref index, Form *form) {
    Ref radius = points->radius;
    if (points->radius_list &&
        !zip_component(ev, points->radius_list, points->n, 0, index, &radius)) {
        return false;
    }
    form->geometry[3] = radius_of(ev, points, index, radius);
    for (int k = 0; k < 3; k++) {
        if (!zip_component(ev, points->at_list, points->n, k, index, &form->geometry[k]) ||
            (points->color &&
             !zip_component(ev, points->color_list, points->n, k, index, &form->color[k]))) {
            return false;
        }
    }
    return true;
}

static const Form sphere = {.kind = SHAPE_SPHERE,
                            .vertex = {REF_NONE, REF_NONE, REF_NONE},
                            .color = {REF_NONE, REF_NONE, REF_NONE},
                            .n_geometry = 4};

static void emit_each(Eval *ev, const Object *object, const Place *place, const char *label,
                      const Points *points, LowerEmit *emit) {
    for (uint32_t i = 0; i < points->n; i++) {
        Form form = sphere;
        Ref radius = points->radius_list ? points->radius_list->items[i].ref[0] : points->radius;
        form.geometry[3] = radius_of(ev, points, dag_const(ev->dag, i), radius);
        memcpy(form.geometry, points->at[i].ref, 3 * sizeof(Ref));
        if (points->color) {
            memcpy(form.color, points->color[i].ref, 3 * sizeof(Ref));
        }
        emit(ev, object, place, arena_printf(ev->arena, "%s[%u]", label, i), &form);
    }
}

void lower_points(Eval *ev, const Object *object, const Place *place, const char *label,
                  LowerEmit *emit) {
    Points points;
    uint32_t depth = ev->loops ? ev->loops->depth + 1 : 0,
             n_around = ev->loops ? ev->loops->n_instances : 1;
    if (!read_points(ev, object, &points) || points.n == 0) {
        return;
    }
    if (depth >= EVAL_MAX_LOOPS || points.n > EVAL_MAX_ITEMS / n_around) {
        ev->unroll |= (1u << depth) - 1; // one loop after another, then
        if (depth == 0) {
            eval_error_at(ev, object->where, NULL, "more than %d points", EVAL_MAX_ITEMS);
        }
        return;
    }
    Ref index = dag_input(ev->dag, (Input)(IN_LOOP0 + depth));
    Form form = sphere;
    if (points.n == 1 || !zip_form(ev, &points, index, &form)) {
        emit_each(ev, object, place, label, &points, emit);
        return;
    }
    double *counting = ARENA_ARRAY(ev->arena, points.n, double);
    for (uint32_t i = 0; i < points.n; i++) {
        counting[i] = i;
    }
    Loops loops = {.parent = ev->loops,
                   .values = counting,
                   .n_values = points.n,
                   .depth = depth,
                   .n_instances = n_around * points.n,
                   .counts = true};
    ev->loops = &loops;
    emit(ev, object, place, label, &form);
    ev->loops = loops.parent;
}
