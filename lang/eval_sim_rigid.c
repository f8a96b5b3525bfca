// SPDX-License-Identifier: Apache-2.0
// The block of a `sim rigid`: settings, bodies, joints; bodies by their labels.
#include <math.h>
#include <string.h>

#include "lang/eval_sim_parts.h"

enum { MOST_BODIES = 20000, CHILD_SECONDS = 24 * 3600 };

static const Node *node_of(const Env *env, NodeId node) {
    return syntax_node(env->module->syntax, node);
}

// ---- Joints

static bool find_body(RigidBlock *b, const Env *env, NodeId node, int32_t *found) {
    Eval *ev = b->ev;
    const Node *n = node_of(env, node), *name = n->kind == NODE_INDEX ? node_of(env, n->a) : n;
    double index = 0;
    if (name->kind != NODE_NAME) {
        eval_error(ev, env, node, "write a = Arm, or a = Arm[2]", "a body is named by its label");
        return sim_rigid_fail(b);
    }
    if (n->kind == NODE_INDEX && !sim_rigid_index(b, env, n->b, &index)) {
        return false;
    }
    for (size_t i = 0; i < b->n_bodies; i++) {
        const RigidLabel *label = &b->labels[i];
        if (label->name == name->a && label->has_index == (n->kind == NODE_INDEX) &&
            label->index == index) {
            *found = (int32_t)i;
            return true;
        }
    }
    eval_error(ev, env, node, NULL, "no body is called '%s' here",
               symbol_text(ev->symbols, name->a));
    return sim_rigid_fail(b);
}

static bool joint_kind(RigidBlock *b, const Env *env, const uint32_t *extra, RigidJointKind *kind) {
    static const char *const names[] = {"hinge", "ball", "slider", "fixed"};
    const char *name = symbol_text(b->ev->symbols, extra[0]);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(names[i], name) == 0) {
            *kind = (RigidJointKind)i;
            return true;
        }
    }
    eval_error_at(b->ev, syntax_word_span(env->module->syntax, extra[1]),
                  "joints are hinge, ball, slider and fixed", "there is no joint %s", name);
    return sim_rigid_fail(b);
}

static bool refuse_given(RigidBlock *b, const Given *given, const char *hint, const char *what) {
    eval_error(b->ev, &given->env, given->node, hint, "%s %s", property_infos[given->id].name,
               what);
    return sim_rigid_fail(b);
}

static bool read_range(RigidBlock *b, const Given *given, RigidJoint *joint) {
    if (!value_is(&given->value, VALUE_RANGE)) { // an error was reported
        return sim_rigid_fail(b);
    }
    const Range *range = given->value.range;
    bool is_hinge = joint->kind == RIGID_HINGE;
    if (!dag_is_const(b->ev->dag, range->low, &joint->low) ||
        !dag_is_const(b->ev->dag, range->high, &joint->high)) {
        return sim_rigid_fail(b);
    }
    if (is_hinge != range->is_angle) {
        return refuse_given(b, given, is_hinge ? "write -90deg..90deg" : "write -0.5..0.5",
                            is_hinge ? "of a hinge goes from an angle to another"
                                     : "of a slider goes from a length to another");
    }
    if (!(joint->low <= 0 && joint->high >= 0)) {
        return refuse_given(b, given, NULL, "is from where the joint is at the start: 0 is in it");
    }
    const double most = 3.14159; // the engine tells no turns apart
    if (is_hinge && !(joint->low > -most && joint->high < most)) {
        return refuse_given(b, given, NULL, "of a hinge is less than half a turn to either side");
    }
    return true;
}

// Stops, friction or a motor, of joints that have one axis.
static bool read_drive(RigidBlock *b, const Object *object, RigidJoint *joint) {
    static const PropertyId ids[] = {PROPERTY_JOINT_RANGE, PROPERTY_JOINT_STRENGTH,
                                     PROPERTY_JOINT_SPEED};
    Eval *ev = b->ev;
    const Given *range = object_given(object, PROPERTY_JOINT_RANGE),
                *speed = object_given(object, PROPERTY_JOINT_SPEED);
    bool has_axis = joint->kind == RIGID_HINGE || joint->kind == RIGID_SLIDER;
    joint->low = -INFINITY;
    joint->high = INFINITY;
    for (int i = 0; i < 3 && !has_axis; i++) {
        const Given *given = object_given(object, ids[i]);
        if (given) {
            return refuse_given(b, given, NULL, "belongs to a hinge or a slider");
        }
    }
    if (!sim_rigid_numbers(b, object, PROPERTY_JOINT_STRENGTH, &joint->strength) ||
        (range && !read_range(b, range, joint))) {
        return false;
    }
    if (speed && !value_is_numeric(&speed->value)) { // an error was reported
        return sim_rigid_fail(b);
    }
    if (speed && joint->strength == 0) {
        return refuse_given(b, speed, "write strength = ...", "is nothing without strength");
    }
    uint32_t read = speed ? value_inputs(ev->dag, &speed->value) : 0;
    if (read & LOOP_INPUTS) {
        ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        return sim_rigid_fail(b);
    }
    joint->speed = speed ? dag_compile(ev->dag, ev->arena, speed->value.ref, 1) : NULL;
    const double numbers[] = {joint->low, joint->high, joint->strength, speed != NULL};
    sim_rigid_hash(b, numbers, sizeof numbers / sizeof numbers[0]);
    if (speed) {
        dag_hash(ev->dag, speed->value.ref, 1, &b->sim->key);
    }
    return true;
}

