// SPDX-License-Identifier: Apache-2.0
// Simulations by name, and their members as motions.
#include "lang/eval_sim.h"

#include <math.h>
#include <string.h>

#include "lang/lower_parts.h"
#include "lang/object.h"
#include "lang/watch.h"

enum { MAX_NAMES = 64 };

void eval_sim_declare(Eval *ev, const Env *env, NodeId statement) {
    const Syntax *syntax = env->module->syntax;
    const uint32_t *extra = syntax->extra + syntax_node(syntax, statement)->a;
    Binding *binding = eval_bind_name(ev, env, statement, extra[2], BINDING_SIM);
    if (binding) {
        Sim *sim = ARENA_NEW(ev->arena, Sim);
        *sim = (Sim){.name = extra[2],
                     .module = env->module,
                     .scope = env->scope,
                     .statement = statement,
                     .block = extra[4]};
        binding->where = syntax_word_span(syntax, extra[3]);
        binding->sim = sim;
    }
}

// ---- Evaluating and running

bool eval_sim_span(Eval *ev, const Given *given, double *low, double *high) {
    const FilmSettings *film = &ev->lowering->scene->film;
    *low = 0;
    *high = fmax((double)(film->last_frame + 1), 1) / film->fps;
    if (!given || !value_is(&given->value, VALUE_RANGE)) {
        return !given;
    }
    dag_is_const(ev->dag, given->value.range->low, low);
    dag_is_const(ev->dag, given->value.range->high, high);
    if (*low < *high) {
        return true;
    }
    eval_error(ev, &given->env, given->node, NULL,
               "the span is empty: it goes from %.9g s to %.9g s", *low, *high);
    return false;
}

static const char *kind_of(Eval *ev, const Sim *sim) {
    const Syntax *syntax = sim->module->syntax;
    return symbol_text(ev->symbols, syntax->extra[syntax_node(syntax, sim->statement)->a]);
}

static Span name_span(const Sim *sim) {
    const Syntax *syntax = sim->module->syntax;
    return syntax_word_span(syntax, syntax->extra[syntax_node(syntax, sim->statement)->a + 3]);
}

static bool build(Eval *ev, Sim *sim) {
    const Syntax *syntax = sim->module->syntax;
    Span kind = syntax_word_span(syntax, syntax->extra[syntax_node(syntax, sim->statement)->a + 1]);
    if (sim->state == BINDING_DONE) {
        return !sim->is_bad;
    }
    sim->is_rigid = strcmp(kind_of(ev, sim), "rigid") == 0;
    if (!sim->is_rigid && strcmp(kind_of(ev, sim), "state") != 0) {
        eval_error_at(ev, kind, "write sim state or sim rigid", "there is no sim %s",
                      kind_of(ev, sim));
        sim->is_bad = true;
    } else {
        diag_next_statement(ev->diag); // its mistakes are its own
        sim->state = BINDING_BUSY;
        sim->within = scope_new(ev->arena, sim->scope);
        sim->is_bad = !(sim->is_rigid ? eval_sim_rigid(ev, sim) : eval_sim_state(ev, sim));
        diag_next_statement(ev->diag);
    }
    // What must be known, and is within a batched loop, is asked for again.
    sim->state = sim->is_bad && ev->unroll ? BINDING_FRESH : BINDING_DONE;
    return !sim->is_bad;
}

static const char *member_text(Eval *ev, const Sim *sim, uint32_t member) {
    const char *name = symbol_text(ev->symbols, sim->name);
    for (uint32_t g = 0; g < sim->n_groups; g++) {
        const SimGroup *group = &sim->groups[g];
        for (uint32_t i = 0; i < group->n && !group->places; i++) {
            if (group->members[i] == member) {
                const char *body = symbol_text(ev->symbols, group->name);
                return group->is_list ? arena_printf(ev->arena, "%s.%s[%u]", name, body, i)
                                      : arena_printf(ev->arena, "%s.%s", name, body);
            }
        }
    }
    return sim->has_count ? arena_printf(ev->arena, "%s, member %u", name, member) : name;
}

static void find_alive(Eval *ev, Sim *sim);

