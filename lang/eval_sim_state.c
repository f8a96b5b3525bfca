// SPDX-License-Identifier: Apache-2.0
// The block of a `sim state`: settings, start values, rates, events; as programs over its states.
#include <math.h>
#include <string.h>

#include "lang/dag_nodes.h"
#include "lang/eval_sim.h"
#include "lang/object.h"

enum { MAX_NAMES = 64, MAX_VARIABLES = 64, MAX_EVENTS = 256, MAX_ASSIGNED = 1024 };
enum { STATE_INPUTS = 1u << IN_T | 1u << IN_FILM_T | 1u << IN_I };

// A statement of the block, or of the choices and loops in it, where it stands.
typedef struct {
    Env env;
    NodeId statement;  // 0: none
    bool is_of_a_loop; // whose mistakes are reported once
} Line;

typedef struct {
    Line *all;
    uint32_t n;
    size_t capacity;
} Lines;

// A block under evaluation.
typedef struct {
    Eval *ev;
    Sim *sim;
    Env env;       // of the statement at hand
    Object object; // its settings
    Lines lines;
    Line born, dies;
    uint32_t n_states;
    Ref conditions[MAX_EVENTS], assigned[MAX_ASSIGNED];
    uint32_t assigned_when[MAX_ASSIGNED], assigned_state[MAX_ASSIGNED];
    uint32_t n_whens, n_assigned;
    bool is_bad;
} Block;

static const Node *node_of(const Block *b, NodeId node) {
    return syntax_node(b->env.module->syntax, node);
}

static const char *text_of(const Block *b, Symbol symbol) {
    return symbol_text(b->ev->symbols, symbol);
}

static Span name_of(const Block *b, NodeId statement) {
    return syntax_name_span(b->env.module->syntax, statement);
}

// ---- Expressions

// False: it reads what it must not (reported, or asked for).
static bool check_inputs(Block *b, NodeId node, const Value *value, const char *what,
                         uint32_t allowed) {
    uint32_t read = value_inputs(b->ev->dag, value) & ~allowed;
    if (read & LOOP_INPUTS) { // each copy is a simulation of its own
        b->ev->unroll |= (read & LOOP_INPUTS) >> IN_LOOP0;
        return false;
    }
    if (read) {
        eval_error(b->ev, &b->env, node, NULL, "%s can not depend on %s", what,
                   eval_input_name(read));
        return false;
    }
    return true;
}

static Value evaluate(Block *b, NodeId node, const char *what, uint32_t allowed) {
    Value value = eval_expr(b->ev, &b->env, node);
    if (value_is_poison(&value) || !check_inputs(b, node, &value, what, allowed)) {
        b->is_bad = true;
        return value_poison();
    }
    return value;
}

static SimVariable *find(const Block *b, Symbol name) {
    for (uint32_t i = 0; i < b->sim->n_variables; i++) {
        if (b->sim->variables[i].name == name) {
            return &b->sim->variables[i];
        }
    }
    return NULL;
}

static const char *nearest_state(const Block *b, const char *name) {
    const char *names[MAX_VARIABLES];
    for (uint32_t i = 0; i < b->sim->n_variables; i++) {
        names[i] = text_of(b, b->sim->variables[i].name);
    }
    const char *near = diag_nearest(name, names, b->sim->n_variables);
    return near ? arena_printf(b->ev->arena, "did you mean '%s'?", near) : NULL;
}

// ---- Statements

static void refuse(Block *b, NodeId statement, bool is_event) {
    const Node *s = node_of(b, statement);
    Span where = s->kind == NODE_OBJECT ? name_of(b, statement) : (Span){s->lo, s->lo + 1};
    eval_error_at(b->ev, where, NULL,
                  is_event ? "an event holds assignments to states: x = e"
                           : "'sim state' holds settings, start values x = e, rates x' = e, and "
                             "events when c { x = e }");
    b->is_bad = true;
}

static void gather(Block *b, Lines *lines, NodeId block, bool is_event, bool is_of_a_loop);

// The statements of a block within the one at hand; NULL value: it is not a loop's.
static void gather_within(Block *b, Lines *lines, NodeId loop, const Value *value, NodeId block,
                          bool is_event, bool is_of_a_loop) {
    Env outer = b->env;
    b->env = (Env){outer.module, scope_new(b->ev->arena, outer.scope)};
    if (value) {
        eval_bind_loop(b->ev, &b->env, loop, *value);
    }
    eval_declare(b->ev, &b->env, block);
    gather(b, lines, block, is_event, is_of_a_loop);
    b->env = outer;
}