static bool is_held(const RigidBlock *b, int32_t body) {
    return body < 0 || b->bodies[body].is_fixed;
}

static bool check_ends(RigidBlock *b, const Object *object, const RigidJoint *joint) {
    bool has_axis = joint->kind == RIGID_HINGE || joint->kind == RIGID_SLIDER;
    const double *d = joint->axis, length = hypot(hypot(d[0], d[1]), d[2]);
    if (joint->a < 0) {
        eval_error_at(b->ev, object->where, "write a = Arm", "a joint holds a body");
    } else if (joint->a == joint->b) {
        eval_error_at(b->ev, object->where, "without b it holds a to the world",
                      "a joint holds two bodies: its a and b are the same");
    } else if (is_held(b, joint->a) && is_held(b, joint->b)) {
        eval_error_at(b->ev, object->where, NULL,
                      "a joint holds a body that can move: this one's are fixed");
    } else if (has_axis && !(length > 0 && isfinite(length))) {
        const Given *axis = object_given(object, PROPERTY_JOINT_AXIS);
        eval_error_at(b->ev, axis ? axis->name : object->where, NULL,
                      "the axis of a joint is a direction: <%.9g, %.9g, %.9g> is none", d[0], d[1],
                      d[2]);
    } else {
        return true;
    }
    return sim_rigid_fail(b);
}

static void read_joint(RigidBlock *b, const Env *env, NodeId statement) {
    Eval *ev = b->ev;
    const Syntax *syntax = env->module->syntax;
    const uint32_t *extra = syntax->extra + node_of(env, statement)->a;
    RigidJoint joint = {.a = -1, .b = -1};
    Object object = {.kind = OBJECT_JOINT,
                     .name = "joint",
                     .where = syntax_word_span(syntax, extra[3]),
                     .is_identity = true};
    double index;
    if (!joint_kind(b, env, extra, &joint.kind) ||
        (extra[5] && !sim_rigid_index(b, env, extra[5], &index))) {
        return;
    }
    object.env = (Env){env->module, scope_new(ev->arena, env->scope)};
    object_begin(ev, &object);
    eval_declare(ev, &object.env, extra[4]);
    const Node *block = node_of(env, extra[4]);
    unsigned n_errors = diag_n_errors(ev->diag);
    for (uint32_t i = 0; i < block->b; i++) {
        NodeId inner = syntax->extra[block->a + i];
        const Node *s = node_of(env, inner);
        const char *name = s->kind == NODE_PROPERTY ? symbol_text(ev->symbols, s->a) : "";
        if (strcmp(name, "a") == 0 || strcmp(name, "b") == 0) {
            find_body(b, &object.env, s->b, *name == 'a' ? &joint.a : &joint.b);
        } else if (s->kind == NODE_PROPERTY) {
            eval_property(ev, &object.env, &object, inner);
        }
        eval_statement_ends(ev);
    }
    bool is_fine = diag_n_errors(ev->diag) == n_errors &&
                   sim_rigid_numbers(b, &object, PROPERTY_JOINT_AT, joint.at) &&
                   sim_rigid_numbers(b, &object, PROPERTY_JOINT_AXIS, joint.axis) &&
                   read_drive(b, &object, &joint);
    if (is_fine && check_ends(b, &object, &joint)) {
        const double ends[3] = {joint.kind, joint.a, joint.b};
        sim_rigid_hash(b, ends, 3);
        sim_rigid_hash(b, joint.at, 3);
        sim_rigid_hash(b, joint.axis, 3);
        b->joints =
            arena_grow(ev->arena, b->joints, b->n_joints, &b->joints_capacity, sizeof *b->joints);
        b->joints[b->n_joints++] = joint;
    } else {
        sim_rigid_fail(b);
    }
    object_end(ev, &object);
}

// ---- The walk: settings, then bodies, then joints

typedef enum { SETTINGS, BODIES, JOINTS } Pass;

