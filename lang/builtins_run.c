// SPDX-License-Identifier: Apache-2.0
// What the functions of the language do with arguments that were checked.
#include "lang/builtins.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "lang/color.h"
#include "lang/eval_clip.h"
#include "lang/eval_rate.h"
#include "lang/eval_sim.h"
#include "lang/functions.h"
#include "lang/loader.h"
#include "lang/watch.h"

static Ref ref1(const BuiltinCall *call, uint32_t i) {
    return call->args[i].ref[0];
}

static Dag *dag_of(const BuiltinCall *call) {
    return call->ev->dag;
}

static Value number(Ref ref) {
    return value_scalar(VALUE_NUMBER, ref);
}

// The place of argument i, of the call where it is a default.
static NodeId node_of(const BuiltinCall *call, uint32_t i) {
    return call->nodes[i] ? call->nodes[i] : call->node;
}

// ---- Arithmetic

static Ref apply(const BuiltinCall *call) {
    return dag_op(dag_of(call), call->op, ref1(call, 0), call->n > 1 ? ref1(call, 1) : REF_NONE,
                  REF_NONE);
}

static Value run_from_angle(const BuiltinCall *call) {
    return number(apply(call));
}

static Value run_to_number(const BuiltinCall *call) {
    return number(apply(call));
}

static Value run_to_angle(const BuiltinCall *call) {
    return value_scalar(VALUE_ANGLE, apply(call));
}

static Value run_each(const BuiltinCall *call) {
    Value result = call->args[0];
    for (uint32_t i = 0; i < result.n; i++) {
        result.ref[i] = dag_op(dag_of(call), call->op, result.ref[i], REF_NONE, REF_NONE);
    }
    return result;
}

static Value run_fold(const BuiltinCall *call) {
    Value result = call->args[0];
    for (uint32_t i = 1; i < call->n; i++) {
        for (uint32_t k = 0; k < result.n; k++) {
            result.ref[k] =
                dag_op(dag_of(call), call->op, result.ref[k], call->args[i].ref[k], REF_NONE);
        }
    }
    if (call->n == 1 && call->op == OP_HYPOT) {
        result.ref[0] = dag_op(dag_of(call), OP_ABS, result.ref[0], REF_NONE, REF_NONE);
    }
    return result;
}

static Value run_clamp(const BuiltinCall *call) {
    Value result = call->args[0];
    for (uint32_t i = 0; i < result.n; i++) {
        result.ref[i] = functions_clamp(dag_of(call), result.ref[i], call->args[1].ref[i],
                                        call->args[2].ref[i]);
    }
    return result;
}

static bool is_vector(const Value *value) {
    return value->type == VALUE_VEC || value->type == VALUE_COLOR;
}

static Value run_mix(const BuiltinCall *call) {
    const Value *a = &call->args[0], *b = &call->args[1];
    if (value_is(a, VALUE_MATERIAL) && value_is(b, VALUE_MATERIAL)) {
        return builtins_mix_materials(call);
    }
    bool is_alike = a->n == b->n && (a->type == b->type || (is_vector(a) && is_vector(b)));
    if (!value_is_numeric(a) || !is_alike || a->type == VALUE_ROTATION ||
        a->type == VALUE_TRANSFORM || a->type == VALUE_BOOL) {
        return eval_error(call->ev, call->env, node_of(call, 1),
                          value_is(a, VALUE_ROTATION) ? "write slerp(a, b, w)" : NULL,
                          "mix: %s and %s do not go together", value_describe(call->ev->arena, a),
                          value_describe(call->ev->arena, b));
    }
    Value result = *a;
    result.type = b->type == VALUE_COLOR ? VALUE_COLOR : a->type;
    for (uint32_t i = 0; i < a->n; i++) {
        result.ref[i] = functions_mix(dag_of(call), a->ref[i], b->ref[i], ref1(call, 2));
    }
    return result;
}

static Value run_step(const BuiltinCall *call) {
    return number(functions_step(dag_of(call), ref1(call, 0), ref1(call, 1)));
}

static Value run_smoothstep(const BuiltinCall *call) {
    return number(functions_smoothstep(dag_of(call), ref1(call, 0), ref1(call, 1), ref1(call, 2)));
}

