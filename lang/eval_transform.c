// SPDX-License-Identifier: Apache-2.0
// Transform statements: translate, scale, rotate, matrix, joined in written order.
#include "lang/object.h"

#include <math.h>

#include "lang/builtins.h"

enum { MOTION_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 15u << IN_LOOP0, MAX_ARGUMENTS = 3 };

static const char *const names[TRANSFORM_COUNT] = {"translate", "scale", "rotate", "matrix"};

typedef struct {
    Eval *ev;
    const Env *env;
    Transform kind;
    const NodeId *nodes;
    Value values[MAX_ARGUMENTS];
    uint32_t n;
} Statement;

static bool complain(const Statement *s, uint32_t i, const char *hint, const char *expected) {
    eval_error(s->ev, s->env, s->nodes[i], hint, "%s takes %s, this is %s", names[s->kind],
               expected, value_describe(s->ev->arena, &s->values[i]));
    return false;
}

static bool is_place(const Statement *s, uint32_t i, const char *expected) {
    const Value *value = &s->values[i];
    if (!value_is_vec3(value)) {
        const char *vector = builtins_vector_hint(s->ev, value);
        return complain(s, i,
                        vector                          ? vector
                        : value_is(value, VALUE_NUMBER) ? "write <x, y, z>"
                                                        : NULL,
                        expected);
    }
    return !value->dimension || value->dimension == DIMENSION_LENGTH ||
           complain(s, i, NULL, "a length");
}

static bool is_angle(const Statement *s, uint32_t i) {
    const Value *value = &s->values[i];
    double x;
    if (!value_is(value, VALUE_ANGLE)) {
        const char *hint = "multiply by 1deg, 1rad or 1turn to make it an angle";
        if (value_is(value, VALUE_NUMBER) && dag_is_const(s->ev->dag, value->ref[0], &x)) {
            hint = arena_printf(s->ev->arena, "write %.15gdeg", x);
        }
        return complain(s, i, value_is(value, VALUE_NUMBER) ? hint : NULL, "an angle");
    }
    return value->dimension != DIMENSION_ANGULAR_RATE ||
           complain(s, i, "multiply by a time, such as t", "an angle");
}

static bool scale_map(const Statement *s, RefMap *map) {
    const Value *by = &s->values[0];
    Dag *dag = s->ev->dag;
    if (value_is(by, VALUE_NUMBER) && !by->dimension) {
        *map = spatial_map_scale(dag, ref3(by->ref[0], by->ref[0], by->ref[0]));
        return true;
    }
    if (!value_is_vec3(by) || by->dimension) {
        return complain(s, 0, builtins_vector_hint(s->ev, by), "a number or a vector of 3 numbers");
    }
    *map = spatial_map_scale(dag, value_ref3(by));
    return true;
}

// POV-Ray's angles in degrees around x, y and z, in one vector.
static const char *hint_angles(const Statement *s) {
    const Value *angles = &s->values[0];
    const char *text = NULL;
    for (uint32_t i = 0; value_is_vec3(angles) && i < 3; i++) {
        double x;
        if (!dag_is_const(s->ev->dag, angles->ref[i], &x)) {
            return "angles have units, and one axis each: write rotate y, a*1deg";
        }
        if (x != 0) {
            text = arena_printf(s->ev->arena, "%s%s rotate %c, %.15gdeg", text ? text : "write",
                                text ? ";" : "", "xyz"[i], x);
        }
    }
    return text                            ? text
           : value_is(angles, VALUE_ANGLE) ? "write rotate y, angle"
                                           : "write rotate y, 90deg";
}

static bool rotate_map(const Statement *s, RefMap *map) {
    Dag *dag = s->ev->dag;
    if (s->n == 1) {
        return value_as_map(dag, &s->values[0], map) ||
               complain(s, 0, hint_angles(s), "a rotation, or an axis and an angle");
    }
    double x[3];
    const Value *axis = &s->values[0];
    if (!value_is_vec3(axis)) {
        return complain(s, 0, "write rotate y, 90deg", "an axis, a vector of 3");
    }
    if (!is_angle(s, 1) || (s->n == 3 && !is_place(s, 2, "a pivot, a vector of 3"))) {
        return false;
    }
    if (dag_is_const(dag, axis->ref[0], &x[0]) && dag_is_const(dag, axis->ref[1], &x[1]) &&
        dag_is_const(dag, axis->ref[2], &x[2]) && x[0] == 0 && x[1] == 0 && x[2] == 0) {
        eval_error(s->ev, s->env, s->nodes[0], NULL, "the axis has no direction: it is <0, 0, 0>");
        return false;
    }
    *map = spatial_map_rotate(dag, value_ref3(axis), s->values[1].ref[0]);
    if (s->n == 3) {
        *map = spatial_map_pivot(dag, map, value_ref3(&s->values[2]));
    }
    return true;
}

