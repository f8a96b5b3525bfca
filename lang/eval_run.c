// SPDX-License-Identifier: Apache-2.0
// Runs of statements that differ in their numbers: evaluated at once, as loops are.
#include "lang/eval_run.h"

#include <string.h>

#include "lang/lower.h"

enum { LEAST_AT_ONCE = 16 }; // statements of a run; fewer keep their own labels

// Of a run, when the group was walked.
typedef enum { EACH, AT_ONCE } Way;

typedef struct {
    Eval *ev;
    const Env *env;
    const Place *place;
    const RunGroup *group;
    bool has_objects;
    const char *name;
    uint8_t way[RUN_MAX_PATTERNS]; // Way
    // The shapes of each run that was walked at once: [first, end).
    uint32_t first[RUN_MAX_PATTERNS], end[RUN_MAX_PATTERNS];
    double *rows;   // 0, 1, 2..., of the longest; made when first needed
    uint32_t *each; // of those walked one by one: where the shapes of each end
    size_t n_each, each_capacity;
    Arena scratch;
} Walk;

Ref eval_run_number(Eval *ev, const Env *env, NodeId node) {
    for (const RunLoop *loop = ev->runs; loop; loop = loop->outer) {
        const Run *run = loop->run;
        if (loop->module == env->module && node >= run->node_lo && node < run->node_hi) {
            const RunSlot *slot = run_slot(run, node);
            Ref row = dag_input(ev->dag, loop->row);
            return slot ? dag_column(ev->dag, row, slot->values, run->n) : REF_NONE;
        }
    }
    return REF_NONE;
}

// ---- Each by itself

// What is found out about the nodes of a statement ends with it.
static void reserve_flags(Eval *ev, const Module *module, size_t first) {
    Module *grown = (Module *)module;
    size_t n = module->syntax->n_nodes;
    if (n > grown->n_flags) {
        uint8_t *flags = ARENA_ARRAY(ev->arena, 2 * n, uint8_t);
        memcpy(flags, grown->flags, first);
        grown->flags = flags;
        grown->n_flags = 2 * n;
    }
    memset(grown->flags + first, 0, n - first);
}

static void emit(Walk *walk, NodeId statement) {
    Eval *ev = walk->ev;
    if (statement && eval_step(ev, walk->env, statement)) {
        eval_emit_statement(ev, walk->env, walk->place, statement, walk->has_objects, walk->name);
    }
    eval_statement_ends(ev);
}

// A statement of a run by itself. The tree holds one of them at a time, but for the first.
static void emit_one(Walk *walk, Parser *parser, const Run *run, uint32_t row) {
    Eval *ev = walk->ev;
    Syntax *syntax = walk->env->module->syntax;
    const RunLoop *runs = ev->runs;
    size_t n_nodes = syntax->n_nodes, n_extra = syntax->n_extra;
    ev->runs = NULL;
    diag_order(ev->diag, run->at[row]);
    if (row == 0) {
        emit(walk, run->first);
    } else {
        NodeId statement = run_parse_statement(parser, run->at[row]);
        reserve_flags(ev, walk->env->module, n_nodes);
        emit(walk, statement);
    }
    ev->runs = runs;
    syntax->n_nodes = n_nodes;
    syntax->n_extra = n_extra;
}

// What was not walked at once, in the order of the file.
static void emit_each(Walk *walk) {
    Eval *ev = walk->ev;
    const RunGroup *group = walk->group;
    uint32_t rows[RUN_MAX_PATTERNS] = {0}, n_singles = 0;
    Syntax *syntax = walk->env->module->syntax;
    uint32_t begin = group->n_runs ? group->runs[0].at[0] : syntax->file->base;
    Parser parser;
    parser_resume(&parser, ev->arena, syntax, ev->diag, begin);
    for (uint32_t i = 0; i < group->n && !ev->unroll; i++) {
        uint8_t kind = group->kinds ? group->kinds[i] : 0;
        if (kind == RUN_SINGLE) {
            NodeId statement = group->singles[n_singles++];
            diag_order(ev->diag, syntax_node(syntax, statement)->lo);
            emit(walk, statement);
        } else if (walk->way[kind] == EACH) {
            emit_one(walk, &parser, &group->runs[kind], rows[kind]++);
        } else {
            continue;
        }
        walk->each = arena_grow(&walk->scratch, walk->each, walk->n_each, &walk->each_capacity,
                                sizeof *walk->each);
        walk->each[walk->n_each++] = lowering_mark(ev->lowering).n_shapes;
    }
}

// ---- All at once

// They last: where no loop is around they are the loop variables of the shapes.
static double *row_numbers(Walk *walk) {
    uint32_t n = 0;
    for (uint32_t k = 0; k < walk->group->n_runs; k++) {
        n = walk->group->runs[k].n > n ? walk->group->runs[k].n : n;
    }
    double *rows = ARENA_ARRAY(lower_arena(walk->ev), n, double);
    for (uint32_t i = 0; i < n; i++) {
        rows[i] = i;
    }
    return rows;
}

