// SPDX-License-Identifier: Apache-2.0
// Random expressions for the tests of the graph: a list of steps that is both built as a graph and
// computed step by step, which is the oracle.
#ifndef TESTS_EXPRESSION_H
#define TESTS_EXPRESSION_H

#include "lang/dag.h"

enum { MAX_STEPS = 40, N_INPUTS = 3 };

typedef struct {
    Op op;
    int a, b, c; // earlier steps
    double value;
    int input;
    int table;
} Step;

typedef struct {
    Step steps[MAX_STEPS];
    int n;
} Expression;

extern const Input expression_inputs[N_INPUTS];
extern const double expression_search[5];
extern uint64_t expression_seed; // of all that is random here

uint32_t expression_int(uint32_t n);          // below n
double expression_real(double lo, double hi); // open interval

// Inputs and constants, then random steps of these operations up to `size` steps.
void expression_random(Expression *e, const Op *ops, uint32_t n_ops, int size);
Ref expression_build(Dag *dag, const Expression *e);

// exact: transcendental functions by the programs' own code, so that bits can be compared; else by
// the C library. False: the result depends on the sign of a zero or the bits of a NaN, or has no
// rate.
bool expression_evaluate(const Expression *e, const double in[N_INPUTS], bool exact,
                         double *result);

// The graph's value, by a program of its own.
double expression_run(Dag *dag, Arena *arena, Ref ref, const double in[N_INPUTS]);
void expression_print(const Expression *e);

// All operations with operands. Returns their number.
uint32_t expression_ops(Op ops[OP_COUNT], bool with_pow);

#endif