// A transform, or the three rows of one.
static bool matrix_map(const Statement *s, RefMap *map) {
    if (s->n == 1) {
        return value_as_map(s->ev->dag, &s->values[0], map) ||
               complain(s, 0, NULL, "a transform, or three rows of 4 numbers");
    }
    for (uint32_t i = 0; i < s->n; i++) {
        if (!value_is(&s->values[i], VALUE_VEC) || s->values[i].n != 4) {
            return complain(s, i, NULL, "three rows of 4 numbers");
        }
        for (int j = 0; j < 4; j++) {
            map->m[i][j] = s->values[i].ref[j];
        }
    }
    return true;
}

static bool make_map(const Statement *s, RefMap *map) {
    switch (s->kind) {
    case TRANSFORM_TRANSLATE:
        if (!is_place(s, 0, "a vector of 3")) {
            return false;
        }
        *map = spatial_map_translate(s->ev->dag, value_ref3(&s->values[0]));
        return true;
    case TRANSFORM_SCALE:
        return scale_map(s, map);
    case TRANSFORM_ROTATE:
        return rotate_map(s, map);
    default:
        return matrix_map(s, map);
    }
}

static bool check_map(const Statement *s, NodeId statement, const RefMap *map) {
    const Ref *refs = &map->m[0][0];
    for (int i = 0; i < 12; i++) {
        double x;
        uint32_t read = dag_inputs(s->ev->dag, refs[i]) & ~MOTION_INPUTS;
        if (read) {
            eval_error(s->ev, s->env, statement, "write a deform to move single points",
                       "a transform moves the whole object, it can not depend on %s",
                       eval_input_name(read));
            return false;
        }
        if (dag_is_const(s->ev->dag, refs[i], &x) && !isfinite(x)) {
            eval_error(s->ev, s->env, statement, NULL, "this transform is not finite");
            return false;
        }
    }
    return true;
}

static bool count_is_right(const Statement *s, NodeId statement) {
    static const char *const usages[TRANSFORM_COUNT] = {
        "write translate <x, y, z>", "write scale 2, or scale <x, y, z>",
        "write rotate y, 90deg, or rotate y, 90deg, pivot",
        "write matrix with a transform or three rows"};
    bool is_right = s->kind == TRANSFORM_ROTATE   ? s->n >= 1 && s->n <= 3
                    : s->kind == TRANSFORM_MATRIX ? s->n == 1 || s->n == 3
                                                  : s->n == 1;
    if (!is_right) {
        eval_error(s->ev, s->env, statement, usages[s->kind], "%s does not take %u values",
                   names[s->kind], s->n);
    }
    return is_right;
}

void eval_transform(Eval *ev, const Env *env, Object *object, NodeId statement) {
    const Node *node = syntax_node(env->module->syntax, statement);
    Statement s = {.ev = ev,
                   .env = env,
                   .kind = (Transform)node->aux,
                   .nodes = env->module->syntax->extra + node->a,
                   .n = node->b};
    if (object->kind != OBJECT_INSTANCE &&
        (node_infos[object->kind].class == NODE_CLASS_SETTING || object->kind == OBJECT_SKY)) {
        eval_error(ev, env, statement, NULL, "%s has no place: it can not be moved", object->name);
        return;
    }
    if (!count_is_right(&s, statement)) {
        return;
    }
    for (uint32_t i = 0; i < s.n; i++) {
        s.values[i] = eval_expr(ev, env, s.nodes[i]);
        if (value_is_poison(&s.values[i])) {
            return;
        }
        if (ev->playing) {
            s.values[i] = value_at_clips(ev, ev->playing, &s.values[i]);
        }
    }
    RefMap map;
    if (!make_map(&s, &map) || !check_map(&s, statement, &map)) {
        return;
    }
    object->map = object->is_identity ? map : spatial_map_compose(ev->dag, &map, &object->map);
    object->is_identity = false;
}
