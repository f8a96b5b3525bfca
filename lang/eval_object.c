// SPDX-License-Identifier: Apache-2.0
// Objects: nodes of the language and copies of defs, with what their blocks say.
#include "lang/object.h"

#include <string.h>

#include "lang/eval_clip.h"
#include "lang/eval_run.h"
#include "lang/eval_sim.h"
#include "lang/loader.h"
#include "lang/lower.h"

enum { MAX_NAMES = 512 };

// The parts of NODE_OBJECT.
typedef struct {
    bool is_instance;
    NodeId path;
    ExtraId args;
    Symbol label;
    NodeId index, block, statement;
} Parts;

static Parts parts_of(const Env *env, NodeId statement) {
    const uint32_t *extra =
        env->module->syntax->extra + syntax_node(env->module->syntax, statement)->a;
    return (Parts){extra[0] != 0, extra[1], extra[2], extra[3], extra[5], extra[6], statement};
}

// ---- Places

static const Given *innermost(const Given *outer, const Object *object, PropertyId id,
                              PropertyId own) {
    const Given *given = object_given(object, id);
    given = given || own == PROPERTY_COUNT ? given : object_given(object, own);
    return given ? given : outer;
}

static void join_map(Eval *ev, Place *place, const RefMap *map) {
    place->map = place->is_identity ? *map : spatial_map_compose(ev->dag, &place->map, map);
    place->is_identity = false;
}

Place place_outermost(Eval *ev) {
    return (Place){.is_identity = true,
                   .visible = dag_const(ev->dag, 1),
                   .path = "",
                   .suffix = "",
                   .clock = REF_NONE};
}

Place place_within(Eval *ev, const Place *place, const Object *object) {
    Place within = *place;
    bool is_surface = object->kind == OBJECT_SURFACE, is_mesh = object->kind == OBJECT_MESH;
    const Given *pose = object_given(object, PROPERTY_OBJECT_POSE);
    RefMap map;
    if (pose) {
        Value value = ev->playing ? value_at_clips(ev, ev->playing, &pose->value) : pose->value;
        if (value_as_map(ev->dag, &value, &map)) {
            join_map(ev, &within, &map);
        }
    }
    if (!object->is_identity) {
        join_map(ev, &within, &object->map);
    }
    const Given *visible = object_given(object, PROPERTY_ANY_VISIBLE);
    if (visible && value_is(&visible->value, VALUE_BOOL)) {
        within.visible = dag_op(ev->dag, OP_AND, place->visible, visible->value.ref[0], REF_NONE);
    }
    within.material = innermost(place->material, object, PROPERTY_OBJECT_MATERIAL, PROPERTY_COUNT);
    within.bake = innermost(place->bake, object, PROPERTY_OBJECT_BAKE, PROPERTY_COUNT);
    static const PropertyId seen[RAY_KINDS] = {PROPERTY_OBJECT_SEEN, PROPERTY_OBJECT_SHADOW,
                                               PROPERTY_OBJECT_REFLECTION};
    for (int k = 0; k < RAY_KINDS; k++) {
        within.seen[k] = innermost(place->seen[k], object, seen[k], PROPERTY_COUNT);
    }
    within.catcher = innermost(place->catcher, object, PROPERTY_OBJECT_CATCHER, PROPERTY_COUNT);
    within.smooth = innermost(place->smooth, object, PROPERTY_INHERITED_SMOOTH,
                              is_surface ? PROPERTY_SURFACE_SMOOTH
                              : is_mesh  ? PROPERTY_MESH_SMOOTH
                                         : PROPERTY_COUNT);
    within.tolerance = innermost(place->tolerance, object, PROPERTY_INHERITED_TOLERANCE,
                                 is_surface ? PROPERTY_SURFACE_TOLERANCE
                                 : is_mesh  ? PROPERTY_MESH_TOLERANCE
                                            : PROPERTY_COUNT);
    within.samples = innermost(place->samples, object, PROPERTY_INHERITED_SAMPLES,
                               is_surface ? PROPERTY_SURFACE_SAMPLES
                               : is_mesh  ? PROPERTY_MESH_SAMPLES
                                          : PROPERTY_COUNT);
    within.is_outermost = false;
    return within;
}

// ---- Labels

// The copies of batched loops have numbers of their own; false: a string was expected, asked for.
static bool number_label(Eval *ev, Place *shape, Ref number, bool is_joined) {
    if (!shape) {
        ev->unroll |= dag_inputs(ev->dag, number) >> IN_LOOP0;
        return false;
    }
    shape->has_number = true;
    shape->is_joined = is_joined;
    shape->number = number;
    return true;
}

