// SPDX-License-Identifier: Apache-2.0
// What must be known while the scene is loaded, and the reports where it is not.
#include "lang/eval.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

// ---- Reports

static Value report(Eval *ev, Span where, const char *hint, const char *format, va_list args) {
    va_list again;
    va_copy(again, args);
    int n = vsnprintf(NULL, 0, format, args);
    char *text = arena_array(ev->arena, (size_t)n + 1, 1);
    vsnprintf(text, (size_t)n + 1, format, again);
    va_end(again);
    diag_error(ev->diag, where, hint, "%s", text);
    return value_poison();
}

Value eval_error_at(Eval *ev, Span where, const char *hint, const char *format, ...) {
    va_list args;
    va_start(args, format);
    Value poison = report(ev, where, hint, format, args);
    va_end(args);
    return poison;
}

Value eval_error(Eval *ev, const Env *env, NodeId node, const char *hint, const char *format, ...) {
    va_list args;
    va_start(args, format);
    Value poison = report(ev, syntax_span(env->module->syntax, node), hint, format, args);
    va_end(args);
    return poison;
}

bool eval_step(Eval *ev, const Env *env, NodeId node) {
    if (ev->stopped || ev->unroll) {
        return false;
    }
    if (dag_n_nodes(ev->dag) > EVAL_MAX_NODES) {
        eval_error(ev, env, node, NULL, "this scene's expressions take more than %d operations",
                   EVAL_MAX_NODES);
        ev->steps = ev->max_steps + 1;
        ev->stopped = true;
        return false;
    }
    // What recursion doubles with each level is refused sooner than what loops say.
    ev->steps += ev->calls > EVAL_DEEP ? 4 : 1;
    if (ev->steps > ev->max_steps) {
        eval_error(ev, env, node, "loops and recursion are carried out while the scene is loaded",
                   "evaluating this scene takes more than %llu steps",
                   (unsigned long long)ev->max_steps);
        ev->stopped = true;
        return false;
    }
    return true;
}

// ---- What must be known

const char *eval_input_name(uint32_t inputs) {
    static const char *const names[IN_COUNT] = {"t",
                                                "T",
                                                "u",
                                                "v",
                                                "p",
                                                "p",
                                                "p",
                                                "n",
                                                "n",
                                                "n",
                                                "P",
                                                "P",
                                                "P",
                                                "N",
                                                "N",
                                                "N",
                                                "i",
                                                "x",
                                                "a loop's variable",
                                                "a loop's variable",
                                                "a loop's variable",
                                                "a loop's variable"};
    for (int i = 0; i < IN_COUNT; i++) {
        if (inputs >> i & 1) {
            return names[i];
        }
    }
    return "nothing";
}

Known eval_known(Eval *ev, Ref ref, double *x) {
    if (dag_is_const(ev->dag, ref, x)) {
        return KNOWN;
    }
    uint32_t inputs = dag_inputs(ev->dag, ref);
    if (inputs & ~LOOP_INPUTS) {
        return KNOWN_NEVER;
    }
    ev->unroll |= inputs >> IN_LOOP0;
    return KNOWN_LATER;
}

bool eval_need(Eval *ev, const Env *env, NodeId node, Ref ref, const char *what, double *x) {
    switch (eval_known(ev, ref, x)) {
    case KNOWN:
        return true;
    case KNOWN_NEVER:
        eval_error(ev, env, node, NULL,
                   "%s must be known when the scene is loaded, this depends on %s", what,
                   eval_input_name(dag_inputs(ev->dag, ref) & ~LOOP_INPUTS));
        return false;
    default:
        return false;
    }
}

bool eval_need_bool(Eval *ev, const Env *env, NodeId node, const Value *value, const char *what,
                    const char *hint, bool *x) {
    if (value_is_poison(value)) {
        return false;
    }
    if (!value_is(value, VALUE_BOOL)) {
        eval_error(ev, env, node, value_is(value, VALUE_NUMBER) ? "write a comparison" : NULL,
                   "%s is true or false, this is %s", what, value_describe(ev->arena, value));
        return false;
    }
    double truth = 0;
    switch (eval_known(ev, value->ref[0], &truth)) {
    case KNOWN:
        *x = truth != 0;
        return true;
    case KNOWN_NEVER:
        eval_error(ev, env, node, hint,
                   "%s must be known when the scene is loaded, this depends on %s", what,
                   eval_input_name(dag_inputs(ev->dag, value->ref[0]) & ~LOOP_INPUTS));
        return false;
    default:
        return false;
    }
}

// ---- All copies of a batched loop

// The values of a loop's variable for the copies [first, first + n): the innermost changes fastest.
static void loop_values(const Loops *loop, size_t every, size_t first, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) {
        values[i] = loop->values[(first + i) / every % loop->n_values];
    }
}