static void gather_loop(Block *b, Lines *lines, NodeId loop, bool is_event) {
    Sequence sequence;
    unsigned n_errors = diag_n_errors(b->ev->diag); // the first value with a mistake is enough
    if (!eval_loop_sequence(b->ev, &b->env, loop, &sequence)) {
        b->is_bad = true;
        return;
    }
    NodeId block = eval_loop_block(&b->env, loop);
    for (uint32_t i = 0; i < sequence.n && diag_n_errors(b->ev->diag) == n_errors &&
                         eval_step(b->ev, &b->env, loop);
         i++) {
        Value value = sequence_item(b->ev, &sequence, i);
        gather_within(b, lines, loop, &value, block, is_event, true);
    }
}

// Adds what stands in a block, that of chosen and repeated blocks included.
static void gather(Block *b, Lines *lines, NodeId block, bool is_event, bool is_of_a_loop) {
    const Syntax *syntax = b->env.module->syntax;
    const Node node = *node_of(b, block);
    for (uint32_t i = 0; i < node.b; i++) {
        NodeId statement = syntax->extra[node.a + i], chosen;
        switch (node_of(b, statement)->kind) {
        case NODE_RATE:
        case NODE_WHEN:
            if (is_event) {
                refuse(b, statement, is_event);
                break;
            } // fall through
        case NODE_PROPERTY:
            lines->all = arena_grow(b->ev->arena, lines->all, lines->n, &lines->capacity,
                                    sizeof *lines->all);
            lines->all[lines->n++] = (Line){b->env, statement, is_of_a_loop};
            break;
        case NODE_LET:
        case NODE_FN:
            break;
        case NODE_FOR:
            gather_loop(b, lines, statement, is_event);
            break;
        case NODE_IF:
            chosen = eval_chosen_block(
                b->ev, &b->env, statement,
                "it is decided once, for all members: write c ? a : b in what is given");
            if (chosen) {
                gather_within(b, lines, 0, NULL, chosen, is_event, is_of_a_loop);
            }
            break;
        default:
            refuse(b, statement, is_event);
            break;
        }
        eval_statement_ends(b->ev);
    }
}

// Whether it is a statement of that kind that is to be read; it becomes the one at hand.
static bool take_line(Block *b, const Line *line, NodeKind kind) {
    b->env = line->env;
    return node_of(b, line->statement)->kind == kind && !(line->is_of_a_loop && b->is_bad);
}

// ---- Start values and settings

static void add_state(Block *b, NodeId statement) {
    Eval *ev = b->ev;
    const Node *s = node_of(b, statement);
    const char *name = text_of(b, s->a);
    SimVariable *old = find(b, s->a);
    if (old || b->sim->n_variables == MAX_VARIABLES || strcmp(name, "t") == 0 ||
        strcmp(name, "T") == 0 || strcmp(name, "id") == 0 || strcmp(name, "alive") == 0) {
        eval_error_at(ev, name_of(b, statement), NULL,
                      old                                   ? "%s is given twice"
                      : b->sim->n_variables < MAX_VARIABLES ? "a state can not be called '%s'"
                                                            : "'%s' is one state too many",
                      name);
        b->is_bad = true;
        return;
    }
    Value start = evaluate(b, s->b, "a start value", 1u << IN_I);
    bool is_plain = value_is_numeric(&start) && !value_is(&start, VALUE_TRANSFORM);
    if (!value_is_poison(&start) && !is_plain) {
        eval_error(ev, &b->env, s->b, NULL,
                   "a state is a number, an angle, a vector, a color or a rotation, this is %s",
                   value_describe(ev->arena, &start));
        b->is_bad = true;
        start = value_poison();
    }
    start.dimension = DIMENSION_NONE;
    SimVariable *variable = &b->sim->variables[b->sim->n_variables++];
    *variable =
        (SimVariable){.name = s->a, .start = start, .first = b->n_states, .statement = statement};
    b->n_states += start.n;
}