// Without the digits at its end.
static const char *label_stem(Eval *ev, Symbol label) {
    const char *name = symbol_text(ev->symbols, label);
    size_t n = strlen(name);
    while (n > 0 && name[n - 1] >= '0' && name[n - 1] <= '9') {
        n--;
    }
    return arena_string(ev->arena, name, n);
}

// "Wheel" or "Wheel[2]"; NULL: reported, or asked for. Where batched loops tell copies apart, a
// shape (NULL: it is no shape) gets the number of each. Where there is one loop, whose variable
// counts from 0, the renderer adds the index of each copy.
static const char *label_text(Eval *ev, const Env *env, const Parts *parts, Place *shape) {
    const uint32_t loop_inputs = 15u << IN_LOOP0;
    const char *name = symbol_text(ev->symbols, parts->label);
    Ref joined = ev->runs ? eval_run_number(ev, env, parts->statement) : REF_NONE;
    if (joined != REF_NONE) {
        bool is_known = number_label(ev, parts->index ? NULL : shape, joined, true);
        return is_known ? label_stem(ev, parts->label) : NULL;
    }
    if (!parts->index) {
        return name;
    }
    Value index = eval_expr(ev, env, parts->index);
    if (value_is_poison(&index)) {
        return NULL;
    }
    if (!value_is(&index, VALUE_NUMBER) && !value_is(&index, VALUE_STRING)) {
        eval_error(ev, env, parts->index, NULL,
                   "a label's index is a number or a string, this is %s",
                   value_describe(ev->arena, &index));
        return NULL;
    }
    const Loops *loops = ev->loops;
    if (shape && loops && !loops->parent && value_is(&index, VALUE_NUMBER) &&
        index.ref[0] == dag_input(ev->dag, IN_LOOP0) && loops->counts) {
        return name;
    }
    double x;
    uint32_t inputs = value_is(&index, VALUE_NUMBER) ? dag_inputs(ev->dag, index.ref[0]) : 0;
    if (inputs && !(inputs & ~loop_inputs)) {
        return number_label(ev, shape, index.ref[0], false) ? name : NULL;
    }
    if (value_is(&index, VALUE_NUMBER) &&
        !eval_need(ev, env, parts->index, index.ref[0], "a label's index", &x)) {
        return NULL;
    }
    return arena_printf(ev->arena, "%s[%s]", name,
                        value_text(ev->arena, ev->dag, ev->symbols, &index, 0));
}

// ---- Nodes of the language

// What the variables of a surface are: numbers or angles, as its ranges say.
static ValueType variable_type(const Object *object, PropertyId range) {
    const Given *given = object_given(object, range);
    return given && value_is(&given->value, VALUE_RANGE) && given->value.range->is_angle
               ? VALUE_ANGLE
               : VALUE_NUMBER;
}

static void bind_variable(Eval *ev, Object *object, const char *name, Value value) {
    Symbol symbol = symbol_of(ev->symbols, name, strlen(name));
    if (!scope_find_own(object->env.scope, symbol)) { // the block's own let wins
        scope_bind(ev->arena, object->env.scope, symbol, BINDING_VARIABLE)->value = value;
    }
}

static Value input_value(Eval *ev, ValueType type, Input first, uint32_t n) {
    Ref refs[3];
    for (uint32_t i = 0; i < n; i++) {
        refs[i] = dag_input(ev->dag, (Input)(first + i));
    }
    return value_vec(type, refs, n);
}

// The properties that others of the same block depend on come first: what u and v are, and fps
// (the unit f needs it).
static void gather_first(Eval *ev, Object *object, NodeId block, const char *name) {
    const Syntax *syntax = object->env.module->syntax;
    const Node *node = syntax_node(syntax, block);
    for (uint32_t i = 0; i < node->b; i++) {
        NodeId statement = syntax->extra[node->a + i];
        const Node *s = syntax_node(syntax, statement);
        if (s->kind == NODE_PROPERTY && strcmp(symbol_text(ev->symbols, s->a), name) == 0) {
            eval_property(ev, &object->env, object, statement);
            diag_next_statement(ev->diag);
            return;
        }
    }
}

