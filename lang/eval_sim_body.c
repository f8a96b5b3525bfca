// SPDX-License-Identifier: Apache-2.0
// Bodies of a `sim rigid`: their places and properties.
#include <math.h>
#include <string.h>

#include "lang/eval_sim_parts.h"

enum { CLOCKS = 1u << IN_T | 1u << IN_FILM_T };
enum { FORCE_INPUTS = CLOCKS | 7u << IN_PX | 7u << IN_WX };

static const Node *node_of(const Env *env, NodeId node) {
    return syntax_node(env->module->syntax, node);
}

bool sim_rigid_fail(RigidBlock *b) {
    b->is_bad = true;
    return false;
}

void sim_rigid_hash(RigidBlock *b, const double *numbers, size_t n) {
    hash_add(&b->sim->key, numbers, n * sizeof *numbers);
}

// ---- Numbers and poses that must be known

bool sim_rigid_numbers(RigidBlock *b, const Object *object, PropertyId id, double *out) {
    Value value = object_value(b->ev, object, id);
    bool is_known = value_is_numeric(&value);
    for (uint32_t k = 0; k < value.n && is_known; k++) {
        is_known = dag_is_const(b->ev->dag, value.ref[k], &out[k]);
    }
    const Given *given = object_given(object, id);
    if (!is_known && given && !value_is_poison(&value)) {
        uint32_t read = value_inputs(b->ev->dag, &value);
        b->ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        if (read & ~LOOP_INPUTS) {
            eval_error(b->ev, &given->env, given->node, NULL,
                       "%s of a rigid body must be known when the scene is loaded",
                       property_infos[id].name);
        }
    }
    return is_known || sim_rigid_fail(b);
}

bool sim_rigid_index(RigidBlock *b, const Env *env, NodeId node, double *index) {
    Value value = eval_expr(b->ev, env, node);
    bool is_number = value_is(&value, VALUE_NUMBER);
    if (!is_number && !value_is_poison(&value)) {
        eval_error(b->ev, env, node, NULL, "a label's index is a number, this is %s",
                   value_describe(b->ev->arena, &value));
    }
    return (is_number && eval_need(b->ev, env, node, value.ref[0], "a label's index", index)) ||
           sim_rigid_fail(b);
}

// By the simulation's own clock, at an instant. False: it depends on more than that.
static bool is_known_at(RigidBlock *b, Ref ref, double t, double *x) {
    Dag *dag = b->ev->dag;
    ref = dag_substitute(dag, ref, IN_FILM_T, dag_input(dag, IN_T));
    return dag_is_const(dag, dag_substitute(dag, ref, IN_T, dag_const(dag, t)), x);
}

// What moves a body must not change its size, at any of a few instants.
static bool check_scale(RigidBlock *b, Span where, const RefParts *parts) {
    enum { LOOKS = 8 };
    const Ref scale[3] = {parts->scale.x, parts->scale.y, parts->scale.z};
    const double low = b->sim->rigid.low, span = b->sim->rigid.high - low;
    for (int k = 0; k < 3 * LOOKS; k++) {
        double x;
        if (is_known_at(b, scale[k % 3], low + span * (k / 3) / LOOKS, &x) && fabs(x - 1) > 1e-6) {
            eval_error_at(b->ev, where, "scale the shapes in it", "a rigid body can not be scaled");
            return sim_rigid_fail(b);
        }
    }
    return true;
}

static void parts_refs(const RefParts *p, Ref refs[RIGID_COLUMNS]) {
    const Ref all[RIGID_COLUMNS] = {p->translation.x, p->translation.y, p->translation.z,
                                    p->rotation.x,    p->rotation.y,    p->rotation.z,
                                    p->rotation.w};
    memcpy(refs, all, sizeof all);
}