// ---- Vectors and rotations

static Ref dot(Dag *dag, const Value *a, const Value *b) {
    Ref sum = dag_const(dag, 0);
    for (uint32_t i = 0; i < a->n; i++) {
        Ref product = dag_op(dag, OP_MUL, a->ref[i], b->ref[i], REF_NONE);
        sum = dag_op(dag, OP_ADD, sum, product, REF_NONE);
    }
    return sum;
}

static Value run_dot(const BuiltinCall *call) {
    return number(dot(dag_of(call), &call->args[0], &call->args[1]));
}

static Ref length_of(Dag *dag, const Value *v) {
    return v->n == 3 ? spatial_length(dag, value_ref3(v))
                     : dag_op(dag, OP_SQRT, dot(dag, v, v), REF_NONE, REF_NONE);
}

static Value run_length(const BuiltinCall *call) {
    return number(length_of(dag_of(call), &call->args[0]));
}

static Value run_cross(const BuiltinCall *call) {
    return value_from3(VALUE_VEC, spatial_cross(dag_of(call), value_ref3(&call->args[0]),
                                                value_ref3(&call->args[1])));
}

static Value run_normalize(const BuiltinCall *call) {
    Dag *dag = dag_of(call);
    Value v = call->args[0];
    if (v.n == 3) {
        return value_from3(VALUE_VEC, spatial_normalize(dag, value_ref3(&v)));
    }
    Ref length = length_of(dag, &v);
    Ref is_zero = dag_op(dag, OP_EQ, length, dag_const(dag, 0), REF_NONE);
    for (uint32_t i = 0; i < v.n; i++) {
        Ref unit = dag_op(dag, OP_DIV, v.ref[i], length, REF_NONE);
        v.ref[i] = dag_op(dag, OP_SELECT, is_zero, v.ref[i], unit);
    }
    v.dimension = DIMENSION_NONE;
    return v;
}

static Value run_turned(const BuiltinCall *call) {
    return value_from3(VALUE_VEC, spatial_turned(dag_of(call), value_ref3(&call->args[0]),
                                                 value_ref3(&call->args[1]), ref1(call, 2)));
}

static Value run_slerp(const BuiltinCall *call) {
    return value_from_quat(spatial_slerp(dag_of(call), value_quat(&call->args[0]),
                                         value_quat(&call->args[1]), ref1(call, 2)));
}

static Value run_translate(const BuiltinCall *call) {
    RefMap map = spatial_map_translate(dag_of(call), value_ref3(&call->args[0]));
    return value_transform(call->ev->arena, &map);
}

static Value run_scale(const BuiltinCall *call) {
    const Value *by = &call->args[0];
    if (!value_is(by, VALUE_NUMBER) && !value_is_vec3(by)) {
        return eval_error(call->ev, call->env, node_of(call, 0), NULL,
                          "scale: 's' is a number or a vector of 3, this is %s",
                          value_describe(call->ev->arena, by));
    }
    Ref3 factors = by->n == 3 ? value_ref3(by) : ref3(by->ref[0], by->ref[0], by->ref[0]);
    RefMap map = spatial_map_scale(dag_of(call), factors);
    return value_transform(call->ev->arena, &map);
}

static Value run_rotate(const BuiltinCall *call) {
    Ref3 axis = value_ref3(&call->args[0]);
    if (!call->nodes[2]) {
        return value_from_quat(spatial_quat(dag_of(call), axis, ref1(call, 1)));
    }
    RefMap map = spatial_map_rotate(dag_of(call), axis, ref1(call, 1));
    map = spatial_map_pivot(dag_of(call), &map, value_ref3(&call->args[2]));
    return value_transform(call->ev->arena, &map);
}

// ---- Time

static Value run_rate(const BuiltinCall *call) {
    return eval_rate(call->ev, call->env, node_of(call, 0), &call->args[0]);
}

static Value run_at(const BuiltinCall *call) {
    return eval_at(call->ev, call->env, node_of(call, 0), &call->args[0], ref1(call, 1));
}

static Value run_near(const BuiltinCall *call) {
    return eval_sim_near(call->ev, call->env, call->node, call->args);
}