static void bind_variables(Eval *ev, Object *object, NodeId block) {
    if (object->kind == OBJECT_SURFACE) {
        gather_first(ev, object, block, "u");
        gather_first(ev, object, block, "v");
        bind_variable(ev, object, "u",
                      input_value(ev, variable_type(object, PROPERTY_SURFACE_U), IN_U, 1));
        bind_variable(ev, object, "v",
                      input_value(ev, variable_type(object, PROPERTY_SURFACE_V), IN_V, 1));
    } else if (object->kind == OBJECT_MESH) {
        bind_variable(ev, object, "p", input_value(ev, VALUE_VEC, IN_PX, 3));
        bind_variable(ev, object, "n", input_value(ev, VALUE_VEC, IN_NX, 3));
        bind_variable(ev, object, "uv", input_value(ev, VALUE_VEC, IN_U, 2));
        bind_variable(ev, object, "i", input_value(ev, VALUE_NUMBER, IN_I, 1));
    } else if (object->kind == OBJECT_FILM) {
        gather_first(ev, object, block, "fps");
        lower_fps(ev, object);
    }
}

void eval_node_begin(Eval *ev, Object *object, NodeId block) {
    object_begin(ev, object);
    eval_declare(ev, &object->env, block);
    bind_variables(ev, object, block);
    eval_gather(ev, &object->env, object, block);
}

// The nodes that have such a function: "mesh and surface"; NULL: none has.
static const char *owners_of(Eval *ev, const char *name) {
    const char *owners = NULL;
    for (int kind = 0; kind < OBJECT_KINDS; kind++) {
        for (uint32_t id = node_infos[kind].first; id < schema_end((ObjectKind)kind); id++) {
            const PropertyInfo *info = &property_infos[id];
            if (info->type == PROPERTY_TYPE_FUNCTION && strcmp(info->name, name) == 0) {
                owners = owners
                             ? arena_printf(ev->arena, "%s and %s", owners, node_infos[kind].name)
                             : node_infos[kind].name;
            }
        }
    }
    return owners;
}

static void refuse_helper(Eval *ev, const Object *object, Span where, const char *name,
                          const char *near) {
    const char *owners = near ? NULL : owners_of(ev, name);
    if (near || owners) {
        eval_error_at(ev, where,
                      near ? arena_printf(ev->arena, "did you mean '%s'?", near)
                           : arena_printf(ev->arena, "%s is a function of %s", name, owners),
                      "%s has no property '%s', and nothing uses this function", object->name,
                      name);
        diag_next_statement(ev->diag);
    }
}

// A `fn` that nobody uses and whose name is a property's elsewhere, or nearly one's here, was meant
// to be one.
static void check_helpers(Eval *ev, const Object *object) {
    const char *names[64];
    size_t n = schema_property_names(object->kind, names, 64), n_functions = 0;
    for (size_t i = 0; i < n; i++) {
        if (property_is_function(object, names[i])) {
            names[n_functions++] = names[i];
        }
    }
    const Scope *scope = object->env.scope;
    for (uint32_t i = 0; i < scope->n; i++) {
        const Binding *binding = &scope->bindings[i];
        const char *name = symbol_text(ev->symbols, binding->name);
        if (binding->kind != BINDING_FN || (binding->module->flags[binding->node] & MODULE_USED)) {
            continue;
        }
        const char *near = diag_nearest(name, names, n_functions);
        if (!near || strcmp(near, name) != 0) {
            refuse_helper(ev, object, binding->where, name, near);
        }
    }
}

static const char *object_label(Eval *ev, const Env *env, Place *place, const Object *object,
                                const Parts *parts) {
    if (parts->label) {
        const char *label = label_text(ev, env, parts, place);
        return label ? arena_printf(ev->arena, "%s%s", place->path, label) : NULL;
    }
    return arena_printf(ev->arena, "%s%s@%u%s", place->path, object->name,
                        source_line(ev->sources, object->where.lo), place->suffix);
}

static void refuse_args(Eval *ev, const Object *object) {
    const char *first = property_infos[node_infos[object->kind].first].name;
    bool has_own = node_infos[object->kind].first < schema_end(object->kind);
    eval_error_at(ev, object->where,
                  has_own ? arena_printf(ev->arena, "write %s { %s = ... }", object->name, first)
                          : NULL,
                  "%s takes no arguments in brackets", object->name);
}

static void finish_node(Eval *ev, const Env *env, const Place *place, Object *object,
                        const Parts *parts) {
    NodeClass class = node_infos[object->kind].class;
    Place within = place_within(ev, place, object);
    if (class == NODE_CLASS_GROUP) {
        if (parts->label) {
            const char *label = label_text(ev, env, parts, NULL);
            if (!label) {
                return;
            }
            within.path = arena_printf(ev->arena, "%s%s/", place->path, label);
        }
        eval_emit(ev, &object->env, &within, parts->block, true, object->name);
        return;
    }
    eval_emit(ev, &object->env, &within, parts->block, false, object->name);
    if (ev->unroll || ev->stopped) {
        return;
    }
    const char *label = object_label(ev, env, &within, object, parts);
    if (ev->body) {
        eval_body_take(ev, object, &within);
    } else if (label) {
        lower_object(ev, object, &within, label);
    }
}

