// SPDX-License-Identifier: Apache-2.0
// What is known of a node before it is ever computed: bounds, whole numbers, signs.
#include "lang/dag_nodes.h"

#include <math.h>
#include <string.h>

// |t| in seconds is below 2^100 for any film; this is what lets t*0 be 0.
enum { BOUND_TIME = 100 };

double dag_node_value(const DagNode *n) {
    uint64_t bits = (uint64_t)n->b << 32 | n->a;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

// The smallest k with |x| <= 2^k.
static int exponent_of(double x) {
    if (x == 0) {
        return -1100;
    }
    int k;
    double m = frexp(fabs(x), &k);
    return m == 0.5 ? k - 1 : k;
}

static int16_t bound_of_exponent(int k) {
    return k > 1023 ? BOUND_NONE : (int16_t)(k < -1100 ? -1100 : k);
}

static int16_t bound_of_value(double x) {
    return isfinite(x) ? bound_of_exponent(exponent_of(x)) : BOUND_NONE;
}

// By their bits, in which larger magnitudes are larger numbers, and what is not finite the largest.
int16_t dag_table_bound(const ProgramTable *table) {
    uint64_t most = 0;
    for (uint32_t i = 0; i < table->n; i++) {
        uint64_t bits;
        memcpy(&bits, &table->values[i], sizeof bits);
        bits &= ~(UINT64_C(1) << 63);
        most = bits > most ? bits : most;
    }
    double largest;
    memcpy(&largest, &most, sizeof largest);
    return bound_of_value(largest);
}

static int16_t bound_of_quotient(const Dag *dag, int bound, Ref b) {
    double divisor;
    if (bound == BOUND_NONE || !dag_is_const(dag, b, &divisor) || divisor == 0 ||
        !isfinite(divisor)) {
        return BOUND_NONE;
    }
    return bound_of_exponent(bound - exponent_of(divisor) + 1);
}

static int16_t bound_of_input(Input input) {
    bool is_finite =
        input == IN_T || input == IN_FILM_T || input == IN_I || input == IN_X || input >= IN_LOOP0;
    return is_finite ? BOUND_TIME : BOUND_NONE;
}

int16_t dag_node_bound(const Dag *dag, const DagNode *n) {
    uint32_t arity = op_operands[n->op];
    int a = arity > 0 ? dag->nodes[n->a].bound : 0;
    int b = arity > 1 ? dag->nodes[n->b].bound : 0;
    int c = arity > 2 ? dag->nodes[n->c].bound : 0;
    int most = a > b ? a : b;
    switch ((Op)n->op) {
    case OP_CONST:
        return bound_of_value(dag_node_value(n));
    case OP_INPUT:
        return bound_of_input((Input)n->a);
    case OP_TABLE:
        return dag->bounds[n->b];
    case OP_SEARCH:
        return 32;
    case OP_LT:
    case OP_LE:
    case OP_EQ:
    case OP_NOT:
    case OP_AND:
    case OP_OR:
    case OP_HASH:
        return 0;
    case OP_SELECT:
        return (int16_t)(b > c ? b : c);
    default:
        break;
    }
    if (most == BOUND_NONE || c == BOUND_NONE) {
        return BOUND_NONE;
    }
    switch ((Op)n->op) {
    case OP_SIGN:
    case OP_SIN:
    case OP_COS:
    case OP_NOISE:
        return 0;
    case OP_ATAN:
        return 1;
    case OP_ATAN2:
        return 2;
    case OP_ADD:
    case OP_SUB:
    case OP_HYPOT:
        return bound_of_exponent(most + 1);
    case OP_MUL:
        return bound_of_exponent(a + b);
    case OP_DIV:
        return bound_of_quotient(dag, a, n->b);
    case OP_MOD: // the quotient must be finite too; the remainder may round up to the divisor
        return bound_of_quotient(dag, a, n->b) == BOUND_NONE ? BOUND_NONE
                                                             : bound_of_exponent(most + 1);
    case OP_NEG:
    case OP_ABS:
    case OP_MIN:
    case OP_MAX:
        return (int16_t)most;
    case OP_FLOOR:
    case OP_CEIL:
    case OP_ROUND:
        return bound_of_exponent((a > 0 ? a : 0) + 1);
    case OP_EXP:
        return a <= 8 ? 512 : BOUND_NONE;
    default:
        return BOUND_NONE;
    }
}

uint8_t dag_node_facts(const Dag *dag, const DagNode *n) {
    uint32_t arity = op_operands[n->op];
    uint8_t a = arity > 0 ? dag->nodes[n->a].facts : 0;
    uint8_t b = arity > 1 ? dag->nodes[n->b].facts : 0;
    uint8_t c = arity > 2 ? dag->nodes[n->c].facts : 0;
    double x;
    switch ((Op)n->op) {
    case OP_CONST:
        x = dag_node_value(n);
        return (uint8_t)((x == 0 || x == 1 ? FACT_TRUTH : 0) | (x == floor(x) ? FACT_INTEGER : 0) |
                         (x >= 0 ? FACT_POSITIVE : 0));
    case OP_INPUT:
        return n->a == IN_I ? FACT_INTEGER | FACT_POSITIVE : 0;
    case OP_LT:
    case OP_LE:
    case OP_EQ:
    case OP_NOT:
    case OP_AND:
    case OP_OR:
        return FACT_TRUTH | FACT_INTEGER | FACT_POSITIVE;
    case OP_SEARCH:
        return FACT_INTEGER | FACT_POSITIVE;
    case OP_FLOOR:
    case OP_CEIL:
    case OP_ROUND:
        return (uint8_t)(FACT_INTEGER | (a & FACT_POSITIVE));
    case OP_SIGN:
        return (uint8_t)(FACT_INTEGER | (a & FACT_POSITIVE));
    case OP_ABS:
        return (uint8_t)(FACT_POSITIVE | (a & FACT_INTEGER));
    case OP_SQRT:
    case OP_EXP:
    case OP_HYPOT:
    case OP_HASH:
    case OP_ACOS:
        return FACT_POSITIVE;
    case OP_MUL:
        return (uint8_t)((a & b & (FACT_INTEGER | FACT_POSITIVE)) |
                         (n->a == n->b ? FACT_POSITIVE : 0));
    case OP_ADD:
        return (uint8_t)(a & b & (FACT_INTEGER | FACT_POSITIVE));
    case OP_DIV:
        return (uint8_t)(a & b & FACT_POSITIVE);
    case OP_SUB:
        return (uint8_t)(a & b & FACT_INTEGER);
    case OP_NEG:
        return (uint8_t)(a & FACT_INTEGER);
    case OP_MIN:
    case OP_MAX:
        return a & b;
    case OP_SELECT:
        return b & c;
    default:
        return 0;
    }
}