static void read_property(Block *b, NodeId statement) {
    const Node *s = node_of(b, statement);
    PropertyId id = schema_property(OBJECT_SIM_STATE, text_of(b, s->a));
    if (id == PROPERTY_SIM_STATE_BORN || id == PROPERTY_SIM_STATE_DIES) {
        Line *at = id == PROPERTY_SIM_STATE_BORN ? &b->born : &b->dies;
        if (at->statement) {
            eval_error_at(b->ev, name_of(b, statement), NULL, "%s is given twice",
                          text_of(b, s->a));
            b->is_bad = true;
        }
        *at = (Line){b->env, statement, false};
    } else if (id != PROPERTY_COUNT) {
        eval_property(b->ev, &b->env, &b->object, statement);
    } else {
        add_state(b, statement);
    }
}

static void read_starts(Block *b) {
    for (uint32_t i = 0; i < b->lines.n; i++) {
        if (take_line(b, &b->lines.all[i], NODE_PROPERTY)) {
            read_property(b, b->lines.all[i].statement);
        }
        eval_statement_ends(b->ev);
    }
}

static double number_of(Block *b, PropertyId id, double otherwise) {
    Value value = object_value(b->ev, &b->object, id);
    double x = otherwise;
    if (!value_is_poison(&value)) {
        dag_is_const(b->ev->dag, value.ref[0], &x);
    }
    return x;
}

static void read_settings(Block *b) {
    Eval *ev = b->ev;
    SimState *spec = &b->sim->spec;
    const Given *span = object_given(&b->object, PROPERTY_SIM_STATE_SPAN);
    b->sim->has_count = object_given(&b->object, PROPERTY_SIM_STATE_COUNT) != NULL;
    spec->n_members = (uint32_t)number_of(b, PROPERTY_SIM_STATE_COUNT, 1);
    spec->tolerance = number_of(b, PROPERTY_SIM_STATE_TOLERANCE, 1e-6);
    spec->is_stiff = number_of(b, PROPERTY_SIM_STATE_STIFF, 0) != 0;
    b->is_bad = !eval_sim_span(ev, span, &spec->low, &spec->high) || b->is_bad;
    for (uint32_t i = 0; i < b->object.n_given; i++) {
        b->is_bad = b->is_bad || value_is_poison(&b->object.given[i].value);
    }
}

// ---- States as names

static void bind_states(Block *b) {
    Eval *ev = b->ev;
    Sim *sim = b->sim;
    SimState *spec = &sim->spec;
    Ref id = dag_input(ev->dag, IN_I), any = dag_input(ev->dag, IN_X);
    spec->n_states = b->n_states;
    spec->there = ARENA_ARRAY(ev->arena, spec->n_members, double);
    spec->live = ARENA_ARRAY(ev->arena, (size_t)spec->n_states * spec->n_members, double);
    for (uint32_t i = 0; i < sim->n_variables; i++) {
        SimVariable *variable = &sim->variables[i];
        Ref each[4];
        for (uint32_t k = 0; k < variable->start.n; k++) {
            uint32_t state = variable->first + k;
            each[k] = dag_live(ev->dag, any, spec->live + (size_t)state * spec->n_members,
                               spec->n_members, state);
            variable->own[k] = dag_substitute(ev->dag, each[k], IN_X, id);
        }
        if (!value_is_poison(&variable->start)) {
            variable->value = sim_state_value(ev, variable, variable->own);
            variable->each = sim_state_value(ev, variable, each);
        }
        Binding *old = scope_find_own(b->env.scope, variable->name);
        if (old && old->node) {
            eval_error_at(ev, name_of(b, variable->statement), NULL, "'%s' is defined twice",
                          text_of(b, variable->name));
            diag_note(ev->diag, old->where, "first defined here");
            b->is_bad = true;
            continue;
        }
        scope_bind(ev->arena, b->env.scope, variable->name, BINDING_ARGUMENT)->value =
            variable->value;
    }
}

// ---- Rates and events

static bool is_alike(const Value *a, const Value *b) {
    bool are_vectors = value_is_vec3(a) && value_is_vec3(b);
    return (a->type == b->type && a->n == b->n) || are_vectors;
}

// What a state gets; poison: reported.
static Value evaluate_for(Block *b, NodeId node, const SimVariable *variable, const char *what) {
    Value value = evaluate(b, node, what, STATE_INPUTS);
    if (value_is_poison(&value) || value_is_poison(&variable->start)) {
        return value_poison();
    }
    if (!is_alike(&value, &variable->start)) {
        eval_error(b->ev, &b->env, node, NULL,
                   "%s of '%s' is %s, as its start value is; this is %s", what,
                   text_of(b, variable->name), value_describe(b->ev->arena, &variable->start),
                   value_describe(b->ev->arena, &value));
        b->is_bad = true;
        return value_poison();
    }
    return value;
}