static void walk(RigidBlock *b, const Env *env, NodeId block, Pass pass);

static void walk_loop(RigidBlock *b, const Env *env, NodeId statement, Pass pass) {
    Sequence sequence;
    NodeId body = eval_loop_block(env, statement);
    if (!eval_loop_sequence(b->ev, env, statement, &sequence)) {
        sim_rigid_fail(b);
        return;
    }
    for (uint32_t i = 0; i < sequence.n && !b->is_bad && eval_step(b->ev, env, statement); i++) {
        Env inside = {env->module, scope_new(b->ev->arena, env->scope)};
        eval_bind_loop(b->ev, &inside, statement, sequence_item(b->ev, &sequence, i));
        eval_declare(b->ev, &inside, body);
        walk(b, &inside, body, pass);
    }
}

static void walk_object(RigidBlock *b, const Env *env, NodeId statement) {
    const uint32_t *extra = env->module->syntax->extra + node_of(env, statement)->a;
    const Node *path = node_of(env, extra[1]);
    const char *name = path->kind == NODE_NAME ? symbol_text(b->ev->symbols, path->a) : "";
    bool is_fixed = strcmp(name, "fixed") == 0;
    if (!is_fixed && strcmp(name, "body") != 0) {
        eval_error_at(b->ev, syntax_name_span(env->module->syntax, statement),
                      "write body Name { ... }", "'sim rigid' holds body, fixed and joint");
        sim_rigid_fail(b);
    } else if (b->n_bodies == MOST_BODIES) {
        eval_error_at(b->ev, syntax_name_span(env->module->syntax, statement), NULL,
                      "more than %d bodies", MOST_BODIES);
        sim_rigid_fail(b);
    } else {
        sim_rigid_body(b, env, statement, is_fixed);
    }
}

static void walk(RigidBlock *b, const Env *env, NodeId block, Pass pass) {
    const Syntax *syntax = env->module->syntax;
    const Node *node = node_of(env, block);
    for (uint32_t i = 0; i < node->b && !b->is_bad; i++) {
        NodeId statement = syntax->extra[node->a + i];
        const Node *s = node_of(env, statement);
        switch ((NodeKind)s->kind) {
        case NODE_PROPERTY:
            if (pass == SETTINGS) {
                eval_property(b->ev, env, &b->object, statement);
            } else if (env->scope->parent != b->sim->scope) {
                eval_error_at(b->ev, syntax_name_span(syntax, statement), NULL,
                              "settings of a sim stand in its own block");
                sim_rigid_fail(b);
            }
            break;
        case NODE_OBJECT:
            if (pass == BODIES) {
                walk_object(b, env, statement);
            }
            break;
        case NODE_JOINT:
            if (pass == JOINTS) {
                read_joint(b, env, statement);
            }
            break;
        case NODE_FOR:
            if (pass != SETTINGS) {
                walk_loop(b, env, statement, pass);
            }
            break;
        case NODE_IF:
            if (pass != SETTINGS) {
                NodeId chosen = eval_chosen_block(b->ev, env, statement,
                                                  "what is in a simulation is decided once");
                Env inside = {env->module, scope_new(b->ev->arena, env->scope)};
                if (chosen) {
                    eval_declare(b->ev, &inside, chosen);
                    walk(b, &inside, chosen, pass);
                }
            }
            break;
        case NODE_LET:
        case NODE_FN:
            break;
        default:
            eval_error_at(b->ev, (Span){s->lo, s->lo + 1},
                          (NodeKind)s->kind == NODE_RUN ? "write them in a for" : NULL,
                          (NodeKind)s->kind == NODE_RUN
                              ? "not supported yet: so many bodies one after another"
                              : "'sim rigid' holds settings, body, fixed and joint");
            sim_rigid_fail(b);
            break;
        }
        eval_statement_ends(b->ev);
    }
}

// ---- All of it

