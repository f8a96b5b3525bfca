// SPDX-License-Identifier: Apache-2.0
// Runs of statements that differ in their numbers: evaluated at once, as loops are.
#include "lang/eval_run.h"

#include <string.h>

#include "lang/lower.h"

static const Run *run_of(const Env *env, NodeId statement) {
    const Syntax *syntax = env->module->syntax;
    return &syntax->runs[syntax_node(syntax, statement)->a];
}

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

// The tree holds one of them at a time.
static void emit_each(Eval *ev, const Env *env, const Place *place, const Run *run, uint32_t from,
                      bool has_objects, const char *name) {
    Syntax *syntax = env->module->syntax;
    const uint32_t *at = run->at;
    const RunLoop *runs = ev->runs;
    size_t n_nodes = syntax->n_nodes, n_extra = syntax->n_extra;
    uint32_t n = run->n;
    Parser parser;
    parser_resume(&parser, ev->arena, syntax, ev->diag, at[0]);
    ev->runs = NULL;
    for (uint32_t i = from; i < n && !ev->unroll; i++) {
        NodeId statement = run_parse_statement(&parser, at[i]);
        reserve_flags(ev, env->module, n_nodes);
        if (statement && eval_step(ev, env, statement)) {
            eval_emit_statement(ev, env, place, statement, has_objects, name);
        }
        eval_statement_ends(ev);
        syntax->n_nodes = n_nodes;
        syntax->n_extra = n_extra;
    }
    ev->runs = runs;
}

// ---- All at once

static const double *row_numbers(Eval *ev, uint32_t n) {
    double *rows = ARENA_ARRAY(ev->arena, n, double);
    for (uint32_t i = 0; i < n; i++) {
        rows[i] = i;
    }
    return rows;
}

// False: a number must be known; what was made is forgotten.
static bool emit_at_once(Eval *ev, const Env *env, const Place *place, NodeId statement,
                         bool has_objects, const char *name) {
    const Run *run = run_of(env, statement);
    Loops *outer = ev->loops;
    Loops *loops = ARENA_NEW(ev->arena, Loops);
    *loops = (Loops){.parent = outer,
                     .values = row_numbers(ev, run->n),
                     .n_values = run->n,
                     .depth = outer ? outer->depth + 1 : 0,
                     .n_instances = run->n * (outer ? outer->n_instances : 1),
                     .counts = true};
    RunLoop *loop = ARENA_NEW(ev->arena, RunLoop);
    *loop = (RunLoop){ev->runs, env->module, run, (Input)(IN_LOOP0 + loops->depth)};
    LoweringMark mark = lowering_mark(ev->lowering);
    ev->loops = loops;
    ev->runs = loop;
    eval_emit_statement(ev, env, place, run->first, has_objects, name);
    ev->loops = outer;
    ev->runs = loop->outer;
    if (!ev->unroll) {
        return true;
    }
    lowering_rewind(ev->lowering, mark);
    if (ev->unroll >> loops->depth & 1) {
        env->module->flags[statement] |= MODULE_UNROLL;
        ev->unroll &= ~(1u << loops->depth);
    }
    return false;
}

void eval_emit_run(Eval *ev, const Env *env, const Place *place, NodeId statement, bool has_objects,
                   const char *name) {
    const Run *run = run_of(env, statement);
    uint32_t depth = ev->loops ? ev->loops->depth + 1 : 0, from = 0;
    uint64_t n = (uint64_t)run->n * (ev->loops ? ev->loops->n_instances : 1);
    unsigned n_errors = diag_n_errors(ev->diag);
    if (depth < EVAL_MAX_LOOPS && n <= EVAL_MAX_ITEMS &&
        !(env->module->flags[statement] & MODULE_UNROLL) &&
        emit_at_once(ev, env, place, statement, has_objects, name)) {
        if (diag_n_errors(ev->diag) == n_errors) {
            return;
        }
        eval_statement_ends(ev);
        from = 1; // each statement has the mistake
    }
    if (!ev->unroll) { // else a loop further out goes first
        emit_each(ev, env, place, run, from, has_objects, name);
    }
}