// False: a number must be known; what was made is forgotten.
static bool emit_at_once(Walk *walk, const Run *run) {
    Eval *ev = walk->ev;
    Loops *outer = ev->loops;
    Loops *loops = ARENA_NEW(ev->arena, Loops);
    walk->rows = walk->rows ? walk->rows : row_numbers(walk);
    *loops = (Loops){.parent = outer,
                     .values = walk->rows,
                     .n_values = run->n,
                     .depth = outer ? outer->depth + 1 : 0,
                     .n_instances = run->n * (outer ? outer->n_instances : 1),
                     .counts = true,
                     .table = outer ? NULL : walk->rows};
    RunLoop *loop = ARENA_NEW(ev->arena, RunLoop);
    *loop = (RunLoop){ev->runs, walk->env->module, run, (Input)(IN_LOOP0 + loops->depth)};
    LoweringMark mark = lowering_mark(ev->lowering);
    ev->loops = loops;
    ev->runs = loop;
    eval_emit_statement(ev, walk->env, walk->place, run->first, walk->has_objects, walk->name);
    ev->loops = outer;
    ev->runs = loop->outer;
    if (!ev->unroll) {
        return true;
    }
    lowering_rewind(ev->lowering, mark);
    if (ev->unroll >> loops->depth & 1) {
        walk->env->module->flags[run->first] |= MODULE_UNROLL;
        ev->unroll &= ~(1u << loops->depth);
    }
    return false;
}

// Those of which there are many.
static void emit_runs(Walk *walk) {
    Eval *ev = walk->ev;
    uint32_t depth = ev->loops ? ev->loops->depth + 1 : 0;
    uint32_t n_outer = ev->loops ? ev->loops->n_instances : 1;
    for (uint32_t k = 0; k < walk->group->n_runs && !ev->unroll; k++) {
        const Run *run = &walk->group->runs[k];
        LoweringMark mark = lowering_mark(ev->lowering);
        unsigned n_errors = diag_n_errors(ev->diag);
        bool may_be = run->n >= LEAST_AT_ONCE && depth < EVAL_MAX_LOOPS &&
                      (uint64_t)run->n * n_outer <= EVAL_MAX_ITEMS &&
                      !(walk->env->module->flags[run->first] & MODULE_UNROLL);
        diag_order(ev->diag, run->at[0]);
        if (!may_be || !eval_step(ev, walk->env, run->first) || !emit_at_once(walk, run)) {
            continue;
        }
        eval_statement_ends(ev);
        if (diag_n_errors(ev->diag) != n_errors) { // each statement has the mistake
            lowering_rewind(ev->lowering, mark);
            continue;
        }
        walk->way[k] = AT_ONCE;
        walk->first[k] = mark.n_shapes;
        walk->end[k] = lowering_mark(ev->lowering).n_shapes;
    }
}

// ---- The order of the file

// All copies become the objects that they would be, had each statement been walked by itself.
static void set_order(Walk *walk, uint32_t first) {
    Eval *ev = walk->ev;
    const RunGroup *group = walk->group;
    uint32_t n_shapes = lowering_mark(ev->lowering).n_shapes - first;
    uint32_t rows[RUN_MAX_PATTERNS] = {0};
    size_t n_each = 0;
    if (n_shapes < 2 || ev->loops) { // a loop around: shape by shape, as loops are
        return;
    }
    uint32_t next = lowering_n_objects(ev->lowering, first);
    LoweredOrder *orders = ARENA_ARRAY(&walk->scratch, n_shapes, LoweredOrder);
    for (uint32_t s = 0; s < n_shapes; s++) {
        orders[s] = lowering_order(ev->lowering, first + s);
    }
    uint32_t s_each = 0; // those walked one by one lie behind all others
    for (uint32_t k = 0; k < group->n_runs; k++) {
        s_each = walk->way[k] == AT_ONCE && walk->end[k] - first > s_each ? walk->end[k] - first
                                                                          : s_each;
    }
    for (uint32_t i = 0; i < group->n; i++) {
        uint8_t kind = group->kinds[i];
        if (kind == RUN_SINGLE || walk->way[kind] == EACH) {
            for (uint32_t end = walk->each[n_each++] - first; s_each < end; s_each++) {
                for (uint32_t k = 0; k < orders[s_each].n; k++) {
                    orders[s_each].object[k] = next++;
                }
            }
            continue;
        }
        uint32_t row = rows[kind]++;
        for (uint32_t s = walk->first[kind] - first; s < walk->end[kind] - first; s++) {
            uint32_t n = orders[s].n / group->runs[kind].n;
            for (uint32_t k = 0; k < n; k++) {
                orders[s].object[row * n + k] = next++;
            }
        }
    }
}

void eval_emit_run(Eval *ev, const Env *env, const Place *place, NodeId statement, bool has_objects,
                   const char *name) {
    const Syntax *syntax = env->module->syntax;
    Walk walk = {.ev = ev,
                 .env = env,
                 .place = place,
                 .group = &syntax->runs[syntax_node(syntax, statement)->a],
                 .has_objects = has_objects,
                 .name = name};
    uint32_t first = lowering_mark(ev->lowering).n_shapes;
    diag_hold(ev->diag);
    if (!ev->body) {
        emit_runs(&walk);
    }
    if (!ev->unroll) { // else a loop further out goes first
        emit_each(&walk);
    }
    if (!ev->unroll && walk.group->kinds) {
        set_order(&walk, first);
    }
    diag_release(ev->diag);
    arena_free(&walk.scratch);
}
