// SPDX-License-Identifier: Apache-2.0
// Loading a scene, step by step: read, bind names, film first, then everything else; lower.
#include "lang/scene_load.h"

#include <stdlib.h>
#include <string.h>

#include "lang/builtins.h"
#include "lang/loader.h"
#include "lang/lower.h"
#include "lang/run.h"
#include "lang/watch.h"

struct Loading {
    Arena arena;
    LoadOptions options;
    Eval ev;
    Module *script;
    Place place; // outermost
    bool has_film;
};

enum { DEFAULT_STEPS = 1 << 26, LOAD_LEAST_MEMORY = 32 << 20 };

// ---- What every script finds

static void predefine(Eval *ev, const char *name, Value value) {
    Symbol symbol = symbol_of(ev->symbols, name, strlen(name));
    scope_bind(ev->arena, ev->predefined, symbol, BINDING_VARIABLE)->value = value;
}

static Value inputs(Eval *ev, Input first, uint32_t n) {
    Ref refs[3];
    for (uint32_t i = 0; i < n; i++) {
        refs[i] = dag_input(ev->dag, (Input)(first + i));
    }
    return value_vec(n == 1 ? VALUE_NUMBER : VALUE_VEC, refs, n);
}

static void predefine_all(Eval *ev) {
    Dag *dag = ev->dag;
    static const char *const axes[3] = {"x", "y", "z"};
    Value time = inputs(ev, IN_T, 1), film_time = inputs(ev, IN_FILM_T, 1);
    time.dimension = film_time.dimension = DIMENSION_NONE;
    predefine(ev, "t", time);
    predefine(ev, "T", film_time);
    predefine(ev, "pi", value_number(dag, 3.141592653589793));
    predefine(ev, "true", value_scalar(VALUE_BOOL, dag_const(dag, 1)));
    predefine(ev, "false", value_scalar(VALUE_BOOL, dag_const(dag, 0)));
    for (int i = 0; i < 3; i++) {
        predefine(ev, axes[i], value_from3(VALUE_VEC, spatial_const(dag, i == 0, i == 1, i == 2)));
    }
    predefine(ev, "p", inputs(ev, IN_PX, 3));
    predefine(ev, "n", inputs(ev, IN_NX, 3));
    predefine(ev, "P", inputs(ev, IN_WX, 3));
    predefine(ev, "N", inputs(ev, IN_WNX, 3));
    predefine(ev, "u", inputs(ev, IN_U, 1));
    predefine(ev, "v", inputs(ev, IN_V, 1));
    predefine(ev, "uv", inputs(ev, IN_U, 2));
}

static void begin(Loading *loading, Arena *scene_arena, Sources *sources, Diag *diag) {
    Eval *ev = &loading->ev;
    Arena *arena = &loading->arena;
    *ev = (Eval){.arena = arena, .diag = diag, .sources = sources};
    ev->dag = dag_new(arena);
    ev->symbols = symbols_new(arena);
    ev->kind_names = ARENA_ARRAY(arena, OBJECT_KINDS, Symbol);
    for (int kind = 0; kind < OBJECT_KINDS; kind++) {
        const NodeInfo *info = &node_infos[kind];
        if (info->class != NODE_CLASS_COMMON) {
            ev->kind_names[kind] = symbol_of(ev->symbols, info->name, strlen(info->name));
        }
    }
    ev->watches = watches_new(arena);
    ev->builtins = builtins_new(arena, ev->symbols);
    ev->predefined = scope_new(arena, NULL);
    predefine_all(ev);
    ev->max_steps = loading->options.max_steps ? loading->options.max_steps : DEFAULT_STEPS;
    ev->loader = loader_new(arena, &loading->options);
    ev->simulator = loading->options.simulator;
    ev->lowering = lowering_new(scene_arena, arena);
    loading->place = place_outermost(ev);
    loading->place.is_outermost = true;
}

// ---- The command line

static void read_overrides(Loading *loading, Overrides *overrides) {
    const LoadOptions *options = &loading->options;
    *overrides = (Overrides){.width = options->width,
                             .height = options->height,
                             .fps = options->fps,
                             .has_frames = options->has_frames,
                             .first_frame = options->first_frame,
                             .last_frame = options->last_frame,
                             .has_shutter = options->shutter != NULL};
    lowering_override(&loading->ev, overrides);
}