// ---- Chance

static Value run_random(const BuiltinCall *call) {
    Ref *keys = ARENA_ARRAY(call->ev->arena, (size_t)call->n * 4, Ref);
    uint32_t n = 0;
    for (uint32_t i = 0; i < call->n; i++) {
        const Value *value = &call->args[i];
        if (!value_is_numeric(value) || value->n > 4) {
            return eval_error(call->ev, call->env, node_of(call, i), NULL,
                              "%s takes numbers and vectors, this is %s",
                              builtin_infos[call->id].name, value_describe(call->ev->arena, value));
        }
        for (uint32_t k = 0; k < value->n; k++) {
            keys[n++] = value->ref[k];
        }
    }
    switch (call->id) {
    case BUILTIN_RANDDIR:
        return value_from3(VALUE_VEC, functions_randdir(dag_of(call), keys, n));
    case BUILTIN_RANDN:
        return number(functions_randn(dag_of(call), keys, n));
    default:
        return number(functions_rand(dag_of(call), keys, n));
    }
}

// A number, or a vector of 2 or 3, as a point; false: reported.
static bool point_argument(const BuiltinCall *call, Ref3 *p) {
    const Value *value = &call->args[0];
    bool is_point = value_is(value, VALUE_NUMBER) || (is_vector(value) && value->n <= 3);
    Ref zero = dag_const(dag_of(call), 0);
    if (!is_point) {
        eval_error(call->ev, call->env, node_of(call, 0), NULL,
                   "%s: 'p' is a number or a vector of 2 or 3, this is %s",
                   builtin_infos[call->id].name, value_describe(call->ev->arena, value));
        return false;
    }
    *p = ref3(value->ref[0], value->n > 1 ? value->ref[1] : zero,
              value->n > 2 ? value->ref[2] : zero);
    return true;
}

static Value run_noise(const BuiltinCall *call) {
    Ref3 p;
    return point_argument(call, &p) ? number(functions_noise(dag_of(call), p)) : value_poison();
}

static Value run_fbm(const BuiltinCall *call) {
    Ref3 p;
    double octaves;
    if (!point_argument(call, &p) || !eval_need(call->ev, call->env, node_of(call, 1),
                                                ref1(call, 1), "the number of octaves", &octaves)) {
        return value_poison();
    }
    if (!(octaves >= 1 && octaves <= FUNCTIONS_MAX_OCTAVES) || octaves != floor(octaves)) {
        return eval_error(call->ev, call->env, node_of(call, 1), NULL,
                          "fbm: 'octaves' is a whole number from 1 to %d", FUNCTIONS_MAX_OCTAVES);
    }
    return number(functions_fbm(dag_of(call), p, (uint32_t)octaves, 2, 0.5));
}

static Value run_checker(const BuiltinCall *call) {
    Ref3 p;
    if (!point_argument(call, &p)) {
        return value_poison();
    }
    Ref is_odd = functions_checker(dag_of(call), p, ref1(call, 1));
    return eval_select(call->ev, call->env, call->node, is_odd, call->args[3], call->args[2]);
}

// Straight lines between the rows, each end held: y[i] + (x - x[i]) * slope[i].
static Value run_table(const BuiltinCall *call) {
    Dag *dag = dag_of(call);
    const Table *table = loader_table(call->ev, call->env, node_of(call, 0), &call->args[0]);
    if (!table) {
        return value_poison();
    }
    uint32_t n = table->n;
    double *slopes = ARENA_ARRAY(call->ev->arena, n, double);
    for (uint32_t i = 0; i + 1 < n; i++) {
        slopes[i] = (table->ys[i + 1] - table->ys[i]) / (table->xs[i + 1] - table->xs[i]);
    }
    Ref x = functions_clamp(dag, ref1(call, 1), dag_const(dag, table->xs[0]),
                            dag_const(dag, table->xs[n - 1]));
    Ref row = dag_table_op(dag, OP_SEARCH, x, table->xs, n);
    Ref along = dag_op(dag, OP_SUB, x, dag_table_op(dag, OP_TABLE, row, table->xs, n), REF_NONE);
    Ref rise = dag_op(dag, OP_MUL, along, dag_table_op(dag, OP_TABLE, row, slopes, n), REF_NONE);
    return number(
        dag_op(dag, OP_ADD, dag_table_op(dag, OP_TABLE, row, table->ys, n), rise, REF_NONE));
}

