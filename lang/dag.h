// SPDX-License-Identifier: Apache-2.0
// Expressions over time as a graph of scalars: what the evaluator's values are made of.
//
// Evaluating a script computes with graph nodes instead of numbers: a number is a constant node, a
// vector is three nodes, `t` is an input. Nodes are hash-consed (equal expressions are one node)
// and folded as they are made, so what does not mention t is a number as soon as it exists, common
// subexpressions cost once, and functions vanish by being applied. What remains is compiled to a
// render/program.h program. Folding uses program_fold(): folded and computed results agree in
// their bits.
#ifndef LANG_DAG_H
#define LANG_DAG_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/arena.h"
#include "lang/hash.h"
#include "render/program.h"

typedef struct Dag Dag;
typedef uint32_t Ref; // a node; valid as long as the Dag

enum { REF_NONE = UINT32_MAX };

Dag *dag_new(Arena *arena);

Ref dag_const(Dag *dag, double value);
Ref dag_input(Dag *dag, Input input);
// Folds constants and simplifies (x*0 and x-x only where x is finite for sure); results have the
// same bits as the operations written, but for the sign of a zero. Unused operands: REF_NONE.
Ref dag_op(Dag *dag, Op op, Ref a, Ref b, Ref c);
// SEARCH or TABLE; copies the values (n >= 1).
Ref dag_table_op(Dag *dag, Op op, Ref a, const double *values, uint32_t n);
// A TABLE whose values (n >= 1) last longer than every program compiled from the graph: they are
// neither copied nor compared with other tables.
Ref dag_column(Dag *dag, Ref a, const double *values, uint32_t n);
// A TABLE of n values that change between the runs of a program, the state of a simulation: nothing
// of it is folded. which: tells it from others in dag_hash.
Ref dag_live(Dag *dag, Ref a, const double *values, uint32_t n, uint32_t which);

// The channel (0..3: r g b and opacity) of a picture at (s, t). Never folded; the image lasts
// longer than every program compiled from the graph.
Ref dag_image(Dag *dag, Ref s, Ref t, const ProgramImage *image, uint32_t channel);
// SEARCH for pieces that join smoothly: what is built on it does not jump or bend at its steps, so
// they are no breaks.
Ref dag_search_unseen(Dag *dag, Ref a, const double *values, uint32_t n);

bool dag_is_const(const Dag *dag, Ref ref, double *value); // value may be NULL
bool dag_is_finite(const Dag *dag, Ref ref);               // for sure, and never NaN
uint32_t dag_inputs(const Dag *dag, Ref ref);              // bit i: Input i is read
uint32_t dag_n_nodes(const Dag *dag);

// d ref / d input, by the chain rule; exact where the function is differentiable, one-sided from
// the right at jumps (floor, select, search: their own rate is 0). NOISE and HASH of what changes:
// *opaque (may be NULL) is set and a central difference over +-step is built instead.
Ref dag_diff(Dag *dag, Ref ref, Input input, double step, bool *opaque);

// ref with every read of `input` replaced by `with`.
Ref dag_substitute(Dag *dag, Ref ref, Input input, Ref with);
// The same for several inputs at once (simultaneously).
Ref dag_substitute_all(Dag *dag, Ref ref, const Input *inputs, const Ref *with, uint32_t n);

// Adds what the expressions compute, whatever else the graph holds: operations, constants, tables
// by their values (live ones by what tells them apart).
void dag_hash(const Dag *dag, const Ref *refs, uint32_t n, Hash128 *hash);

// One expression that is refs[i] where index is i, for i < n: constants become tables. REF_NONE:
// the expressions are not alike enough.
Ref dag_zip(Dag *dag, const Ref *refs, uint32_t n, Ref index);

// Scalars of t alone (and of loop variables) whose floor changes where any of the roots may jump or
// bend: operands of floor and mod; comparisons, signs and searches themselves, so that a scalar
// changes at no other instants. Poles count as jumps. Each once. Writes at most max, returns the
// number there are.
uint32_t dag_breaks(Dag *dag, const Ref *roots, uint32_t n_roots, Ref *out, uint32_t max);

Program *dag_compile(const Dag *dag, Arena *arena, const Ref *roots, uint32_t n_roots);

#endif