bool sim_rigid_pose(RigidBlock *b, const Object *object, RigidPose *pose, Ref *moving,
                    bool *moves) {
    Dag *dag = b->ev->dag;
    *pose = (RigidPose){{0}, {0, 0, 0, 1}};
    if (object->is_identity) {
        return true;
    }
    RefParts parts = spatial_map_split(dag, &object->map);
    Ref refs[RIGID_COLUMNS];
    double x[RIGID_COLUMNS];
    parts_refs(&parts, refs);
    if (!check_scale(b, object->where, &parts)) {
        return false;
    }
    uint32_t read = 0;
    for (int i = 0; i < RIGID_COLUMNS; i++) {
        read |= dag_inputs(dag, refs[i]);
    }
    if (read & LOOP_INPUTS) {
        b->ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        return sim_rigid_fail(b);
    }
    if (read & ~(moving ? (uint32_t)CLOCKS : 0u)) {
        eval_error_at(b->ev, object->where,
                      moving ? NULL : "only what is fixed may move by itself: write fixed",
                      "the place of %s can not depend on %s", object->name, eval_input_name(read));
        return sim_rigid_fail(b);
    }
    for (int i = 0; i < RIGID_COLUMNS; i++) { // a moving one begins where it is at t = 0
        Ref ref = dag_substitute(dag, refs[i], IN_FILM_T, dag_input(dag, IN_T));
        if (moving) {
            moving[i] = ref;
        }
        if (!is_known_at(b, ref, b->sim->rigid.low, &x[i]) || !isfinite(x[i])) {
            eval_error_at(b->ev, object->where, NULL, "this place is not finite");
            return sim_rigid_fail(b);
        }
    }
    if (moving) {
        *moves = read != 0;
    }
    memcpy(pose->at, x, sizeof pose->at);
    memcpy(pose->turn, x + 3, sizeof pose->turn);
    return true;
}

// ---- Bodies

static bool read_label(RigidBlock *b, const Env *env, NodeId statement, bool is_fixed,
                       RigidLabel *label) {
    Eval *ev = b->ev;
    const uint32_t *extra = env->module->syntax->extra + node_of(env, statement)->a;
    *label = (RigidLabel){.name = extra[3], .has_index = extra[5] != 0, .statement = statement};
    if (!label->name && !is_fixed) {
        eval_error_at(ev, syntax_name_span(env->module->syntax, statement),
                      "write body Crate { ... }", "a body needs a label, by which it is read");
        return sim_rigid_fail(b);
    }
    return !label->has_index || sim_rigid_index(b, env, extra[5], &label->index);
}

static void bind_inputs(RigidBlock *b, Object *object, const char *name, Input first) {
    Symbol symbol = symbol_of(b->ev->symbols, name, strlen(name));
    Ref refs[3];
    for (uint32_t k = 0; k < 3; k++) {
        refs[k] = dag_input(b->ev->dag, (Input)(first + k));
    }
    if (!scope_find_own(object->env.scope, symbol)) {
        scope_bind(b->ev->arena, object->env.scope, symbol, BINDING_VARIABLE)->value =
            value_vec(VALUE_VEC, refs, 3);
    }
}

static const Program *compile(RigidBlock *b, const Ref *refs, uint32_t n) {
    dag_hash(b->ev->dag, refs, n, &b->sim->key);
    return dag_compile(b->ev->dag, b->ev->arena, refs, n);
}

static bool read_properties(RigidBlock *b, const Object *object, RigidBody *body) {
    Eval *ev = b->ev;
    const Given *force = object_given(object, PROPERTY_BODY_FORCE);
    bool is_fine = sim_rigid_numbers(b, object, PROPERTY_BODY_DENSITY, &body->density) &&
                   sim_rigid_numbers(b, object, PROPERTY_BODY_FRICTION, &body->friction) &&
                   sim_rigid_numbers(b, object, PROPERTY_BODY_BOUNCE, &body->bounce) &&
                   sim_rigid_numbers(b, object, PROPERTY_BODY_VEL, body->velocity) &&
                   sim_rigid_numbers(b, object, PROPERTY_BODY_SPIN, body->spin) &&
                   (!object_given(object, PROPERTY_BODY_MASS) ||
                    sim_rigid_numbers(b, object, PROPERTY_BODY_MASS, &body->mass));
    if (is_fine && force) {
        if (!eval_check_vec3(ev, force->where, "force", &force->value,
                             FORCE_INPUTS | LOOP_INPUTS)) {
            return sim_rigid_fail(b);
        }
        uint32_t loops = value_inputs(ev->dag, &force->value) & LOOP_INPUTS;
        ev->unroll |= loops >> IN_LOOP0;
        body->force = loops ? NULL : compile(b, force->value.ref, 3);
        is_fine = !loops || sim_rigid_fail(b);
    }
    return is_fine;
}