// --shutter, once the film is known: 4f is four of its frames.
static void read_shutter(Loading *loading, Overrides *overrides) {
    Eval *ev = &loading->ev;
    Module *module = NULL;
    const char *text = loading->options.shutter;
    NodeId node = text ? loader_parse_expr(ev, "--shutter", text, &module) : 0;
    if (!node) {
        return;
    }
    const Env env = {module, ev->predefined};
    Value value = eval_expr(ev, &env, node);
    bool is_time =
        value_is(&value, VALUE_NUMBER) && (!value.dimension || value.dimension == DIMENSION_TIME);
    bool is_angle = value_is(&value, VALUE_ANGLE) && !value.dimension;
    if (value_is_poison(&value)) {
        return;
    }
    if (!is_time && !is_angle) {
        eval_error(ev, &env, node, "write 180deg or 4f",
                   "the shutter is open for an angle or a time, this is %s",
                   value_describe(ev->arena, &value));
        return;
    }
    overrides->shutter_is_angle = is_angle;
    if (eval_need(ev, &env, node, value.ref[0], "the shutter", &overrides->shutter) &&
        !(overrides->shutter >= 0 && overrides->shutter < 1e15)) {
        eval_error(ev, &env, node, NULL,
                   "the shutter can not be open for less than no time, or for ever");
    }
    lowering_override(ev, overrides);
}

// ---- Walks

static void try_film(Loading *loading, const Env *env, NodeId statement) {
    Eval *ev = &loading->ev;
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, statement);
    if (node->kind != NODE_OBJECT || loading->has_film) {
        return;
    }
    const Node *path = syntax_node(syntax, syntax->extra[node->a + 1]);
    if (path->kind == NODE_NAME && path->a == ev->kind_names[OBJECT_FILM]) {
        loading->has_film = true;
        eval_object(ev, env, &loading->place, statement);
        diag_next_statement(ev->diag);
    }
}

static void find_film(Eval *ev, const Env *env, NodeId block, void *context) {
    (void)ev;
    const Syntax *syntax = env->module->syntax;
    const Node *node = syntax_node(syntax, block);
    for (uint32_t i = 0; i < node->b; i++) {
        NodeId statement = syntax->extra[node->a + i];
        const Node *s = syntax_node(syntax, statement);
        if (s->kind != NODE_RUN) {
            try_film(context, env, statement);
            continue;
        }
        const RunGroup *group = &syntax->runs[s->a];
        for (uint32_t k = 0; k < group->n_runs; k++) {
            try_film(context, env, group->runs[k].first);
        }
        for (uint32_t k = 0; k < group->n_singles; k++) {
            try_film(context, env, group->singles[k]);
        }
    }
}

// The film comes first: frames as a unit and film.fps depend on it.
static void load_film(Loading *loading) {
    Eval *ev = &loading->ev;
    ev->reads_film = true;
    loader_visit(ev, loading->script, find_film, loading);
    ev->reads_film = false;
    if (!loading->has_film) {
        lowering_default_film(ev);
    }
}

static void warn_unused(Eval *ev, const Module *script) {
    const Syntax *syntax = script->syntax;
    Symbol largest = 0;
    for (size_t i = 1; i < syntax->n_nodes; i++) {
        if (syntax->nodes[i].kind == NODE_NAME && syntax->nodes[i].a > largest) {
            largest = syntax->nodes[i].a;
        }
    }
    uint8_t *is_read = ARENA_ARRAY(ev->arena, (size_t)largest + 1, uint8_t);
    for (size_t i = 1; i < syntax->n_nodes; i++) {
        if (syntax->nodes[i].kind == NODE_NAME) {
            is_read[syntax->nodes[i].a] = 1;
        }
    }
    for (size_t i = 1; i < syntax->n_nodes; i++) {
        const Node *node = &syntax->nodes[i];
        if (node->kind == NODE_LET && (node->a > largest || !is_read[node->a])) {
            diag_warn(ev->diag, WARN_UNUSED_LET, syntax_name_span(syntax, (NodeId)i), NULL,
                      "nothing uses '%s'", symbol_text(ev->symbols, node->a));
        }
    }
}

static void evaluate(Loading *loading) {
    Eval *ev = &loading->ev;
    const Module *script = loading->script;
    const Env env = {script, script->scope};
    NodeId root = script->syntax->root;
    Object file = {.kind = OBJECT_GROUP, .env = env, .is_identity = true};
    Overrides overrides;
    read_overrides(loading, &overrides);
    eval_declare(ev, &env, root);
    if (ev->has_bad_file) {
        return; // names are missing, what follows would speak of them
    }
    object_begin(ev, &file);
    load_film(loading);
    read_shutter(loading, &overrides);
    eval_gather(ev, &env, &file, root);
    Place place = place_within(ev, &loading->place, &file);
    place.is_outermost = true;
    eval_emit(ev, &env, &place, root, true, NULL);
    object_end(ev, &file);
    loader_check_defines(ev);
}

// ---- The doors

// What is asked for bounds frames first of all: small ones are no reason to refuse a small scene.
static size_t least_memory(size_t memory) {
    return memory && memory < LOAD_LEAST_MEMORY ? LOAD_LEAST_MEMORY : memory;
}