// How fast a rotation changes that turns with an angular velocity (poison: reported): half of that
// times it, which keeps its length.
static Value evaluate_spin(Block *b, NodeId node, const SimVariable *variable) {
    Dag *dag = b->ev->dag;
    Value spin = evaluate(b, node, "the rate", STATE_INPUTS);
    if (value_is_poison(&spin)) {
        return spin;
    }
    if (!value_is_vec3(&spin)) {
        b->is_bad = true;
        return eval_error(b->ev, &b->env, node, NULL,
                          "the rate of '%s' is its angular velocity, a vector, this is %s",
                          text_of(b, variable->name), value_describe(b->ev->arena, &spin));
    }
    Ref3 half = spatial_scale(dag, value_ref3(&spin), dag_const(dag, 0.5));
    const Ref *q = variable->own;
    return value_from_quat(spatial_quat_mul(dag,
                                            (RefQuat){half.x, half.y, half.z, dag_const(dag, 0)},
                                            (RefQuat){q[0], q[1], q[2], q[3]}));
}

static SimVariable *state_of(Block *b, NodeId statement, const char *what) {
    const Node *s = node_of(b, statement);
    SimVariable *variable = find(b, s->a);
    if (!variable) {
        const char *name = text_of(b, s->a), *near = nearest_state(b, name);
        eval_error_at(b->ev, name_of(b, statement),
                      near ? near : arena_printf(b->ev->arena, "write %s = ... as well", name),
                      "'%s' has %s, but no start value", name, what);
        b->is_bad = true;
    }
    return variable;
}

static void read_rate(Block *b, NodeId statement, Ref *rates) {
    SimVariable *variable = state_of(b, statement, "a rate");
    if (!variable) {
        return;
    }
    if (variable->rate) {
        eval_error_at(b->ev, name_of(b, statement), NULL, "the rate of '%s' is given twice",
                      text_of(b, variable->name));
        b->is_bad = true;
        return;
    }
    variable->rate = statement;
    NodeId node = node_of(b, statement)->b;
    Value rate = value_is(&variable->start, VALUE_ROTATION)
                     ? evaluate_spin(b, node, variable)
                     : evaluate_for(b, node, variable, "the rate");
    for (uint32_t k = 0; k < rate.n; k++) {
        rates[variable->first + k] = rate.ref[k];
    }
}

// A number that is below 0 where the condition is true, and passes 0 where it changes.
static Ref root_of(Dag *dag, Ref condition) {
    const DagNode node = dag->nodes[condition];
    Ref a, b;
    switch ((Op)node.op) {
    case OP_LT:
    case OP_LE:
        return dag_op(dag, OP_SUB, node.a, node.b, REF_NONE);
    case OP_NOT:
        return dag_op(dag, OP_NEG, root_of(dag, node.a), REF_NONE, REF_NONE);
    case OP_AND:
    case OP_OR:
        a = root_of(dag, node.a);
        b = root_of(dag, dag->nodes[condition].b);
        return dag_op(dag, node.op == OP_AND ? OP_MAX : OP_MIN, a, b, REF_NONE);
    default:
        return dag_op(dag, OP_SELECT, condition, dag_const(dag, -1), dag_const(dag, 1));
    }
}

static void read_assignment(Block *b, NodeId statement) {
    SimVariable *variable = state_of(b, statement, "an assignment");
    if (!variable) {
        return;
    }
    variable->is_assigned = true;
    Value value = evaluate_for(b, node_of(b, statement)->b, variable, "a new value");
    for (uint32_t k = 0; k < value.n; k++) {
        if (b->n_assigned == MAX_ASSIGNED) {
            eval_error_at(b->ev, name_of(b, statement), NULL, "more than %d assignments",
                          MAX_ASSIGNED);
            b->is_bad = true;
            return;
        }
        b->assigned[b->n_assigned] = value.ref[k];
        b->assigned_when[b->n_assigned] = b->n_whens - 1;
        b->assigned_state[b->n_assigned++] = variable->first + k;
    }
}