static const char *label_text(RigidBlock *b, const RigidLabel *label) {
    const char *name = label->name ? symbol_text(b->ev->symbols, label->name) : "fixed";
    return label->has_index ? arena_printf(b->ev->arena, "%s[%.15g]", name, label->index) : name;
}

// Where a fixed body is, by IN_T.
static Value place_value(Eval *ev, const Object *object, const Ref refs[RIGID_COLUMNS]) {
    bool moves = !object->is_identity;
    RefMap map = spatial_map_quat(ev->dag, moves ? (RefQuat){refs[3], refs[4], refs[5], refs[6]}
                                                 : spatial_quat_identity(ev->dag));
    for (int k = 0; moves && k < 3; k++) {
        map.m[k][3] = refs[k];
    }
    return value_transform(ev->arena, &map);
}

static void read_shapes(RigidBlock *b, const Object *object, NodeId block, RigidOwner owner,
                        RigidBody *body) {
    body->first_shape = (uint32_t)b->n_shapes;
    sim_rigid_shapes(b, &object->env, block, &owner);
    body->n_shapes = (uint32_t)b->n_shapes - body->first_shape;
    if (!b->is_bad && body->n_shapes == 0) {
        eval_error_at(b->ev, object->where, "write box { } in it", "a body needs a shape");
        sim_rigid_fail(b);
    }
}

void sim_rigid_body(RigidBlock *b, const Env *env, NodeId statement, bool is_fixed) {
    Eval *ev = b->ev;
    const uint32_t *extra = env->module->syntax->extra + node_of(env, statement)->a;
    Object object = {.kind = OBJECT_BODY,
                     .name = is_fixed ? "fixed" : "body",
                     .where = syntax_name_span(env->module->syntax, statement),
                     .is_identity = true};
    RigidBody body = {.is_fixed = is_fixed};
    RigidLabel label;
    RigidPose pose;
    Ref motion[RIGID_COLUMNS];
    bool moves = false;
    if (!read_label(b, env, statement, is_fixed, &label)) {
        return;
    }
    object.env = (Env){env->module, scope_new(ev->arena, env->scope)};
    object_begin(ev, &object);
    eval_declare(ev, &object.env, extra[6]);
    bind_inputs(b, &object, "pos", IN_PX);
    bind_inputs(b, &object, "vel", IN_WX);
    unsigned n_errors = diag_n_errors(ev->diag);
    eval_gather(ev, &object.env, &object, extra[6]);
    bool is_fine = diag_n_errors(ev->diag) == n_errors ? true : sim_rigid_fail(b);
    if (is_fine && sim_rigid_pose(b, &object, &pose, is_fixed ? motion : NULL, &moves) &&
        read_properties(b, &object, &body)) {
        memcpy(body.at, pose.at, sizeof body.at);
        memcpy(body.turn, pose.turn, sizeof body.turn);
        body.motion = moves ? compile(b, motion, RIGID_COLUMNS) : NULL;
        double is_convex = 0;
        sim_rigid_numbers(b, &object, PROPERTY_BODY_CONVEX, &is_convex);
        body.name = label_text(b, &label);
        const RigidOwner owner = {body.name, &pose, is_fixed, moves, is_convex != 0};
        read_shapes(b, &object, extra[6], owner, &body);
        const double numbers[] = {is_fixed,  moves,         body.force != NULL, body.density,
                                  body.mass, body.friction, body.bounce,        body.n_shapes};
        sim_rigid_hash(b, numbers, sizeof numbers / sizeof numbers[0]);
        sim_rigid_hash(b, body.at, 3);
        sim_rigid_hash(b, body.turn, 4);
        sim_rigid_hash(b, body.velocity, 3);
        sim_rigid_hash(b, body.spin, 3);
        b->labels =
            arena_grow(ev->arena, b->labels, b->n_bodies, &b->labels_capacity, sizeof *b->labels);
        b->bodies =
            arena_grow(ev->arena, b->bodies, b->n_bodies, &b->bodies_capacity, sizeof *b->bodies);
        label.place = is_fixed ? place_value(ev, &object, motion) : value_poison();
        b->labels[b->n_bodies] = label;
        b->bodies[b->n_bodies++] = body;
    }
    object_end(ev, &object);
}