static bool all_within(const Program *program, const Loops *loops, double low, double high) {
    enum { COPIES = 1024 };
    double values[EVAL_MAX_LOOPS][COPIES], results[COPIES], *out = results;
    ProgramInputs in = {0};
    bool is_within = true;
    for (size_t first = 0; first < loops->n_instances && is_within; first += COPIES) {
        size_t n = loops->n_instances - first < COPIES ? loops->n_instances - first : COPIES;
        size_t every = 1;
        for (const Loops *loop = loops; loop; every *= loop->n_values, loop = loop->parent) {
            Input input = (Input)(IN_LOOP0 + loop->depth);
            loop_values(loop, every, first, n, values[loop->depth]);
            in.at[input] = values[loop->depth];
            in.varying |= 1u << input;
        }
        program_run(program, &in, n, &out);
        for (size_t i = 0; i < n; i++) {
            is_within &= isfinite(results[i]) && results[i] >= low && results[i] <= high;
        }
    }
    return is_within;
}

bool eval_copies_within(Eval *ev, Ref ref, double low, double high) {
    uint32_t inputs = dag_inputs(ev->dag, ref);
    if (!ev->loops || !inputs || (inputs & ~LOOP_INPUTS)) {
        return true;
    }
    if (isinf(low) && isinf(high) && dag_is_finite(ev->dag, ref)) {
        return true;
    }
    Arena scratch = {0};
    const Program *program = dag_compile(ev->dag, &scratch, &ref, 1);
    bool is_within = all_within(program, ev->loops, low, high);
    arena_free(&scratch);
    ev->unroll |= is_within ? 0 : inputs >> IN_LOOP0;
    return is_within;
}

// ---- Sequences

static bool range_sequence(Eval *ev, const Env *env, NodeId node, const Range *range,
                           Sequence *sequence) {
    double low, high, step = 1;
    if (!eval_need(ev, env, node, range->low, "the beginning of a range", &low) ||
        !eval_need(ev, env, node, range->high, "the end of a range", &high) ||
        (range->step != REF_NONE &&
         !eval_need(ev, env, node, range->step, "the step of a range", &step))) {
        return false;
    }
    if (range->is_angle && range->step == REF_NONE) {
        eval_error(ev, env, node, "write 0deg..90deg by 10deg",
                   "a range of angles needs a step here");
        return false;
    }
    if (!isfinite(low) || !isfinite(high) || !(step > 0) || !isfinite(step)) {
        eval_error(ev, env, node, NULL, "a range goes from a number to a number by a step above 0");
        return false;
    }
    // 0..1 by 0.1 holds 1, though ten times 0.1 may round to more.
    double n = high < low ? 0 : floor((high - low) / step * (1 + 4e-16) + 1e-9) + 1;
    if (n > EVAL_MAX_ITEMS) {
        eval_error(ev, env, node, "did you mean fewer, or a longer step?",
                   "this range has %.15g values, at most %d are allowed", n, EVAL_MAX_ITEMS);
        return false;
    }
    ev->steps += (uint64_t)n / 8; // memory is work too
    double *numbers = ARENA_ARRAY(ev->arena, (size_t)n, double);
    for (size_t i = 0; i < (size_t)n; i++) {
        numbers[i] = fmin(low + (double)i * step, high);
    }
    *sequence =
        (Sequence){(uint32_t)n, numbers, NULL, range->is_angle ? VALUE_ANGLE : VALUE_NUMBER};
    return true;
}

// A list of known numbers (or angles) is a sequence of numbers too.
static void list_sequence(Eval *ev, const List *list, Sequence *sequence) {
    *sequence = (Sequence){list->n, NULL, list->items, VALUE_NUMBER};
    ValueType type = list->n ? (ValueType)list->items[0].type : VALUE_POISON;
    if (type != VALUE_NUMBER && type != VALUE_ANGLE) {
        return;
    }
    double *numbers = ARENA_ARRAY(ev->arena, list->n, double);
    for (uint32_t i = 0; i < list->n; i++) {
        if (list->items[i].type != type ||
            !dag_is_const(ev->dag, list->items[i].ref[0], &numbers[i])) {
            return;
        }
    }
    sequence->numbers = numbers;
    sequence->type = type;
}

bool eval_list_is_known(Eval *ev, const List *list) {
    double length;
    return !list->length || eval_known(ev, *list->length, &length) == KNOWN;
}

bool eval_sequence(Eval *ev, const Env *env, NodeId node, const Value *value, Sequence *sequence) {
    switch (value->type) {
    case VALUE_POISON:
        return false;
    case VALUE_RANGE:
        return range_sequence(ev, env, node, value->range, sequence);
    case VALUE_LIST:
        list_sequence(ev, value->list, sequence);
        return eval_list_is_known(ev, value->list);
    default:
        eval_error(ev, env, node, value_is(value, VALUE_NUMBER) ? "write 0..(n - 1)" : NULL,
                   "a range or a list is expected after 'in', this is %s",
                   value_describe(ev->arena, value));
        return false;
    }
}

Value sequence_item(Eval *ev, const Sequence *sequence, uint32_t i) {
    return sequence->items ? sequence->items[i]
                           : value_scalar(sequence->type, dag_const(ev->dag, sequence->numbers[i]));
}