static void eval_kind(Eval *ev, const Env *env, const Place *place, NodeId statement,
                      ObjectKind kind, const Parts *parts) {
    Object object = {.kind = kind, .name = node_infos[kind].name, .is_identity = true};
    unsigned n_errors = diag_n_errors(ev->diag);
    object.where = syntax_name_span(env->module->syntax, statement);
    object.env = (Env){env->module, scope_new(ev->arena, env->scope)};
    if (kind == OBJECT_FILM && lowered_film(ev, env->module, statement)) {
        return; // it was evaluated before everything else
    }
    if (node_infos[kind].class == NODE_CLASS_SETTING && !place->is_outermost) {
        eval_error_at(ev, object.where, NULL, "%s stands outermost, in no block", object.name);
        return;
    }
    if (kind == OBJECT_FILM && !ev->reads_film) {
        lower_misplaced_film(ev, &object);
        return;
    }
    if (parts->is_instance) {
        eval_error_at(ev, object.where, arena_printf(ev->arena, "write %s { }", object.name),
                      "instances are of defs, %s is a node", object.name);
        return;
    }
    if (parts->args) {
        refuse_args(ev, &object);
        return;
    }
    eval_node_begin(ev, &object, parts->block);
    if (node_infos[kind].status == SCHEMA_LATER) {
        eval_error_at(ev, object.where, NULL, "not supported yet: %s", object.name);
    } else {
        finish_node(ev, env, place, &object, parts);
    }
    if (diag_n_errors(ev->diag) == n_errors) {
        check_helpers(ev, &object);
    }
    object_end(ev, &object);
}

// ---- Copies of defs

static void emit_def(Eval *ev, const Place *place, Object *copy, const Binding *def, NodeId block) {
    Object body = {
        .kind = OBJECT_GROUP, .name = copy->name, .where = copy->where, .is_identity = true};
    body.env = (Env){def->module, scope_new(ev->arena, copy->arguments)};
    object_begin(ev, &body);
    eval_declare(ev, &body.env, block);
    clips_bind(ev, copy->clips, body.env.scope);
    eval_gather(ev, &body.env, &body, block);
    Place within = place_within(ev, place, &body);
    eval_emit(ev, &body.env, &within, block, true, body.name);
    object_end(ev, &body);
}

// Recursion that places itself twice doubles with each level; what is made by hand is not as deep.
enum { MAX_DEEP = 1 << 16 };

static bool enter_def(Eval *ev, Span where) {
    if (ev->calls >= EVAL_DEEP && ++ev->n_deep > MAX_DEEP) {
        eval_error_at(ev, where, "each level of a def that places itself multiplies them",
                      "more than %d copies of defs are nested more than %d deep", MAX_DEEP,
                      EVAL_DEEP);
        ev->stopped = true;
        return false;
    }
    if (ev->calls < EVAL_MAX_CALLS) {
        ev->calls++;
        return true;
    }
    if (ev->loops) {
        ev->unroll |= (2u << ev->loops->depth) - 1;
        return false;
    }
    eval_error_at(ev, where, "recursion must end while the scene is loaded",
                  "defs are nested more than %d deep", EVAL_MAX_CALLS);
    ev->stopped = true;
    return false;
}

// The copy's own block is evaluated: its arguments, then the def's block.
static void finish_copy(Eval *ev, const Env *env, const Place *place, NodeId statement,
                        Object *copy, const Binding *def, const Parts *parts) {
    if (!eval_bind(ev, env, statement, parts->args, def->module, def->node, copy->arguments)) {
        return;
    }
    Place within = place_within(ev, place, copy);
    if (parts->label) {
        const char *label = label_text(ev, env, parts, NULL);
        if (!label) {
            return;
        }
        within.path = arena_printf(ev->arena, "%s%s/", place->path, label);
    }
    eval_emit(ev, &copy->env, &within, parts->block, false, copy->name);
    if (!place_enter_instance(ev, &within, copy, parts->is_instance)) {
        return;
    }
    if (enter_def(ev, copy->where)) {
        unsigned n_errors = diag_n_errors(ev->diag);
        const Place *playing = ev->playing;
        ev->playing = within.clips ? &within : NULL;
        emit_def(ev, &within, copy, def, copy->def_block);
        ev->playing = playing;
        ev->calls--;
        eval_note_call(ev, n_errors, copy->where, def->module, def->node);
    }
}