static bool run(Eval *ev, Sim *sim) {
    SimFailure failure;
    if (sim->has_run || sim->is_bad) {
        return !sim->is_bad;
    }
    sim->has_run = true;
    const SimJob job = {symbol_text(ev->symbols, sim->name), sim->is_rigid ? NULL : &sim->spec,
                        sim->is_rigid ? &sim->rigid : NULL, sim->key};
    if (!ev->simulator) {
        eval_error_at(ev, name_span(sim), NULL, "simulations are not run here");
        sim->is_bad = true;
        return false;
    }
    if (!ev->simulator->run(ev->simulator->context, lower_arena(ev), &job, &sim->tracks,
                            &failure)) {
        eval_error_at(ev, name_span(sim), NULL, "%s: at t = %.6g s %s",
                      member_text(ev, sim, failure.member), failure.time, failure.message);
        sim->is_bad = true;
        return false;
    }
    if (sim->tracks.n_resting) {
        diag_warn(ev->diag, WARN_SIM_RESTS, name_span(sim), NULL,
                  "%s rests from t = %.6g s on: too many events follow each other%s",
                  member_text(ev, sim, sim->tracks.first_resting), sim->tracks.rest_time,
                  sim->tracks.n_resting > 1
                      ? arena_printf(ev->arena, "; so do %u more", sim->tracks.n_resting - 1)
                      : "");
    }
    uint32_t n = sim->tracks.n_columns;
    sim->columns = ARENA_ARRAY(ev->arena, n, Ref);
    for (uint32_t i = 0; i < n; i++) {
        sim->columns[i] = REF_NONE;
    }
    find_alive(ev, sim);
    return true;
}

void eval_sim_emit(Eval *ev, const Env *env, NodeId statement) {
    const Syntax *syntax = env->module->syntax;
    Symbol name = syntax->extra[syntax_node(syntax, statement)->a + 2];
    Binding *binding = scope_find_own(env->scope, name);
    if (!binding || binding->kind != BINDING_SIM || binding->sim->statement != statement) {
        return; // the name is another's (reported)
    }
    Sim *sim = binding->sim;
    if (build(ev, sim) && ev->simulator && ev->simulator->runs_all) {
        run(ev, sim);
    }
}

// ---- Graphs of what came of it

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref of_member(Dag *dag, const Sim *sim, const double *values) {
    return dag_table_op(dag, OP_TABLE, dag_input(dag, IN_X), values, sim->tracks.n_members);
}

static void find_alive(Eval *ev, Sim *sim) {
    Dag *dag = ev->dag;
    const SimTracks *tracks = &sim->tracks;
    Ref t = dag_input(dag, IN_T), alive = dag_const(dag, 1);
    bool is_born = false, dies = false;
    for (uint32_t m = 0; m < tracks->n_members; m++) {
        is_born = is_born || tracks->born[m] > -INFINITY;
        dies = dies || tracks->dies[m] < INFINITY;
    }
    if (is_born) {
        alive = op2(dag, OP_AND, alive, op2(dag, OP_LE, of_member(dag, sim, tracks->born), t));
    }
    if (dies) {
        alive = op2(dag, OP_AND, alive, op2(dag, OP_LT, t, of_member(dag, sim, tracks->dies)));
    }
    sim->alive = alive;
}

Value sim_state_value(Eval *ev, const SimVariable *variable, const Ref *scalars) {
    Value value = value_like(ev->arena, &variable->start, scalars);
    if (value_is(&value, VALUE_ROTATION)) { // an error may have made it longer or shorter
        value = value_from_quat(spatial_quat_normalize(ev->dag, value_quat(&value)));
    }
    return value;
}

// Scalar i of the member IN_X at t.
static Ref column(Eval *ev, Sim *sim, uint32_t i) {
    Dag *dag = ev->dag;
    const SimTracks *s = &sim->tracks;
    if (sim->columns[i] != REF_NONE) {
        return sim->columns[i];
    }
    Ref t = dag_input(dag, IN_T), spacing = dag_const(dag, s->spacing);
    Ref local = op2(dag, OP_MAX, t, of_member(dag, sim, s->birth));
    local = op2(dag, OP_MIN, local, of_member(dag, sim, s->end));
    Ref since = op2(dag, OP_SUB, local, dag_const(dag, s->low));
    Ref arc = dag_input(dag, IN_X);
    if (s->n_arcs > s->n_members) {
        Ref key = op2(dag, OP_ADD, op2(dag, OP_MUL, arc, spacing), since);
        arc = dag_table_op(dag, OP_SEARCH, key, s->arc_key, s->n_arcs);
    }
    Ref key = op2(dag, OP_ADD, op2(dag, OP_MUL, arc, spacing), since);
    Ref piece = dag_search_unseen(dag, key, s->piece_key, s->n_pieces);
    Ref progress = op2(dag, OP_SUB, local, dag_column(dag, piece, s->piece_start, s->n_pieces));
    progress = op2(dag, OP_MUL, progress, dag_column(dag, piece, s->piece_rate, s->n_pieces));
    Ref sum = REF_NONE;
    for (uint32_t k = s->n_coefficients; k-- > 0;) {
        size_t at = ((size_t)i * s->n_coefficients + k) * s->n_pieces;
        Ref c = dag_column(dag, piece, s->coefficient + at, s->n_pieces);
        sum = sum == REF_NONE ? c : op2(dag, OP_ADD, op2(dag, OP_MUL, sum, progress), c);
    }
    sim->columns[i] = sum;
    return sum;
}