static void read_event(Block *b, NodeId statement) {
    Eval *ev = b->ev;
    const Node *s = node_of(b, statement);
    Value condition = evaluate(b, s->a, "the condition", STATE_INPUTS);
    if (!value_is_poison(&condition) && !value_is(&condition, VALUE_BOOL)) {
        eval_error(ev, &b->env, s->a, NULL, "the condition of 'when' is true or false, this is %s",
                   value_describe(ev->arena, &condition));
        b->is_bad = true;
    }
    if (b->n_whens == MAX_EVENTS) {
        eval_error_at(ev, (Span){s->lo, s->lo + 4}, NULL, "more than %d events", MAX_EVENTS);
        b->is_bad = true;
        return;
    }
    bool is_bool = value_is(&condition, VALUE_BOOL);
    b->conditions[b->n_whens++] = is_bool ? root_of(ev->dag, condition.ref[0]) : REF_NONE;
    Lines lines = {0};
    Env outer = b->env;
    gather_within(b, &lines, 0, NULL, s->b, true, false);
    for (uint32_t i = 0; i < lines.n; i++) {
        if (take_line(b, &lines.all[i], NODE_PROPERTY)) {
            read_assignment(b, lines.all[i].statement);
        }
        eval_statement_ends(ev);
    }
    b->env = outer;
}

static void read_dynamics(Block *b, Ref *rates) {
    for (uint32_t i = 0; i < b->lines.n; i++) {
        const Line *line = &b->lines.all[i];
        if (take_line(b, line, NODE_RATE)) {
            read_rate(b, line->statement, rates);
        } else if (take_line(b, line, NODE_WHEN)) {
            read_event(b, line->statement);
        }
        eval_statement_ends(b->ev);
    }
    b->env = b->object.env;
    for (uint32_t i = 0; i < b->sim->n_variables; i++) {
        const SimVariable *variable = &b->sim->variables[i];
        const char *names[MAX_NAMES], *name = text_of(b, variable->name);
        if (!variable->rate && !variable->is_assigned) {
            const char *near = diag_nearest(
                name, names, schema_property_names(OBJECT_SIM_STATE, names, MAX_NAMES));
            eval_error_at(
                b->ev, name_of(b, variable->statement),
                near ? arena_printf(b->ev->arena, "did you mean '%s'?", near)
                     : arena_printf(b->ev->arena, "write %s' = ..., or let %s = ...", name, name),
                "'%s' has no rate, and no event assigns to it", name);
            eval_statement_ends(b->ev);
            b->is_bad = true;
        }
    }
}

// ---- Programs

// Also adds to the key what it computes.
static const Program *compile(Block *b, const Ref *refs, uint32_t n) {
    hash_add(&b->sim->key, &n, sizeof n);
    dag_hash(b->ev->dag, refs, n, &b->sim->key);
    return dag_compile(b->ev->dag, b->ev->arena, refs, n);
}

static void compile_life(Block *b) {
    Dag *dag = b->ev->dag;
    Ref life[2] = {dag_const(dag, -INFINITY), dag_const(dag, INFINITY)};
    const Line *lines[2] = {&b->born, &b->dies};
    for (int i = 0; i < 2; i++) {
        b->env = lines[i]->statement ? lines[i]->env : b->object.env;
        NodeId node = lines[i]->statement ? node_of(b, lines[i]->statement)->b : 0;
        Value value = node ? evaluate(b, node, i ? "dies" : "born", 1u << IN_I)
                           : value_scalar(VALUE_NUMBER, life[i]);
        bool is_time = value_is(&value, VALUE_NUMBER) &&
                       (!value.dimension || value.dimension == DIMENSION_TIME);
        if (!value_is_poison(&value) && !is_time) {
            eval_error(b->ev, &b->env, node, NULL, "%s is a time, this is %s", i ? "dies" : "born",
                       value_describe(b->ev->arena, &value));
            b->is_bad = true;
        } else if (is_time) {
            life[i] = value.ref[0];
        }
        eval_statement_ends(b->ev);
    }
    b->env = b->object.env;
    if (!b->is_bad && (b->born.statement || b->dies.statement)) {
        b->sim->spec.life = compile(b, life, 2);
    }
}

