// SPDX-License-Identifier: Apache-2.0
// Evaluating runs (lang/run.h): statements that differ in their numbers alone, all at once.
#ifndef LANG_EVAL_RUN_H
#define LANG_EVAL_RUN_H

#include "lang/object.h"
#include "lang/run.h"

// The runs around the place where the walk is, inner to outer: batched loops over their rows.
typedef struct RunLoop {
    const struct RunLoop *outer;
    const Module *module;
    const Run *run;
    Input row;
} RunLoop;

// The number at a node that differs from statement to statement; REF_NONE: it does not.
Ref eval_run_number(Eval *ev, const Env *env, NodeId node);

// All statements of a NODE_RUN; parameters as eval_emit.
void eval_emit_run(Eval *ev, const Env *env, const Place *place, NodeId statement, bool has_objects,
                   const char *name);

#endif