// ---- Members

static Value at_index(Eval *ev, const Value *each, Ref index) {
    Ref refs[12];
    for (uint32_t k = 0; k < each->n; k++) {
        refs[k] = dag_substitute(ev->dag, value_refs(each)[k], IN_X, index);
    }
    return value_like(ev->arena, each, refs);
}

Ref sim_index(Dag *dag, Ref index, uint32_t n) {
    index = dag_op(dag, OP_FLOOR, index, REF_NONE, REF_NONE);
    index = op2(dag, OP_MAX, index, dag_const(dag, 0));
    return op2(dag, OP_MIN, index, dag_const(dag, n - 1.0));
}

Value eval_sim_at(Eval *ev, const List *list, Ref index) {
    Dag *dag = ev->dag;
    if (!eval_copies_within(ev, index, 0, list->n - 1.0)) {
        return value_poison();
    }
    return at_index(ev, list->each, sim_index(dag, index, list->n));
}

static Value list_value(Eval *ev, uint32_t n, const Value *each, Ref alive) {
    List *list = ARENA_NEW(ev->arena, List);
    Value *items = ARENA_ARRAY(ev->arena, n, Value);
    Value *model = ARENA_NEW(ev->arena, Value);
    *model = *each;
    *list = (List){.n = n, .items = items, .each = model, .alive = alive};
    for (uint32_t m = 0; m < list->n; m++) {
        items[m] = at_index(ev, each, dag_const(ev->dag, m));
        list->inputs |= value_inputs(ev->dag, &items[m]);
    }
    ev->steps += list->n;
    return (Value){.type = VALUE_LIST, .list = list};
}

static Value member_value(Eval *ev, Sim *sim, const Value *each) {
    if (sim->has_count) {
        return list_value(ev, sim->spec.n_members, each, sim->alive);
    }
    return at_index(ev, each, dag_const(ev->dag, 0));
}

static SimVariable *find_variable(Eval *ev, Sim *sim, const char *name) {
    for (uint32_t i = 0; i < sim->n_variables; i++) {
        if (strcmp(symbol_text(ev->symbols, sim->variables[i].name), name) == 0) {
            return &sim->variables[i];
        }
    }
    return NULL;
}

static Value unknown_member(Eval *ev, const Env *env, NodeId node, const Sim *sim,
                            const char *member) {
    const char *names[MAX_NAMES];
    uint32_t n = 0;
    for (uint32_t g = 0; g < sim->n_groups && n + 1 < MAX_NAMES; g++) {
        names[n++] = symbol_text(ev->symbols, sim->groups[g].name);
    }
    for (uint32_t i = 0; i < sim->n_variables && n + 1 < MAX_NAMES; i++) {
        names[n++] = symbol_text(ev->symbols, sim->variables[i].name);
    }
    if (!sim->is_rigid) {
        names[n++] = "alive";
    }
    const char *near = diag_nearest(member, names, n);
    return eval_error(ev, env, node,
                      near ? arena_printf(ev->arena, "did you mean '%s'?", near) : NULL,
                      "%s has no member '%s'", symbol_text(ev->symbols, sim->name), member);
}

// Within its own block: the states of all members at the instant at hand, or who is there.
static Value member_within(Eval *ev, const Env *env, NodeId node, Sim *sim, SimVariable *variable,
                           const char *member) {
    Dag *dag = ev->dag;
    bool is_alive = !variable && strcmp(member, "alive") == 0;
    if (!variable && !is_alive) {
        return unknown_member(ev, env, node, sim, member);
    }
    if (!sim->spec.there) { // its states are not bound yet
        return eval_error(ev, env, node, NULL,
                          "start values, born and dies can not read the members");
    }
    Ref there =
        dag_live(dag, dag_input(dag, IN_X), sim->spec.there, sim->spec.n_members, SIM_LIVE_THERE);
    Value alive = value_scalar(VALUE_BOOL, op2(dag, OP_LT, dag_const(dag, 0.5), there));
    const Value *each = is_alive ? &alive : &variable->each;
    const List **list = is_alive ? &sim->alive_within : &variable->within;
    if (!sim->has_count) {
        return at_index(ev, each, dag_const(dag, 0));
    }
    if (!*list) {
        *list = list_value(ev, sim->spec.n_members, each, dag_const(dag, 1)).list;
    }
    return (Value){.type = VALUE_LIST, .list = *list};
}

// Before it begins nothing has happened yet: only what comes after its end is worth a word.
static void note_end(Eval *ev, const Env *env, NodeId node, const Sim *sim) {
    watch_end(ev, syntax_span(env->module->syntax, node), symbol_text(ev->symbols, sim->name),
              sim->tracks.high);
}