static bool read_settings(RigidBlock *b) {
    SimRigid *rigid = &b->sim->rigid;
    double seed = 0, iterations = 0;
    bool is_fine =
        eval_sim_span(b->ev, object_given(&b->object, PROPERTY_SIM_RIGID_SPAN), &rigid->low,
                      &rigid->high) &&
        sim_rigid_numbers(b, &b->object, PROPERTY_SIM_RIGID_STEP, &rigid->step) &&
        sim_rigid_numbers(b, &b->object, PROPERTY_SIM_RIGID_GRAVITY, rigid->gravity) &&
        sim_rigid_numbers(b, &b->object, PROPERTY_SIM_RIGID_TOLERANCE, &rigid->tolerance) &&
        sim_rigid_numbers(b, &b->object, PROPERTY_SIM_RIGID_SEED, &seed) &&
        sim_rigid_numbers(b, &b->object, PROPERTY_SIM_RIGID_ITERATIONS, &iterations);
    if (!is_fine) {
        return sim_rigid_fail(b);
    }
    rigid->seed = (uint32_t)seed;
    rigid->iterations = (uint32_t)iterations;
    rigid->limit = CHILD_SECONDS;
    double n_steps = (rigid->high - rigid->low) / rigid->step;
    if (!(n_steps <= RIGID_MOST_STEPS)) {
        eval_error_at(b->ev, b->object.where, "a longer step, or a shorter span",
                      "this takes %.3g steps, at most %d are allowed", n_steps, RIGID_MOST_STEPS);
        return sim_rigid_fail(b);
    }
    const double numbers[] = {rigid->low,       rigid->high, rigid->step,
                              rigid->tolerance, seed,        iterations};
    sim_rigid_hash(b, numbers, sizeof numbers / sizeof numbers[0]);
    sim_rigid_hash(b, rigid->gravity, 3);
    return true;
}

static SimGroup *group_of(RigidBlock *b, Symbol name) {
    Sim *sim = b->sim;
    for (uint32_t g = 0; g < sim->n_groups; g++) {
        if (sim->groups[g].name == name) {
            return &sim->groups[g];
        }
    }
    SimGroup *group = &sim->groups[sim->n_groups++];
    *group = (SimGroup){.name = name};
    return group;
}

// Bodies by their labels: members in the order of the script, and fixed ones.
static bool make_groups(RigidBlock *b) {
    Eval *ev = b->ev;
    uint32_t *members = ARENA_ARRAY(ev->arena, b->n_bodies, uint32_t), n = 0;
    b->sim->n_groups = 0;
    b->sim->groups = ARENA_ARRAY(ev->arena, b->n_bodies, SimGroup);
    for (size_t i = 0; i < b->n_bodies; i++) {
        const RigidLabel *label = &b->labels[i];
        const bool is_fixed = b->bodies[i].is_fixed;
        if (!label->name) {
            continue;
        }
        SimGroup *group = group_of(b, label->name);
        bool is_next = label->has_index
                           ? (group->n == 0 || (group->is_list && is_fixed == !!group->places)) &&
                                 label->index == group->n
                           : group->n == 0;
        if (!is_next) {
            eval_error_at(ev, syntax_name_span(b->sim->module->syntax, label->statement), NULL,
                          label->has_index ? "the bodies '%s' are to be numbered 0, 1, 2..."
                                           : "there are two bodies '%s'",
                          symbol_text(ev->symbols, label->name));
            return sim_rigid_fail(b);
        }
        group->is_list = label->has_index;
        if (is_fixed) {
            group->places = arena_grow(ev->arena, group->places, group->n, &group->capacity,
                                       sizeof *group->places);
            group->places[group->n++] = label->place;
            continue;
        }
        group->members = arena_grow(ev->arena, group->members, group->n, &group->capacity,
                                    sizeof *group->members);
        group->members[group->n++] = n;
        members[n++] = (uint32_t)i;
    }
    b->sim->rigid.members = members;
    b->sim->rigid.n_members = n;
    return true;
}

bool eval_sim_rigid(Eval *ev, Sim *sim) {
    RigidBlock *b = ARENA_NEW(ev->arena, RigidBlock);
    Env env = {sim->module, sim->within};
    *b = (RigidBlock){.ev = ev, .sim = sim};
    b->object = (Object){.kind = OBJECT_SIM_RIGID,
                         .name = "sim rigid",
                         .env = env,
                         .where = syntax_name_span(sim->module->syntax, sim->statement),
                         .is_identity = true};
    sim->rigid = (SimRigid){0};
    sim->key = (Hash128){0};
    unsigned n_errors = diag_n_errors(ev->diag);
    eval_declare(ev, &env, sim->block);
    object_begin(ev, &b->object);
    walk(b, &env, sim->block, SETTINGS);
    if (!b->is_bad && read_settings(b)) {
        walk(b, &env, sim->block, BODIES);
        walk(b, &env, sim->block, JOINTS);
    }
    object_end(ev, &b->object);
    if (!b->is_bad && make_groups(b) && sim->rigid.n_members == 0) {
        eval_error_at(ev, b->object.where, "write body Crate { box { } }",
                      "the simulation has no bodies that move");
    }
    sim->rigid.bodies = b->bodies;
    sim->rigid.n_bodies = (uint32_t)b->n_bodies;
    sim->rigid.shapes = b->shapes;
    sim->rigid.n_shapes = (uint32_t)b->n_shapes;
    sim->rigid.joints = b->joints;
    sim->rigid.n_joints = (uint32_t)b->n_joints;
    return !b->is_bad && !ev->unroll && diag_n_errors(ev->diag) == n_errors;
}