static void eval_copy(Eval *ev, const Env *env, const Place *place, NodeId statement,
                      const Binding *found, Scope *at, const Parts *parts) {
    const Binding def = *found; // it moves when more names are bound in its scope
    const Env def_env = {def.module, at};
    const Node *node = syntax_node(def.module->syntax, def.node);
    Object copy = {.kind = OBJECT_INSTANCE,
                   .name = symbol_text(ev->symbols, def.name),
                   .is_identity = true,
                   .def_env = &def_env,
                   .def_params = def.module->syntax->extra[node->b],
                   .def_block = def.module->syntax->extra[node->b + 1],
                   .clips = clips_of_def(ev, at, found)};
    copy.where = syntax_name_span(env->module->syntax, statement);
    copy.env = (Env){env->module, scope_new(ev->arena, env->scope)};
    copy.arguments = scope_new(ev->arena, at);
    object_begin(ev, &copy);
    eval_declare(ev, &copy.env, parts->block);
    eval_gather(ev, &copy.env, &copy, parts->block);
    finish_copy(ev, env, place, statement, &copy, &def, parts);
    object_end(ev, &copy);
}

// ---- What a path names

static void unknown_object(Eval *ev, const Env *env, NodeId statement, const char *name) {
    const char *names[MAX_NAMES], *foreign = schema_foreign_word(NULL, name);
    size_t n = schema_node_names(names, MAX_NAMES);
    for (const Scope *scope = env->scope; scope; scope = scope->parent) {
        for (uint32_t i = 0; i < scope->n && n < MAX_NAMES; i++) {
            if (scope->bindings[i].kind == BINDING_DEF) {
                names[n++] = symbol_text(ev->symbols, scope->bindings[i].name);
            }
        }
    }
    const char *near = diag_nearest(name, names, n);
    eval_error_at(ev, syntax_name_span(env->module->syntax, statement),
                  foreign ? foreign
                  : near  ? arena_printf(ev->arena, "did you mean '%s'?", near)
                          : NULL,
                  foreign ? "there is no '%s' here" : "there is no node or def '%s'", name);
}

Binding *object_find(const Env *env, NodeId path, Scope **at) {
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, path);
    if (node->kind == NODE_NAME) {
        return scope_find(env->scope, node->a, at);
    }
    const Node *prefix = node->kind == NODE_MEMBER ? syntax_node(syntax, node->a) : node;
    Binding *module = prefix->kind == NODE_NAME ? scope_find(env->scope, prefix->a, at) : NULL;
    if (!module || module->kind != BINDING_MODULE) {
        *at = NULL;
        return NULL;
    }
    *at = module->members;
    return scope_find_own(*at, node->b);
}

// NULL: reported.
static Binding *find_def(Eval *ev, const Env *env, NodeId statement, NodeId path, Scope **at) {
    const Node *node = syntax_node(env->module->syntax, path);
    Span where = syntax_name_span(env->module->syntax, statement);
    Symbol name = node->kind == NODE_NAME ? node->a : node->b;
    Binding *binding = object_find(env, path, at);
    if (!*at && node->kind != NODE_NAME) {
        eval_error_at(ev, where, NULL, "what stands before '.' is no included file");
        return NULL;
    }
    if (!binding) {
        unknown_object(ev, env, statement, symbol_text(ev->symbols, name));
        return NULL;
    }
    if (binding->kind != BINDING_DEF) {
        eval_error_at(ev, where, NULL, "'%s' is not a def: nothing can be placed",
                      symbol_text(ev->symbols, name));
        if (binding->where.hi) {
            diag_note(ev->diag, binding->where, "defined here");
        }
        return NULL;
    }
    binding->module->flags[binding->node] |= MODULE_USED;
    return binding;
}

void eval_object(Eval *ev, const Env *env, const Place *place, NodeId statement) {
    Parts parts = parts_of(env, statement);
    const Node *path = syntax_node(env->module->syntax, parts.path);
    if (path->kind == NODE_NAME) {
        for (int kind = 0; kind < OBJECT_KINDS; kind++) {
            if (ev->kind_names[kind] == path->a) {
                eval_kind(ev, env, place, statement, (ObjectKind)kind, &parts);
                return;
            }
        }
    }
    Scope *at = NULL;
    Binding *def = find_def(ev, env, statement, parts.path, &at);
    if (def) {
        eval_copy(ev, env, place, statement, def, at, &parts);
    }
}