void scene_load(Arena *arena, Sources *sources, Diag *diag, const char *path, const char *text,
                size_t text_size, const LoadOptions *options, LoadedScene *loaded) {
    static const LoadOptions none = {0};
    Loading *loading = calloc(1, sizeof *loading);
    *loaded = (LoadedScene){.loading = loading, .status = 3};
    if (!loading) {
        return;
    }
    loading->options = options ? *options : none;
    size_t limit = arena->limit;
    arena->limit = loading->arena.limit = least_memory(loading->options.memory);
    begin(loading, arena, sources, diag);
    Eval *ev = &loading->ev;
    unsigned n_errors = diag_n_errors(diag);
    loading->script = loader_script(ev, path, text, text_size);
    const Syntax *syntax = loading->script ? loading->script->syntax : NULL;
    if (syntax && !syntax->has_errors) {
        if (syntax_node(syntax, syntax->root)->b == 0) {
            eval_error_at(ev, (Span){syntax->file->base, syntax->file->base},
                          "write sphere { } to begin with", "an empty file shows nothing");
        }
        evaluate(loading);
    }
    loaded->files = loader_files(ev->loader, &loaded->n_files);
    if (syntax && diag_n_errors(diag) == n_errors) {
        warn_unused(ev, loading->script);
        loaded->scene = lowering_finish(ev, loader_hash(ev->loader));
        watches_report(ev, loaded->scene);
    }
    // Warnings may count as errors.
    bool is_fine = diag_n_errors(diag) == n_errors;
    loaded->scene = is_fine ? loaded->scene : NULL;
    loaded->status = is_fine ? 0 : ev->has_failed_file ? 3 : 1;
    arena->limit = limit;
}

void scene_load_free(LoadedScene *loaded) {
    if (loaded->loading) {
        Arena arena = loaded->loading->arena;
        free(loaded->loading);
        arena_free(&arena);
        loaded->loading = NULL;
        loaded->files = NULL;
        loaded->n_files = 0;
    }
}

// Evaluates an expression in the script's outermost scope; poison: reported.
static Value eval_outermost(Loading *loading, const char *origin, const char *expr, Env *env,
                            NodeId *node) {
    Eval *ev = &loading->ev;
    Module *module = NULL;
    ev->stopped = false;
    diag_next_statement(ev->diag);
    *node = loader_parse_expr(ev, origin, expr, &module);
    *env = (Env){module, loading->script->scope};
    return *node ? eval_expr(ev, env, *node) : value_poison();
}

static bool is_time(const Value *value) {
    return value_is(value, VALUE_NUMBER) &&
           (!value->dimension || value->dimension == DIMENSION_TIME);
}

bool scene_eval_times(LoadedScene *loaded, Arena *arena, const char *origin, const char *expr,
                      const double **times, size_t *n) {
    Loading *loading = loaded->loading;
    if (!loading || !loading->script) {
        return false;
    }
    Eval *ev = &loading->ev;
    Env env;
    NodeId node;
    Value value = eval_outermost(loading, origin, expr, &env, &node);
    Sequence sequence = {.n = 1, .items = &value};
    bool is_sequence = value_is(&value, VALUE_LIST) || value_is(&value, VALUE_RANGE);
    if (value_is_poison(&value) ||
        (is_sequence && !eval_sequence(ev, &env, node, &value, &sequence))) {
        return false;
    }
    double *seconds = ARENA_ARRAY(arena, sequence.n, double);
    bool is_known = !sequence.items && sequence.numbers && sequence.type == VALUE_NUMBER;
    if (is_known) { // without a node of the graph for each
        memcpy(seconds, sequence.numbers, sequence.n * sizeof *seconds);
    }
    for (uint32_t i = 0; i < sequence.n && !is_known; i++) {
        Value item = sequence_item(ev, &sequence, i);
        if (!is_time(&item)) {
            eval_error(ev, &env, node, "write 1.5s, 36f, 0..2 by 0.1",
                       "a time is expected, this is %s", value_describe(ev->arena, &item));
            return false;
        }
        if (!eval_need(ev, &env, node, item.ref[0], "the time", &seconds[i])) {
            return false;
        }
    }
    *times = seconds;
    *n = sequence.n;
    return true;
}

bool scene_eval(LoadedScene *loaded, Arena *arena, const char *expr, SceneMotion *motion) {
    Loading *loading = loaded->loading;
    if (!loading || !loading->script) {
        return false;
    }
    Eval *ev = &loading->ev;
    Env env;
    NodeId node;
    Value value = eval_outermost(loading, "expression", expr, &env, &node);
    if (value_is_poison(&value)) {
        return false;
    }
    uint32_t read = value_inputs(ev->dag, &value) & ~(1u << IN_T | 1u << IN_FILM_T);
    if (read) {
        eval_error(ev, &env, node, NULL, "only t and T have values here, this depends on %s",
                   eval_input_name(read));
        return false;
    }
    *motion = (SceneMotion){.type = value_type_name(arena, &value)};
    if (value_is_numeric(&value)) {
        motion->n_columns = value.n;
        motion->program = dag_compile(ev->dag, arena, value_refs(&value), value.n);
    } else {
        motion->text = value_text(arena, ev->dag, ev->symbols, &value, 0);
    }
    return true;
}