// ---- Functions

static Ref binary(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Value run_trapezoid(const BuiltinCall *call) {
    double a, b;
    if (!eval_need(call->ev, call->env, node_of(call, 0), ref1(call, 0), "a of trapezoid", &a) ||
        !eval_need(call->ev, call->env, node_of(call, 1), ref1(call, 1), "b of trapezoid", &b)) {
        return value_poison();
    }
    if (!(a >= 0 && b >= 0 && a + b <= 1)) {
        return eval_error(call->ev, call->env, call->node, "they are parts of the whole",
                          "trapezoid: 'a' and 'b' are at least 0 and together at most 1, these are "
                          "%g and %g",
                          a, b);
    }
    Dag *dag = dag_of(call);
    Ref x = dag_input(dag, IN_X), one = dag_const(dag, 1), height = one;
    if (a > 0) {
        height = binary(dag, OP_MIN, height, binary(dag, OP_DIV, x, ref1(call, 0)));
    }
    if (b > 0) {
        Ref left = binary(dag, OP_SUB, one, x);
        height = binary(dag, OP_MIN, height, binary(dag, OP_DIV, left, ref1(call, 1)));
    }
    Closure *closure = ARENA_NEW(call->ev->arena, Closure);
    *closure = (Closure){
        .builtin = -1, .is_graph = true, .graph = binary(dag, OP_MAX, height, dag_const(dag, 0))};
    return (Value){.type = VALUE_FUNCTION, .closure = closure};
}

// A number that loop variables may decide, for all copies at least `least`. False: reported, or
// asked for.
static bool is_play_number(const BuiltinCall *call, uint32_t i, const char *name, double least,
                           const char *bound) {
    double x;
    Ref ref = ref1(call, i);
    uint32_t inputs = dag_inputs(dag_of(call), ref);
    if (inputs & ~LOOP_INPUTS) {
        eval_error(call->ev, call->env, node_of(call, i), "each instance has its own, for good",
                   "play: '%s' can not depend on %s", name, eval_input_name(inputs & ~LOOP_INPUTS));
        return false;
    }
    if (!dag_is_const(dag_of(call), ref, &x)) {
        return eval_copies_within(call->ev, ref, least, DBL_MAX);
    }
    if (!(x >= least && x <= DBL_MAX)) {
        eval_error(call->ev, call->env, node_of(call, i), NULL, "play: '%s' is %s, this is %.6g",
                   name, bound, x);
        return false;
    }
    return true;
}

static bool is_play_time(const BuiltinCall *call, uint32_t i, const char *name, double least,
                         const char *bound) {
    const Value *value = &call->args[i];
    if (value->dimension && value->dimension != DIMENSION_TIME) {
        eval_error(call->ev, call->env, node_of(call, i), NULL, "play: '%s' is a time, this is %s",
                   name, value_describe(call->ev->arena, value));
        return false;
    }
    return is_play_number(call, i, name, least, bound);
}

static Value run_play(const BuiltinCall *call) {
    const Value *clip = &call->args[0];
    if (clip->clip->is_played) {
        return eval_error(call->ev, call->env, node_of(call, 0),
                          "give at, fade and speed to one play(...)",
                          "play: 'clip' is one that play(...) gave");
    }
    if (!is_play_time(call, 1, "at", -DBL_MAX, "a finite number") ||
        !is_play_time(call, 2, "fade", 0, "at least 0") ||
        !is_play_number(call, 3, "speed", DBL_MIN, "more than 0") ||
        !is_play_number(call, 5, "parts", 0, "at least 0")) {
        return value_poison();
    }
    return clip_play(call->ev, clip->clip, call->args + 1);
}

static bool is_true(const BuiltinCall *call, uint32_t i) {
    double x;
    return dag_is_const(dag_of(call), ref1(call, i), &x) && x != 0;
}

// A color, or of image_alpha the opacity.
static Value run_image(const BuiltinCall *call) {
    const Value *uv = &call->args[1];
    bool is_alpha = call->id == BUILTIN_IMAGE_ALPHA;
    double known;
    if (!is_vector(uv) || uv->n != 2) {
        return eval_error(call->ev, call->env, node_of(call, 1), "write <u, v>",
                          "%s: 'uv' is a vector of 2, this is %s", builtin_infos[call->id].name,
                          value_describe(call->ev->arena, uv));
    }
    if (!is_alpha && !eval_need(call->ev, call->env, node_of(call, 2), ref1(call, 2),
                                "whether a picture is raw", &known)) {
        return value_poison();
    }
    const ProgramImage *image = loader_picture(call->ev, call->env, node_of(call, 0),
                                               &call->args[0], !is_alpha && is_true(call, 2));
    if (!image) {
        return value_poison();
    }
    if (is_alpha) {
        return number(dag_image(dag_of(call), uv->ref[0], uv->ref[1], image, 3));
    }
    Ref rgb[3];
    for (uint32_t c = 0; c < 3; c++) {
        rgb[c] = dag_image(dag_of(call), uv->ref[0], uv->ref[1], image, c);
    }
    return value_vec(VALUE_COLOR, rgb, 3);
}

// ---- Text, colors, materials

static Value run_text(const BuiltinCall *call) {
    double digits = 0;
    const Value *value = &call->args[0];
    uint32_t loops = value_inputs(dag_of(call), value) & LOOP_INPUTS;
    if (value_is(value, VALUE_STRING)) {
        return *value;
    }
    if (loops) {
        call->ev->unroll |= loops >> IN_LOOP0;
        return value_poison();
    }
    if (!eval_need(call->ev, call->env, node_of(call, 1), ref1(call, 1), "the number of digits",
                   &digits)) {
        return value_poison();
    }
    for (uint32_t i = 0; i < value->n; i++) {
        double x;
        if (!eval_need(call->ev, call->env, node_of(call, 0), value_refs(value)[i],
                       "what becomes text", &x)) {
            return value_poison();
        }
    }
    if (!(digits >= 0 && digits <= 17)) {
        return eval_error(call->ev, call->env, node_of(call, 1), NULL,
                          "str: 'digits' is from 0 to 17");
    }
    const char *text =
        value_text(call->ev->arena, dag_of(call), call->ev->symbols, value, (int)digits);
    return (Value){.type = VALUE_STRING,
                   .symbol = symbol_of(call->ev->symbols, text, strlen(text))};
}

static Value run_rgb(const BuiltinCall *call) {
    return value_from3(VALUE_COLOR, ref3(ref1(call, 0), ref1(call, 1), ref1(call, 2)));
}

static Value run_srgb(const BuiltinCall *call) {
    const Value *value = &call->args[0];
    double rgb[3];
    if (value_is_vec3(value)) {
        return value_from3(VALUE_COLOR, color_srgb(dag_of(call), value_ref3(value)));
    }
    if (!value_is(value, VALUE_STRING) ||
        !color_parse(symbol_text(call->ev->symbols, value->symbol), rgb)) {
        return eval_error(call->ev, call->env, node_of(call, 0), "write \"#c83\" or \"#cc8833\"",
                          "srgb: this is no color");
    }
    Ref3 encoded = spatial_const(dag_of(call), rgb[0], rgb[1], rgb[2]);
    return value_from3(VALUE_COLOR, color_srgb(dag_of(call), encoded));
}

static Value run_hsv(const BuiltinCall *call) {
    return value_from3(VALUE_COLOR,
                       color_hsv(dag_of(call), ref1(call, 0), ref1(call, 1), ref1(call, 2)));
}

static Value run_kelvin(const BuiltinCall *call) {
    return value_from3(VALUE_COLOR, color_kelvin(dag_of(call), ref1(call, 0)));
}

static Value run_material(const BuiltinCall *call) {
    return builtins_material(call);
}

#define run_later NULL
const BuiltinAction builtin_actions[BUILTIN_COUNT] = {
#define FUNCTION(id, name, params, result, run, op, help) {run_##run, OP_##op},
#include "lang/builtins.def"
#undef FUNCTION
};