static Value fixed_value(Eval *ev, SimGroup *group) {
    if (!group->is_list) {
        return group->places[0];
    }
    if (!group->values) {
        List *list = ARENA_NEW(ev->arena, List);
        *list = (List){.n = group->n, .items = group->places};
        for (uint32_t i = 0; i < group->n; i++) {
            list->inputs |= value_inputs(ev->dag, &group->places[i]);
        }
        group->values = list;
    }
    return (Value){.type = VALUE_LIST, .list = group->values};
}

// Where the bodies of a label are: transforms.
static Value bodies_value(Eval *ev, const Env *env, NodeId node, Sim *sim, SimGroup *group) {
    Dag *dag = ev->dag;
    if (group->places) {
        return fixed_value(ev, group);
    }
    if (!run(ev, sim)) {
        return value_poison();
    }
    note_end(ev, env, node, sim);
    if (group->values) {
        return (Value){.type = VALUE_LIST, .list = group->values};
    }
    double *members = ARENA_ARRAY(ev->arena, group->n, double);
    for (uint32_t i = 0; i < group->n; i++) {
        members[i] = group->members[i];
    }
    Ref member = dag_table_op(dag, OP_TABLE, dag_input(dag, IN_X), members, group->n);
    Ref c[RIGID_COLUMNS];
    for (uint32_t k = 0; k < RIGID_COLUMNS; k++) {
        c[k] = dag_substitute(dag, column(ev, sim, k), IN_X, member);
    }
    RefQuat turn = spatial_quat_normalize(dag, (RefQuat){c[3], c[4], c[5], c[6]});
    RefMap map = spatial_map_quat(dag, turn);
    for (int k = 0; k < 3; k++) {
        map.m[k][3] = c[k];
    }
    Value each = value_transform(ev->arena, &map);
    if (!group->is_list) {
        return at_index(ev, &each, dag_const(dag, 0));
    }
    group->values = list_value(ev, group->n, &each, dag_const(dag, 1)).list;
    return (Value){.type = VALUE_LIST, .list = group->values};
}

static Value rigid_member(Eval *ev, const Env *env, NodeId node, Sim *sim, const char *member) {
    for (uint32_t g = 0; g < sim->n_groups; g++) {
        if (strcmp(symbol_text(ev->symbols, sim->groups[g].name), member) == 0) {
            return bodies_value(ev, env, node, sim, &sim->groups[g]);
        }
    }
    return unknown_member(ev, env, node, sim, member);
}

static bool is_within(const Scope *scope, const Scope *outer) {
    while (scope && scope != outer) {
        scope = scope->parent;
    }
    return scope != NULL;
}

Value eval_sim_member(Eval *ev, const Env *env, NodeId node, Sim *sim, const char *member) {
    if (!sim) {
        return value_poison();
    }
    if (sim->state == BINDING_BUSY && !is_within(env->scope, sim->within)) {
        // What is read there at an instant of the run is no motion, and would be kept as one.
        const char *name = symbol_text(ev->symbols, sim->name);
        const char *hint = arena_printf(ev->arena,
                                        "write it in the block of %s; simulations that need each "
                                        "other are to be one",
                                        name);
        eval_error(ev, env, node, hint, "%s.%s is read here for what %s itself needs to run", name,
                   member, name);
        diag_note(ev->diag, name_span(sim), "%s is here", name);
        return value_poison();
    }
    if (sim->state == BINDING_BUSY && sim->is_rigid) {
        return eval_error(ev, env, node, NULL, "a sim rigid can not read its own bodies");
    }
    if (sim->state == BINDING_BUSY) {
        return member_within(ev, env, node, sim, find_variable(ev, sim, member), member);
    }
    if (!build(ev, sim)) {
        return value_poison();
    }
    if (sim->is_rigid) {
        return rigid_member(ev, env, node, sim, member);
    }
    SimVariable *variable = find_variable(ev, sim, member);
    bool is_alive = !variable && strcmp(member, "alive") == 0;
    if (!variable && !is_alive) {
        return unknown_member(ev, env, node, sim, member);
    }
    if (!run(ev, sim)) {
        return value_poison();
    }
    if (is_alive) {
        Value each = value_scalar(VALUE_BOOL, sim->alive);
        return member_value(ev, sim, &each);
    }
    note_end(ev, env, node, sim);
    if (variable->outside) {
        return (Value){.type = VALUE_LIST, .list = variable->outside};
    }
    Ref refs[4];
    for (uint32_t k = 0; k < variable->start.n; k++) {
        refs[k] = column(ev, sim, variable->first + k);
    }
    Value each = sim_state_value(ev, variable, refs);
    each.dimension = DIMENSION_NONE;
    Value value = member_value(ev, sim, &each);
    variable->outside = value_is(&value, VALUE_LIST) ? value.list : NULL;
    return value;
}
