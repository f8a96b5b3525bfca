// SPDX-License-Identifier: Apache-2.0
// Random expressions: making, graphs, plain evaluation.
#include "tests/expression.h"
#include "tests/suite.h"

#include <math.h>
#include <stdio.h>

const Input expression_inputs[N_INPUTS] = {IN_T, IN_U, IN_PX};
const double expression_search[5] = {-1.5, -0.25, 0, 0.5, 2};
static const double value_table[4] = {3, -1, 0.125, 7};
static const double constants[] = {0, 1, -1, 2, 0.5, 3, -0.75, 0.1, 10};

uint64_t expression_seed;

uint32_t expression_int(uint32_t n) {
    expression_seed = expression_seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(expression_seed >> 33) % n;
}

double expression_real(double lo, double hi) {
    return lo + (hi - lo) * (expression_int(1u << 30) + 0.5) / (1u << 30);
}

static void add_leaves(Expression *e) {
    for (int i = 0; i < N_INPUTS; i++) {
        e->steps[e->n++] = (Step){.op = OP_INPUT, .input = i};
    }
    for (int i = 0; i < 4; i++) {
        uint32_t k = expression_int(sizeof constants / sizeof *constants + 2);
        double value =
            k < sizeof constants / sizeof *constants ? constants[k] : expression_real(-4, 4);
        e->steps[e->n++] = (Step){.op = OP_CONST, .value = value};
    }
}

static int any_step(const Expression *e) {
    return (int)expression_int((uint32_t)e->n);
}

void expression_random(Expression *e, const Op *ops, uint32_t n_ops, int size) {
    e->n = 0;
    add_leaves(e);
    while (e->n < size) {
        Step s = {.op = ops[expression_int(n_ops)],
                  .a = any_step(e),
                  .b = any_step(e),
                  .c = any_step(e),
                  .table = (int)expression_int(2)};
        e->steps[e->n++] = s;
    }
}

Ref expression_build(Dag *dag, const Expression *e) {
    Ref refs[MAX_STEPS];
    for (int i = 0; i < e->n; i++) {
        const Step *s = &e->steps[i];
        if (s->op == OP_INPUT) {
            refs[i] = dag_input(dag, expression_inputs[s->input]);
        } else if (s->op == OP_CONST) {
            refs[i] = dag_const(dag, s->value);
        } else if (s->op == OP_SEARCH) {
            refs[i] = dag_table_op(dag, OP_SEARCH, refs[s->a], expression_search, 5);
        } else if (s->op == OP_TABLE) {
            refs[i] = dag_table_op(dag, OP_TABLE, refs[s->a], value_table, 4);
        } else {
            refs[i] = dag_op(dag, s->op, refs[s->a], refs[s->b], refs[s->c]);
        }
    }
    return refs[e->n - 1];
}

// A step by its definition; the operations that have no counterpart in libm by their own code.
static double evaluate_step(const Step *s, double a, double b, double c) {
    switch (s->op) {
    case OP_ADD:
        return a + b;
    case OP_SUB:
        return a - b;
    case OP_MUL:
        return a * b;
    case OP_DIV:
        return a / b;
    case OP_NEG:
        return -a;
    case OP_ABS:
        return fabs(a);
    case OP_FLOOR:
        return floor(a);
    case OP_CEIL:
        return ceil(a);
    case OP_SQRT:
        return sqrt(a);
    case OP_EXP:
        return exp(a);
    case OP_LOG:
        return log(a);
    case OP_SIN:
        return sin(a);
    case OP_COS:
        return cos(a);
    case OP_TAN:
        return tan(a);
    case OP_ASIN:
        return asin(a);
    case OP_ACOS:
        return acos(a);
    case OP_ATAN:
        return atan(a);
    case OP_ATAN2:
        return atan2(a, b);
    case OP_HYPOT:
        return hypot(a, b);
    case OP_POW:
        return pow(a, b);
    case OP_LT:
        return a < b;
    case OP_LE:
        return a <= b;
    case OP_EQ:
        return a == b;
    case OP_NOT:
        return a == 0;
    case OP_AND:
        return a != 0 && b != 0;
    case OP_OR:
        return a != 0 || b != 0;
    case OP_SELECT:
        return a != 0 ? b : c;
    case OP_SEARCH: {
        int i = 0;
        while (i < 4 && expression_search[i + 1] <= a) {
            i++;
        }
        return i;
    }
    case OP_TABLE:
        return value_table[a >= 3 ? 3 : a >= 2 ? 2 : a >= 1 ? 1 : 0];
    default:
        return program_fold(s->op, a, b, c);
    }
}

// Whether the result depends on the sign of a zero, which simplification does not keep, or on the
// bits of a NaN; or has no rate.
static bool is_singular(const Step *s, double a, double b) {
    return (s->op == OP_DIV && b == 0) || (s->op == OP_ATAN2 && a == 0) ||
           (s->op == OP_POW && a == 0) || (s->op == OP_SQRT && a == 0) ||
           (s->op == OP_HASH && (isnan(a) || isnan(b)));
}

// exact: transcendental functions by the program's own code, so that bits can be compared.
// False: some step is singular.
bool expression_evaluate(const Expression *e, const double in[N_INPUTS], bool exact,
                         double *result) {
    double v[MAX_STEPS];
    bool is_certain = true;
    for (int i = 0; i < e->n; i++) {
        const Step *s = &e->steps[i];
        if (s->op == OP_INPUT) {
            v[i] = in[s->input];
        } else if (s->op == OP_CONST) {
            v[i] = s->value;
        } else {
            double a = v[s->a], b = v[s->b], c = v[s->c];
            is_certain = is_certain && !is_singular(s, a, b);
            bool is_table = s->op == OP_SEARCH || s->op == OP_TABLE;
            v[i] = exact && !is_table ? program_fold(s->op, a, b, c) : evaluate_step(s, a, b, c);
        }
    }
    *result = v[e->n - 1];
    return is_certain;
}

double expression_run(Dag *dag, Arena *arena, Ref ref, const double in[N_INPUTS]) {
    double inputs[IN_COUNT] = {0}, out;
    for (int i = 0; i < N_INPUTS; i++) {
        inputs[expression_inputs[i]] = in[i];
    }
    program_run1(dag_compile(dag, arena, &ref, 1), inputs, &out);
    return out;
}

void expression_print(const Expression *e) {
    for (int i = 0; i < e->n; i++) {
        const Step *s = &e->steps[i];
        print_message("%d: %s a=%d b=%d c=%d value=%.17g input=%d\n", i, op_names[s->op], s->a,
                      s->b, s->c, s->value, s->input);
    }
}

uint32_t expression_ops(Op ops[OP_COUNT], bool with_pow) {
    uint32_t n = 0;
    for (int op = 0; op < OP_COUNT; op++) {
        if (op_operands[op] > 0 && (with_pow || op != OP_POW) && op != OP_IMAGE) {
            ops[n++] = (Op)op;
        }
    }
    return n;
}