static uint32_t *copied(Block *b, const uint32_t *from, uint32_t n) {
    uint32_t *to = ARENA_ARRAY(b->ev->arena, n, uint32_t);
    for (uint32_t i = 0; i < n; i++) {
        to[i] = from[i];
    }
    hash_add(&b->sim->key, to, n * sizeof *to);
    return to;
}

static void compile_all(Block *b, const Ref *rates) {
    Sim *sim = b->sim;
    SimState *spec = &sim->spec;
    Ref *starts = ARENA_ARRAY(b->ev->arena, spec->n_states, Ref);
    for (uint32_t i = 0; i < sim->n_variables; i++) {
        memcpy(starts + sim->variables[i].first, sim->variables[i].start.ref,
               sim->variables[i].start.n * sizeof *starts);
    }
    spec->n_whens = b->n_whens;
    spec->n_assigned = b->n_assigned;
    spec->start = compile(b, starts, spec->n_states);
    spec->rates = compile(b, rates, spec->n_states);
    spec->conditions = b->n_whens ? compile(b, b->conditions, b->n_whens) : NULL;
    spec->assigned = b->n_assigned ? compile(b, b->assigned, b->n_assigned) : NULL;
    Dag *dag = b->ev->dag;
    spec->reads[SIM_RATES] = sim_reads(dag, rates, spec->n_states, spec->n_members);
    spec->reads[SIM_CONDITIONS] = sim_reads(dag, b->conditions, b->n_whens, spec->n_members);
    spec->reads[SIM_ASSIGNED] = sim_reads(dag, b->assigned, b->n_assigned, spec->n_members);
    spec->is_coupled =
        spec->reads[SIM_RATES] || spec->reads[SIM_CONDITIONS] || spec->reads[SIM_ASSIGNED];
    spec->assigned_when = copied(b, b->assigned_when, b->n_assigned);
    spec->assigned_state = copied(b, b->assigned_state, b->n_assigned);
    const double numbers[] = {spec->low,      spec->high,       spec->tolerance,
                              spec->is_stiff, spec->n_states,   spec->n_members,
                              spec->n_whens,  spec->is_coupled, spec->life != NULL};
    hash_add(&sim->key, numbers, sizeof numbers);
}

bool eval_sim_state(Eval *ev, Sim *sim) {
    Block *b = ARENA_NEW(ev->arena, Block);
    *b = (Block){.ev = ev, .sim = sim};
    b->env = (Env){sim->module, sim->within};
    b->object = (Object){.kind = OBJECT_SIM_STATE,
                         .name = "sim state",
                         .env = b->env,
                         .where = name_of(b, sim->statement),
                         .is_identity = true};
    sim->variables = ARENA_ARRAY(ev->arena, MAX_VARIABLES, SimVariable);
    sim->n_variables = 0;
    sim->alive_within = NULL;
    sim->spec = (SimState){0};
    sim->key = (Hash128){0};
    eval_declare(ev, &b->env, sim->block);
    scope_bind(ev->arena, b->env.scope, symbol_of(ev->symbols, "id", 2), BINDING_ARGUMENT)->value =
        value_scalar(VALUE_NUMBER, dag_input(ev->dag, IN_I));
    object_begin(ev, &b->object);
    unsigned n_errors = diag_n_errors(ev->diag);
    gather(b, &b->lines, sim->block, false, false);
    read_starts(b);
    b->env = b->object.env;
    read_settings(b);
    b->is_bad = b->is_bad || ev->unroll || diag_n_errors(ev->diag) > n_errors;
    if (sim->n_variables == 0 && !b->is_bad) {
        eval_error_at(ev, b->object.where, "write x = 0  x' = 1", "the simulation has no states");
        b->is_bad = true;
    }
    if (!b->is_bad) {
        compile_life(b); // which reads no states
        bind_states(b);
        Ref *rates = ARENA_ARRAY(ev->arena, b->n_states, Ref);
        for (uint32_t i = 0; i < b->n_states; i++) {
            rates[i] = dag_const(ev->dag, 0);
        }
        SimNears *outer = ev->nears, *nears = sim_nears_new(ev, sim);
        ev->nears = nears;
        read_dynamics(b, rates);
        ev->nears = outer;
        b->is_bad = b->is_bad || ev->unroll || diag_n_errors(ev->diag) > n_errors;
        if (!b->is_bad) {
            compile_all(b, rates);
            sim_nears_finish(ev, nears);
        }
    }
    object_end(ev, &b->object);
    return !b->is_bad;
}
